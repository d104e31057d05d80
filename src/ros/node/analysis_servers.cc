// SPDX-License-Identifier: BSD-3-Clause
#include "analysis_servers.h"

#include <chrono>
#include <thread>
#include <type_traits>
#include <utility>

#include "src/ros/answer/controllability_answer.h"
#include "src/ros/answer/covariance_answer.h"
#include "src/ros/answer/ensemble_answer.h"
#include "src/ros/answer/feedback_answer.h"
#include "src/ros/answer/gradient_answer.h"
#include "src/ros/answer/optimization_answer.h"
#include "src/ros/answer/periodic_orbit_answer.h"
#include "src/ros/answer/poincare_answer.h"
#include "src/ros/answer/policy_answer.h"
#include "src/ros/answer/stability_answer.h"
#include "src/ros/answer/trajectory_answer.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/same_fields.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/service/handler.h"
#include "src/ros/service/stopping.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Answers a service whose result is a message of its own.
template <class Record, class Request, class Response>
bool Analyse(const char* name, const Setup& setup, WorkPool* pool, Outlet* outlet,
             const Request& in, Response* out) {
  out->outcome = Response::REFUSED;
  return Guard(name, out, [&] {
    Record record;
    record.request = SameFields<decltype(record.request)>(in);
    AnswerWithin<Response>(pool, name, LimitsOf(setup, OptionsOf(record.request)), &record.result,
                           [&] { return Answer(setup, record.request); });
    out->result = record.result;
    Deliver(outlet, &record, out);
    out->result.header = record.header;
  });
}

/// Whether nobody has listened to the results of an action for kLost, after somebody had. Asked by
/// one thread.
class Audience {
 public:
  explicit Audience(const ros::Publisher& results) : results_(results) {}
  bool Left() {
    const auto now = std::chrono::steady_clock::now();
    if (results_.getNumSubscribers() > 0) {
      heard_ = true;
      last_ = now;
    }
    return heard_ && std::chrono::duration<double>(now - last_).count() > kLost;
  }

 private:
  static constexpr double kLost = 5;  // [s]: longer than it takes to connect anew
  const ros::Publisher& results_;
  bool heard_ = false;
  std::chrono::steady_clock::time_point last_;
};

/// No goal ends sooner: actionlib's client in Python drops what comes while it still sends, and
/// waits for ever for a result that it has dropped.
constexpr auto kNoticed = std::chrono::milliseconds(50);

/// What the iterations of a search are told by.
template <class Feedback, class Server>
void ShowSearch(Server* server, Feedback* shown, Watch* watch) {
  if constexpr (std::is_same_v<Feedback, OptimizeTrajectoryFeedback>) {
    watch->report_step = [shown](const TrajectoryIteration& at) {
      shown->violation = at.violation;
      shown->step = at.step;
      shown->pieces = static_cast<std::uint32_t>(at.pieces);
      shown->kink = KinkStatusName(at.kink);
      shown->least = at.best;
    };
  }
  watch->report = [server, shown](int iteration, double fraction, double value,
                                  const Vector& best) {
    Feedback feedback = *shown;
    feedback.iteration = static_cast<std::uint32_t>(iteration);
    feedback.fraction = fraction;
    feedback.value = value;
    feedback.best = ToMsg(VectorRef(best));
    server->publishFeedback(feedback);
  };
}

/// What the runs of a sweep are told by.
template <class Server>
void ShowSweep(Server* server, Watch* watch) {
  watch->report_sweep = [server](const SweepProgress& at) {
    SweepEnsembleFeedback feedback;
    feedback.done = at.done;
    feedback.total = at.total;
    feedback.fraction = static_cast<double>(at.done) / static_cast<double>(at.total);
    feedback.rate = at.rate;
    feedback.elapsed = at.elapsed;
    feedback.left = at.left;
    feedback.outcomes = ToMsg(at.outcomes);
    server->publishFeedback(feedback);
  };
}

/// Pursues the goal of an action until it is reached or cancelled, or its client has gone.
template <class Record, class Feedback, class Result, class Server, class Goal>
void Pursue(const char* name, const Setup& setup, WorkPool* pool, Outlet* outlet,
            const ros::Publisher& results, const Goal& goal, Server* server) {
  const auto earliest = std::chrono::steady_clock::now() + kNoticed;
  Result out;
  out.outcome = Result::REFUSED;
  Watch watch;
  Audience audience(results);
  watch.cancelled = [server, &audience] {
    return server->isPreemptRequested() || audience.Left() || IsStopping();
  };
  Feedback shown;
  if constexpr (std::is_same_v<Feedback, SweepEnsembleFeedback>) {
    ShowSweep(server, &watch);
  } else {
    ShowSearch(server, &shown, &watch);
  }
  Guard(name, &out, [&] {
    Record record;
    record.request = goal.request;
    BudgetLimits limits = LimitsOf(setup, OptionsOf(record.request));
    limits.cancelled = watch.cancelled;
    // Goals are watched and cancelled: they may take as long as may be, if nothing is asked for.
    if (record.request.options.max_seconds == 0) limits.max_seconds = kMaxSeconds;
    AnswerWithin<Result>(pool, name, std::move(limits), &record.result,
                         [&] { return Answer(setup, record.request, watch); });
    out.result = record.result;
    Deliver(outlet, &record, &out);
    out.result.header = record.header;
  });
  std::this_thread::sleep_until(earliest);
  if (!out.success) {
    server->setAborted(out, out.message);
  } else if (out.outcome == kAnalysisCancelled) {
    server->setPreempted(out, out.message);
  } else {
    server->setSucceeded(out, out.message);
  }
}

}  // namespace

AnalysisServers::AnalysisServers(ros::NodeHandle* node, ros::NodeHandle* work_node,
                                 const Setup& setup, Outlet* outlet, WorkPool* pool)
    : setup_(setup),
      outlet_(outlet),
      pool_(pool),
      find_orbit_(
          *node, "find_periodic_orbit",
          [this](const FindPeriodicOrbitGoalConstPtr& goal) { FindOrbit(goal); }, false),
      optimize_(
          *node, "optimize", [this](const OptimizeOutcomeGoalConstPtr& goal) { Optimize(goal); },
          false),
      choose_trajectory_(
          *node, "optimize_trajectory",
          [this](const OptimizeTrajectoryGoalConstPtr& goal) { ChooseTrajectory(goal); }, false),
      sweep_(
          *node, "sweep", [this](const SweepEnsembleGoalConstPtr& goal) { RunEnsemble(goal); },
          false) {
  servers_ = {
      work_node->advertiseService("poincare_map", &AnalysisServers::ReturnMap, this),
      work_node->advertiseService("assess_stability", &AnalysisServers::Stability, this),
      work_node->advertiseService("find_stabilizing_feedback", &AnalysisServers::Feedback, this),
      work_node->advertiseService("assess_controllability", &AnalysisServers::Controllability,
                                  this),
      work_node->advertiseService("propagate_covariance", &AnalysisServers::Covariance, this),
      work_node->advertiseService("gradient", &AnalysisServers::Gradient, this),
      work_node->advertiseService("make_policy", &AnalysisServers::FollowRun, this)};
  orbit_results_ = node->advertise<FindPeriodicOrbitActionResult>("find_periodic_orbit/result", 50);
  optimize_results_ = node->advertise<OptimizeOutcomeActionResult>("optimize/result", 50);
  trajectory_results_ =
      node->advertise<OptimizeTrajectoryActionResult>("optimize_trajectory/result", 50);
  sweep_results_ = node->advertise<SweepEnsembleActionResult>("sweep/result", 50);
  find_orbit_.start();
  optimize_.start();
  choose_trajectory_.start();
  sweep_.start();
}

bool AnalysisServers::ReturnMap(ComputePoincareMap::Request& in,
                                ComputePoincareMap::Response& out) {
  return Analyse<PoincareRecord>("poincare_map", setup_, pool_, outlet_, in, &out);
}

bool AnalysisServers::Stability(DecideStability::Request& in, DecideStability::Response& out) {
  return Analyse<StabilityRecord>("assess_stability", setup_, pool_, outlet_, in, &out);
}

bool AnalysisServers::Feedback(FindStabilizingFeedback::Request& in,
                               FindStabilizingFeedback::Response& out) {
  return Analyse<StepFeedbackRecord>("find_stabilizing_feedback", setup_, pool_, outlet_, in, &out);
}

bool AnalysisServers::Controllability(DecideControllability::Request& in,
                                      DecideControllability::Response& out) {
  return Analyse<ControllabilityRecord>("assess_controllability", setup_, pool_, outlet_, in, &out);
}

bool AnalysisServers::Covariance(ComputeCovariance::Request& in, ComputeCovariance::Response& out) {
  return Analyse<CovarianceRecord>("propagate_covariance", setup_, pool_, outlet_, in, &out);
}

bool AnalysisServers::Gradient(ComputeGradient::Request& in, ComputeGradient::Response& out) {
  return Analyse<GradientRecord>("gradient", setup_, pool_, outlet_, in, &out);
}

bool AnalysisServers::FollowRun(MakePolicy::Request& in, MakePolicy::Response& out) {
  return Analyse<PolicyRecord>("make_policy", setup_, pool_, outlet_, in, &out);
}

void AnalysisServers::FindOrbit(const FindPeriodicOrbitGoalConstPtr& goal) {
  Pursue<PeriodicOrbitRecord, FindPeriodicOrbitFeedback, FindPeriodicOrbitResult>(
      "find_periodic_orbit", setup_, pool_, outlet_, orbit_results_, *goal, &find_orbit_);
}

void AnalysisServers::Optimize(const OptimizeOutcomeGoalConstPtr& goal) {
  Pursue<OptimizationRecord, OptimizeOutcomeFeedback, OptimizeOutcomeResult>(
      "optimize", setup_, pool_, outlet_, optimize_results_, *goal, &optimize_);
}

void AnalysisServers::ChooseTrajectory(const OptimizeTrajectoryGoalConstPtr& goal) {
  Pursue<TrajectoryRecord, OptimizeTrajectoryFeedback, OptimizeTrajectoryResult>(
      "optimize_trajectory", setup_, pool_, outlet_, trajectory_results_, *goal,
      &choose_trajectory_);
}

void AnalysisServers::RunEnsemble(const SweepEnsembleGoalConstPtr& goal) {
  Pursue<EnsembleRecord, SweepEnsembleFeedback, SweepEnsembleResult>(
      "sweep", setup_, pool_, outlet_, sweep_results_, *goal, &sweep_);
}

}  // namespace ros_interface
}  // namespace contact_flow
