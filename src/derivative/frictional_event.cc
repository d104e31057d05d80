// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_event.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "input_cluster.h"
#include "landing_orders.h"
#include "src/dynamics/implied_contacts.h"
#include "walk_point.h"

namespace contact_flow {
namespace {

/// Velocities are the same below this, relative.
constexpr double kNoRate = 1e-9;
/// Those behind a perturbed run's events and the run's own, below this, and as many tolerances.
constexpr double kSameOutcome = 1e-6, kUnresolved = 1e3;
/// Pieces are looked for beyond what so many rays from inside a cone meet first, for each of its
/// facets, and along so many directions anywhere.
constexpr int kRays = 6, kBlindDirections = 200;
/// Rays go on by this much beyond a facet, relative: the cone behind it may be thin.
constexpr double kBeyond = 1e-3;
/// A direction lies on a facet, relative.
constexpr double kOnFacet = 1e-9;
constexpr std::size_t kMaxPieces = 5000;

/// How far it is from w, inside the cone, to its first facet along a ray, or `most`.
double Reach(const Matrix& cone, const Vector& w, const Vector& along, double most) {
  const Vector slope = cone * along, height = cone * w;
  for (Eigen::Index row = 0; row < cone.rows(); ++row) {
    if (slope(row) < 0) most = std::min(most, std::max(height(row), 0.0) / -slope(row));
  }
  return most;
}

/// Shoots rays from w, inside the cone, to its facets and at random, and adds what is just beyond.
template <class Draw, class Add>
void AcrossFacets(const Matrix& cone, Vector w, const Draw& draw, const Add& add) {
  for (Eigen::Index ray = 0; ray < kRays * cone.rows(); ++ray) {
    AskBudget();
    const Vector aside = draw();
    const double ahead = Reach(cone, w, aside, 1), back = Reach(cone, w, -aside, 1);
    w += 0.5 * (ahead - back) * aside;  // to the middle: w may have been close to a facet
    Vector along = draw();
    if (ray % 2 == 0) along = 0.1 * along - cone.row(ray / 2 % cone.rows()).transpose();
    const double reach = Reach(cone, w, along, std::numeric_limits<double>::infinity());
    if (std::isfinite(reach)) add(w + (1 + kBeyond) * reach * along);
  }
}

/// An orthonormal basis of the gradients of gaps and gap rates of what the mode before holds, to
/// which directions of runs that hold it are orthogonal [2d+k × ·].
Matrix HeldDirections(ContactDynamics* dynamics, const Transition& transition) {
  const WalkPoint point(dynamics, transition);
  const int size = static_cast<int>(point.gap_jacobian().cols());
  const ConstraintSet held = transition.mode_before;
  if (held.Empty()) return Matrix::Zero(size, 0);
  Matrix gradients(size, 2 * held.Size());
  Eigen::Index k = 0;
  for (int i : held) {
    gradients.col(k++) = point.gap_jacobian().row(i).normalized();
    gradients.col(k++) = point.rate_jacobian().row(i).normalized();
  }
  Eigen::ColPivHouseholderQR<Matrix> factor(gradients);
  return factor.householderQ() * Matrix::Identity(size, factor.rank());
}

}  // namespace

FrictionalEvent::FrictionalEvent(std::shared_ptr<ContactDynamics> dynamics,
                                 const Transition& transition, std::vector<Vector> inputs)
    : dynamics_(std::move(dynamics)),
      system_(&dynamics_->system()),
      guards_(*system_),
      transition_(transition),
      inputs_(std::move(inputs)),
      size_(2 * system_->dof() + dynamics_->num_variables()),
      held_(HeldDirections(dynamics_.get(), transition)) {
  if (transition_.activated.Size() > 1) Classify();
}

FrictionalPath FrictionalEvent::Follow(const VectorRef& w, const VectorRef& dt) const {
  Vector direction = w;
  if (!(direction.norm() > 0) && dt.isZero(0)) {  // any path
    direction = Held(Vector::LinSpaced(size_, 1, 2));
  }
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << transition_.t << " s the perturbed run ";
  try {
    FrictionalPath path = WalkThrough(dynamics_.get(), transition_, inputs_, direction, dt);
    HoldCone(direction, &path);
    if (!path.matrix.allFinite()) {
      message << "has a derivative that is not finite";
      throw std::domain_error(message.str());
    }
    const Vector end = transition_.x_plus.tail(system_->dof());
    const double apart = (path.v_plus - end).cwiseAbs().maxCoeff();
    const double size =
        end.cwiseAbs().maxCoeff() + transition_.x_minus.tail(system_->dof()).cwiseAbs().maxCoeff();
    if (apart <= kSameOutcome * size + kUnresolved * transition_.absolute_tolerance) return path;
    message << "ends its events with other velocities, " << apart
            << " apart: their order decides the outcome, which is discontinuous here";
  } catch (const FrictionRefusal& reason) {
    message << "is not decided: " << reason.what();
  }
  throw std::domain_error(message.str());
}

/// The part of w that leaves held what the mode before holds.
Vector FrictionalEvent::Held(const Vector& w) const { return w - held_ * (held_.transpose() * w); }

/// Decisions among directions that hold what the mode before holds; others are none.
void FrictionalEvent::HoldCone(const Vector& w, FrictionalPath* path) const {
  Matrix cone(path->cone.rows(), size_);
  Eigen::Index rows = 0;
  path->margin = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < path->cone.rows(); ++k) {
    const Vector row = Held(path->cone.row(k).transpose());
    if (row.norm() <= kOnFacet) continue;
    cone.row(rows) = row.normalized().transpose();
    path->margin = std::min(path->margin, cone.row(rows++).dot(w) / w.norm());
  }
  path->cone = cone.topRows(rows);
}

std::vector<FrictionalPath> FrictionalEvent::Paths(std::size_t max_pieces) const {
  std::vector<FrictionalPath> paths;
  std::vector<Vector> inside;  // directions that led to them
  // The same path may have several cones.
  const auto known = [&](const FrictionalPath& path, const Vector& w) {
    return std::any_of(paths.begin(), paths.end(), [&](const FrictionalPath& other) {
      return other.guards == path.guards && other.modes == path.modes &&
             ((other.cone * w).array() >= -kOnFacet * w.norm()).all() &&
             (other.matrix - path.matrix).cwiseAbs().maxCoeff() <=
                 1e-9 * (1 + path.matrix.cwiseAbs().maxCoeff());
    });
  };
  const auto add = [&](const Vector& w) {
    const Vector held = Held(w);
    FrictionalPath path = Follow(held);
    const bool decided = path.cone.rows() == 0 || path.margin > kOnFacet;
    if (!decided || known(path, held)) return;
    if (paths.size() >= max_pieces) {
      throw std::length_error("a cluster with friction has more than " +
                              std::to_string(max_pieces) + " pieces");
    }
    paths.push_back(std::move(path));
    inside.push_back(held);
  };
  // Across every facet of every cone found so far, from several places inside it.
  std::mt19937 random(20);
  std::normal_distribution<double> normal;
  const auto draw = [&] {
    Vector w(size_);
    for (double& entry : w) entry = normal(random);
    return w;
  };
  std::size_t k = 0;
  for (int blind = 0; blind < kBlindDirections; ++blind) {
    for (; k < paths.size(); ++k) {
      const Matrix cone = paths[k].cone;  // a copy: paths move
      AcrossFacets(cone, inside[k], draw, add);
    }
    add(draw());  // what facets did not lead to
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
      if (event.constraint >= system_->num_constraints()) event.kind = PerturbedEvent::Kind::kInput;
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

std::vector<PieceTimes> FrictionalEvent::Times() const {
  std::vector<PieceTimes> times;
  for (const FrictionalPath& path : Paths(kMaxPieces)) times.push_back({path.guards, path.times});
  return times;
}

PiecewiseLinearMap FrictionalEvent::Map() const {
  const std::vector<std::string>& names = system_->description().constraints;
  const int n = system_->num_constraints();
  std::vector<LinearPiece> pieces;
  for (const FrictionalPath& path : Paths(kMaxPieces)) {
    LinearPiece piece;
    piece.matrix = path.matrix;
    piece.cone = path.cone;
    std::vector<std::string> word;
    for (int i : path.guards) word.push_back(i < n ? names[i] : kInputChange);
    if (!word.empty()) piece.omega.push_back(word);
    piece.eta.push_back(transition_.mode_before.ToString(names));
    piece.words.push_back(transition_.mode_before.Word(n));
    for (ContactMode mode : path.modes) {
      piece.eta.push_back(mode.ToString(names));
      piece.words.push_back(mode.Word(n));
    }
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

/// x⁻ and states around it.
std::vector<Vector> FrictionalEvent::Around() const {
  const int d = system_->dof();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Vector> states = {transition_.x_minus};
  for (int sample = 0; sample < 3; ++sample) {
    Vector w = Vector::Zero(2 * d);
    for (double& entry : w.head(d)) entry = 1e-3 * normal(random);
    states.push_back(system_->Perturb(transition_.x_minus, w));
  }
  return states;
}

/// What closes one of those that land closes all, here and around: corners of one body on a plane,
/// with those on which it stands. They have no order.
bool FrictionalEvent::LandAsOne() const {
  for (const Vector& x : Around()) {
    for (int i : transition_.activated) {
      const ConstraintSet others = transition_.activated.Without(i);
      const ConstraintSet closed = transition_.mode_before.Members().With(i);
      if (ImpliedClosed(*system_, x, closed, others) != others) return false;
    }
  }
  return true;
}

/// Class A_f: the full blocks A_i P A_jᵀ of all pairs of touching contacts vanish, here and around.
bool FrictionalEvent::Decoupled(ConstraintSet contacts) const {
  const int nq = system_->num_positions(), d = system_->dof();
  for (const Vector& x : Around()) {
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

/// The contact mode in which an order's outcome goes on.
void FrictionalEvent::FindModeAfter(OrderOutcome* outcome) const {
  const int nq = system_->num_positions(), d = system_->dof();
  Vector x = transition_.x_minus;
  x.tail(d) = outcome->v_plus;
  ConstraintTerms terms;
  system_->Constraints(x.head(nq), x.tail(d), &terms);
  SimulateOptions options;
  for (int i : transition_.mode_before | transition_.activated) {
    options.gap_tolerance = std::max(options.gap_tolerance, 2 * std::abs(terms.gap(i)));
  }
  try {
    outcome->mode_after =
        InitialMode(*system_, x, inputs_.empty() ? dynamics_->u() : inputs_.back(), options);
  } catch (const std::invalid_argument& reason) {
    outcome->status = {Outcome::kNotDifferentiable, reason.what()};
  }
}

/// Every order of the touchdowns, here and around.
void FrictionalEvent::Classify() {
  if (Decoupled(transition_.mode_before.Members() | transition_.activated) || LandAsOne()) return;
  if (transition_.activated.Size() > kMaxOrderedLandings) {
    status_ = {Outcome::kNotDifferentiable,
               "more than five contacts with friction land at once and feel each other"};
    return;
  }
  LandingOrders orders = FindLandingOrders(*system_, transition_);
  if (orders.agree) return;
  for (OrderOutcome& outcome : orders.outcomes) {
    if (outcome.status.ok()) FindModeAfter(&outcome);
  }
  const double size = 1 + transition_.x_plus.tail(system_->dof()).cwiseAbs().maxCoeff();
  std::ostringstream message;
  message << "at t = " << transition_.t << " s contacts "
          << transition_.activated.ToString(system_->description().constraints)
          << " land at once and feel each other through their tangential or normal forces: orders "
             "lead to different velocities, ";
  if (orders.apart > kNoRate * size) {
    message << orders.apart << " apart";
  } else {
    message << "not here, but at states around";
  }
  status_ = {Outcome::kDiscontinuous, message.str()};
  outcomes_ = std::move(orders.outcomes);
}

}  // namespace contact_flow
