// SPDX-License-Identifier: BSD-3-Clause
// Rigid bodies, beside MuJoCo where it is installed: the quadruped of config/robots (18 degrees of
// freedom), in one run. Ratios count, not microseconds.
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/inverse_dynamics_jacobian.h"
#include "src/model/rigid_body/tree_factor.h"
#include "timing.h"
#if CONTACT_FLOW_HAVE_MUJOCO
#include "test/model/rigid_body/mujoco_feet.h"
#endif

namespace contact_flow {
namespace benchmark {
namespace {

/// The trunk this far above where the feet touch the ground [m]: slightly inside it, standing.
constexpr double kSink = -1e-4;

/// Our kernel at one state.
struct Kernel {
  Kernel(const RobotSystem& system, const Vector& x)
      : tree(system.robot().model.tree),
        q(x.head(system.num_positions())),
        v(x.tail(system.dof())),
        state(tree),
        jacobian(tree),
        factor(tree),
        mass(tree.dof(), tree.dof()),
        by_q(mass),
        by_v(mass),
        tau(tree.dof()),
        acceleration(Vector::Ones(tree.dof())) {}

  /// M and v̇ = −M⁻¹ b.
  void ForwardDynamics() {
    UpdatePositions(tree, q.data(), &state);
    UpdateVelocities(tree, v.data(), &state);
    UpdateInertias(tree, &state);
    MassMatrix(tree, &state, mass.data());
    InverseDynamics<double>(tree, tree.gravity(), nullptr, nullptr, &state, tau.data());
    factor.Compute(&mass);
    tau = -tau;
    factor.Solve(mass, tau);
  }
  /// ∂(inverse dynamics)/∂(q, v), with all it needs.
  void Differentiate() {
    UpdatePositions(tree, q.data(), &state);
    UpdateVelocities(tree, v.data(), &state);
    UpdateInertias(tree, &state);
    UpdateMomenta(tree, &state);
    InverseDynamics<double>(tree, tree.gravity(), acceleration.data(), nullptr, &state, tau.data());
    jacobian.Compute(tree, tree.gravity(), nullptr, state, by_q.data(), by_v.data());
  }

  const RigidBodyTree& tree;
  const Vector q, v;
  TreeState<double> state;
  InverseDynamicsJacobian<double> jacobian;
  TreeFactor factor;
  Matrix mass, by_q, by_v;
  Vector tau;
  const Vector acceleration;
};

Vector Standing(const RobotSystem& system) {
  Vector x = system.nominal().x;
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  x(2) += kSink - terms.gap(0);  // base_z
  for (int j = 0; j < system.dof(); ++j) x(system.num_positions() + j) = 0.01 * std::sin(j + 1.0);
  return x;
}

void Judge(const char* what, double value, bool holds, const char* bar) {
  std::printf("  %s  %-54s %6.2f  (%s)\n", holds ? "holds" : "FAILS", what, value, bar);
}

/// The flow and its Jacobian, dropped from the nominal configuration to just before it lands: from
/// rest, where nothing but the height changes much, or with every joint and the body in motion.
void TimeFlow(const RobotSystem& system, bool moves) {
  const NominalRun& nominal = system.nominal();
  Vector x = nominal.x;
  for (int j = 0; moves && j < system.dof(); ++j) {
    x(system.num_positions() + j) = 0.3 * std::sin(j + 1.0);
  }
  SimulateOptions options;
  BDerivativeOptions derivative_options;
  const double duration = 0.1;
  const Trajectory run = Simulate(system, x, nominal.u, duration, options);
  const std::vector<double> seconds =
      TimeInterleaved({[&] { Simulate(system, x, nominal.u, duration, options); },
                       [&] { DifferentiateOutcome(system, run, derivative_options); }},
                      5e-3, 9);
  const double ratio = 1 + seconds[1] / seconds[0];
  std::printf(
      "dropped %s: plain run %.3f ms of %ld steps, Jacobian of the flow without it %.3f ms\n",
      moves ? "in motion" : "from rest", 1e3 * seconds[0], static_cast<long>(run.statistics.steps),
      1e3 * seconds[1]);
  if (moves) {
    Judge("Jacobian of the flow / plain run", ratio, ratio <= 7, "at most 7");
  } else {
    std::printf("         Jacobian of the flow / plain run %37.2f\n", ratio);
  }
}

void Run(const char* file) {
  const std::unique_ptr<RobotSystem> system = LoadRobot(file);
  const Vector x = Standing(*system), u = system->nominal().u;
  Kernel kernel(*system, x);
  ContactDynamics dynamics(*system, u);
  const ContactMode all({0, 1, 2, 3});
  std::vector<const char*> names = {"forward dynamics with M", "derivatives of inverse dynamics",
                                    "constrained dynamics, 4 contacts",
                                    "  the same with its Jacobian"};
  std::vector<std::function<void()>> tasks = {
      [&] { kernel.ForwardDynamics(); }, [&] { kernel.Differentiate(); },
      [&] { dynamics.Evaluate(x, all); }, [&] { dynamics.Differentiate(x, all); }};
#if CONTACT_FLOW_HAVE_MUJOCO
  const auto free = std::make_unique<MujocoModel>(system->robot().model.tree);
  const std::unique_ptr<MujocoModel> standing = OnFeetInMujoco(*system, 1);
  const Vector q = x.head(system->num_positions()), v = x.tail(system->dof());
  free->SetState(q, v);
  standing->SetState(q, v);
  mj_forward(standing->model, standing->data);
  std::printf("MuJoCo %s: %d contacts\n", mj_versionString(), standing->data->ncon);
  const int n = system->dof();
  std::vector<double> A(4 * n * n);
  names.insert(names.end(),
               {"mj_forward", "mj_forward, 4 contacts", "mjd_transitionFD one-sided, 4 contacts"});
  tasks.push_back([&] { mj_forward(free->model, free->data); });
  tasks.push_back([&] { mj_forward(standing->model, standing->data); });
  tasks.push_back([&] {
    mjd_transitionFD(standing->model, standing->data, 1e-6, 0, A.data(), nullptr, nullptr, nullptr);
  });
#endif
  const std::vector<double> seconds = TimeInterleaved(tasks, 5e-3, 15);
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::printf("%-42s %8.2f us\n", names[k], 1e6 * seconds[k]);
  }
  for (const bool moves : {false, true}) TimeFlow(*system, moves);
#if CONTACT_FLOW_HAVE_MUJOCO
  Judge("forward dynamics / mj_forward", seconds[0] / seconds[4], seconds[0] <= 1.5 * seconds[4],
        "at most 1.5");
  Judge("mjd_transitionFD / constrained dynamics with Jacobian", seconds[6] / seconds[3],
        seconds[6] >= 5 * seconds[3], "at least 5");
  Judge("constrained dynamics with Jacobian / mj_forward", seconds[3] / seconds[4],
        3.4 * seconds[3] <= 20 * seconds[4], "at most 20 us / 3.4 us = 5.88");
#endif
}

/// Four point feet that stick, 12 rows, at rest.
void RunSticking(const char* file) {
  const std::unique_ptr<RobotSystem> system = LoadRobot(file);
  Vector x = Standing(*system);
  x.tail(system->dof()).setZero();
  ContactDynamics dynamics(*system, system->nominal().u);
  ContactMode sticking;
  for (int i = 0; i < 4; ++i) sticking.Set(i, Letter::kStick);
  std::vector<const char*> names = {"constrained dynamics, 4 contacts that stick",
                                    "  the same with its Jacobian"};
  std::vector<std::function<void()>> tasks = {[&] { dynamics.Evaluate(x, sticking); },
                                              [&] { dynamics.Differentiate(x, sticking); }};
#if CONTACT_FLOW_HAVE_MUJOCO
  const auto free = std::make_unique<MujocoModel>(system->robot().model.tree);
  const std::unique_ptr<MujocoModel> standing = OnFeetInMujoco(*system, 3);
  for (MujocoModel* mujoco : {free.get(), standing.get()}) {
    mujoco->SetState(x.head(system->num_positions()), x.tail(system->dof()));
    mj_forward(mujoco->model, mujoco->data);
  }
  std::printf("MuJoCo with friction: %d contacts\n", standing->data->ncon);
  names.insert(names.end(), {"mj_forward", "mj_forward, 4 contacts with friction"});
  tasks.push_back([&] { mj_forward(free->model, free->data); });
  tasks.push_back([&] { mj_forward(standing->model, standing->data); });
#endif
  const std::vector<double> seconds = TimeInterleaved(tasks, 5e-3, 15);
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::printf("%-44s %8.2f us\n", names[k], 1e6 * seconds[k]);
  }
#if CONTACT_FLOW_HAVE_MUJOCO
  Judge("sticking dynamics / mj_forward, 4 contacts", seconds[0] / seconds[3],
        seconds[0] <= 1.5 * seconds[3], "at most 1.5");
  Judge("sticking dynamics with Jacobian / mj_forward", seconds[1] / seconds[2],
        3.4 * seconds[1] <= 25 * seconds[2], "at most 25 us / 3.4 us = 7.35");
#endif
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main() {
  contact_flow::benchmark::Run(CONTACT_FLOW_ROBOTS "quadruped.yaml");
  contact_flow::benchmark::RunSticking(CONTACT_FLOW_ROBOTS "quadruped_friction.yaml");
}
