// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chained_bag.h"

namespace contact_flow {
namespace ros_interface {

/// Writes results to bags of one directory, each bag complete and readable after every result.
/// A bag that has grown beyond kSplitSize is followed by NAME_1.bag, NAME_2.bag, …, each of which
/// begins with the model again. Not for use by several threads at once.
class Recorder {
 public:
  /// A bag is written anew with every call of Write, in time proportional to its size: about 10 ms
  /// at this.
  static constexpr std::size_t kSplitSize = std::size_t{4} << 20;

  /// `directory` is made when recording starts.
  explicit Recorder(std::string directory) : directory_(std::move(directory)) {}
  /// Stops, if it can.
  ~Recorder();

  bool Recording() const { return bag_.has_value(); }
  /// Path of the bag that is being written.
  std::string Path() const { return Recording() ? summary_.paths.back() : ""; }

  /// Begins NAME.bag. Throws std::invalid_argument, with name and reason, for a name that is not
  /// one (a path, "..") or taken, or when already recording; std::runtime_error when the directory
  /// cannot be written.
  void Start(const std::string& name, const RecordingPlan& plan, const ros::Time& stamp);
  struct Result {
    std::vector<BagEntry> entries;
    ros::Time stamp;
  };
  /// Adds results, which one link covers. They are on the disk when this returns. Throws
  /// std::runtime_error when they are not; recording goes on, and the bag holds
  /// what it held before.
  void Write(const std::vector<Result>& results);
  void Write(const std::vector<BagEntry>& entries, const ros::Time& stamp) {
    Write({{entries, stamp}});
  }

  /// The bags written and the number of results in them.
  struct Summary {
    std::vector<std::string> paths;
    std::size_t results = 0;
    std::string error;  ///< why the end of the recording could not be written, or ""
  };
  Summary Stop();

 private:
  void Replace(const std::string& path, ChainedBag bag, std::string_view body, bool must_be_new);

  std::string directory_;
  std::string name_;
  std::optional<ChainedBag> bag_;  // of the recording that is on
  std::string body_;               // of the present bag, without its index
  Summary summary_;
};

/// DIRECTORY/NAME.bag, with the directory made. Throws std::invalid_argument, with name and reason,
/// for a name that is not one or taken, std::runtime_error when the directory cannot be made.
std::string NewBagPath(const std::string& directory, const std::string& name);

/// The first of NAME_<part>.bag, NAME_<part+1>.bag, … that is free, for NAME.bag.
std::string NextPartPath(const std::string& path, std::size_t part);

/// $ROS_HOME/contact_flow, or ~/.ros/contact_flow.
std::string DefaultBagDirectory();

}  // namespace ros_interface
}  // namespace contact_flow
