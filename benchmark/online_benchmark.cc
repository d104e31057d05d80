// SPDX-License-Identifier: BSD-3-Clause
// How punctual an online simulation with its rolling derivative is: the quadruped of config/robots
// (18 degrees of freedom), on its four feet, with servos that move, looked at a
// thousand times a second.
//
//   online_benchmark [seconds, 60 unless given]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/io/robot_file.h"
#include "src/ros/simulator/pace.h"

namespace contact_flow {
namespace benchmark {
namespace {

using ros_interface::Pace;

constexpr double kRate = 1000;         // [Hz]
constexpr long kInputTicks = 20;       // the servos are told new setpoints at 50 Hz
constexpr double kSway = 0.05;         // [rad] of the setpoints
constexpr double kMarkEvery = 1;       // [s]: the mark follows, so that tangents stay within range
constexpr double kRestart = 2;         // [s]: frictionless feet slide apart; it is put back
constexpr double kMaxLateness = 1e-3;  // [s] at p99.9
constexpr double kComparison = 10;     // [s] of each measurement for comparison

/// The simulator's loop without ROS.
class Loop {
 public:
  Loop(std::shared_ptr<const MechanicalSystem> system, int directions)
      : system_(std::move(system)), standing_(system_->nominal().x) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const int size = 2 * system_->dof();
    directions_ =
        directions >= size ? Matrix(Matrix::Identity(size, size)) : Matrix(size, directions);
    if (directions < size) {
      for (double& entry : directions_.reshaped()) entry = normal(random);
    }
    Stand();
  }

  /// Goes on to tick k, as far as there is one.
  void Tick(long k) {
    const double t = static_cast<double>(k) / kRate;
    if (t - epoch_ >= kRestart || !flow_->status().ok()) Restart(flow_->now());
    if (k % kInputTicks == 0) {
      Vector u = system_->nominal().u;
      for (Eigen::Index i = 0; i < u.size(); ++i) {
        u(i) += kSway * std::sin(10 * t + static_cast<double>(i));
      }
      flow_->SetInput(flow_->now(), u);
    }
    bool passed = true;
    while (passed) {
      passed = flow_->AdvanceTo(t);
      if (passed && !flow_->transition().changes_input) ++events_;
      rolling_->Follow(flow_.get(), passed);
    }
    tangents_ += rolling_->Read(flow_.get()).tangents.cols();
    if (!rolling_->status().ok()) ++undifferentiable_;
    if (!rolling_->status().ok() || t - rolling_->mark() >= kMarkEvery) Mark();
    dynamics_->SetInput(flow_->NextInput());
    dynamics_->Evaluate(flow_->State(), flow_->mode());  // what is published: state and forces
    contacts_ += flow_->mode().Size();
  }

  long events() const { return events_; }
  long undifferentiable() const { return undifferentiable_; }
  double contacts() const { return static_cast<double>(contacts_); }

 private:
  /// Lets it land and come to stand, once.
  void Stand() {
    flow_ = std::make_unique<OnlineFlow>(system_, 0, standing_, system_->nominal().u, Options());
    while (flow_->AdvanceTo(0.6)) continue;
    standing_ = flow_->State();
    ProjectContacts(*system_, flow_->mode(), &standing_);
    Restart(0);
  }
  void Restart(double t) {
    flow_ = std::make_unique<OnlineFlow>(system_, t, standing_, system_->nominal().u, Options());
    dynamics_ = std::make_unique<ContactDynamics>(*system_, system_->nominal().u);
    epoch_ = t;
    Mark();
  }
  void Mark() {
    BDerivativeOptions options;
    options.tolerance = 1e-6;
    rolling_ = std::make_unique<RollingDerivative>(flow_.get(), directions_, options, Options());
  }
  static SimulateOptions Options() {
    SimulateOptions options;
    options.complete_zeno = true;
    options.relative_tolerance = options.absolute_tolerance = 1e-8;
    return options;
  }

  const std::shared_ptr<const MechanicalSystem> system_;
  Vector standing_;
  Matrix directions_;
  std::unique_ptr<OnlineFlow> flow_;
  std::unique_ptr<RollingDerivative> rolling_;
  std::unique_ptr<ContactDynamics> dynamics_;
  double epoch_ = 0;
  long events_ = 0, undifferentiable_ = 0, contacts_ = 0;
  long tangents_ = 0;  // read
};

double Seconds(Pace::Clock::time_point since) {
  return std::chrono::duration<double>(Pace::Clock::now() - since).count();
}

/// Ticks in a second, as fast as possible.
double AttainableRate(const std::shared_ptr<const MechanicalSystem>& system, int directions) {
  Loop loop(system, directions);
  const auto begin = Pace::Clock::now();
  long k = 0;
  while (Seconds(begin) < 3) loop.Tick(++k);
  return static_cast<double>(k) / Seconds(begin);
}

/// Prints quantiles and returns that of 99.9 % [s].
double Report(const char* name, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) {
    return 1e3 * values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
  };
  std::printf("  %-12s median %.3f ms, p99 %.3f ms, p99.9 %.3f ms, largest %.3f ms\n", name,
              at(0.5), at(0.99), at(0.999), at(1));
  return at(0.999) / 1e3;
}

/// Does `work(k)` before each of the ticks, and tells how late their ends are.
template <class Work>
double Punctuality(double seconds, bool busy_wait, Work work) {
  const long ticks = std::lround(seconds * kRate);
  std::vector<double> lateness, worked;
  lateness.reserve(static_cast<std::size_t>(ticks));
  worked.reserve(static_cast<std::size_t>(ticks));
  Pace pace(1);
  pace.Anchor(0, 1);
  for (long k = 1; k <= ticks; ++k) {
    const double t = static_cast<double>(k) / kRate;
    const auto begin = Pace::Clock::now();
    work(k);
    worked.push_back(Seconds(begin));
    if (busy_wait) {
      pace.SpinUntil(t);
    } else {
      std::this_thread::sleep_until(pace.Due(t));
    }
    lateness.push_back(pace.Lateness(t));
  }
  Report("work a tick", worked);
  return Report("lateness", lateness);
}

int Run(double seconds) {
  const std::shared_ptr<const MechanicalSystem> system = LoadRobot(CONTACT_FLOW_QUADRUPED);
  double late = 0;
  for (const bool busy_wait : {false, true}) {
    const double length = busy_wait ? seconds : std::min(seconds, kComparison);
    const char* waits = busy_wait ? "busy_wait" : "sleeping between ticks";
    std::printf("%s, the machine alone: nothing to do in a tick, %.0f s\n", waits, kComparison);
    Punctuality(kComparison, busy_wait, [](long) {});
    Loop loop(system, 4);
    std::printf("%s, the quadruped: %d degrees of freedom, 4 directions, %.0f Hz, %.0f s\n", waits,
                system->dof(), kRate, length);
    late = Punctuality(length, busy_wait, [&](long k) { loop.Tick(k); });
    std::printf("  %.2f contacts on average, %ld events (%ld without a derivative)\n",
                loop.contacts() / (length * kRate), loop.events(), loop.undifferentiable());
  }
  std::printf("attainable rate with 4 directions: %.0f Hz\n", AttainableRate(system, 4));
  std::printf("attainable rate with the full %d×%d derivative: %.0f Hz\n", 2 * system->dof(),
              2 * system->dof(), AttainableRate(system, 2 * system->dof()));
  std::printf("%s   p99.9 of the lateness with busy_wait %.3f ms  (at most 1)\n",
              late <= kMaxLateness ? "holds" : "FAILS", 1e3 * late);
  return 0;  // timing decides nothing
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  return contact_flow::benchmark::Run(argc > 1 ? std::atof(argv[1]) : 60);
}
