// SPDX-License-Identifier: BSD-3-Clause
#include "impact_process.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// A step changes the slip by this part of it; a slip of this part of the first has ended.
constexpr double kPart = 0.02, kLeastPart = 1e-9, kEnded = 1e-9;
/// Beside the gain without friction.
constexpr double kNearlySingular = 1e-3;
/// A slip is told from none by this part of the jammed one.
constexpr double kSlipBegun = 1e-9;
constexpr int kMaxSteps = 20000, kProcessBisections = 60, kMaxRounds = 1000;
/// Forces that are rounding, relative, and energy.
constexpr double kProcessRounding = 1e-10;

/// What the contacts of an impact process do that are not the jammed one: they are held, but those
/// that are free, or slip although J lets them stick.
struct Others {
  ConstraintSet free, slipping;
};

/// Velocities and impulses of the frame's rows along the normal impulse of one of its contacts.
class Process {
 public:
  Process(const FrictionFrame& frame, const ContactMode& J, std::size_t jammed, const Vector& rates,
          const Others& others)
      : problem_(frame.problem()), jammed_(jammed), row_(problem_.Row(jammed)), rates_(rates) {
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const int i = frame.constraints()[k];
      if (k == jammed || others.free.Contains(i)) continue;
      held_.push_back({problem_.Row(k), Vector::Unit(rates.size(), problem_.Row(k))});
      const int dimension = problem_.contacts[k].dimension;
      if (J.LetterOf(i) != Letter::kStick || others.slipping.Contains(i)) {
        if (dimension > 0) slips_.push_back({k, held_.size() - 1, Vector::Zero(dimension)});
        if (J.LetterOf(i) == Letter::kStick) begin_.push_back(slips_.size() - 1);
      } else {
        HoldTangents(k);
      }
    }
    impulse_ = Vector::Zero(rates.size());
  }

  /// False where the process does not begin, or end. The instant at which the slip is singular is
  /// not known to the last digit: until N v falls, the slip turns without it.
  bool Run() {
    const double first = Slip(rates_).norm();
    if (!(first > 0) || !BeginSlips()) return false;
    const double nearly = kNearlySingular * problem_.G(row_, row_);
    double part = kPart;
    bool falls = false;
    for (int step = 0; step < kMaxSteps; ++step) {
      const double slip = Slip(rates_).norm();
      if (slip <= kEnded * first) return Stick();
      const std::optional<Vector> slope = Slope(rates_);
      if (!slope) return false;
      const Vector rate = problem_.G * *slope;
      if (!falls && !(rate(row_) < nearly)) return false;
      falls = falls || rate(row_) < 0;
      top_ = std::max(top_, rates_(row_));
      const double length = part * slip / (1e-300 + Slip(rate).norm());
      const std::optional<Vector> change = Change(length);
      if (!change) return false;
      const Vector next = impulse_ + *change;
      const Vector rates = Rates(next);
      if (falls && !(rates(row_) < top_)) {
        if (rates_(row_) < top_) return Return(length);
        part *= 0.5;  // it falls for less than a step
        if (part < kLeastPart) return false;
        --step;
        continue;
      }
      impulse_ = next;
      rates_ = rates;
      part = std::min(kPart, 2 * part);
    }
    return false;
  }

  const Vector& impulse() const { return impulse_; }
  /// dp/dp_n at the beginning.
  const std::optional<Vector>& first() const { return first_; }

 private:
  struct Held {
    int row;      // whose rate stays
    Vector push;  // of its multiplier, by row
  };
  struct Slipping {
    std::size_t contact, held;  // its place among `held_`
    Vector direction;           // in which it begins, where it has none yet
  };

  void HoldTangents(std::size_t k) {
    const int row = problem_.Row(k);
    for (int j = 1; j <= problem_.contacts[k].dimension; ++j) {
      held_.push_back({row + j, Vector::Unit(rates_.size(), row + j)});
    }
  }
  Vector SlipOf(std::size_t k, const Vector& rates) const {
    return rates.segment(problem_.Row(k) + 1, problem_.contacts[k].dimension);
  }
  Vector Slip(const Vector& rates) const { return SlipOf(jammed_, rates); }
  Vector Rates(const Vector& impulse) const { return rates_ + problem_.G * (impulse - impulse_); }

  /// Nᵀ − μ Tᵀ d of contact k.
  Vector Push(std::size_t k, const Vector& direction) const {
    Vector push = Vector::Unit(rates_.size(), problem_.Row(k));
    const FrictionContact& contact = problem_.contacts[k];
    push.segment(problem_.Row(k) + 1, contact.dimension) = -contact.coefficient * direction;
    return push;
  }

  /// Impulses of all rows for `push` of the jammed contact, so that what is held stays, the least
  /// where rows depend on one another; none where nothing holds it.
  std::optional<Vector> WithHeld(Vector push) const {
    const auto m = static_cast<Eigen::Index>(held_.size());
    if (m == 0) return push;
    Matrix columns(push.size(), m), A(m, m);
    Vector right(m);
    const Vector moved = problem_.G * push;
    for (Eigen::Index k = 0; k < m; ++k) columns.col(k) = held_[static_cast<std::size_t>(k)].push;
    const Matrix moves = problem_.G * columns;
    for (Eigen::Index k = 0; k < m; ++k) {
      const int row = held_[static_cast<std::size_t>(k)].row;
      A.row(k) = moves.row(row);
      right(k) = -moved(row);
    }
    const Eigen::CompleteOrthogonalDecomposition<Matrix> factor(A);
    const Vector held = factor.solve(right);
    if (factor.rank() < m && (A * held - right).norm() > kProcessRounding * right.norm()) {
      return std::nullopt;
    }
    return Vector(push + columns * held);
  }

  /// dp/dp_n where the contacts slip with these rates.
  std::optional<Vector> Slope(const Vector& rates) {
    for (const Slipping& other : slips_) {
      const Vector slip = SlipOf(other.contact, rates);
      const bool begins = !(slip.norm() > kSlipBegun * Slip(rates).norm());
      held_[other.held].push =
          Push(other.contact, begins ? other.direction : Vector(slip / slip.norm()));
    }
    const Vector slip = Slip(rates);
    return WithHeld(Push(jammed_, slip / slip.norm()));
  }

  /// The directions of slips that begin: in which each gains speed, against its own force. Of a
  /// gain r − K d that is the d which r − K d + s d points along, for any s; iterations contract
  /// where s is at least |K d|.
  bool BeginSlips() {
    std::vector<Vector> first(begin_.size());
    std::vector<double> shift(begin_.size(), 0);
    for (int round = 0; round < kMaxRounds; ++round) {
      const std::optional<Vector> slope = Slope(rates_);
      if (!slope) return false;
      const Vector rate = problem_.G * *slope;
      double change = 0;
      for (std::size_t k = 0; k < begin_.size(); ++k) {
        Slipping& other = slips_[begin_[k]];
        const Vector gained = SlipOf(other.contact, rate);
        if (round == 0) first[k] = gained;
        shift[k] = std::max(shift[k], (gained - first[k]).norm());
        const Vector next = (gained + shift[k] * other.direction).normalized();
        change = std::max(change, (next - other.direction).norm());
        other.direction = next;
      }
      if (change > kProcessRounding) continue;
      first_ = slope;
      return Gain(rate);
    }
    return false;
  }
  bool Gain(const Vector& rate) const {
    return std::all_of(begin_.begin(), begin_.end(), [&](std::size_t k) {
      return SlipOf(slips_[k].contact, rate).dot(slips_[k].direction) > 0;
    });
  }

  /// Runge and Kutta's step.
  std::optional<Vector> Change(double length) {
    constexpr double kNodes[] = {0, 0.5, 0.5, 1}, kWeights[] = {1, 2, 2, 1};
    Vector slope = Vector::Zero(rates_.size()), sum = slope;
    for (int k = 0; k < 4; ++k) {
      const std::optional<Vector> next = Slope(rates_ + kNodes[k] * length * (problem_.G * slope));
      if (!next) return std::nullopt;
      slope = *next;
      sum += kWeights[k] / 6 * slope;
    }
    return Vector(length * sum);
  }

  /// The part of a step at whose end N v = 0.
  bool Return(double length) {
    double low = 0, high = length;
    for (int k = 0; k < kProcessBisections; ++k) {
      const double middle = 0.5 * (low + high);
      const std::optional<Vector> change = Change(middle);
      if (!change) return false;
      (Rates(impulse_ + *change)(row_) < top_ ? low : high) = middle;
    }
    const std::optional<Vector> change = Change(high);
    if (change) impulse_ += *change;
    return change.has_value();
  }

  /// The slip has ended: by what keeps it so until N v = 0.
  bool Stick() {
    const FrictionContact& contact = problem_.contacts[jammed_];
    HoldTangents(jammed_);
    const std::optional<Vector> slope = WithHeld(Vector::Unit(rates_.size(), row_));
    if (!slope) return false;
    const double cone = contact.coefficient * (*slope)(row_);
    if (slope->segment(row_ + 1, contact.dimension).norm() > cone) return false;
    const double rate = problem_.G.row(row_).dot(*slope);
    if (!(rate > 0)) return false;
    impulse_ += -rates_(row_) / rate * *slope;
    return true;
  }

  const FrictionProblem& problem_;
  const std::size_t jammed_;
  const int row_;
  Vector rates_, impulse_;  // of the rows
  std::optional<Vector> first_;
  double top_ = 0;  // the highest N v so far, none but for rounding
  std::vector<Held> held_;
  std::vector<Slipping> slips_;     // the others
  std::vector<std::size_t> begin_;  // those of them that do not slip yet
};

/// The contact that is pulled most, or −1.
int Pulled(const FrictionProblem& problem, const Vector& impulse) {
  double least = -kProcessRounding * impulse.cwiseAbs().maxCoeff();
  int pulled = -1;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (!(impulse(problem.Row(k)) < least)) continue;
    least = impulse(problem.Row(k));
    pulled = static_cast<int>(k);
  }
  return pulled;
}

/// What is held outside its cone.
ConstraintSet LeaveCones(const FrictionFrame& frame, const Vector& impulse) {
  const FrictionProblem& problem = frame.problem();
  const double rounding = kProcessRounding * impulse.cwiseAbs().maxCoeff();
  ConstraintSet leave;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const FrictionContact& contact = problem.contacts[k];
    const int row = problem.Row(k);
    const double held = impulse.segment(row + 1, contact.dimension).norm();
    if (held > contact.coefficient * impulse(row) + rounding) leave.Insert(frame.constraints()[k]);
  }
  return leave;
}

/// What these impulses pull is let go, and what they move out of its cone slips: whether there is
/// such; nothing where there is, but no more to let go.
std::optional<bool> Adapt(const FrictionFrame& frame, int jammed, const Vector& impulse,
                          Others* others) {
  const int pulled = Pulled(frame.problem(), impulse);
  const ConstraintSet leave = LeaveCones(frame, impulse);
  if (pulled < 0 && leave.Empty()) return false;
  ConstraintSet& changed = pulled < 0 ? others->slipping : others->free;
  const ConstraintSet found =
      pulled < 0 ? leave : ConstraintSet{frame.constraints()[static_cast<std::size_t>(pulled)]};
  if (found.Contains(jammed) || (found - changed).Empty()) return std::nullopt;
  changed = changed | found;
  return true;
}

/// Whether what is free does not approach.
bool StaysApart(const FrictionFrame& frame, const Vector& impulse, const ConstraintSet& free) {
  const Vector rates = frame.problem().G * impulse;
  for (std::size_t k = 0; k < frame.problem().contacts.size(); ++k) {
    const int row = frame.problem().Row(k);
    if (free.Contains(frame.constraints()[k]) && !(rates(row) >= 0)) return false;
  }
  return impulse.allFinite();
}

}  // namespace

std::optional<FrictionalImpact> FollowImpact(const MechanicalSystem& system, const VectorRef& q,
                                             const VectorRef& v_minus, const ContactMode& J,
                                             int jammed) {
  const InverseInertia inertia(system, q, v_minus);
  const FrictionFrame frame(system, inertia, J);
  const FrictionProblem& problem = frame.problem();
  std::size_t place = 0;
  while (frame.constraints()[place] != jammed) ++place;
  Vector rates = frame.rows() * v_minus;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) rates(problem.Row(k)) = 0;
  Others others;
  Vector p;
  for (;;) {  // what does not hold beside it lets go, or slips: from the first, or in the end
    Process process(frame, J, place, rates, others);
    const bool ends = process.Run();
    if (!ends && !process.first()) return std::nullopt;
    p = ends ? process.impulse() : *process.first();
    const std::optional<bool> adapted = Adapt(frame, jammed, p, &others);
    if (!adapted || (!*adapted && !ends)) return std::nullopt;
    if (!*adapted) break;
  }
  if (!StaysApart(frame, p, others.free)) return std::nullopt;
  FrictionalImpact impact;
  impact.result.v_plus = v_minus + frame.reach() * p;
  impact.result.impulse = frame.Impulse(inertia, p);
  impact.energy_change = 0.5 * p.dot(frame.rows() * (v_minus + impact.result.v_plus));
  impact.word = J.Without(others.free);
  const Vector after = frame.rows() * impact.result.v_plus;
  const auto slip = [&](const Vector& v) {
    return v.segment(problem.Row(place) + 1, problem.contacts[place].dimension).norm();
  };
  const bool sticks = slip(after) <= 1e3 * kEnded * slip(rates);
  if (sticks) impact.word.Set(jammed, Letter::kStick);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int i = frame.constraints()[k];
    if (!(others.slipping - others.free).Contains(i)) continue;
    const Letter letter = after(problem.Row(k) + 1) > 0 ? Letter::kForward : Letter::kBackward;
    impact.word.Set(i, problem.contacts[k].dimension == 1 ? letter : Letter::kSlip);
  }
  impact.result.hit = J.Members() - others.free;
  const double energy = KineticEnergy(inertia.mass(), v_minus) + p.cwiseAbs().dot(rates.cwiseAbs());
  if (!impact.result.v_plus.allFinite() || impact.energy_change > kProcessRounding * energy) {
    return std::nullopt;
  }
  return impact;
}

}  // namespace contact_flow
