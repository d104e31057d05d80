// SPDX-License-Identifier: BSD-3-Clause
#include "impact_process.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// A step changes the slip by this part of it; a slip of this part of the first has ended.
constexpr double kPart = 0.02, kLeastPart = 1e-9, kEnded = 1e-9;
constexpr int kMaxSteps = 20000, kProcessBisections = 60;
/// Forces that are rounding, relative, and energy.
constexpr double kProcessRounding = 1e-10;

/// Velocities and impulses of the frame's rows along the normal impulse of one of its contacts,
/// while the others, but those that are `free`, are held.
class Process {
 public:
  Process(const FrictionFrame& frame, ContactMode J, std::size_t jammed, const Vector& rates,
          ConstraintSet free)
      : problem_(frame.problem()), jammed_(jammed), row_(problem_.Row(jammed)), rates_(rates) {
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const FrictionContact& contact = problem_.contacts[k];
      const int row = problem_.Row(k);
      if (k == jammed || free.Contains(frame.constraints()[k])) continue;
      const bool sticks = J.LetterOf(frame.constraints()[k]) == Letter::kStick;
      Held held{row, Vector::Zero(rates.size())};
      held.push(row) = 1;
      if (!sticks && contact.dimension > 0) {
        const auto slip = rates.segment(row + 1, contact.dimension);
        held.push.segment(row + 1, contact.dimension) = -contact.coefficient * slip / slip.norm();
      }
      held_.push_back(held);
      for (int j = 1; sticks && j <= contact.dimension; ++j) {
        held_.push_back({row + j, Vector::Unit(rates.size(), row + j)});
      }
    }
    impulse_ = Vector::Zero(rates.size());
  }

  /// False where the process does not begin, or end.
  bool Run() {
    const double first = Slip(rates_).norm();
    if (!(first > 0)) return false;
    double part = kPart;
    for (int step = 0; step < kMaxSteps; ++step) {
      const double slip = Slip(rates_).norm();
      if (slip <= kEnded * first) return Stick();
      const Vector slope = Slope(rates_);
      if (slope.size() == 0) return false;
      const Vector rate = problem_.G * slope;
      if (step == 0 && !(rate(row_) < 0)) return false;
      const double length = part * slip / (1e-300 + Slip(rate).norm());
      const Vector next = impulse_ + Change(length);
      const Vector rates = Rates(next);
      if (!(rates(row_) < 0)) {
        if (step > 0) {
          Return(length);
          return true;
        }
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

 private:
  struct Held {
    int row;      // whose rate stays
    Vector push;  // of its multiplier, by row
  };

  Vector Slip(const Vector& rates) const {
    return rates.segment(row_ + 1, problem_.contacts[jammed_].dimension);
  }
  Vector Rates(const Vector& impulse) const { return rates_ + problem_.G * (impulse - impulse_); }

  /// Impulses of all rows for `push` of the jammed contact, so that what is held stays; none where
  /// they are not determined.
  Vector WithHeld(Vector push) const {
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
    const Eigen::FullPivLU<Matrix> factor(A);
    if (!factor.isInvertible()) return {};
    return push + columns * factor.solve(right);
  }

  /// dp/dp_n where the slip has these rates.
  Vector Slope(const Vector& rates) const {
    const FrictionContact& contact = problem_.contacts[jammed_];
    Vector push = Vector::Unit(rates.size(), row_);
    const Vector slip = Slip(rates);
    push.segment(row_ + 1, contact.dimension) = -contact.coefficient * slip / slip.norm();
    return WithHeld(std::move(push));
  }

  /// Runge and Kutta's step.
  Vector Change(double length) const {
    const Vector a = Slope(rates_), b = Slope(rates_ + length / 2 * (problem_.G * a)),
                 c = Slope(rates_ + length / 2 * (problem_.G * b)),
                 d = Slope(rates_ + length * (problem_.G * c));
    return length / 6 * (a + 2 * b + 2 * c + d);
  }

  /// The part of a step at whose end N v = 0.
  void Return(double length) {
    double low = 0, high = length;
    for (int k = 0; k < kProcessBisections; ++k) {
      const double middle = 0.5 * (low + high);
      (Rates(impulse_ + Change(middle))(row_) < 0 ? low : high) = middle;
    }
    impulse_ += Change(high);
  }

  /// The slip has ended: by what keeps it so until N v = 0.
  bool Stick() {
    const FrictionContact& contact = problem_.contacts[jammed_];
    Held slip{0, {}};
    for (int j = 1; j <= contact.dimension; ++j) {
      slip.row = row_ + j;
      slip.push = Vector::Unit(rates_.size(), row_ + j);
      held_.push_back(slip);
    }
    const Vector slope = WithHeld(Vector::Unit(rates_.size(), row_));
    if (slope.size() == 0) return false;
    const double cone = contact.coefficient * slope(row_);
    if (slope.segment(row_ + 1, contact.dimension).norm() > cone) return false;
    const double rate = problem_.G.row(row_).dot(slope);
    if (!(rate > 0)) return false;
    impulse_ += -rates_(row_) / rate * slope;
    return true;
  }

  const FrictionProblem& problem_;
  const std::size_t jammed_;
  const int row_;
  Vector rates_, impulse_;  // of the rows
  std::vector<Held> held_;
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

/// Whether impulses of what sticks are in their cones, and what is free does not approach.
bool Admissible(const FrictionFrame& frame, const Vector& impulse, ConstraintSet free) {
  const FrictionProblem& problem = frame.problem();
  const Vector rates = problem.G * impulse;
  const double rounding = kProcessRounding * impulse.cwiseAbs().maxCoeff();
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const FrictionContact& contact = problem.contacts[k];
    const int row = problem.Row(k);
    const double cone = contact.coefficient * impulse(row);
    if (impulse.segment(row + 1, contact.dimension).norm() > cone + rounding) return false;
    if (free.Contains(frame.constraints()[k]) && !(rates(row) >= 0)) return false;
  }
  return impulse.allFinite();
}

}  // namespace

std::optional<FrictionalImpact> FollowImpact(const MechanicalSystem& system, const VectorRef& q,
                                             const VectorRef& v_minus, ContactMode J, int jammed) {
  const InverseInertia inertia(system, q, v_minus);
  const FrictionFrame frame(system, inertia, J);
  const FrictionProblem& problem = frame.problem();
  std::size_t place = 0;
  while (frame.constraints()[place] != jammed) ++place;
  Vector rates = frame.rows() * v_minus;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) rates(problem.Row(k)) = 0;
  ConstraintSet free;
  Vector p;
  for (;;) {  // what would be pulled is let go
    Process process(frame, J, place, rates, free);
    if (!process.Run()) return std::nullopt;
    p = process.impulse();
    const int pulled = Pulled(problem, p);
    if (pulled < 0) break;
    const int contact = frame.constraints()[static_cast<std::size_t>(pulled)];
    if (contact == jammed || free.Contains(contact)) return std::nullopt;
    free.Insert(contact);
  }
  if (!Admissible(frame, p, free)) return std::nullopt;
  FrictionalImpact impact;
  impact.result.v_plus = v_minus + frame.reach() * p;
  impact.result.impulse = frame.Impulse(inertia, p);
  impact.energy_change = 0.5 * p.dot(frame.rows() * (v_minus + impact.result.v_plus));
  impact.word = J.Without(free);
  const Vector after = frame.rows() * impact.result.v_plus;
  const auto slip = [&](const Vector& v) {
    return v.segment(problem.Row(place) + 1, problem.contacts[place].dimension).norm();
  };
  const bool sticks = slip(after) <= 1e3 * kEnded * slip(rates);
  if (sticks) impact.word.Set(jammed, Letter::kStick);
  impact.result.hit = J.Members() - free;
  const double energy = KineticEnergy(inertia.mass(), v_minus) + p.cwiseAbs().dot(rates.cwiseAbs());
  if (!impact.result.v_plus.allFinite() || impact.energy_change > kProcessRounding * energy) {
    return std::nullopt;
  }
  return impact;
}

}  // namespace contact_flow
