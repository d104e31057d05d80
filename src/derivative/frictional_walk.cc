// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_walk.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/implied_contacts.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/force_slack.h"
#include "frictional_reset.h"

namespace contact_flow {
namespace {

/// A slip, or a normal velocity, is zero at the base point below this, relative to its terms.
constexpr double kZero = 1e-9;
/// A direction does not move a slip, relative to the sizes of D(T v) and w.
constexpr double kUnmoved = 1e-11;
constexpr double kBorder = 1e-9;
constexpr int kRoundsForEach = 4;  // contact, at most

/// Along one direction w; everything is carried as matrices, so that the result holds on the whole
/// cone of the decisions that w makes.
class FrictionalWalk {
 public:
  FrictionalWalk(ContactDynamics* dynamics, const Transition& transition, const VectorRef& w)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        transition_(transition),
        guards_(system_),
        d_(system_.dof()),
        nq_(system_.num_positions()),
        size_(2 * d_ + dynamics->num_variables()),
        w_(w),
        sizes_(w.cwiseAbs()),
        x_(transition.x_minus),
        mode_(transition.mode_before),
        pending_(transition.activated) {
    path_.matrix = Matrix::Identity(size_, size_);
    path_.times.resize(0, size_);
    path_.margin = std::numeric_limits<double>::infinity();
    still_ = mode_.Sticking();
    for (int g : transition.guards) {
      if (guards_.OfSlips(mode_).Contains(g)) still_.Insert(guards_.ConstraintOf(g));
    }
    for (int i : transition.vanishing) {
      if (std::isinf(system_.friction()[i].coefficient)) releasing_.Insert(i);
    }
    slack_ = ForceSlack(&dynamics_, transition);
    Measure();
    SettleSticking();
  }

  FrictionalPath Take() {
    const int limit = kRoundsForEach * (system_.num_constraints() + 1);
    for (int round = 0; Next(); ++round) {
      AskBudget();
      if (round < limit) continue;
      throw std::domain_error("events of a perturbed run follow each other without end");
    }
    StopInSpace();
    FinishWord();
    path_.cone = Rows();
    path_.v_plus = v();
    return path_;
  }

 private:
  /// A guard that is to vanish, with its gradient [2d+k].
  struct Candidate {
    enum class Kind { kTouchdown, kStop, kRelease } kind;
    int constraint;
    Eigen::RowVectorXd gradient;
    double rate;  // along F
  };

  Vector v() const { return x_.tail(d_); }

  /// Rows of T v and its derivatives at the present base point.
  void Measure() {
    system_.Constraints(x_.head(nq_), v(), &terms_);
    rate_ = terms_.jacobian * v();
    rate_jacobian_ = RateJacobian(dynamics_, x_);
    acceleration_ = LargestAcceleration(dynamics_, x_,
                                        transition_.mode_before.Members() | transition_.activated);
    gap_jacobian_ = Matrix::Zero(system_.num_rows(), size_);
    gap_jacobian_.leftCols(d_) = terms_.jacobian;
    const std::vector<int>& parameters = dynamics_.variables().parameters;
    if (!parameters.empty()) {
      ParameterJacobian by_parameter;
      system_.DifferentiateImpactByParameters(x_.head(nq_), Vector::Zero(d_),
                                              Vector::Zero(system_.num_rows()), v(), parameters,
                                              &by_parameter);
      gap_jacobian_.rightCols(by_parameter.gap.cols()) = by_parameter.gap;
    }
  }

  double SizeOf(int row) const {
    return terms_.jacobian.row(row).cwiseAbs().dot(v().cwiseAbs()) +
           transition_.x_minus.tail(d_).cwiseAbs().maxCoeff() *
               terms_.jacobian.row(row).cwiseAbs().maxCoeff();
  }
  /// Whether the slip of contact i vanishes at the base point.
  bool Still(int i) const {
    const int row = system_.friction()[i].row;
    return still_.Contains(i) || std::abs(rate_(row)) <= kZero * SizeOf(row);
  }
  /// D(T v) w of contact i in the plane, or 0 where w does not move it.
  double Moves(int i) const {
    const int row = system_.friction()[i].row;
    const double moved = rate_jacobian_.row(row).dot(path_.matrix * w_);
    const double size = rate_jacobian_.row(row).cwiseAbs().dot(sizes_);
    return std::abs(moved) <= kUnmoved * size ? 0 : moved;
  }
  void Decide(const Eigen::RowVectorXd& row) {
    const double norm = row.norm();
    if (!(norm > 0)) return;
    decisions_.push_back(row / norm);
    path_.margin = std::min(path_.margin, decisions_.back().dot(w_) / w_.norm());
  }
  Matrix Rows() const {
    Matrix rows(static_cast<Eigen::Index>(decisions_.size()), size_);
    for (std::size_t k = 0; k < decisions_.size(); ++k) {
      rows.row(static_cast<Eigen::Index>(k)) = decisions_[k];
    }
    return rows;
  }

  /// Contacts that stick where the cluster begins, and that w moves: by the projection (F7).
  void SettleSticking() {
    ContactMode moved;
    for (int i : mode_.Sticking()) {
      const Friction& friction = system_.friction()[i];
      const Vector now = path_.matrix * w_;
      const auto rows = rate_jacobian_.middleRows(friction.row, friction.dimension);
      const double size = (rows.cwiseAbs() * now.cwiseAbs()).norm();
      if ((rows * now).norm() > 1e-9 * size) moved.Insert(i);
    }
    if (moved.Empty()) return;
    path_.matrix =
        StopProjection(&dynamics_, x_, mode_, mode_.Sticking(), rate_jacobian_) * path_.matrix;
  }

  std::vector<Candidate> Candidates(const Vector& field) {
    std::vector<Candidate> candidates;
    for (int i : pending_) {
      candidates.push_back({Candidate::Kind::kTouchdown, i, gap_jacobian_.row(i), rate_(i)});
    }
    for (int i : mode_.SlippingInPlane()) {
      const int row = system_.friction()[i].row;
      if (!Still(i)) continue;
      const double sign = mode_.LetterOf(i) == Letter::kBackward ? -1 : 1;
      const double slowing = sign * rate_jacobian_.row(row).dot(field);
      if (!(slowing < -kBorder * acceleration_)) continue;  // a word that holds may miss as much
      candidates.push_back({Candidate::Kind::kStop, i, sign * rate_jacobian_.row(row), slowing});
    }
    for (int i : releasing_) {
      if (!mode_.Contains(i)) continue;
      dynamics_.Differentiate(x_, mode_);
      const Eigen::RowVectorXd gradient = dynamics_.force_jacobian().row(i);
      candidates.push_back({Candidate::Kind::kRelease, i, gradient, gradient.dot(field)});
    }
    return candidates;
  }

  /// The guard that vanishes next; false when none is left.
  bool Next() {
    const Vector field = dynamics_.Field(x_, mode_);
    const std::vector<Candidate> candidates = Candidates(field);
    if (candidates.empty()) return false;
    std::vector<Eigen::RowVectorXd> times;
    std::size_t first = 0;
    for (const Candidate& c : candidates) {
      times.push_back(-(c.gradient * path_.matrix) / c.rate);
      if (times.back().dot(w_) < times[first].dot(w_)) first = times.size() - 1;
    }
    const Candidate& c = candidates[first];
    const ContactMode along = Along(c);
    for (std::size_t k = 0; k < times.size(); ++k) {
      const bool same = candidates[k].kind == c.kind && along.Contains(candidates[k].constraint);
      if (k != first && !same) Decide(times[k] - times[first]);
    }
    const Eigen::RowVectorXd tau = times[first];
    const double moved = std::abs(tau.dot(w_));
    path_.matrix += field * tau;
    sizes_ += moved * field.cwiseAbs();
    just_stopped_ = ContactMode();
    switch (c.kind) {
      case Candidate::Kind::kTouchdown:
        Land(c.constraint, along);
        break;
      case Candidate::Kind::kStop:
        just_stopped_ = along.With(c.constraint);
        break;
      case Candidate::Kind::kRelease:
        releasing_.Erase(c.constraint);
        released_.Insert(c.constraint);
        break;
    }
    SelectNext();
    const Vector after = dynamics_.Field(x_, mode_);
    path_.matrix -= after * tau;
    sizes_ += moved * after.cwiseAbs();
    path_.guards.push_back(c.constraint);
    path_.modes.push_back(mode_);
    path_.times.conservativeResize(path_.times.rows() + 1, Eigen::NoChange);
    path_.times.bottomRows(1) = tau;
    return true;
  }

  /// Contacts of the same body that an event brings along: what lands, or stops, with it.
  ContactMode Along(const Candidate& c) const {
    if (c.kind == Candidate::Kind::kTouchdown) {
      return ImpliedClosed(system_, x_, mode_.Members().With(c.constraint),
                           pending_.Without(c.constraint));
    }
    if (c.kind != Candidate::Kind::kStop) return {};
    return ImpliedStill(system_, x_, mode_.Members(), mode_.Sticking().With(c.constraint));
  }

  void Land(int i, ContactMode along) {
    pending_ = pending_ - along.With(i);
    const ContactMode touching = mode_.Members().With(i) | along;
    const FrictionalReset reset(dynamics_, x_, touching, i, mode_, transition_.mode_after);
    const FrictionalReset::Branch& branch =
        reset.Choose(path_.matrix * w_, sizes_,
                     [&](const Eigen::RowVectorXd& row) { Decide(row * path_.matrix); });
    path_.matrix = branch.jacobian * path_.matrix;
    sizes_ = branch.jacobian.cwiseAbs() * sizes_;
    x_.tail(d_) = reset.v_plus();
    still_ = (still_ - branch.word) | branch.word.Sticking();
    landed_ = touching;
    Measure();
    for (int j : still_ - branch.word) {  // an impact elsewhere may throw it along
      const Friction& friction = system_.friction()[j];
      const double slip = rate_.segment(friction.row, friction.dimension).norm();
      if (friction.dimension > 0 && slip > kZero * SizeOf(friction.row)) still_.Erase(j);
    }
    // What has let go before, by less than to first order, and is driven back is hit at once.
    for (int j : transition_.mode_before.Members() - touching - pending_) {
      if (rate_(j) < -kZero * SizeOf(j)) pending_.Insert(j);
    }
    lifted_ = ContactMode();
    for (int j : touching) {
      const bool bounces = along.With(i).Contains(j) && system_.restitution()(j) > 0;
      const bool free = bounces || !branch.word.Contains(j);
      if (free && rate_(j) > kZero * SizeOf(j)) lifted_.Insert(j);
    }
  }

  /// The word at the base point for runs perturbed along w.
  void SelectNext() {
    TouchingContacts contacts;
    contacts.slack = slack_;
    const ContactMode closed = (landed_.Empty() ? mode_ : landed_).Members() - released_;
    for (int i : closed) {
      if (lifted_.Contains(i)) continue;
      const Friction& friction = system_.friction()[i];
      if (friction.dimension == 0 || friction.coefficient == 0) {
        contacts.slipping.Insert(i);
      } else if (std::isinf(friction.coefficient)) {
        contacts.still.Insert(i);
      } else if (friction.dimension == 2) {
        SortInSpace(i, &contacts);
      } else if (!Still(i)) {
        contacts.slipping.Set(i, rate_(friction.row) > 0 ? Letter::kForward : Letter::kBackward);
      } else if (const double moved = just_stopped_.Contains(i) ? 0 : Moves(i); moved != 0) {
        const double sign = moved > 0 ? 1 : -1;
        Decide(sign * rate_jacobian_.row(friction.row) * path_.matrix);
        contacts.slipping.Set(i, moved > 0 ? Letter::kForward : Letter::kBackward);
      } else {
        contacts.still.Insert(i);
      }
    }
    mode_ = SelectWord(&dynamics_, x_, contacts, kBorder);
    // What never slips holds until its own release: its force along the ground does not vanish.
    releasing_ = StillReleasing(&dynamics_, x_, mode_, ContactMode(closed & releasing_) - lifted_);
    for (int i : releasing_) mode_.Set(i, Letter::kStick);
    landed_ = lifted_ = ContactMode();
  }

  void SortInSpace(int i, TouchingContacts* contacts) {
    const Friction& friction = system_.friction()[i];
    if (rate_.segment<2>(friction.row).norm() > kZero * SizeOf(friction.row)) {
      contacts->slipping.Insert(i);
    } else {
      contacts->still.Insert(i);
    }
  }

  /// Slips in space that end at the base point, all at once: their order does not matter.
  void StopInSpace() {
    const ContactMode after = transition_.mode_after;
    ContactMode stopped;
    for (int i : transition_.mode_before) {
      const bool in_space = system_.friction()[i].dimension == 2;
      if (in_space && mode_.LetterOf(i) == Letter::kSlip && after.LetterOf(i) == Letter::kStick) {
        stopped.Insert(i);
      }
    }
    if (stopped.Empty()) return;
    x_ = transition_.x_plus;
    Measure();
    path_.matrix = StopProjection(&dynamics_, x_, after, stopped, rate_jacobian_) * path_.matrix;
    mode_ = after;
    path_.modes.push_back(after);
  }

  /// Guards that are identities change the word alone.
  void FinishWord() {
    const ContactMode after = transition_.mode_after;
    if (mode_ == after) return;
    path_.modes.push_back(after);
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Transition& transition_;
  const Guards guards_;
  const int d_, nq_, size_;
  const Vector w_;
  Vector sizes_;  // of the terms that the entries of the tangent are sums of [2d+k]
  Vector x_;
  Vector slack_;  // of forces that vanish, by constraint
  ContactMode mode_;
  ContactMode pending_;    // touchdowns to come
  ContactMode releasing_;  // without slip, to come
  ContactMode released_;
  ContactMode landed_, lifted_;  // by the last touchdown: what took part, and what left
  ContactMode still_;            // known to have no slip at the base point
  double acceleration_ = 0;      // of rows, without contact forces
  ContactMode just_stopped_;
  ConstraintTerms terms_;
  Vector rate_;
  Matrix rate_jacobian_, gap_jacobian_;  // D(A v) and D(a, b) [rows × 2d+k]
  std::vector<Eigen::RowVectorXd> decisions_;
  FrictionalPath path_;
};

}  // namespace

FrictionalPath WalkThrough(ContactDynamics* dynamics, const Transition& transition,
                           const VectorRef& w) {
  return FrictionalWalk(dynamics, transition, w).Take();
}

}  // namespace contact_flow
