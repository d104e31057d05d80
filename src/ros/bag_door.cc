// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/bag_door.h"

#include <mutex>
#include <utility>

namespace contact_flow {
namespace ros_interface {
namespace {

/// One for the process. It is never destroyed, as threads may write until the very end.
std::mutex& Door() {
  static std::mutex& door = *new std::mutex;
  return door;
}

}  // namespace

std::unique_ptr<rosbag::Bag> OpenBag(const std::string& path, rosbag::bagmode::BagMode mode) {
  const std::lock_guard<std::mutex> lock(Door());
  auto bag = std::make_unique<rosbag::Bag>();
  try {
    bag->open(path, mode);
  } catch (...) {
    GiveUpBag(std::move(bag));
    throw;
  }
  return bag;
}

void CloseBag(std::unique_ptr<rosbag::Bag> bag) {
  if (!bag) return;
  const std::lock_guard<std::mutex> lock(Door());
  try {
    bag->close();
  } catch (...) {
    GiveUpBag(std::move(bag));
    throw;
  }
  bag.reset();  // within the lock
}

void GiveUpBag(std::unique_ptr<rosbag::Bag> bag) { static_cast<void>(bag.release()); }

}  // namespace ros_interface
}  // namespace contact_flow
