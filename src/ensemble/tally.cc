// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/tally.h"

#include <boost/crc.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

namespace contact_flow {
namespace {

constexpr std::uint32_t kVersion = 0x43465431;  // "CFT1"
constexpr int kMaxHeight = 56;                  // 2⁵⁶ blocks are 2⁶⁴ runs

std::uint32_t Checksum(const char* bytes, std::size_t size) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes, size);
  return crc.checksum();
}

}  // namespace

bool Tally::Overlaps(Node node) const {
  for (const auto& [other, summary] : nodes_) {
    const int h = std::max(node.first, other.first);
    if (node.second >> (h - node.first) == other.second >> (h - other.first)) return true;
  }
  return false;
}

void Tally::Insert(Node node, Summary summary) {
  if (Overlaps(node)) {
    throw std::invalid_argument("block " + std::to_string(node.second << node.first) +
                                " of the ensemble was added already");
  }
  for (;;) {
    const auto sibling = nodes_.find({node.first, node.second ^ 1});
    if (sibling == nodes_.end()) break;
    if (node.second & 1) {
      sibling->second.Merge(summary);
      summary = std::move(sibling->second);
    } else {
      summary.Merge(sibling->second);
    }
    nodes_.erase(sibling);
    node = {node.first + 1, node.second >> 1};
  }
  nodes_.emplace(node, std::move(summary));
}

void Tally::Add(std::uint64_t block, Summary summary) { Insert({0, block}, std::move(summary)); }

void Tally::Merge(const Tally& other) {
  for (const auto& [node, summary] : other.nodes_) {
    if (Overlaps(node)) {
      throw std::invalid_argument("the tallies have a block in common");
    }
  }
  for (const auto& [node, summary] : other.nodes_) Insert(node, summary);
}

Summary Tally::Total() const {
  std::map<std::uint64_t, const Summary*> ordered;  // by first block
  for (const auto& [node, summary] : nodes_) ordered[node.second << node.first] = &summary;
  if (ordered.empty()) return Summary();
  Summary total = *ordered.begin()->second;
  for (auto it = std::next(ordered.begin()); it != ordered.end(); ++it) total.Merge(*it->second);
  return total;
}

std::string Tally::ToBytes() const {
  ByteWriter out;
  out.Put(kVersion);
  out.Put(static_cast<std::uint64_t>(nodes_.size()));
  for (const auto& [node, summary] : nodes_) {
    out.Put(static_cast<std::int64_t>(node.first));
    out.Put(node.second);
    summary.Write(&out);
  }
  const std::uint32_t checksum = Checksum(out.bytes().data(), out.bytes().size());
  out.Put(checksum);
  return out.bytes();
}

Tally Tally::FromBytes(const std::string& bytes) {
  constexpr std::size_t kSum = sizeof(std::uint32_t);
  if (bytes.size() < 2 * kSum) ByteReader::Refuse();
  const std::string content = bytes.substr(0, bytes.size() - kSum);
  const std::string tail = bytes.substr(content.size());
  if (ByteReader(tail).Get<std::uint32_t>() != Checksum(content.data(), content.size())) {
    ByteReader::Refuse();
  }
  ByteReader in(content);
  if (in.Get<std::uint32_t>() != kVersion) ByteReader::Refuse();
  Tally tally;
  for (std::size_t k = in.GetSize(16); k > 0; --k) {
    const auto height = in.Get<std::int64_t>();
    const auto index = in.Get<std::uint64_t>();
    if (height < 0 || height > kMaxHeight || index >> (kMaxHeight - height) != 0) {
      ByteReader::Refuse();
    }
    tally.Insert({static_cast<int>(height), index}, Summary::Read(&in));
  }
  if (!in.AtEnd()) ByteReader::Refuse();
  return tally;
}

}  // namespace contact_flow
