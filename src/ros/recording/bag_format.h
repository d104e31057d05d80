// SPDX-License-Identifier: BSD-3-Clause
// The file format of bags, version 2.0 (http://wiki.ros.org/Bags/Format/2.0).
#pragma once

#include <ros/time.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace contact_flow {
namespace ros_interface {

inline constexpr char kBagVersion[] = "#ROSBAG V2.0\n";
inline constexpr std::size_t kBagHeaderSize = 4096;  ///< first record, without lengths [bytes]

enum class BagOp : std::uint8_t {
  kMessage = 2,
  kFileHeader = 3,
  kIndexData = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7
};

/// Fields of a header, by name.
using BagFields = std::map<std::string, std::string>;

/// The header of a connection: topic, type, md5sum, message_definition, callerid, latching.
using BagConnection = std::shared_ptr<const BagFields>;

/// Makes the bytes of a bag that only grows: every call answers what is to be put at its end. What
/// has been put there is readable, at the latest after `rosbag reindex`, whatever happens then.
class BagEncoder {
 public:
  /// What a file begins with until it is closed.
  static std::string Begin();

  /// A chunk of its own with one message. One that is of the same connection has the same pointer.
  std::string Message(const BagConnection& connection, const ros::Time& time,
                      const std::vector<std::uint8_t>& data);

  /// The index; after it the beginning of the file is to be overwritten with Head().
  std::string End();
  std::string Head() const;

  std::size_t size() const { return size_; }  ///< of all that was answered, with Begin() [bytes]

 private:
  struct Chunk {
    std::uint64_t position;
    std::uint32_t connection;
    ros::Time time;
  };

  std::size_t size_ = Begin().size();
  std::uint64_t index_position_ = 0;
  std::map<BagConnection, std::uint32_t> ids_;
  std::vector<BagConnection> connections_;
  std::vector<Chunk> chunks_;
};

}  // namespace ros_interface
}  // namespace contact_flow
