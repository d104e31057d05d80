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

}  // namespace

RunCost PowerRate(const TrajectoryProblem& problem, int nq) {
  RunCost cost;
  cost.running = [&problem, nq](double, const Vector& x, const Vector& u, CostRate* rate) {
    rate->value = 0;
    rate->by_state.setZero();
    rate->by_input.setZero();
    for (const PowerTerm& term : problem.power) {
      const double force = u(term.input), speed = x(nq + term.velocity);
      const double scaled = term.weight * force * speed;
      rate->value += scaled * force * speed;
      rate->by_state(nq + term.velocity) += 2 * scaled * force;
      rate->by_input(term.input) += 2 * scaled * speed;
    }
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

double PowerOf(const TrajectoryProblem& problem, const Trajectory& run, int nq) {
  double cost = 0;
  for (const Arc& arc : run.arcs) {
    cost += IntegrateArc(arc, [&](const Vector& x) {
      double rate = 0;
      for (const PowerTerm& term : problem.power) {
        const double power = arc.u(term.input) * x(nq + term.velocity);
        rate += term.weight * power * power;
      }
      return rate;
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
