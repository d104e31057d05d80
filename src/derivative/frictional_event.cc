// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_event.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "frictional_reset.h"

namespace contact_flow {
namespace {

/// A slip, or a normal velocity, is zero at the base point below this, relative to its terms.
constexpr double kZero = 1e-9;
/// A direction does not move a slip, relative to the sizes of D(T v) and w.
constexpr double kUnmoved = 1e-11;
constexpr double kBorder = 1e-9;
constexpr int kRoundsForEach = 4;  // contact, at most

}  // namespace

/// Along one direction w; everything is carried as matrices, so that the result holds on the whole
/// cone of the decisions that w makes.
class FrictionalEvent::Walk {
 public:
  Walk(const FrictionalEvent& event, const VectorRef& w)
      : event_(event),
        system_(*event.system_),
        dynamics_(*event.dynamics_),
        d_(system_.dof()),
        nq_(system_.num_positions()),
        w_(w),
        sizes_(w.cwiseAbs()),
        x_(event.transition_.x_minus),
        mode_(event.transition_.mode_before),
        pending_(event.transition_.activated) {
    path_.matrix = Matrix::Identity(event.size_, event.size_);
    path_.times.resize(0, event.size_);
    path_.margin = std::numeric_limits<double>::infinity();
    still_ = mode_.Sticking();
    for (int g : event.transition_.guards) {
      if (event_.guards_.OfSlips(mode_).Contains(g)) still_.Insert(event_.guards_.ConstraintOf(g));
    }
    first_field_ = dynamics_.Field(x_, mode_);
    for (int i : event.transition_.vanishing) {
      if (std::isinf(system_.friction()[i].coefficient)) releasing_.Insert(i);
    }
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
    gap_jacobian_ = Matrix::Zero(system_.num_rows(), event_.size_);
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
           event_.transition_.x_minus.tail(d_).cwiseAbs().maxCoeff() *
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
    Matrix rows(static_cast<Eigen::Index>(decisions_.size()), event_.size_);
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
      const double size = rate_jacobian_.row(row).cwiseAbs().dot(first_field_.cwiseAbs());
      if (!(slowing < -kZero * size)) continue;
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
    for (std::size_t k = 0; k < times.size(); ++k) {
      if (k != first) Decide(times[k] - times[first]);
    }
    const Candidate& c = candidates[first];
    const Eigen::RowVectorXd tau = times[first];
    const double moved = std::abs(tau.dot(w_));
    path_.matrix += field * tau;
    sizes_ += moved * field.cwiseAbs();
    just_stopped_ = -1;
    switch (c.kind) {
      case Candidate::Kind::kTouchdown:
        Land(c.constraint);
        break;
      case Candidate::Kind::kStop:
        just_stopped_ = c.constraint;
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

  void Land(int i) {
    pending_.Erase(i);
    const ContactMode touching = mode_.Members().With(i);
    const FrictionalReset reset(dynamics_, x_, touching, i, mode_);
    const FrictionalReset::Branch& branch =
        reset.Choose(path_.matrix * w_, sizes_,
                     [&](const Eigen::RowVectorXd& row) { Decide(row * path_.matrix); });
    path_.matrix = branch.jacobian * path_.matrix;
    sizes_ = branch.jacobian.cwiseAbs() * sizes_;
    x_.tail(d_) = reset.v_plus();
    still_ = (still_ - branch.word) | branch.word.Sticking();
    landed_ = touching;
    Measure();
    lifted_ = ContactMode();
    for (int j : touching) {
      const bool bounces = j == i && system_.restitution()(j) > 0;
      const bool free = bounces || !branch.word.Contains(j);
      if (free && rate_(j) > kZero * SizeOf(j)) lifted_.Insert(j);
    }
  }

  /// The word at the base point for runs perturbed along w.
  void SelectNext() {
    TouchingContacts contacts;
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
      } else if (const double moved = i == just_stopped_ ? 0 : Moves(i); moved != 0) {
        const double sign = moved > 0 ? 1 : -1;
        Decide(sign * rate_jacobian_.row(friction.row) * path_.matrix);
        contacts.slipping.Set(i, moved > 0 ? Letter::kForward : Letter::kBackward);
      } else {
        contacts.still.Insert(i);
      }
    }
    landed_ = lifted_ = ContactMode();
    mode_ = SelectWord(&dynamics_, x_, contacts, kBorder);
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
    const ContactMode after = event_.transition_.mode_after;
    ContactMode stopped;
    for (int i : event_.transition_.mode_before) {
      const bool in_space = system_.friction()[i].dimension == 2;
      if (in_space && mode_.LetterOf(i) == Letter::kSlip && after.LetterOf(i) == Letter::kStick) {
        stopped.Insert(i);
      }
    }
    if (stopped.Empty()) return;
    x_ = event_.transition_.x_plus;
    Measure();
    path_.matrix = StopProjection(&dynamics_, x_, after, stopped, rate_jacobian_) * path_.matrix;
    mode_ = after;
    path_.modes.push_back(after);
  }

  /// Guards that are identities change the word alone.
  void FinishWord() {
    const ContactMode after = event_.transition_.mode_after;
    if (mode_ == after) return;
    path_.modes.push_back(after);
  }

  const FrictionalEvent& event_;
  const MechanicalSystem& system_;
  ContactDynamics& dynamics_;
  const int d_, nq_;
  const Vector w_;
  Vector sizes_;  // of the terms that the entries of the tangent are sums of [2d+k]
  Vector x_;
  ContactMode mode_;
  ContactMode pending_;    // touchdowns to come
  ContactMode releasing_;  // without slip, to come
  ContactMode released_;
  ContactMode landed_, lifted_;  // by the last touchdown: what took part, and what left
  ContactMode still_;            // known to have no slip at the base point
  Vector first_field_;           // before the cluster
  int just_stopped_ = -1;
  ConstraintTerms terms_;
  Vector rate_;
  Matrix rate_jacobian_, gap_jacobian_;  // D(A v) and D(a, b) [rows × 2d+k]
  std::vector<Eigen::RowVectorXd> decisions_;
  FrictionalPath path_;
};

FrictionalEvent::FrictionalEvent(std::shared_ptr<ContactDynamics> dynamics,
                                 const Transition& transition)
    : dynamics_(std::move(dynamics)),
      system_(&dynamics_->system()),
      guards_(*system_),
      transition_(transition),
      size_(2 * system_->dof() + dynamics_->num_variables()) {
  if (transition_.activated.Size() > 1) Classify();
}

FrictionalPath FrictionalEvent::Follow(const VectorRef& w) const {
  Vector direction = w;
  if (!(direction.norm() > 0)) {  // any path
    direction = Vector::LinSpaced(size_, 1, 2);
  }
  try {
    return Walk(*this, direction).Take();
  } catch (const FrictionRefusal& reason) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << transition_.t
            << " s the perturbed run is not decided: " << reason.what();
    throw std::domain_error(message.str());
  }
}

std::vector<FrictionalPath> FrictionalEvent::Paths(std::size_t max_pieces) const {
  std::vector<FrictionalPath> paths;
  const auto known = [&](const FrictionalPath& path) {
    return std::any_of(paths.begin(), paths.end(), [&](const FrictionalPath& other) {
      return other.guards == path.guards && other.modes == path.modes &&
             (other.matrix - path.matrix).cwiseAbs().maxCoeff() <=
                 1e-9 * (1 + path.matrix.cwiseAbs().maxCoeff());
    });
  };
  const auto add = [&](const Vector& w) {
    FrictionalPath path = Follow(w);
    if (known(path)) return;
    if (paths.size() >= max_pieces) {
      throw std::length_error("a cluster with friction has more than " +
                              std::to_string(max_pieces) + " pieces");
    }
    paths.push_back(std::move(path));
  };
  // Across every facet of every cone found so far, from several places inside it.
  std::mt19937 random(20);
  std::normal_distribution<double> normal;
  const auto draw = [&] {
    Vector w(size_);
    for (double& entry : w) entry = normal(random);
    return w;
  };
  constexpr int kPlaces = 6;
  for (int k = 0; k < kPlaces; ++k) add(draw());
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const Matrix cone = paths[k].cone;
    for (Eigen::Index row = 0; row < cone.rows(); ++row) {
      for (int place = 0; place < kPlaces; ++place) {
        AskBudget();
        Vector w = draw();
        w -= (cone.row(row).dot(w) + 0.1) * cone.row(row).transpose();
        add(w);
        add(w + 0.2 * cone.row(row).transpose());
      }
    }
  }
  return paths;
}

std::vector<PerturbedEvent> FrictionalEvent::Events(const VectorRef& w) const {
  const FrictionalPath path = Follow(w);
  std::vector<PerturbedEvent> events;
  for (std::size_t k = 0; k < path.modes.size(); ++k) {
    PerturbedEvent event;
    if (k < path.guards.size()) {
      event.constraint = path.guards[k];
      event.time = path.times.row(static_cast<Eigen::Index>(k)).dot(w);
    } else if (!events.empty()) {
      event = events.back();
    } else if (!transition_.guards.empty()) {
      event.constraint = guards_.ConstraintOf(transition_.guards.front());
    }
    event.mode = path.modes[k];
    events.push_back(event);
  }
  return events;
}

PiecewiseLinearMap FrictionalEvent::Map() const {
  constexpr std::size_t kMaxPieces = 5000;
  const std::vector<std::string>& names = system_->description().constraints;
  const int n = system_->num_constraints();
  std::vector<LinearPiece> pieces;
  for (const FrictionalPath& path : Paths(kMaxPieces)) {
    LinearPiece piece;
    piece.matrix = path.matrix;
    piece.cone = path.cone;
    std::vector<std::string> word;
    for (int i : path.guards) word.push_back(names[i]);
    if (!word.empty()) piece.omega.push_back(word);
    piece.eta.push_back(transition_.mode_before.Word(n));
    for (ContactMode mode : path.modes) piece.eta.push_back(mode.Word(n));
    pieces.push_back(std::move(piece));
  }
  return PiecewiseLinearMap(std::move(pieces));
}

double FrictionalEvent::Kink() const {
  constexpr std::size_t kMaxPieces = 500;
  try {
    const std::vector<FrictionalPath> paths = Paths(kMaxPieces);
    double kink = 0;
    for (const FrictionalPath& path : paths) {
      kink = std::max(kink, (path.matrix - paths.front().matrix).cwiseAbs().maxCoeff());
    }
    return kink;
  } catch (const std::exception&) {
    return std::numeric_limits<double>::quiet_NaN();
  }
}

/// Class A_f: the full blocks A_i P A_jᵀ of all pairs of touching contacts vanish, here and around.
bool FrictionalEvent::Decoupled(ContactMode contacts) const {
  const int nq = system_->num_positions(), d = system_->dof();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int sample = 0; sample < 4; ++sample) {
    Vector w = Vector::Zero(2 * d);
    if (sample > 0) {
      for (double& entry : w.head(d)) entry = 1e-3 * normal(random);
    }
    const Vector x = system_->Perturb(transition_.x_minus, w);
    const InverseInertia inertia(*system_, x.head(nq), x.tail(d));
    const FrictionFrame frame(*system_, inertia, contacts);
    const FrictionProblem& problem = frame.problem();
    for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto block =
            problem.G.block(problem.Row(i), problem.Row(j), 1 + problem.contacts[i].dimension,
                            1 + problem.contacts[j].dimension);
        const double own = std::sqrt(problem.G(problem.Row(i), problem.Row(i)) *
                                     problem.G(problem.Row(j), problem.Row(j)));
        if (block.cwiseAbs().maxCoeff() > 1e-12 * own) return false;
      }
    }
  }
  return true;
}

/// Every order of the touchdowns at the base point.
void FrictionalEvent::Classify() {
  const ContactMode all = transition_.mode_before.Members() | transition_.activated;
  if (Decoupled(all)) return;
  std::vector<int> order;
  for (int i : transition_.activated) order.push_back(i);
  if (order.size() > 5) {
    status_ = {Outcome::kNotDifferentiable,
               "more than five contacts with friction land at once and feel each other"};
    return;
  }
  const int nq = system_->num_positions(), d = system_->dof();
  bool same_class = true;
  const Vector v_together = transition_.x_plus.tail(d);
  double apart = 0;
  std::vector<OrderOutcome> outcomes;
  do {
    Vector v = transition_.x_minus.tail(d);
    ContactMode closed = transition_.mode_before.Members();
    OrderOutcome outcome;
    outcome.order = order;
    try {
      FrictionalImpact impact;
      for (int i : order) {
        ConstraintTerms terms;
        system_->Constraints(transition_.x_minus.head(nq), v, &terms);
        if (!(terms.jacobian.row(i).dot(v) < 0)) {
          same_class = false;  // it was lifted by another
          continue;
        }
        closed.Insert(i);
        impact = SolveFrictionalImpact(*system_, transition_.x_minus.head(nq), v, closed);
        v = impact.result.v_plus;
        for (int j : closed) {
          if (terms.jacobian.row(j).dot(v) > kZero * (1 + v.cwiseAbs().maxCoeff())) closed.Erase(j);
        }
      }
      // Class B_f: plastic, and all of them stick, pressed, in the last step.
      for (int i : all) {
        same_class = same_class && system_->restitution()(i) == 0 &&
                     impact.word.LetterOf(i) == Letter::kStick;
      }
    } catch (const FrictionRefusal& reason) {
      outcome.status = {Outcome::kNotDifferentiable, reason.what()};
      same_class = false;
    }
    outcome.v_plus = v;
    apart = std::max(apart, (v - v_together).cwiseAbs().maxCoeff());
    outcomes.push_back(outcome);
  } while (std::next_permutation(order.begin(), order.end()));
  const double size = 1 + v_together.cwiseAbs().maxCoeff();
  if (same_class && apart <= 1e-9 * size) return;
  std::ostringstream message;
  message << "at t = " << transition_.t << " s contacts "
          << transition_.activated.ToString(system_->description().constraints)
          << " land at once and feel each other through their tangential or normal forces: orders "
             "lead to different velocities, "
          << apart << " apart";
  status_ = {Outcome::kDiscontinuous, message.str()};
  outcomes_ = std::move(outcomes);
}

}  // namespace contact_flow
