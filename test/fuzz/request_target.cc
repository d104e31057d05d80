// SPDX-License-Identifier: BSD-3-Clause
#include "test/fuzz/request_target.h"

#include <ros/console.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "contact_flow/PredictionRequest.h"
#include "contact_flow/SimulatorMark.h"
#include "src/ros/answer/answers.h"
#include "src/ros/answer/assumptions_answer.h"
#include "src/ros/answer/controllability_answer.h"
#include "src/ros/answer/covariance_answer.h"
#include "src/ros/answer/ensemble_answer.h"
#include "src/ros/answer/feedback_answer.h"
#include "src/ros/answer/gradient_answer.h"
#include "src/ros/answer/linearize_answer.h"
#include "src/ros/answer/optimization_answer.h"
#include "src/ros/answer/periodic_orbit_answer.h"
#include "src/ros/answer/poincare_answer.h"
#include "src/ros/answer/policy_answer.h"
#include "src/ros/answer/stability_answer.h"
#include "src/ros/answer/trajectory_answer.h"
#include "src/ros/message/serialize.h"
#include "src/ros/recording/bag_reader.h"
#include "src/ros/request/session_messages.h"
#include "src/session/session.h"
#include "src/session/step_limits.h"
#include "test/fuzz/request_seeds.h"

/// Debian 13's Ipopt brings an MPI, which keeps what it takes as it is loaded.
extern "C" const char* __lsan_default_suppressions() { return "leak:libpmix\n"; }

namespace contact_flow {
namespace fuzz {
namespace {

/// The cases of Try, in their order.
constexpr const char* kKinds[] = {"simulate",
                                  "b_derivative",
                                  "compare",
                                  "check_assumptions",
                                  "linearize",
                                  "poincare_map",
                                  "assess_stability",
                                  "assess_stability",
                                  "assess_controllability",
                                  "propagate_covariance",
                                  "find_periodic_orbit",
                                  "optimize",
                                  "gradient",
                                  "set_state",
                                  "apply_impulse",
                                  "set_parameters",
                                  "set_input",
                                  "optimize_trajectory",
                                  "find_stabilizing_feedback",
                                  "make_policy",
                                  "sweep",
                                  "predict"};

/// What to do where a message has changed since.
constexpr const char* kWriteAgain = ": test/data/fuzz/make_requests.py writes it again";

std::size_t CaseOf(const std::string& kind) {
  const auto* found =
      std::find(std::begin(kKinds), std::end(kKinds), kind == "mark" ? "predict" : kind);
  if (found == std::end(kKinds)) throw std::invalid_argument("no service " + kind);
  return static_cast<std::size_t>(found - std::begin(kKinds));
}

[[noreturn]] void Abort(const std::string& finding) {
  std::fprintf(stderr, "FINDING: %s\n", finding.c_str());
  std::abort();
}

}  // namespace

struct RequestTarget::State {
  explicit State(const std::string& model)
      : seeds(model), session(RequestSeeds::Configured(model), {}, {}), first(Good()) {
    session.LimitSteps({1, 0.05, 0.5});
  }
  ros_if::Bytes Good() const { return ros_if::Serialize(ros_if::Answer(seeds.setup, seeds.good)); }

  const RequestSeeds seeds;
  Session session;
  const ros_if::Bytes first;  // of good requests
  std::vector<WireRequest> corpus;
};

RequestTarget::RequestTarget(const std::string& model) : state_(new State(model)) {}
RequestTarget::RequestTarget(RequestTarget&&) noexcept = default;
RequestTarget::~RequestTarget() = default;

void RequestTarget::CheckGood() {
  State& s = *state_;
  if (s.Good() != s.first) {
    Abort("a good request is answered otherwise than before");
  }
}

void RequestTarget::ReadCorpus(const std::string& folder) {
  const std::string model = state_->seeds.setup.system->description().name;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() == ".bin" && name.compare(0, model.size() + 1, model + ".") == 0) {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());  // as nobody promises their order
  for (const std::filesystem::path& path : paths) {
    std::string kind = path.filename().string().substr(model.size() + 1);
    kind.resize(kind.find('.'));
    CaseOf(kind);
    const std::string bytes = ros_if::ReadRegularFile(path.string());
    state_->corpus.push_back({kind, {bytes.begin(), bytes.end()}});
  }
}

std::size_t RequestTarget::CorpusSize() const { return state_->corpus.size(); }

RequestTarget::Result RequestTarget::TryCorpus(std::size_t number, Asked* asked) {
  std::mt19937 unused;
  return Try(&unused, &state_->corpus.at(number), false, asked);
}

RequestTarget::Result RequestTarget::TryOne(std::mt19937* generator, Asked* asked) {
  const auto& corpus = state_->corpus;
  const bool old = !corpus.empty() && (*generator)() % 8 == 0;
  return Try(generator, old ? &corpus[(*generator)() % corpus.size()] : nullptr, true, asked);
}

RequestTarget::Result RequestTarget::Try(std::mt19937* generator, const WireRequest* seed,
                                         bool mutate, Asked* asked) {
  State& s = *state_;
  const RequestSeeds& seeds = s.seeds;
  MessageMutator dice(generator, seeds.words);
  const auto hostile = [&](const char* name, auto* request) {
    if (seed != nullptr) {
      std::vector<std::uint8_t> bytes = seed->bytes;
      ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
      try {
        ros::serialization::deserialize(stream, *request);
      } catch (const ros::Exception&) {
        Abort("a request of the corpus is too short for " + seed->kind + kWriteAgain);
      }
      const bool rest = stream.getLength() > 0;
      if (rest) Abort("a request of the corpus is too long for " + seed->kind + kWriteAgain);
    }
    if (mutate) dice.Mutate(request);
    asked->model = seeds.setup.system->description().name;
    asked->wire = {name, ros_if::Serialize(*request)};
    std::ostringstream text;
    text << asked->model << '/' << name << '\n';
    if (asked->at_length) text << *request;
    asked->text = text.str();
  };
  // With friction radii are not known; an order may have no map by itself.
  const bool friction = seeds.setup.system->HasFriction();
  const auto judge = [friction](const auto& result) {
    if (result.outcome != 0) return;
    const std::string place = NanFinder({".in_order.data", friction ? ".radii" : ""}).In(result);
    if (!place.empty()) Abort("an answer that is in order holds " + place);
  };
  const auto ask = [&](const char* name, auto request) {
    seeds.Fill(&dice, &request);
    hostile(name, &request);
    Shorten(&request);
    return request;
  };
  const auto command = [&](const char* name, auto request) {
    seeds.Fill(&dice, &request);
    hostile(name, &request);
    ros_if::CheckMessage(request);
    return request;
  };
  const auto answer = [&](const char* name, auto request) {
    judge(ros_if::Answer(seeds.setup, ask(name, request)));
  };
  const auto search = [&](const char* name, auto request) {
    judge(ros_if::Answer(seeds.setup, ask(name, request), {}));
  };
  try {
    BudgetLimits limits = ProcessorBudget(kSeconds).limits();
    limits.max_megabytes = 200;
    const BudgetScope scope{Budget(limits)};
    switch (seed != nullptr ? CaseOf(seed->kind) : dice.Below(std::size(kKinds))) {
      case 0:
        answer("simulate", SimulationRequest());
        break;
      case 1:
        answer("b_derivative", DerivativeRequest());
        break;
      case 2:  // NaN has a meaning there
        ros_if::Answer(seeds.setup, ask("compare", ComparisonRequest()));
        break;
      case 3:  // and there
        ros_if::Answer(seeds.setup, ask("check_assumptions", AssumptionRequest()));
        break;
      case 4:
        answer("linearize", LinearizationRequest());
        break;
      case 5:
        answer("poincare_map", PoincareRequest());
        break;
      case 6:
      case 7:
        answer("assess_stability", StabilityRequest());
        break;
      case 8:
        answer("assess_controllability", ControllabilityRequest());
        break;
      case 9:
        answer("propagate_covariance", CovarianceRequest());
        break;
      case 10:
        search("find_periodic_orbit", PeriodicOrbitRequest());
        break;
      case 11:
        search("optimize", OptimizationRequest());
        break;
      case 12:
        answer("gradient", GradientRequest());
        break;
      case 13:
        s.session.SetState(
            ros_if::FromMsg(command("set_state", SetSimulatorState::Request()).state));
        break;
      case 14: {
        const auto request = command("apply_impulse", ApplyImpulse::Request());
        s.session.ApplyImpulse(request.names, request.impulse);
        break;
      }
      case 15: {
        const auto request = command("set_parameters", SetSimulatorParameters::Request());
        s.session.SetParameters(request.names, request.values);
        break;
      }
      case 16: {
        const auto request = command("set_input", SetInput::Request());
        const double at = request.at == 0 ? s.session.now() : request.at;
        s.session.SetInput(at, request.names, request.values);
        break;
      }
      case 17:
        search("optimize_trajectory", TrajectoryRequest());
        break;
      case 18:
        answer("find_stabilizing_feedback", StepFeedbackRequest());
        break;
      case 19:
        answer("make_policy", PolicyRequest());
        break;
      case 20:  // NaN has a meaning there, too
        ros_if::Answer(seeds.setup, ask("sweep", EnsembleRequest()));
        break;
      default: {
        SimulatorMark mark;
        seeds.AddDirections(&dice, &mark);
        PredictionRequest request;
        seeds.AddDirections(&dice, &request);
        request.horizon = kDuration;
        if (seed != nullptr ? seed->kind == "mark" : dice.Below(2) == 0) {
          hostile("mark", &mark);
          ros_if::CheckMessage(mark);
          s.session.Mark(ros_if::FromMsg(mark));
        } else {
          hostile("predict", &request);
          ros_if::CheckMessage(request);
          AskedPrediction prediction = ros_if::FromMsg(request);
          const Snapshot snapshot = s.session.AskPrediction(&prediction);
          judge(ros_if::ToMsg(Predict(snapshot, prediction, {})));
        }
      }
    }
  } catch (const std::exception& refusal) {
    if (std::string(refusal.what()).size() < 5) Abort("a refusal without words");
    return Result::kRefused;
  }
  return Result::kAnswered;
}

void RequestTarget::GoOn() {
  Session& session = state_->session;
  session.AdvanceTo(session.now() + 2e-3);
  if (!session.status().ok()) {
    session.ResetSimulation();
  } else if (!session.State().allFinite()) {
    Abort("the simulator's state is not finite");
  }
  ros_if::StateOf(&session);
  if (const auto reading = session.ReadMark()) {
    ros_if::ToMsg(session.setup()->system->description(), *reading, session.epoch());
  }
}

}  // namespace fuzz
}  // namespace contact_flow
