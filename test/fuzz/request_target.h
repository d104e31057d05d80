// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <random>
#include <string>

namespace contact_flow {
namespace fuzz {

/// Answers hostile requests as the node does, without a master: every answer of a service or an
/// action, and every command of the simulator.
class RequestTarget {
 public:
  explicit RequestTarget(const std::string& model);
  RequestTarget(RequestTarget&&) noexcept;
  ~RequestTarget();

  enum class Result { kAnswered, kRefused };
  /// Makes a hostile request from a good one and answers it. What is wrong must come as a
  /// std::exception with words; anything else, and NaN in an answer that is in order, aborts.
  /// `what`, which outlives the call, tells what is being asked, for the report of a finding.
  Result TryOne(std::mt19937* generator, std::string* what);

  /// The simulator goes on by 2 ms; aborts where it is not in order.
  void GoOn();

  /// Good requests are answered to the same bits as before; aborts if not.
  void CheckGood();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fuzz
}  // namespace contact_flow
