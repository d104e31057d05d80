// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "contact_flow/ensemble/summary.h"

namespace contact_flow {

/// Summaries of blocks of kBlock runs, merged along the binary tree over the numbers of the blocks:
/// node (h, k) holds blocks k 2ʰ to (k+1) 2ʰ − 1, and its two halves are merged left to right. So
/// sums have the same bits whatever the blocks' order, chunks, threads and machines. It holds as
/// many summaries as the blocks that are there need: log₂ of their number when they come in order.
class Tally {
 public:
  static constexpr std::uint64_t kBlock = 256;  ///< runs of a block; the last may have fewer

  /// Adds one block. Throws std::invalid_argument where it is there.
  void Add(std::uint64_t block, Summary summary);
  /// Adds all that another one holds. Throws std::invalid_argument where both have a block.
  void Merge(const Tally& other);

  /// All that was added: the nodes, merged from the first block to the last.
  Summary Total() const;
  /// How many summaries it holds.
  std::size_t NumNodes() const { return nodes_.size(); }

  /// To bytes and back; with a version and a checksum (CRC-32).
  std::string ToBytes() const;
  /// Throws std::invalid_argument for bytes that are damaged or of another version.
  static Tally FromBytes(const std::string& bytes);

 private:
  using Node = std::pair<int, std::uint64_t>;  // (h, k)
  void Insert(Node node, Summary summary);
  bool Overlaps(Node node) const;

  std::map<Node, Summary> nodes_;
};

}  // namespace contact_flow
