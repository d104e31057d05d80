// SPDX-License-Identifier: BSD-3-Clause
// A humanoid (36 degrees of freedom, thirty servos, eight point contacts) that falls on its feet,
// for half a second: run and Jacobian beside MuJoCo's steps and chain of mjd_transitionFD. Errors
// are each against the own model's motion: contact is rigid here, soft there. Argument: a drop.
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/random_drop.h"
#include "timing.h"
#if CONTACT_FLOW_HAVE_MUJOCO
#include "test/model/rigid_body/mujoco_feet.h"
#endif

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kDuration = 0.5;  // [s]
constexpr int kDrop = 17;          // lands on heels and toes of both feet, and lets go
/// The tolerance whose derivative is judged, 1e-6; looser ones have none.
constexpr std::size_t kJudged = 2;
constexpr double kRadius = 0.005;  // of what the feet stand on [m]

/// The robot with spheres for the points under its feet, as far down.
std::string Spheres(std::string yaml) {
  const auto replace = [&](const std::string& what, const std::string& by) {
    for (std::size_t at = 0; (at = yaml.find(what, at)) != std::string::npos; at += by.size()) {
      yaml.replace(at, what.size(), by);
    }
  };
  replace("-0.035]", "-0.03]");
  replace("radius: 0}", "radius: 0.005}");
  return yaml;
}

void Judge(const char* what, double value, bool holds, const char* bar) {
  std::printf("  %s  %-54s %8.2g  (%s)\n", holds ? "holds" : "FAILS", what, value, bar);
}

struct Setup {
  explicit Setup(int drop) : texts(ReadRobotTexts(DropFile("humanoid"))) {
    texts.yaml = Spheres(texts.yaml);
    system = MakeRobot(texts);
    x = RandomDrop(*system, drop);
    u = system->nominal().u;
  }
  RobotTexts texts;
  std::unique_ptr<RobotSystem> system;
  Vector x, u;
};

/// Our runs at one tolerance.
struct Ours {
  double tolerance, error;
  Trajectory run;
  SimulateOptions options;
  BDerivativeOptions derivative;
  bool differentiable;
};

std::vector<Ours> RunOurs(const Setup& setup) {
  const RobotSystem& system = *setup.system;
  const auto run_at = [&](double tolerance, SimulateOptions* options) {
    options->relative_tolerance = options->absolute_tolerance = tolerance;
    return Simulate(system, setup.x, setup.u, kDuration, *options);
  };
  SimulateOptions finest;
  const Vector truth = run_at(1e-12, &finest).FinalState();
  std::vector<Ours> all;
  for (const double tolerance : {1e-3, 1e-4, 1e-6, 1e-9}) {
    Ours ours;
    ours.tolerance = tolerance;
    ours.run = run_at(tolerance, &ours.options);
    ours.error = system.Separation(ours.run.FinalState(), truth).cwiseAbs().maxCoeff();
    ours.derivative.tolerance = tolerance;
    const Status status = DifferentiateOutcome(system, ours.run, ours.derivative).status;
    ours.differentiable = status.ok();
    if (!status.ok()) std::printf("tolerance %g: %s\n", tolerance, status.message.c_str());
    all.push_back(std::move(ours));
  }
  return all;
}

#if CONTACT_FLOW_HAVE_MUJOCO
/// The same robot in MuJoCo, its servos as springs and dampers of the joints.
class Theirs {
 public:
  explicit Theirs(const Setup& setup)
      : setup_(setup), mujoco_(OnFeetInMujoco(*setup.system, 1, kRadius)) {
    const SystemDescription& description = setup.system->description();
    const YAML::Node efforts = YAML::Load(setup.texts.yaml)["efforts"];
    mjModel* model = mujoco_->model;
    const int d = setup.system->dof();
    for (const auto& effort : efforts) {
      const auto name = effort.second["joint"].as<std::string>();
      int ours = 0, input = 0;
      while (description.velocities[ours] != name) ++ours;
      while (description.inputs[input] != effort.second["input"].as<std::string>()) ++input;
      int theirs = 0;
      while (mujoco_->ours()[theirs] != ours) ++theirs;
      const int joint = model->dof_jntid[theirs];
      model->jnt_stiffness[joint] = effort.second["stiffness"].as<double>();
      model->dof_damping[theirs] = effort.second["damping"].as<double>();
      model->qpos_spring[model->jnt_qposadr[joint]] = setup.u(input);
    }
    A_.resize(4 * d * d);
  }
  const mjModel* model() const { return mujoco_->model; }

  /// Their numbers at the end, by steps of this length [s].
  Vector Run(double step) {
    Begin(step);
    for (long k = 0; k < Steps(step); ++k) mj_step(mujoco_->model, mujoco_->data);
    Vector end(mujoco_->model->nq + mujoco_->model->nv);
    for (int k = 0; k < mujoco_->model->nq; ++k) end(k) = mujoco_->data->qpos[k];
    for (int k = 0; k < mujoco_->model->nv; ++k)
      end(mujoco_->model->nq + k) = mujoco_->data->qvel[k];
    return end;
  }
  /// The derivative of the end by the start [2d×2d].
  Matrix Differentiate(double step) {
    Begin(step);
    const int n = 2 * mujoco_->model->nv;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Matrix chain = Matrix::Identity(n, n);
    for (long k = 0; k < Steps(step); ++k) {
      mjd_transitionFD(mujoco_->model, mujoco_->data, 1e-6, 0, A_.data(), nullptr, nullptr,
                       nullptr);
      chain = Eigen::Map<RowMajor>(A_.data(), n, n) * chain;
      mj_step(mujoco_->model, mujoco_->data);
    }
    return chain;
  }

 private:
  static long Steps(double step) { return std::lround(kDuration / step); }
  void Begin(double step) {
    mj_resetData(mujoco_->model, mujoco_->data);
    mujoco_->model->opt.timestep = step;
    const int nq = setup_.system->num_positions();
    mujoco_->SetState(setup_.x.head(nq), setup_.x.tail(setup_.system->dof()));
  }

  const Setup& setup_;
  std::unique_ptr<MujocoModel> mujoco_;
  std::vector<double> A_;
};
#endif

void Run(int drop) {
  const Setup setup(drop);
  std::vector<Ours> all = RunOurs(setup);
  std::vector<std::function<void()>> tasks;
  for (const Ours& ours : all) {
    tasks.push_back([&] { Simulate(*setup.system, setup.x, setup.u, kDuration, ours.options); });
    tasks.push_back([&] {
      if (ours.differentiable) DifferentiateOutcome(*setup.system, ours.run, ours.derivative);
    });
  }
#if CONTACT_FLOW_HAVE_MUJOCO
  Theirs theirs(setup);
  const double step = theirs.model()->opt.timestep;
  const Vector truth = theirs.Run(step / 200);
  const double their_error = (theirs.Run(step) - truth).cwiseAbs().maxCoeff();
  tasks.push_back([&] { theirs.Run(step); });
  tasks.push_back([&] { theirs.Differentiate(step); });
#endif
  const std::vector<double> seconds = TimeInterleaved(tasks, 1e-3, 5);
  std::printf("%d degrees of freedom, %d contacts, %g s, %zu events\n", setup.system->dof(),
              setup.system->num_constraints(), kDuration, all.back().run.transitions.size());
  std::printf("%-34s %10s %12s %14s\n", "", "run [ms]", "error", "Jacobian [ms]");
  for (std::size_t k = 0; k < all.size(); ++k) {
    std::printf("contact_flow, tolerance %-10g %10.2f %12.1e", all[k].tolerance,
                1e3 * seconds[2 * k], all[k].error);
    if (all[k].differentiable) std::printf(" %14.1f", 1e3 * seconds[2 * k + 1]);
    std::printf("\n");
  }
#if CONTACT_FLOW_HAVE_MUJOCO
  const double run = seconds[seconds.size() - 2], chain = seconds.back();
  std::printf("MuJoCo %-6s steps of %-10g %10.2f %12.1e %14.1f\n", mj_versionString(), step,
              1e3 * run, their_error, 1e3 * chain);
  Judge("error of ours at 1e-3 / MuJoCo's", all[0].error / their_error, all[0].error <= their_error,
        "at most 1");
  Judge("time of ours at 1e-3 / MuJoCo's", seconds[0] / run, seconds[0] <= run, "at most 1");
  const double jacobian = seconds[2 * kJudged + 1];
  Judge("mjd_transitionFD's chain / Jacobian at 1e-6", chain / jacobian,
        all[kJudged].differentiable && chain >= 20 * jacobian, "at least 20");
#endif
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  contact_flow::benchmark::Run(argc > 1 ? std::atoi(argv[1]) : contact_flow::benchmark::kDrop);
}
