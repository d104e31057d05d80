// SPDX-License-Identifier: BSD-3-Clause
#include "feedback_answer.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/FindStabilizingFeedback.h"
#include "contact_flow/analysis/orbit_sizes.h"
#include "contact_flow/analysis/step_feedback.h"
#include "contact_flow/piecewise_linear/stabilizing_feedback.h"
#include "limits.h"
#include "poincare_answer.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using FeedbackCodes = FindStabilizingFeedback::Response;

std::vector<int> ResolveFedInputs(const SystemDescription& names,
                                  const std::vector<std::string>& asked) {
  std::vector<int> inputs;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const std::string field = "inputs[" + std::to_string(k) + "]";
    const int i = NameIndex(field, "input", asked[k], names.inputs);
    if (std::find(inputs.begin(), inputs.end(), i) != inputs.end()) {
      throw std::invalid_argument(field + " is '" + asked[k] + "' for the second time");
    }
    inputs.push_back(i);
  }
  for (std::size_t i = 0; asked.empty() && i < names.inputs.size(); ++i) {
    inputs.push_back(static_cast<int>(i));
  }
  if (inputs.empty()) {
    throw std::invalid_argument("inputs: a feedback needs one, '" + names.name + "' has none");
  }
  return inputs;
}

FeedbackOptions ResolveFeedback(const Setup& setup, const StepFeedbackRequest& request) {
  FeedbackOptions options;
  options.piecewise = request.piecewise;
  options.good_enough = ResolveNumber("good_enough", request.good_enough, 0, 1);
  StabilityOptions& proof = options.stability;
  proof.margin = ResolveNumber("margin", request.margin, proof.margin, 0.5);
  proof.max_word_length = ResolveCount("max_word_length", request.max_word_length,
                                       proof.max_word_length, kMaxWordLength);
  proof.max_words =
      ResolveCount("max_words", request.max_words, static_cast<int>(proof.max_words), kMaxWords);
  proof.max_linear_programs =
      ResolveCount("max_linear_programs", request.max_linear_programs,
                   static_cast<int>(proof.max_linear_programs), kMaxPrograms);
  proof.cancelled = setup.options.cancelled;
  return options;
}

void Fill(const StabilizingFeedback& found, const FeedbackOptions& options,
          StepFeedbackResult* result) {
  result->message = found.message;
  result->rate = found.rate;
  result->law = ToMsg(found.law);
  result->closed = ToMsg(found.closed);
  result->certificate = ToMsg(found.certificate);
  result->test = StabilityTestName(found.certificate.test);
  result->verified =
      found.certified && VerifyCertificate(found.closed, found.certificate, options.stability);
  result->outcome = result->verified ? FeedbackCodes::CERTIFIED : FeedbackCodes::NOT_CERTIFIED;
  if (found.certified && !result->verified) {
    result->message += "; but the certificate is rejected when it is checked again";
  }
}

}  // namespace

StepFeedbackResult Answer(const Setup& setup, const StepFeedbackRequest& request) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const FeedbackOptions options = ResolveFeedback(setup, request);
  ReturnQuestion question = ResolveReturn(setup, request.return_map);
  const std::vector<int> inputs = ResolveFedInputs(names, request.inputs);
  question.options.derivative.variables = {};
  question.options.derivative.variables.inputs = true;
  const PoincareMap map(system, question.u, question.section, question.options);
  const PoincareReturn one = map.Return(question.x);
  if (one.status == ReturnStatus::kRefused) throw std::invalid_argument(one.message);
  StepFeedbackResult result;
  result.model = names.name;
  for (int i : inputs) result.inputs.push_back(names.inputs[static_cast<std::size_t>(i)]);
  result.input = ToMsg(VectorRef(question.u));
  result.q = ToMsg(VectorRef(question.x.head(system.num_positions())));
  result.v = ToMsg(VectorRef(question.x.tail(system.dof())));
  result.outcome = FeedbackCodes::NO_MAP;
  result.message = one.message;
  WarnOfRun(one.trajectory, &result);
  double off_orbit = 0;
  if (one.returned()) {
    result.distance = system.Separation(one.x, question.x).cwiseAbs().maxCoeff();
    off_orbit = OffOrbit(system, question.x, one, question.neutral);
  }
  if (one.status != ReturnStatus::kReturned) return result;
  const std::string differs =
      off_orbit > kOnOrbit ? "" : NextReturnDiffers(system, map, question.x, one, question.neutral);
  if (!differs.empty()) {
    Warn(MakeWarning(ResultWarning::NOT_NEUTRAL,
                     "the neutral directions are none of the motion: " + differs),
         &result);
    return result;
  }
  const ReducedMap controlled = ControlledReturn(system, one, question.neutral, inputs);
  result.basis = ToMsg(MatrixRef(controlled.basis));
  result.neutral_residual = controlled.residual;
  if (controlled.residual > kNeutral) {
    std::ostringstream note;
    note << "the neutral directions are none: residual " << controlled.residual;
    Warn(MakeWarning(ResultWarning::NOT_NEUTRAL, note.str()), &result);
    return result;
  }
  if (controlled.basis.cols() > kMaxMapSize) {
    throw std::invalid_argument("return_map: " + std::to_string(controlled.basis.cols()) +
                                " numbers are to be fed back: at most " +
                                std::to_string(kMaxMapSize) + " can be");
  }
  result.step = ToMsg(controlled.map);
  Fill(FindStabilizingFeedback(controlled.map, options), options, &result);
  if (off_orbit > kOnOrbit) {
    std::ostringstream note;
    note << "but the state is no fixed point, |P(x) - x| = " << result.distance;
    Warn(MakeWarning(ResultWarning::NO_FIXED_POINT, note.str()), &result);
  }
  if (setup.options.cancelled && setup.options.cancelled()) result.outcome = kAnalysisCancelled;
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
