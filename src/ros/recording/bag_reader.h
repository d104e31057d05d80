// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "bag_format.h"

namespace contact_flow {
namespace ros_interface {

/// A file that is no bag, or no more.
class DamagedBag : public std::runtime_error {
 public:
  /// what() is "damaged at byte N: reason".
  DamagedBag(std::size_t position, const std::string& reason);
};

/// A message where it lies in the bytes of the bag.
struct BagMessage {
  BagConnection connection;
  ros::Time time;
  const std::uint8_t* data;
  std::size_t size;
};

/// Everything in a bag, in the order of the file.
struct BagContent {
  std::vector<BagMessage> messages;
  bool closed = true;      ///< it ends with an index
  std::size_t cut_at = 0;  ///< of one that does not: where the last record breaks off, or 0
};

/// Reads a bag strictly: no byte of the file is left unread, and what the file says twice (index,
/// counts, times, connections) must agree. So whatever byte is changed, this throws DamagedBag, or
/// a message, its time or its connection is another. A bag that was never closed is read as far as
/// it goes. Throws std::runtime_error for chunks that are compressed (`rosbag decompress` undoes
/// that). `bytes` must outlive the result. Reads nothing outside of them, whatever they are.
BagContent ReadBag(const std::string& bytes);

/// The bytes of a regular file. Throws std::runtime_error for others.
std::string ReadRegularFile(const std::string& path);

}  // namespace ros_interface
}  // namespace contact_flow
