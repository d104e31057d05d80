// SPDX-License-Identifier: BSD-3-Clause
#include "horizon_solver.h"

#include <exception>
#include <string>
#include <utility>

#include "src/ros/service/work_threads.h"

namespace contact_flow {
namespace ros_interface {

HorizonSolver::HorizonSolver(std::shared_ptr<const MechanicalSystem> system, HorizonProblem problem,
                             HorizonOptions options)
    : system_(std::move(system)), problem_(std::move(problem)), options_(std::move(options)) {
  options_.cancelled = [this] { return stopping_.load(); };
  thread_ = std::thread([this] { Work(); });
}

HorizonSolver::~HorizonSolver() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool HorizonSolver::idle() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return !busy_;
}

void HorizonSolver::Post(PolicyLoop::Ahead ahead) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    busy_ = true;
    ahead_.emplace(std::move(ahead));
  }
  changed_.notify_all();
}

std::optional<HorizonSolver::Solved> HorizonSolver::Take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::optional<Solved> solved = std::move(solved_);
  solved_.reset();
  if (solved) busy_ = false;
  return solved;
}

std::optional<HorizonSolver::Solved> HorizonSolver::Wait() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !busy_ || solved_; });
  }
  return Take();
}

void HorizonSolver::Work() {
  StepBack();
  for (;;) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return stopping_ || ahead_; });
    if (stopping_) return;
    const PolicyLoop::Ahead ahead = *ahead_;
    ahead_.reset();
    lock.unlock();
    Solved solved;
    solved.number = ahead.number;
    try {
      solved.solution = SolveHorizon(system_, problem_, options_, ahead.task);
    } catch (const std::exception& error) {
      solved.solution.t = ahead.task.t;
      solved.solution.begin = ahead.task.begin;
      solved.solution.message = std::string("failed, the last policy is kept: ") + error.what();
    }
    lock.lock();
    solved_ = std::move(solved);
    changed_.notify_all();
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
