// SPDX-License-Identifier: BSD-3-Clause
#include "bag_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>
#include <stdexcept>

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr char kWriting[] = ".writing.";  // between name and random digits

[[noreturn]] void Fail(const std::string& path, int error) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  const std::string reason = std::strerror(error);
  throw std::runtime_error(path + ": " + (full ? "disk full (" + reason + ")" : reason));
}

std::string DirectoryOf(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

/// What is written is there after a power failure, too, where the file system can promise it.
void SyncFd(int fd, const std::string& path) {
  if (::fsync(fd) != 0 && errno != EINVAL && errno != EROFS) Fail(path, errno);
}

std::string RandomDigits() {
  static const char kDigits[] = "0123456789abcdef";
  std::random_device random;
  std::string digits;
  for (int i = 0; i < 16; ++i) digits += kDigits[random() % 16];
  return digits;
}

}  // namespace

void CheckFree(const std::string& path) {
  struct stat status;
  if (::lstat(path.c_str(), &status) == 0) throw std::invalid_argument(path + " exists");
}

NewFile::NewFile(const std::string& path)
    : path_(path),
      fd_(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644)) {
  if (fd_ < 0 && errno == EEXIST) throw std::invalid_argument(path_ + " exists");
  if (fd_ < 0) Fail(path_, errno);
  ::flock(fd_, LOCK_EX | LOCK_NB);  // somebody is writing
}

NewFile::~NewFile() {
  if (fd_ >= 0) ::close(fd_);
}

void NewFile::WriteAt(std::size_t position, std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::pwrite(fd_, bytes.data() + done, bytes.size() - done,
                               static_cast<off_t>(position + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) Fail(path_, n < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(n);
  }
}

void NewFile::Append(std::string_view bytes) {
  try {
    WriteAt(size_, bytes);
  } catch (...) {
    static_cast<void>(::ftruncate(fd_, static_cast<off_t>(size_)) == 0);
    throw;
  }
  size_ += bytes.size();
}

void NewFile::Overwrite(std::size_t position, std::string_view bytes) { WriteAt(position, bytes); }

void NewFile::Sync() { SyncFd(fd_, path_); }

void NewFile::Close() {
  const int fd = fd_;
  fd_ = -1;
  if (fd >= 0 && ::close(fd) != 0) Fail(path_, errno);
}

void ReplaceFile(const std::string& path, std::initializer_list<std::string_view> parts,
                 bool must_be_new) {
  struct stat status;
  if (::lstat(path.c_str(), &status) == 0) {
    if (must_be_new) throw std::invalid_argument(path + " exists");
    if (!S_ISREG(status.st_mode)) throw std::runtime_error(path + ": is no regular file any more");
  }
  const std::string temporary = path + kWriting + RandomDigits();
  try {
    NewFile file(temporary);
    for (const std::string_view part : parts) file.Append(part);
    file.Sync();
    if (!must_be_new) {
      if (::rename(temporary.c_str(), path.c_str()) != 0) Fail(path, errno);
    } else if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) !=
               0) {
      // Not every file system knows how; then by a second name, which none overwrites either.
      if (errno != EINVAL) Fail(path, errno);
      if (::link(temporary.c_str(), path.c_str()) != 0) Fail(path, errno);
      ::unlink(temporary.c_str());
    }
  } catch (const std::runtime_error& error) {
    ::unlink(temporary.c_str());
    const std::string what = error.what();
    const std::size_t at = what.find(temporary);
    if (at != 0) throw;
    throw std::runtime_error(path + what.substr(temporary.size()));
  }
  const std::string directory = DirectoryOf(path);
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) Fail(path, errno);
  ::fsync(fd);
  ::close(fd);
}

std::string LeftOver(const std::string& directory) {
  std::string names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name.find(kWriting) == std::string::npos) continue;
    const int fd = ::open(entry.path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) continue;
    const bool free = ::flock(fd, LOCK_SH | LOCK_NB) == 0;  // nobody is writing
    ::close(fd);
    if (free) names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

}  // namespace ros_interface
}  // namespace contact_flow
