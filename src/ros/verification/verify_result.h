// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "contact_flow/AssumptionRecord.h"
#include "contact_flow/ComparisonRecord.h"
#include "contact_flow/ControllabilityRecord.h"
#include "contact_flow/CovarianceRecord.h"
#include "contact_flow/DerivativeRecord.h"
#include "contact_flow/EnsembleRecord.h"
#include "contact_flow/GradientRecord.h"
#include "contact_flow/LinearizationRecord.h"
#include "contact_flow/ModeSequence.h"
#include "contact_flow/OptimizationRecord.h"
#include "contact_flow/PeriodicOrbitRecord.h"
#include "contact_flow/PoincareRecord.h"
#include "contact_flow/PolicyRecord.h"
#include "contact_flow/SimulationRecord.h"
#include "contact_flow/StabilityRecord.h"
#include "contact_flow/StepFeedbackRecord.h"
#include "contact_flow/TrajectoryRecord.h"
#include "src/ros/message/serialize.h"
#include "src/ros/request/setup.h"
#include "verify.h"

namespace contact_flow {
namespace ros_interface {

/// Answers recorded requests again. Time is no part of a result: what was ended by max_seconds is
/// repeated up to there.
class BagVerifier::Repeater {
 public:
  explicit Repeater(double max_seconds) : max_seconds_(max_seconds) {}

  struct Verdict {
    std::string difference;  ///< or why it could not be repeated
    bool unknown = false;
    std::string note = "same, bit for bit";
  };
  /// How the description differs from that of the model it describes, or "".
  std::string Take(const ModelDescription& description);

  Verdict Repeat(const SimulationRecord& record);
  Verdict Repeat(const DerivativeRecord& record);
  Verdict Repeat(const ComparisonRecord& record);
  Verdict Repeat(const AssumptionRecord& record);
  Verdict Repeat(const LinearizationRecord& record);
  Verdict Repeat(const PoincareRecord& record);
  Verdict Repeat(const StabilityRecord& record);
  Verdict Repeat(const StepFeedbackRecord& record);
  Verdict Repeat(const ControllabilityRecord& record);
  Verdict Repeat(const CovarianceRecord& record);
  Verdict Repeat(const GradientRecord& record);
  Verdict Repeat(const PolicyRecord& record);
  Verdict Repeat(const PeriodicOrbitRecord& record);
  Verdict Repeat(const OptimizationRecord& record);
  Verdict Repeat(const TrajectoryRecord& record);
  Verdict Repeat(const EnsembleRecord& record);

  /// What follows a record on ordinary topics, by type.
  static std::map<std::string, Bytes> Copies(const SimulationRecord& record);
  static std::map<std::string, Bytes> Copies(const DerivativeRecord& record);
  template <class RecordMessage>
  static std::map<std::string, Bytes> Copies(const RecordMessage&) {
    return {};
  }

 private:
  template <class Request, class Body>
  auto Within(const Request& request, const Body& answer);
  template <class RecordMessage>
  Verdict Again(const RecordMessage& record);
  template <class RecordMessage>
  auto UpTo(const RecordMessage& record);
  template <class RecordMessage>
  Verdict Ended(const RecordMessage& record);
  Verdict UpToStep(const SimulationRecord& record);
  template <class RecordMessage>
  std::string OtherBudget(const RecordMessage& record) const;
  void BeginClock();
  Verdict TooLong() const;

  const double max_seconds_;
  double node_seconds_ = 0;  // of requests that say none
  std::chrono::steady_clock::time_point deadline_;
  std::unique_ptr<Setup> setup_;
};

}  // namespace ros_interface
}  // namespace contact_flow
