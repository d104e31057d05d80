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
#include "path_search.h"
#include "src/dynamics/decoupled_contacts.h"
#include "src/dynamics/implied_contacts.h"
#include "tangent_sizes.h"
#include "walk_point.h"

namespace contact_flow {
namespace {

/// Velocities are the same below this, relative.
constexpr double kNoRate = 1e-9;
/// Those behind a perturbed run's events and the run's own, below this, and as many tolerances,
/// and what they change by while the events last, so many times.
constexpr double kSameOutcome = 1e-6, kUnresolved = 1e3, kSpreads = 10;
/// A direction lies on a facet, relative.
constexpr double kOnFacet = 1e-9;
constexpr std::size_t kMaxPieces = 5000;

/// Orthonormal bases, in sizes, of the gradients of gaps and gap rates of what the mode before
/// holds [2d+k × ·], and of the directions that hold it, which are orthogonal to these.
void FindHeld(ContactDynamics* dynamics, const Transition& transition, const Vector& sizes,
              Matrix* held, Matrix* holding) {
  const WalkPoint point(dynamics, transition);
  const Eigen::Index size = sizes.size();
  const ConstraintSet contacts = transition.mode_before;
  Matrix gradients(size, 2 * contacts.Size());
  Eigen::Index k = 0;
  for (int i : contacts) {
    for (const auto& row : {point.gap_jacobian().row(i), point.rate_jacobian().row(i)}) {
      gradients.col(k++) = row.transpose().cwiseProduct(sizes).normalized();
    }
  }
  Matrix basis = Matrix::Identity(size, size);
  Eigen::Index rank = 0;
  if (k > 0) {
    const Eigen::ColPivHouseholderQR<Matrix> factor(gradients);
    basis = factor.householderQ();
    rank = factor.rank();
  }
  *held = basis.leftCols(rank);
  *holding = basis.rightCols(size - rank);
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
      sizes_(TangentSizes(dynamics_.get(), transition.x_minus, transition.mode_before)) {
  FindHeld(dynamics_.get(), transition, sizes_, &held_, &holding_);
  if (transition_.activated.Size() > 1) Classify();
}

FrictionalPath FrictionalEvent::Follow(const VectorRef& w, const VectorRef& dt) const {
  Vector direction = w;
  if (!(direction.norm() > 0) && dt.isZero(0)) {  // any path
    direction = AnyDirection();
  }
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << transition_.t << " s the perturbed run ";
  try {
    FrictionalPath path = WalkThrough(dynamics_.get(), transition_, inputs_, direction, dt);
    HoldCone(&path);
    if (!path.matrix.allFinite()) {
      message << "has a derivative that is not finite";
      throw std::domain_error(message.str());
    }
    const Vector end = transition_.x_plus.tail(system_->dof());
    const double apart = (path.v_plus - end).cwiseAbs().maxCoeff();
    const double size =
        end.cwiseAbs().maxCoeff() + transition_.x_minus.tail(system_->dof()).cwiseAbs().maxCoeff();
    // Where all stop at once nothing else has a size.
    const Vector field = dynamics_->Field(transition_.x_minus, transition_.mode_before);
    const double within = field.segment(system_->dof(), system_->dof()).cwiseAbs().maxCoeff() *
                          kSpreads * transition_.spread;
    if (apart <= kSameOutcome * size + kUnresolved * transition_.absolute_tolerance + within) {
      return path;
    }
    message << "ends its events with other velocities, " << apart
            << " apart: their order decides the outcome, which is discontinuous here";
  } catch (const FrictionRefusal& reason) {
    message << "is not decided: " << reason.what();
  }
  throw std::domain_error(message.str());
}

/// One that leaves held what the mode before holds, if it can without parameters and inputs: these
/// may part what depends on each other.
Vector FrictionalEvent::AnyDirection() const {
  constexpr double kNone = 1e-9;
  const Vector w = Vector::LinSpaced(size_, 1, 2), y = w.cwiseQuotient(sizes_);
  Matrix fixed(size_, held_.cols() + dynamics_->num_variables());
  fixed << held_, Matrix::Identity(size_, size_).rightCols(dynamics_->num_variables());
  if (fixed.cols() == held_.cols()) return Held(w);
  const Eigen::ColPivHouseholderQR<Matrix> factor(fixed);
  const Matrix basis = Matrix(factor.householderQ()).leftCols(factor.rank());
  const Vector moved = y - basis * (basis.transpose() * y);
  return moved.norm() > kNone * y.norm() ? Vector(sizes_.cwiseProduct(moved)) : Held(w);
}

/// The part of w that leaves held what the mode before holds.
Vector FrictionalEvent::Held(const Vector& w) const {
  const Vector y = w.cwiseQuotient(sizes_);
  return sizes_.cwiseProduct(y - held_ * (held_.transpose() * y));
}

/// Decisions among directions that hold what the mode before holds; others are none.
void FrictionalEvent::HoldCone(FrictionalPath* path) const {
  Matrix cone(path->cone.rows(), size_);
  Eigen::Index rows = 0;
  for (Eigen::Index k = 0; k < path->cone.rows(); ++k) {
    const Vector row = path->cone.row(k).transpose().cwiseProduct(sizes_).normalized();
    const Vector held = row - held_ * (held_.transpose() * row);
    if (held.norm() <= kOnFacet) continue;
    const Vector back = held.cwiseQuotient(sizes_);
    cone.row(rows++) = back.transpose() / back.stableNorm();
  }
  path->cone = cone.topRows(rows);
}

std::vector<FrictionalPath> FrictionalEvent::Paths(std::size_t max_pieces) const {
  const auto follow = [this](const Vector& w) { return Follow(w); };
  return PathSearch(follow, sizes_, holding_, max_pieces).Take();
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
      const Matrix apart = sizes_.cwiseInverse().asDiagonal() *
                           (path.matrix - paths.front().matrix) * sizes_.asDiagonal();
      kink = std::max(kink, apart.cwiseAbs().maxCoeff());
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

/// Class A_f: no touching contact feels another, here and around.
bool FrictionalEvent::Decoupled(ConstraintSet contacts) const {
  const std::vector<Vector> states = Around();
  return std::all_of(states.begin(), states.end(),
                     [&](const Vector& x) { return AreDecoupled(*system_, x, contacts); });
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
