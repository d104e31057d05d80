// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "contact_flow/ModelDescription.h"
#include "src/ros/message/serialize.h"
#include "src/ros/recording/record_types.h"
#include "src/session/setup.h"
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

  template <class RecordMessage>
  Verdict Repeat(const RecordMessage& record);
  Verdict Repeat(const SimulationRecord& record);
  Verdict Repeat(const EnsembleRecord& record);

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
