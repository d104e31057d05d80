// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace contact_flow {
namespace fuzz {

/// A request as it travels: what test/data/fuzz holds, as MODEL.KIND.WHAT.bin.
struct WireRequest {
  std::string kind;  ///< as "simulate"
  std::vector<std::uint8_t> bytes;
};

/// What is being asked, for the report of a finding.
struct Asked {
  bool at_length = false;  ///< with all fields: writing them takes as long as answering
  std::string text, model;
  WireRequest wire;
};

/// Answers hostile requests as the node does, without a master: every answer of a service or an
/// action, and every command of the simulator.
class RequestTarget {
 public:
  explicit RequestTarget(const std::string& model);
  RequestTarget(RequestTarget&&) noexcept;
  ~RequestTarget();

  enum class Result { kAnswered, kRefused };
  /// Makes a hostile request from a good one, or from one of the corpus, and answers it. What is
  /// wrong must come as a std::exception with words; anything else, and NaN in an answer that is in
  /// order, aborts. `asked` is filled in before.
  Result TryOne(std::mt19937* generator, Asked* asked);
  /// The corpus of this model in a folder.
  void ReadCorpus(const std::string& folder);
  std::size_t CorpusSize() const;
  /// One of the corpus as it is.
  Result TryCorpus(std::size_t number, Asked* asked);

  static constexpr double kSeconds = 5;  ///< of processor time for one request

  /// The simulator goes on by 2 ms; aborts where it is not in order.
  void GoOn();

  /// Good requests are answered to the same bits as before; aborts if not.
  void CheckGood();

 private:
  struct State;
  Result Try(std::mt19937* generator, const WireRequest* seed, bool mutate, Asked* asked);
  std::unique_ptr<State> state_;
};

}  // namespace fuzz
}  // namespace contact_flow
