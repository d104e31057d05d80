// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "contact_flow/trajectory_optimization/receding_horizon.h"
#include "policy_loop.h"

namespace contact_flow {
namespace ros_interface {

/// A thread that solves, one task at a time. Nobody who posts or takes waits for it.
class HorizonSolver {
 public:
  /// Begins to wait for tasks.
  HorizonSolver(std::shared_ptr<const MechanicalSystem> system, HorizonProblem problem,
                HorizonOptions options);
  /// Ends what it solves.
  ~HorizonSolver();
  HorizonSolver(const HorizonSolver&) = delete;
  HorizonSolver& operator=(const HorizonSolver&) = delete;

  /// A solution, and the beginning of the policy that its task was of.
  struct Solved {
    HorizonSolution solution;  ///< of the task
    std::uint64_t number = 0;  ///< as in PolicyLoop::Ahead
  };
  /// Whether it has nothing to do and nothing to give: then it may be posted a task.
  bool idle() const;
  /// Begins to solve. It must be idle.
  void Post(PolicyLoop::Ahead ahead);
  /// What is solved, if it is.
  std::optional<Solved> Take();
  /// The same, when it is. Nothing when it is idle.
  std::optional<Solved> Wait();

 private:
  void Work();

  const std::shared_ptr<const MechanicalSystem> system_;
  const HorizonProblem problem_;
  HorizonOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::atomic<bool> stopping_{false};
  bool busy_ = false;
  std::optional<PolicyLoop::Ahead> ahead_;
  std::optional<Solved> solved_;
  std::thread thread_;
};

}  // namespace ros_interface
}  // namespace contact_flow
