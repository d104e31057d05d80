// SPDX-License-Identifier: BSD-3-Clause
#include "node.h"

#include <csignal>
#include <exception>
#include <stdexcept>
#include <string>

#include "contact_flow/ros/model_plugins.h"
#include "contact_flow/ros/run_node.h"
#include "src/ros/answer/answers.h"
#include "src/ros/answer/assumptions_answer.h"
#include "src/ros/answer/linearize_answer.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/same_fields.h"
#include "src/ros/recording/bag_file.h"
#include "src/ros/recording/memory_limit.h"
#include "src/ros/request/model_description.h"
#include "src/ros/service/handler.h"
#include "src/ros/service/stopping.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Threads beside those of long work: for requests that are still short, for the services that only
/// hand something on, of which `step` waits in one, and for topics, timers and goals.
constexpr long kShortThreads = 4;
constexpr std::size_t kPromptThreads = 5;
constexpr std::uint32_t kOtherThreads = 3;

ros::NodeHandle NodeOf(ros::CallbackQueue* queue) {
  ros::NodeHandle node("~");
  node.setCallbackQueue(queue);
  return node;
}

static_assert(SimulateTrajectoryResponse::GRAZING == static_cast<int>(Outcome::kGrazing) &&
                  SimulateTrajectoryResponse::ZENO == static_cast<int>(Outcome::kZeno) &&
                  ComputeBDerivativeResponse::DISCONTINUOUS ==
                      static_cast<int>(Outcome::kDiscontinuous) &&
                  CompareBDerivativeResponse::TOO_MANY_PIECES ==
                      static_cast<int>(Outcome::kTooManyPieces),
              "the constants of the services are the values of Outcome");

}  // namespace

Node::Node(const NodeParameters& parameters)
    : setup_(parameters.configuration),
      pool_(static_cast<std::size_t>(parameters.threads),
            static_cast<std::size_t>(parameters.queue)),
      node_("~"),
      work_node_(NodeOf(&work_queue_)),
      prompt_node_(NodeOf(&prompt_queue_)),
      outlet_(&node_, parameters.bag_directory, ToMsg(setup_), parameters.simulator.signing_key),
      analyses_(&node_, &work_node_, setup_, &outlet_, &pool_),
      prompt_threads_(kPromptThreads, &prompt_queue_),
      work_threads_(static_cast<std::size_t>(parameters.threads + parameters.queue + kShortThreads),
                    &work_queue_) {
  setup_.options.cancelled = &IsStopping;
  if (setup_.robot != nullptr) {
    for (const std::string& warning : setup_.robot->robot().model.warnings) {
      ROS_WARN("robot: %s", warning.c_str());
    }
  }
  if (parameters.simulator.online) {
    Configuration configuration = parameters.configuration;
    configuration.options.cancelled = &IsStopping;
    simulator_ = std::make_unique<Simulator>(parameters.simulator, configuration, &node_,
                                             parameters.bag_directory);
  }
  const std::string left = LeftOver(parameters.bag_directory);
  if (!left.empty()) {
    ROS_WARN(
        "%s: left over by a node that was killed while it wrote a result, which it has not "
        "answered: %s; what was answered is in the bags, these may be removed",
        parameters.bag_directory.c_str(), left.c_str());
  }
  if (parameters.record) {
    for (const std::string& path : RecordTo(parameters.bag_name)) {
      ROS_INFO("recording to %s", path.c_str());
    }
  }
  if (simulator_) {
    simulator_->Start();
    simulator_services_ = std::make_unique<SimulatorServices>(
        simulator_.get(), parameters.simulator, &node_, &prompt_node_, &work_node_, &pool_);
  }
  servers_ = {work_node_.advertiseService("simulate", &Node::Simulate, this),
              work_node_.advertiseService("b_derivative", &Node::Differentiate, this),
              work_node_.advertiseService("compare", &Node::Compare, this),
              work_node_.advertiseService("check_assumptions", &Node::CheckAssumed, this),
              work_node_.advertiseService("linearize", &Node::Linearized, this),
              prompt_node_.advertiseService("cancel", &Node::Cancel, this),
              prompt_node_.advertiseService("describe_model", &Node::Describe, this),
              prompt_node_.advertiseService("start_recording", &Node::Start, this),
              prompt_node_.advertiseService("stop_recording", &Node::Stop, this)};
}

/// Answers record->request within its budget.
template <class Response, class Record>
void Node::Compute(const char* service, Record* record) {
  AnswerWithin<Response>(&pool_, service, LimitsOf(setup_, OptionsOf(record->request)),
                         &record->result, [&] { return Answer(setup_, record->request); });
}

bool Node::Cancel(CancelWork::Request& in, CancelWork::Response& out) {
  return Guard("cancel", &out, [&] {
    const WorkPool::Count count =
        in.ask_only ? pool_.Look() : pool_.Cancel(in.service, "cancelled by ~cancel");
    out.cancelled = static_cast<std::uint32_t>(count.cancelled);
    out.running = static_cast<std::uint32_t>(count.running);
    out.waiting = static_cast<std::uint32_t>(count.waiting);
    out.message = count.sentence;
  });
}

bool Node::Simulate(SimulateTrajectory::Request& in, SimulateTrajectory::Response& out) {
  out.outcome = SimulateTrajectory::Response::REFUSED;
  return Guard("simulate", &out, [&] {
    SimulationRecord record;
    record.request = SameFields<SimulationRequest>(in);
    Compute<SimulateTrajectory::Response>("simulate", &record);
    for (const TrajectoryArc& arc : record.result.arcs) {
      std::string label;
      for (const std::string& name : arc.mode) label += (label.empty() ? "" : ", ") + name;
      out.mode_sequence.push_back("{" + label + "}");
      out.mode_words.push_back(arc.mode_word);
    }
    for (const ContactTransition& transition : record.result.transitions) {
      out.event_times.push_back(transition.t);
    }
    out.trajectory = record.result;
    Deliver(&outlet_, &record, &out);
    out.trajectory.header = record.header;
  });
}

bool Node::Differentiate(ComputeBDerivative::Request& in, ComputeBDerivative::Response& out) {
  out.outcome = ComputeBDerivative::Response::REFUSED;
  return Guard("b_derivative", &out, [&] {
    DerivativeRecord record;
    record.request = SameFields<DerivativeRequest>(in);
    Compute<ComputeBDerivative::Response>("b_derivative", &record);
    out.derivative = record.result;
    Deliver(&outlet_, &record, &out);
    out.derivative.header = record.header;
  });
}

bool Node::Compare(CompareBDerivative::Request& in, CompareBDerivative::Response& out) {
  out.outcome = CompareBDerivative::Response::REFUSED;
  return Guard("compare", &out, [&] {
    ComparisonRecord record;
    record.request = SameFields<ComparisonRequest>(in);
    Compute<CompareBDerivative::Response>("compare", &record);
    out.comparison = record.result;
    Deliver(&outlet_, &record, &out);
    out.comparison.header = record.header;
  });
}

bool Node::CheckAssumed(CheckAssumptions::Request& in, CheckAssumptions::Response& out) {
  out.outcome = CheckAssumptions::Response::REFUSED;
  return Guard("check_assumptions", &out, [&] {
    AssumptionRecord record;
    record.request = SameFields<AssumptionRequest>(in);
    Compute<CheckAssumptions::Response>("check_assumptions", &record);
    out.report = record.result;
    Deliver(&outlet_, &record, &out);
    out.report.header = record.header;
  });
}

bool Node::Linearized(LinearizeTrajectory::Request& in, LinearizeTrajectory::Response& out) {
  out.outcome = LinearizeTrajectory::Response::REFUSED;
  return Guard("linearize", &out, [&] {
    LinearizationRecord record;
    record.request = SameFields<LinearizationRequest>(in);
    Compute<LinearizeTrajectory::Response>("linearize", &record);
    out.linearization = record.result;
    Deliver(&outlet_, &record, &out);
    out.linearization.header = record.header;
  });
}

bool Node::Describe(DescribeModel::Request& in, DescribeModel::Response& out) {
  return Guard("describe_model", &out, [&] {
    out.models = ModelNames();
    if (in.model.empty()) {
      out.description = ToMsg(setup_);
    } else {
      Configuration configuration;
      configuration.model = in.model;
      out.description = ToMsg(Setup(configuration));
    }
  });
}

std::vector<std::string> Node::RecordTo(const std::string& name) {
  std::vector<std::string> paths = {outlet_.StartRecording(name)};
  if (!simulator_) return paths;
  const std::string path = paths.front();
  const std::size_t begin = path.find_last_of('/') + 1;
  const std::string stem = path.substr(begin, path.size() - 4 - begin);
  try {
    paths.push_back(simulator_->StartRecording(stem + "_online"));
  } catch (const std::exception&) {
    outlet_.StopRecording();
    throw;
  }
  return paths;
}

bool Node::Start(StartRecording::Request& in, StartRecording::Response& out) {
  return Guard("start_recording", &out, [&] {
    const std::vector<std::string> paths = RecordTo(in.name);
    out.path = paths.front();
    out.message = "recording to " + out.path;
    if (paths.size() > 1) out.message += ", and the simulator to " + paths.back();
  });
}

bool Node::Stop(StopRecording::Request&, StopRecording::Response& out) {
  return Guard("stop_recording", &out, [&] {
    const Recorder::Summary summary = outlet_.StopRecording();
    out.paths = summary.paths;
    out.results = static_cast<std::uint32_t>(summary.results);
    out.message = std::to_string(summary.results) + " results in " + summary.paths.front();
    if (simulator_) {
      for (const std::string& path : simulator_->StopRecording()) out.paths.push_back(path);
    }
    if (!summary.error.empty()) throw std::runtime_error(summary.error);
  });
}

namespace {

/// SIGTERM, SIGHUP and SIGQUIT end the node as SIGINT does, so that its bags are closed; the second
/// one ends the process at once. What is ignored (nohup) stays so.
void EndOnSignals() {
  struct sigaction action {};
  action.sa_handler = [](int) { ros::requestShutdown(); };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGTERM, SIGHUP, SIGQUIT}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) ::sigaction(signal, &action, nullptr);
  }
}

}  // namespace

int RunNode() {
  EndOnSignals();
  // When the last handle goes ROS shuts down, and its log with it: this one
  // outlives what may throw.
  const ros::NodeHandle handle;
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is told as a full disk
  try {
    const NodeParameters parameters = ReadNodeParameters();
    LimitMemory(parameters.max_memory);
    LoadModelPlugins(parameters.model_plugins);
    Node node(parameters);
    ros::AsyncSpinner spinner(kOtherThreads);
    spinner.start();
    if (parameters.simulator.online) {
      ROS_INFO("simulator: %s",
               parameters.simulator.paused ? "paused, see unpause_physics and step" : "running");
    }
    ROS_INFO("contact_flow: %s is ready at %s/simulate, b_derivative, compare, describe_model",
             node.setup().system->description().name.c_str(), ros::this_node::getName().c_str());
    ros::waitForShutdown();
    return 0;
  } catch (const std::exception& error) {
    ROS_FATAL("contact_flow: %s", error.what());
    return 1;
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
