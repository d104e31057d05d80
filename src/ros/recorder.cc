// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/recorder.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

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

bool Exists(const std::string& path) { return ::access(path.c_str(), F_OK) == 0; }

}  // namespace

std::string Recorder::Path() const { return Recording() ? summary_.paths.back() : ""; }

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

void Recorder::Start(const std::string& asked, const std::vector<BagEntry>& preamble) {
  const std::string name = CheckName(asked);
  if (Recording()) throw std::invalid_argument("already recording to " + Path());
  const std::string path = NewBagPath(directory_, asked);
  size_ = ReplaceBag(path, preamble);
  name_ = name;
  preamble_ = preamble;
  entries_ = preamble;
  summary_ = Summary();
  summary_.paths.push_back(path);
}

void Recorder::Write(const std::vector<BagEntry>& entries) {
  std::string path = summary_.paths.back();
  const bool split = size_ > kSplitSize;
  if (split) {
    std::size_t part = summary_.paths.size();
    do {
      path = directory_ + "/" + name_ + "_" + std::to_string(part++) + ".bag";
    } while (Exists(path));
  }
  std::vector<BagEntry> all = split ? preamble_ : entries_;
  all.insert(all.end(), entries.begin(), entries.end());
  size_ = ReplaceBag(path, all);
  entries_.swap(all);
  if (split) summary_.paths.push_back(path);
  ++summary_.results;
}

Recorder::Summary Recorder::Stop() {
  if (!Recording()) throw std::invalid_argument("not recording");
  name_.clear();
  preamble_.clear();
  entries_.clear();
  return summary_;
}

std::string DefaultBagDirectory() {
  if (const char* home = std::getenv("ROS_HOME")) return std::string(home) + "/contact_flow";
  const char* home = std::getenv("HOME");
  return std::string(home ? home : "") + "/.ros/contact_flow";
}

}  // namespace ros_interface
}  // namespace contact_flow
