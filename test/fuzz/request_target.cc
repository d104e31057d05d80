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

#include "contact_flow/ApplyImpulse.h"
#include "contact_flow/MarkInstant.h"
#include "contact_flow/SetInput.h"
#include "contact_flow/SetSimulatorParameters.h"
#include "contact_flow/SetSimulatorState.h"
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
#include "src/ros/answer/stability_answer.h"
#include "src/ros/answer/trajectory_answer.h"
#include "src/ros/message/serialize.h"
#include "src/ros/recording/bag_reader.h"
#include "src/ros/session/session.h"
#include "src/ros/session/step_limits.h"
#include "test/fuzz/request_seeds.h"

namespace contact_flow {
namespace fuzz {
namespace {

/// The cases of Try, in their order.
constexpr const char* kKinds[] = {
    "simulate", "b_derivative", "compare", "check_assumptions", "linearize", "poincare_map",
    "assess_stability", "assess_stability", "assess_controllability", "propagate_covariance",
    "find_periodic_orbit", "optimize", "gradient", "set_state", "apply_impulse", "set_parameters",
    "set_input", "optimize_trajectory", "find_stabilizing_feedback", "sweep", "predict"};

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

RequestTarget::RequestTarget(const std::string& model) : state_(new State(model)) {}
RequestTarget::RequestTarget(RequestTarget&&) noexcept = default;
RequestTarget::~RequestTarget() = default;

void RequestTarget::CheckGood() {
  State& s = *state_;
  if (ros_if::Serialize(ros_if::Answer(s.setup, s.good)) != s.first) {
    Abort("a good request is answered otherwise than before");
  }
}

void RequestTarget::ReadCorpus(const std::string& folder) {
  const std::string model = state_->setup.system->description().name;
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
  MessageMutator dice(generator, s.words);
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
    asked->model = s.setup.system->description().name;
    asked->wire = {name, ros_if::Serialize(*request)};
    std::ostringstream text;
    text << asked->model << '/' << name << '\n';
    if (asked->at_length) text << *request;
    asked->text = text.str();
  };
  // With friction radii are not known; an order may have no map by itself.
  const bool friction = s.setup.system->HasFriction();
  const auto judge = [friction](const auto& result) {
    if (result.outcome != 0) return;
    const std::string place = NanFinder({".in_order.data", friction ? ".radii" : ""}).In(result);
    if (!place.empty()) Abort("an answer that is in order holds " + place);
  };
  const auto answer = [&](const char* name, auto* request) {
    hostile(name, request);
    Shorten(&request->options);
    judge(ros_if::Answer(s.setup, *request));
  };
  const auto search = [&](const char* name, auto* request, std::uint32_t iterations) {
    hostile(name, request);
    Shorten(&request->options);
    Limit(&request->max_iterations, iterations);
    judge(ros_if::Answer(s.setup, *request, {}));
  };
  try {
    const BudgetScope scope(ros_if::ProcessorBudget(kSeconds));
    switch (seed != nullptr ? CaseOf(seed->kind) : dice.Below(std::size(kKinds))) {
      case 0: {
        SimulationRequest request;
        s.BeginRun(&dice, &request);
        hostile("simulate", &request);
        Shorten(&request.options);
        if (request.samples <= 100000) request.samples %= 1000;
        judge(ros_if::Answer(s.setup, request));
        break;
      }
      case 1: {
        DerivativeRequest request;
        s.BeginRun(&dice, &request);
        s.AddDirections(&dice, &request);
        request.all_pieces = dice.Below(2) == 0;
        answer("b_derivative", &request);
        break;
      }
      case 2: {
        ComparisonRequest request;
        s.BeginRun(&dice, &request);
        s.AddDirections(&dice, &request);
        request.alphas = {1e-3, 1e-5};
        hostile("compare", &request);
        Shorten(&request.options);
        ros_if::Answer(s.setup, request);  // NaN has a meaning there
        break;
      }
      case 3: {
        AssumptionRequest request;
        s.BeginRun(&dice, &request);
        request.region_samples = 10;
        hostile("check_assumptions", &request);
        Shorten(&request.options);
        ros_if::Answer(s.setup, request);  // NaN has a meaning there
        break;
      }
      case 4: {
        LinearizationRequest request;
        s.BeginRun(&dice, &request);
        answer("linearize", &request);
        break;
      }
      case 5: {
        PoincareRequest request;
        s.Fill(&dice, &request);
        answer("poincare_map", &request);
        break;
      }
      case 6:
      case 7: {
        StabilityRequest request;
        s.Fill(&dice, &request);
        hostile("assess_stability", &request);
        Shorten(&request.return_map.options);
        Limit(&request.max_words, std::uint32_t{500});
        Limit(&request.max_linear_programs, std::uint32_t{500});
        judge(ros_if::Answer(s.setup, request));
        break;
      }
      case 8: {
        ControllabilityRequest request;
        s.BeginRun(&dice, &request);
        if (dice.Below(2) == 0) request.map = s.Map();
        hostile("assess_controllability", &request);
        Shorten(&request.options);
        Limit(&request.max_linear_programs, std::uint32_t{500});
        judge(ros_if::Answer(s.setup, request));
        break;
      }
      case 9: {
        CovarianceRequest request;
        s.BeginRun(&dice, &request);
        request.deviations.assign(s.V().size() * 2, 0.01);
        answer("propagate_covariance", &request);
        break;
      }
      case 10: {
        PeriodicOrbitRequest request;
        s.Fill(&dice, &request);
        search("find_periodic_orbit", &request, 5);
        break;
      }
      case 11: {
        OptimizationRequest request;
        s.Fill(&dice, &request);
        search("optimize", &request, 5);
        break;
      }
      case 12: {
        GradientRequest request;
        s.BeginRun(&dice, &request);
        request.outcomes = request.path_outcomes = {s.Coordinate(&dice)};
        answer("gradient", &request);
        break;
      }
      case 13: {
        SetSimulatorState::Request request;
        request.state.q = s.Q();
        request.state.v = s.V();
        hostile("set_state", &request);
        ros_if::CheckMessage(request);
        s.session.SetState(request.state);
        break;
      }
      case 14: {
        ApplyImpulse::Request request;
        request.names = {s.setup.system->description().velocities.front()};
        request.impulse = {0.1};
        hostile("apply_impulse", &request);
        ros_if::CheckMessage(request);
        s.session.ApplyImpulse(request.names, request.impulse);
        break;
      }
      case 15: {
        SetSimulatorParameters::Request request;
        const Parameter& one = s.AnyParameter(&dice);
        request.names = {one.name};
        request.values = {one.value};
        hostile("set_parameters", &request);
        ros_if::CheckMessage(request);
        s.session.SetParameters(request.names, request.values);
        break;
      }
      case 16: {
        SetInput::Request request;
        request.values = s.U();
        hostile("set_input", &request);
        ros_if::CheckMessage(request);
        if (request.at == 0) request.at = s.session.now();
        s.session.SetInput(request.at, request.names, request.values);
        break;
      }
      case 17: {
        TrajectoryRequest request;
        s.Fill(&dice, &request);
        search("optimize_trajectory", &request, 3);
        break;
      }
      case 18: {
        StepFeedbackRequest request;
        s.Fill(&dice, &request);
        hostile("find_stabilizing_feedback", &request);
        Shorten(&request.return_map.options);
        Limit(&request.max_words, std::uint32_t{500});
        Limit(&request.max_linear_programs, std::uint32_t{500});
        judge(ros_if::Answer(s.setup, request));
        break;
      }
      case 19: {
        EnsembleRequest request;
        s.Fill(&dice, &request);
        hostile("sweep", &request);
        Shorten(&request.options);
        Limit(&request.runs, std::uint64_t{300});
        Limit(&request.threads, std::uint32_t{2});
        ros_if::Answer(s.setup, request);  // NaN has a meaning there
        break;
      }
      default: {
        SimulatorMark mark;
        s.AddDirections(&dice, &mark);
        PredictionRequest request;
        s.AddDirections(&dice, &request);
        request.horizon = kDuration;
        if (seed != nullptr ? seed->kind == "mark" : dice.Below(2) == 0) {
          hostile("mark", &mark);
          ros_if::CheckMessage(mark);
          s.session.Mark(mark);
        } else {
          hostile("predict", &request);
          judge(ros_if::Predict(s.session.AskPrediction(&request), request, {}));
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
  ros_if::Session& session = state_->session;
  session.AdvanceTo(session.now() + 2e-3);
  if (!session.status().ok()) {
    session.ResetSimulation();
  } else if (!session.State().allFinite()) {
    Abort("the simulator's state is not finite");
  }
  session.StateMsg();
  session.TangentsMsg();
}

}  // namespace fuzz
}  // namespace contact_flow
