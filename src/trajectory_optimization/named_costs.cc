// SPDX-License-Identifier: BSD-3-Clause
#include "named_costs.h"

#include <algorithm>
#include <cmath>

namespace contact_flow {
namespace {

/// Of Gauss and Legendre on [0, 1], exact to degree 15: a square of the continuous extension,
/// which is of degree 7, has 14.
constexpr double kNodes[] = {0.019855071751231884, 0.10166676129318664, 0.2372337950418355,
                             0.4082826787521751,   0.5917173212478249,  0.7627662049581645,
                             0.8983332387068134,   0.9801449282487681};
constexpr double kWeights[] = {0.05061426814518813, 0.11119051722668724, 0.15685332293894363,
                               0.18134189168918100, 0.18134189168918100, 0.15685332293894363,
                               0.11119051722668724, 0.05061426814518813};

/// ∫ f(t, x) dt over an arc.
template <class Rate>
double IntegrateArc(const Arc& arc, const Rate& rate) {
  Vector x(arc.x_begin.size());
  double sum = 0;
  for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(k));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k));
    if (!(end > begin)) continue;
    for (int i = 0; i < 8; ++i) {
      arc.dense.Evaluate(begin + kNodes[i] * (end - begin), x.data());
      sum += kWeights[i] * (end - begin) * rate(x);
    }
  }
  return sum;
}

/// Σ w (u_j v_i)², u_j being led by the clock where inputs are (LinearInputs).
void AddPower(const TrajectoryProblem& problem, const MechanicalSystem& system, const Vector& x,
              const Vector& u, CostRate* rate) {
  const int nq = system.num_positions();
  const Eigen::Index m = u.size() / 2, clock = nq - 1;
  for (const PowerTerm& term : problem.power) {
    const Eigen::Index j = term.input, i = nq + term.velocity;
    const double since = problem.linear_inputs ? x(clock) - u(2 * m) : 0;
    const double slope = problem.linear_inputs ? u(m + j) : 0;
    const double force = u(j) + slope * since, speed = x(i);
    const double scaled = term.weight * force * speed, by_force = 2 * scaled * speed;
    rate->value += scaled * force * speed;
    rate->by_state(i) += 2 * scaled * force;
    rate->by_input(j) += by_force;
    if (!problem.linear_inputs) continue;
    rate->by_state(clock) += by_force * slope;
    rate->by_input(m + j) += by_force * since;
    rate->by_input(2 * m) -= by_force * slope;
  }
}

/// Σ w_c |T_c v|² of the contacts of the mode, and its derivative if `differentiate`.
void AddSlip(const TrajectoryProblem& problem, const MechanicalSystem& system, const Vector& x,
             ContactMode mode, bool differentiate, CostRate* rate) {
  const int nq = system.num_positions(), d = system.dof();
  const Vector q = x.head(nq), v = x.tail(d);
  ConstraintTerms terms;
  Vector slip;  // 2 w T v [n+l+r]
  for (int c : mode) {
    if (problem.slip_weight(c) == 0) continue;
    if (slip.size() == 0) {
      system.Constraints(q, v, &terms);
      slip = Vector::Zero(system.num_rows());
    }
    const Friction& friction = system.friction()[static_cast<std::size_t>(c)];
    for (int row = friction.row; row < friction.row + friction.dimension; ++row) {
      const double speed = terms.jacobian.row(row).dot(v);
      slip(row) = 2 * problem.slip_weight(c) * speed;
      rate->value += problem.slip_weight(c) * speed * speed;
    }
  }
  if (!differentiate || slip.size() == 0) return;
  rate->by_state.tail(d) += terms.jacobian.transpose() * slip;
  ResidualJacobian jacobian;
  system.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(system.num_rows()), v, &jacobian);
  const Vector by_tangent = jacobian.constraint_q.transpose() * slip;
  // As numbers g with Nᵀ g = by_tangent: N of a unit quaternion has NᵀN = 1/4.
  Vector numbers(nq);
  system.space().Rate(q.data(), by_tangent.data(), numbers.data());
  for (const ConfigurationSpace::Rotation& rotation : system.space().rotations()) {
    numbers.segment<4>(rotation.q) *= 4;
  }
  rate->by_state.head(nq) += numbers;
}

}  // namespace

RunCost RunningRate(const TrajectoryProblem& problem, const MechanicalSystem& system) {
  RunCost cost;
  cost.running_in_mode = [&problem, &system](double, const Vector& x, const Vector& u,
                                             ContactMode mode, CostRate* rate) {
    rate->value = 0;
    rate->by_time = 0;
    rate->by_state.setZero();
    rate->by_input.setZero();
    AddPower(problem, system, x, u, rate);
    if (problem.slip_weight.size() > 0) AddSlip(problem, system, x, mode, true, rate);
  };
  return cost;
}

Matrix SquaresOf(const TrajectoryProblem& problem, const Trajectory& run, int nq) {
  const auto count = static_cast<Eigen::Index>(problem.inputs.grid.size());
  Matrix squares = Matrix::Zero(static_cast<Eigen::Index>(problem.power.size()), count);
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < run.arcs.size(); ++i) {
    for (Eigen::Index j = 0; j < squares.rows(); ++j) {
      const int place = nq + problem.power[static_cast<std::size_t>(j)].velocity;
      squares(j, k) +=
          IntegrateArc(run.arcs[i], [place](const Vector& x) { return x(place) * x(place); });
    }
    if (i < run.transitions.size() && run.transitions[i].changes_input) ++k;
  }
  return squares;
}

double RunningCostOf(const TrajectoryProblem& problem, const MechanicalSystem& system,
                     const Trajectory& run) {
  double cost = 0;
  CostRate rate;
  for (const Arc& arc : run.arcs) {
    cost += IntegrateArc(arc, [&](const Vector& x) {
      rate.value = 0;
      rate.by_state = Vector::Zero(x.size());
      rate.by_input = Vector::Zero(arc.u.size());
      AddPower(problem, system, x, arc.u, &rate);
      if (problem.slip_weight.size() > 0) AddSlip(problem, system, x, arc.mode, false, &rate);
      return rate.value;
    });
  }
  return cost;
}

double ImpulseOf(const TrajectoryProblem& problem, const Trajectory& run) {
  double cost = 0;
  for (const Transition& event : run.transitions) {
    if (event.impulse.size() == 0) continue;
    const auto impulses = event.impulse.head(problem.impulse_weight.size());
    cost += problem.impulse_weight.dot(impulses.cwiseAbs2());
  }
  return cost;
}

}  // namespace contact_flow
