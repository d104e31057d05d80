// SPDX-License-Identifier: BSD-3-Clause
#include "bag_format.h"

#include <cstring>

namespace contact_flow {
namespace ros_interface {
namespace {

/// Numbers are little-endian, as the machines that ROS runs on.
template <class Number>
std::string Bits(Number number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(&bytes[0], &number, sizeof(number));
  return bytes;
}
std::string Bits(const ros::Time& time) { return Bits(time.sec) + Bits(time.nsec); }
std::string Bits(BagOp op) { return std::string(1, static_cast<char>(op)); }

std::string WithLength(const std::string& bytes) {
  return Bits(static_cast<std::uint32_t>(bytes.size())) + bytes;
}

std::string Encode(const BagFields& fields) {
  std::string bytes;
  for (const auto& [name, value] : fields) bytes += WithLength(name + "=" + value);
  return bytes;
}

std::string RecordBytes(const BagFields& header, const std::string& data) {
  return WithLength(Encode(header)) + WithLength(data);
}

std::string Connection(std::uint32_t id, const BagFields& fields) {
  return RecordBytes(
      {{"op", Bits(BagOp::kConnection)}, {"conn", Bits(id)}, {"topic", fields.at("topic")}},
      Encode(fields));
}

std::string FileHeader(std::uint64_t index_position, std::uint32_t connections,
                       std::uint32_t chunks) {
  const std::string header = Encode({{"op", Bits(BagOp::kFileHeader)},
                                     {"index_pos", Bits(index_position)},
                                     {"conn_count", Bits(connections)},
                                     {"chunk_count", Bits(chunks)}});
  const std::string padding(kBagHeaderSize - header.size(), ' ');
  return kBagVersion + WithLength(header) + WithLength(padding);
}

}  // namespace

std::string BagEncoder::Begin() { return FileHeader(0, 0, 0); }

std::string BagEncoder::Head() const {
  return FileHeader(index_position_, static_cast<std::uint32_t>(connections_.size()),
                    static_cast<std::uint32_t>(chunks_.size()));
}

std::string BagEncoder::Message(const BagConnection& connection, const ros::Time& time,
                                const std::vector<std::uint8_t>& data) {
  const auto next = static_cast<std::uint32_t>(connections_.size());
  const auto [found, is_new] = ids_.emplace(connection, next);
  const std::uint32_t id = found->second;
  std::string content;
  if (is_new) {
    connections_.push_back(connection);
    content = Connection(id, *connection);
  }
  const auto offset = static_cast<std::uint32_t>(content.size());
  content += RecordBytes({{"op", Bits(BagOp::kMessage)}, {"conn", Bits(id)}, {"time", Bits(time)}},
                         std::string(data.begin(), data.end()));
  std::string bytes = RecordBytes({{"op", Bits(BagOp::kChunk)},
                                   {"compression", "none"},
                                   {"size", Bits(static_cast<std::uint32_t>(content.size()))}},
                                  content);
  bytes += RecordBytes({{"op", Bits(BagOp::kIndexData)},
                        {"ver", Bits(std::uint32_t{1})},
                        {"conn", Bits(id)},
                        {"count", Bits(std::uint32_t{1})}},
                       Bits(time) + Bits(offset));
  chunks_.push_back({size_, id, time});
  size_ += bytes.size();
  return bytes;
}

std::string BagEncoder::End() {
  index_position_ = size_;
  std::string bytes;
  for (std::size_t id = 0; id < connections_.size(); ++id) {
    bytes += Connection(static_cast<std::uint32_t>(id), *connections_[id]);
  }
  for (const Chunk& chunk : chunks_) {
    bytes += RecordBytes({{"op", Bits(BagOp::kChunkInfo)},
                          {"ver", Bits(std::uint32_t{1})},
                          {"chunk_pos", Bits(chunk.position)},
                          {"start_time", Bits(chunk.time)},
                          {"end_time", Bits(chunk.time)},
                          {"count", Bits(std::uint32_t{1})}},
                         Bits(chunk.connection) + Bits(std::uint32_t{1}));
  }
  size_ += bytes.size();
  return bytes;
}

}  // namespace ros_interface
}  // namespace contact_flow
