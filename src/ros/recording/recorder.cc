// SPDX-License-Identifier: BSD-3-Clause
#include "recorder.h"

#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "bag_file.h"
#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// The name without ".bag". Throws unless it is a plain file name.
std::string CheckName(std::string name) {
  const std::string asked = "name " + QuoteName(name) + " ";
  if (name.size() > 4 && name.compare(name.size() - 4, 4, ".bag") == 0)
    name.resize(name.size() - 4);
  if (name.find('/') != std::string::npos || name.find("..") != std::string::npos) {
    throw std::invalid_argument(asked + "is a path: bags are written to ~bag_directory, give a " +
                                "plain name");
  }
  const char kAllowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-.";
  if (name.empty() || name[0] == '.' || name[0] == '-' || name.size() > 128 ||
      name.find_first_not_of(kAllowed) != std::string::npos) {
    throw std::invalid_argument(asked +
                                "is not a bag name: 1 to 128 letters, digits, '_', '-' or " +
                                "'.', beginning with a letter or digit");
  }
  return name;
}

bool Exists(const std::string& path) {
  struct stat status;
  return ::lstat(path.c_str(), &status) == 0;  // also a link that leads nowhere
}

}  // namespace

std::string NewBagPath(const std::string& directory, const std::string& asked) {
  const std::string name = CheckName(asked);
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw std::runtime_error("bag_directory " + directory + ": " + error.message());
  const std::string path = directory + "/" + name + ".bag";
  if (Exists(path)) {
    throw std::invalid_argument("name " + QuoteName(asked) + " is taken: " + path + " exists");
  }
  return path;
}

std::string NextPartPath(const std::string& path, std::size_t part) {
  const std::string name = path.substr(0, path.size() - 4);
  while (true) {
    const std::string next = name + "_" + std::to_string(part++) + ".bag";
    if (!Exists(next)) return next;
  }
}

/// The bag is in the file as a whole, with its index, and `bag` goes on from before that.
void Recorder::Replace(const std::string& path, ChainedBag bag, std::string_view body,
                       bool must_be_new) {
  const std::string index = bag.End(), head = bag.Head();
  ReplaceFile(path, {head, body.substr(head.size()), index}, must_be_new);
}

void Recorder::Start(const std::string& asked, const RecordingPlan& plan, const ros::Time& stamp) {
  const std::string name = CheckName(asked);
  if (Recording()) throw std::invalid_argument("already recording to " + Path());
  const std::string path = NewBagPath(directory_, asked);
  ChainedBag bag(plan);
  std::string body = bag.Begin(stamp);
  body += bag.Link(RecordingLink::GOES_ON);
  Replace(path, bag, body, true);
  name_ = name;
  bag_.emplace(std::move(bag));
  body_ = std::move(body);
  summary_ = Summary();
  summary_.paths.push_back(path);
}

void Recorder::Write(const std::vector<Result>& results) {
  std::string path = summary_.paths.back();
  ChainedBag bag = *bag_;
  const std::size_t before = body_.size();
  const bool split = before > kSplitSize;
  std::string body;  // of the next part
  if (split) {
    const std::string end = bag.Link(RecordingLink::PART_ENDS);
    Replace(path, bag, body_ + end, false);
    path = NextPartPath(summary_.paths.front(), summary_.paths.size());
    body = bag.Begin(ros::Time());
  }
  std::string& grown = split ? body : body_;
  try {
    for (const Result& result : results) {
      for (const BagEntry& entry : result.entries) grown += bag.Add(entry, result.stamp);
    }
    grown += bag.Link(RecordingLink::GOES_ON);
    Replace(path, bag, grown, split);
  } catch (...) {
    body_.resize(before);
    // The part before has been ended too early: it goes on.
    if (split) Replace(summary_.paths.back(), *bag_, body_, false);
    throw;
  }
  bag_ = std::move(bag);
  if (split) {
    body_.swap(body);
    summary_.paths.push_back(path);
  }
  summary_.results += results.size();
}

Recorder::Summary Recorder::Stop() {
  if (!Recording()) throw std::invalid_argument("not recording");
  try {
    body_ += bag_->Link(RecordingLink::RECORDING_ENDS);
    Replace(Path(), *bag_, body_, false);
  } catch (const std::exception& error) {
    summary_.error = std::string(error.what()) + ", so that its end is NOT RECORDED";
  }
  bag_.reset();
  body_.clear();
  return summary_;
}

Recorder::~Recorder() {
  if (Recording()) Stop();
}

std::string DefaultBagDirectory() {
  if (const char* home = std::getenv("ROS_HOME")) return std::string(home) + "/contact_flow";
  const char* home = std::getenv("HOME");
  return std::string(home ? home : "") + "/.ros/contact_flow";
}

}  // namespace ros_interface
}  // namespace contact_flow
