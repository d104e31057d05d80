// SPDX-License-Identifier: BSD-3-Clause
#include "stability_answer.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "contact_flow/DecideStability.h"
#include "contact_flow/analysis/orbit_sizes.h"
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

using StabilityCodes = DecideStability::Response;

static_assert(StabilityCodes::STABLE == static_cast<int>(StabilityVerdict::kStable) &&
                  StabilityCodes::UNSTABLE == static_cast<int>(StabilityVerdict::kUnstable) &&
                  StabilityCodes::UNDETERMINED == static_cast<int>(StabilityVerdict::kUndetermined),
              "the constants of the service are the verdicts");

StabilityOptions ResolveOptions(const Setup& setup, const StabilityRequest& request) {
  StabilityOptions options;
  options.margin = ResolveNumber("margin", request.margin, options.margin, 0.5);
  options.max_word_length = ResolveCount("max_word_length", request.max_word_length,
                                         options.max_word_length, kMaxWordLength);
  options.max_words =
      ResolveCount("max_words", request.max_words, static_cast<int>(options.max_words), kMaxWords);
  options.max_linear_programs =
      ResolveCount("max_linear_programs", request.max_linear_programs,
                   static_cast<int>(options.max_linear_programs), kMaxPrograms);
  options.cancelled = setup.options.cancelled;
  options.consistency = ResolveConsistency(request.map_tolerance, request.max_linear_programs,
                                           !request.map.empty(), setup);
  return options;
}

/// The map that is asked about; false, with the reason in the result, when there is none.
bool FindReturnMap(const Setup& setup, const StabilityRequest& request, PiecewiseLinearMap* map,
                   double* off_orbit, StabilityResult* result) {
  if (!request.map.empty()) {
    *map = ToMap("map", request.map);
    return true;
  }
  const AssessedReturn assessed = AssessReturn(setup, request.return_map);
  result->distance = assessed.distance;
  *off_orbit = assessed.off_orbit;
  result->message = assessed.one.message;
  if (assessed.one.status != ReturnStatus::kReturned || !assessed.reducible) {
    for (const ResultWarning& warning : assessed.warnings) Warn(warning, result);
    return false;
  }
  WarnOfRun(assessed.one.trajectory, result);
  for (const ResultWarning& warning : assessed.warnings) Warn(warning, result);
  if (!assessed.warnings.empty()) return false;  // the quotient would be of no map
  *map = assessed.reduced.map;
  result->basis = ToMsg(MatrixRef(assessed.reduced.basis));
  result->neutral_residual = assessed.reduced.residual;
  return true;
}

void Check(const PiecewiseLinearMap& map, const StabilityCertificate& certificate,
           const StabilityOptions& options, StabilityResult* result) {
  const bool growth = certificate.test >= StabilityTest::kGrowingRay;
  result->verified = VerifyCertificate(map, certificate, options);
  result->outcome = !result->verified ? StabilityCodes::UNDETERMINED
                    : growth          ? StabilityCodes::UNSTABLE
                                      : StabilityCodes::STABLE;
  result->message = std::string("the certificate ") + (result->verified ? "holds" : "is rejected");
}

void Assess(const PiecewiseLinearMap& map, const StabilityOptions& options,
            StabilityResult* result) {
  const StabilityReport report = AssessStability(map, options);
  result->outcome = static_cast<std::uint8_t>(report.verdict);
  result->message = report.message;
  result->certificate = ToMsg(report.certificate);
  result->test = StabilityTestName(report.certificate.test);
  result->verified = VerifyCertificate(map, report.certificate, options);
  result->growth_below = report.growth_below;
  result->growth_above = report.growth_above;
  result->norm_one = report.norm_one;
  result->norm_two = report.norm_two;
  result->norm_infinity = report.norm_infinity;
  result->norm_quadratic = report.norm_quadratic;
  result->word_length = static_cast<std::uint32_t>(report.word_length);
  result->words = static_cast<std::uint32_t>(report.words);
  result->linear_programs = static_cast<std::uint32_t>(report.linear_programs);
  if (report.verdict != StabilityVerdict::kUndetermined && !result->verified) {
    result->outcome = StabilityCodes::UNDETERMINED;
    result->message = "undetermined: the certificate found is not accepted by the checker";
  }
}

}  // namespace

StabilityResult Answer(const Setup& setup, const StabilityRequest& request) {
  CheckMessage(request);
  StabilityResult result;
  result.model = setup.system->description().name;
  StabilityOptions options = ResolveOptions(setup, request);
  const StabilityCertificate given = ToCertificate("certificate", request.certificate);
  for (std::size_t k = 0; k < given.words.size(); ++k) {
    if (given.words[k].size() <= static_cast<std::size_t>(kMaxWordLength)) continue;
    throw std::invalid_argument("certificate.words[" + std::to_string(k) + "] has " +
                                std::to_string(given.words[k].size()) + " pieces, at most " +
                                std::to_string(kMaxWordLength) + " are accepted");
  }
  PiecewiseLinearMap map;
  double off_orbit = 0;
  result.outcome = StabilityCodes::NO_MAP;
  if (!FindReturnMap(setup, request, &map, &off_orbit, &result)) return result;
  if (map.rows() != map.cols() || map.rows() > kMaxMapSize) {
    throw std::invalid_argument("map is " + std::to_string(map.rows()) + " × " +
                                std::to_string(map.cols()) + ", expected a square one of at most " +
                                std::to_string(kMaxMapSize) + " rows");
  }
  result.map = ToMsg(map);
  const MapConsistency consistency = CheckMap(map, !request.map.empty(), &options.consistency);
  if (consistency.defect == MapDefect::kUndecided) {
    Warn(MakeWarning(ResultWarning::MAP_UNCHECKED, consistency.message), &result);
  }
  const std::string warnings = result.message;
  if (!consistency.usable) {
    result.outcome = StabilityCodes::UNDETERMINED;
    result.message = "undetermined: " + consistency.message;
    result.growth_above = std::numeric_limits<double>::infinity();
  } else if (given.test != StabilityTest::kNone) {
    result.certificate = request.certificate;
    result.test = StabilityTestName(given.test);
    Check(map, given, options, &result);
  } else {
    Assess(map, options, &result);
  }
  if (consistency.usable) AddNote(warnings, &result.message);
  if (off_orbit > kOnOrbit) {
    std::ostringstream note;
    note << "but the state is no fixed point, |P(x) - x| = " << result.distance;
    Warn(MakeWarning(ResultWarning::NO_FIXED_POINT, note.str()), &result);
  }
  if (options.cancelled && options.cancelled()) result.outcome = kAnalysisCancelled;
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
