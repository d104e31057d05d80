// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/bag_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <utility>

#include "contact_flow/ros/bag_door.h"

namespace contact_flow {
namespace ros_interface {
namespace {

[[noreturn]] void Fail(const std::string& what, int error) {
  throw std::runtime_error(what + ": " + std::strerror(error));
}

/// An open file that is closed at the end of the scope.
class File {
 public:
  File(int fd, const std::string& name) : fd_(fd) {
    if (fd_ < 0) Fail(name, errno);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { ::close(fd_); }
  int fd() const { return fd_; }

 private:
  int fd_;
};

void WriteAll(int fd, const char* data, std::size_t size, const std::string& path) {
  while (size > 0) {
    const ssize_t written = ::write(fd, data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail(path, errno);
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

/// Copies the whole of one file to the end of another. Returns the number of bytes.
std::size_t Copy(int from, int to, const std::string& path) {
  std::vector<char> buffer(1 << 18);
  std::size_t size = 0;
  while (true) {
    const ssize_t n = ::pread(from, buffer.data(), buffer.size(), static_cast<off_t>(size));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) Fail(path, errno);
    if (n == 0) return size;
    WriteAll(to, buffer.data(), static_cast<std::size_t>(n), path);
    size += static_cast<std::size_t>(n);
  }
}

void Sync(int fd, const std::string& path) {
  // Some file systems cannot: that is not a reason to lose the result.
  if (::fsync(fd) != 0 && errno != EINVAL && errno != EROFS) Fail(path, errno);
}

/// Writes the bag to an open file in memory.
void WriteToMemory(int fd, const std::vector<BagEntry>& entries) {
  std::unique_ptr<rosbag::Bag> bag =
      OpenBag("/proc/self/fd/" + std::to_string(fd), rosbag::bagmode::Write);
  try {
    for (const BagEntry& entry : entries) entry(bag.get());
  } catch (...) {
    GiveUpBag(std::move(bag));
    throw;
  }
  CloseBag(std::move(bag));
}

}  // namespace

std::size_t ReplaceBag(const std::string& path, const std::vector<BagEntry>& entries) {
  // rosbag::Bag leaks or ends the process when a disk is full, so it writes to memory, and what
  // goes to the disk is written, and checked, here.
  const File memory(::memfd_create("bag", MFD_CLOEXEC), "memory for " + path);
  try {
    WriteToMemory(memory.fd(), entries);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("memory for " + path + ": " + error.what());
  }
  const std::string temporary = path + ".writing";
  std::size_t size = 0;
  try {
    const File file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644),
                    path);
    size = Copy(memory.fd(), file.fd(), path);
    Sync(file.fd(), path);
    if (std::rename(temporary.c_str(), path.c_str()) != 0) Fail(path, errno);
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  const std::string directory = path.substr(0, path.find_last_of('/') + 1);
  const File parent(::open(directory.empty() ? "." : directory.c_str(), O_RDONLY | O_CLOEXEC),
                    path);
  Sync(parent.fd(), path);
  return size;
}

}  // namespace ros_interface
}  // namespace contact_flow
