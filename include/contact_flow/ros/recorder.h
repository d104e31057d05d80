// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "contact_flow/ros/bag_file.h"

namespace contact_flow {
namespace ros_interface {

/// Writes results to bags of one directory, each bag complete and readable after every result.
/// A bag that has grown beyond kSplitSize is followed by NAME_1.bag, NAME_2.bag, …, each of which
/// begins with the model again. Not for use by several threads at once.
class Recorder {
 public:
  /// A bag is written anew with every result, in time proportional to its size: about 20 ms at
  /// this.
  static constexpr std::size_t kSplitSize = std::size_t{4} << 20;

  /// `directory` is made when recording starts.
  explicit Recorder(std::string directory) : directory_(std::move(directory)) {}

  bool Recording() const { return !name_.empty(); }
  /// Path of the bag that is being written.
  std::string Path() const;

  /// Begins NAME.bag with the entries that every bag of this recording begins with. Throws
  /// std::invalid_argument, with name and reason, for a name that is not one (a path, "..") or
  /// taken, or when already recording; std::runtime_error when the directory cannot be written.
  void Start(const std::string& name, const std::vector<BagEntry>& preamble);
  /// Adds the entries of one result. They are on the disk when this returns. Throws
  /// std::runtime_error when they are not; recording goes on, and the bag holds what it held
  /// before.
  void Write(const std::vector<BagEntry>& entries);

  /// The bags written and the number of results in them.
  struct Summary {
    std::vector<std::string> paths;
    std::size_t results = 0;
  };
  Summary Stop();

 private:
  std::string directory_;
  std::string name_;  // empty when not recording
  std::vector<BagEntry> preamble_;
  std::vector<BagEntry> entries_;  // all of the present bag
  std::size_t size_ = 0;           // of the present bag [bytes]
  Summary summary_;
};

/// DIRECTORY/NAME.bag, with the directory made. Throws std::invalid_argument, with name and reason,
/// for a name that is not one or taken, std::runtime_error when the directory cannot be made.
std::string NewBagPath(const std::string& directory, const std::string& name);

/// $ROS_HOME/contact_flow, or ~/.ros/contact_flow.
std::string DefaultBagDirectory();

}  // namespace ros_interface
}  // namespace contact_flow
