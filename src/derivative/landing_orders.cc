// SPDX-License-Identifier: BSD-3-Clause
#include "landing_orders.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <random>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/row_layout.h"
#include "src/dynamics/implied_contacts.h"

namespace contact_flow {
namespace {

/// A normal velocity is zero below this, and velocities are the same, relative.
constexpr double kNoVelocity = 1e-9;
/// States around x⁻, and how far away.
constexpr int kAround = 12;
constexpr double kBeside = 1e-3;

/// One state at which contacts land.
class Landing {
 public:
  Landing(const MechanicalSystem& system, const Transition& transition, const Vector& x)
      : system_(system),
        transition_(transition),
        nq_(system.num_positions()),
        x_(x),
        resting_(transition.mode_before.Members()) {}

  Vector Together() const {
    return SolveFrictionalImpact(system_, x_.head(nq_), x_.tail(system_.dof()),
                                 resting_ | transition_.activated)
        .result.v_plus;
  }

  OrderOutcome InOrder(const std::vector<int>& order) const {
    OrderOutcome outcome;
    outcome.order = order;
    outcome.impulse = Vector::Zero(system_.num_rows());
    outcome.v_plus = x_.tail(system_.dof());
    try {
      Land(&outcome);
    } catch (const FrictionRefusal& reason) {
      outcome.status = {Outcome::kNotDifferentiable, reason.what()};
    }
    return outcome;
  }

 private:
  void Land(OrderOutcome* outcome) const {
    Vector& v = outcome->v_plus;
    ConstraintSet closed = resting_;
    for (int i : outcome->order) {
      if (closed.Contains(i)) continue;  // with another, of the same body
      if (!(Rates(v)(i) < 0)) continue;  // it was lifted by another
      closed.Insert(i);
      closed = closed | ImpliedClosed(system_, x_, closed, transition_.activated - closed);
      const FrictionalImpact impact = SolveFrictionalImpact(system_, x_.head(nq_), v, closed);
      if (impact.springs) {
        throw FrictionRefusal(FrictionRefusal::Kind::kIndeterminateForces,
                              "how an impact shares its impulses decides");
      }
      v = impact.result.v_plus;
      outcome->impulse += impact.result.impulse;
      const Vector rates = Rates(v), zero = Zero(v);
      for (int j : closed) {
        if (rates(j) > zero(j)) closed.Erase(j);
      }
    }
    const Vector rates = Rates(v), zero = Zero(v);
    for (int i : resting_ | transition_.activated) {
      if (rates(i) < -zero(i)) outcome->status = {Outcome::kZeno, "one is hit again"};
    }
  }

  Vector Rates(const Vector& v) const {
    ConstraintTerms terms;
    system_.Constraints(x_.head(nq_), v, &terms);
    return terms.jacobian * v;
  }
  /// What rates are zero below, by their own terms.
  Vector Zero(const Vector& v) const {
    ConstraintTerms terms;
    system_.Constraints(x_.head(nq_), v, &terms);
    return kNoVelocity * ((terms.jacobian.cwiseAbs() * v.cwiseAbs()).array() + 1).matrix();
  }

  const MechanicalSystem& system_;
  const Transition& transition_;
  const int nq_;
  const Vector x_;
  const ConstraintSet resting_;
};

/// x⁻ moved at random, so that what rests goes on to and what sticks as well.
template <class Draw>
Vector Beside(const MechanicalSystem& system, const Transition& transition, const Draw& draw) {
  const int nq = system.num_positions(), d = system.dof();
  Vector w(2 * d);
  for (double& entry : w) entry = kBeside * draw();
  w.tail(d).array() *= 1 + transition.x_minus.tail(d).array().abs();
  Vector x = system.Perturb(transition.x_minus, w);
  const InverseInertia inertia(system, x.head(nq), x.tail(d));
  std::vector<int> kept;
  for (int i : transition.mode_before) {
    kept.push_back(i);
    if (transition.mode_before.LetterOf(i) != Letter::kStick) continue;
    RowLayout(system).AddTangential(i, &kept);
  }
  Matrix A(static_cast<Eigen::Index>(kept.size()), d);
  for (std::size_t r = 0; r < kept.size(); ++r) {
    A.row(static_cast<Eigen::Index>(r)) = inertia.terms().jacobian.row(kept[r]);
  }
  if (kept.empty()) return x;
  const Matrix reach = inertia * A.transpose();
  x.tail(d) -=
      reach * Matrix(A * reach).completeOrthogonalDecomposition().solve(Vector(A * x.tail(d)));
  return x;
}

/// The largest difference of velocities, relative to 1 + |v_k|.
double Relative(const Vector& v, const Vector& other) {
  return ((other - v).array().abs() / (1 + v.array().abs())).maxCoeff();
}

/// The largest difference of velocities between any order and all at once, relative; infinite where
/// one is not decided.
double Apart(const Landing& landing, std::vector<int> order) {
  double apart = 0;
  try {
    const Vector together = landing.Together();
    do {
      const OrderOutcome outcome = landing.InOrder(order);
      if (!outcome.status.ok()) return std::numeric_limits<double>::infinity();
      apart = std::max(apart, Relative(together, outcome.v_plus));
    } while (std::next_permutation(order.begin(), order.end()));
  } catch (const FrictionRefusal&) {
    return std::numeric_limits<double>::infinity();
  }
  return apart;
}

}  // namespace

LandingOrders FindLandingOrders(const MechanicalSystem& system, const Transition& transition) {
  LandingOrders orders;
  std::vector<int> order;
  for (int i : transition.activated) order.push_back(i);
  const Landing here(system, transition, transition.x_minus);
  const Vector together = transition.x_plus.tail(system.dof());
  orders.agree = true;
  do {
    OrderOutcome outcome = here.InOrder(order);
    orders.apart = std::max(orders.apart, (outcome.v_plus - together).cwiseAbs().maxCoeff());
    const bool same = Relative(together, outcome.v_plus) <= kNoVelocity;
    orders.agree = orders.agree && outcome.status.ok() && same;
    orders.outcomes.push_back(std::move(outcome));
  } while (std::next_permutation(order.begin(), order.end()));
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  for (int k = 0; orders.agree && k < kAround; ++k) {
    const Landing beside(system, transition, Beside(system, transition, draw));
    orders.agree = Apart(beside, order) <= kNoVelocity;
  }
  return orders;
}

}  // namespace contact_flow
