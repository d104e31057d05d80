// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>

namespace contact_flow {
namespace ros_interface {

/// A new regular file in a directory: never one that is there, or what a link there points to.
/// Everything throws std::runtime_error with path and reason, as "/bags/a.bag: disk full (…)".
class NewFile {
 public:
  /// Throws std::invalid_argument when `path` is taken, by whatever.
  explicit NewFile(const std::string& path);
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  /// All of the bytes are in the file, or none of them and it is as before.
  void Append(std::string_view bytes);
  /// Puts bytes in the place of others.
  void Overwrite(std::size_t position, std::string_view bytes);
  /// On the disk when this returns.
  void Sync();
  void Close();

 private:
  void WriteAt(std::size_t position, std::string_view bytes);

  const std::string path_;
  int fd_;
  std::size_t size_ = 0;
};

/// Puts a file of these parts in the place of `path`, in one step: at every instant, also if the
/// process is killed or the power fails, `path` is either the old file or the new one. `path` must
/// be a regular file, or nothing; where it `must_be_new`, nothing. Throws as NewFile; the old file
/// is untouched then.
void ReplaceFile(const std::string& path, std::initializer_list<std::string_view> parts,
                 bool must_be_new);

/// Throws std::invalid_argument when something has this name, be it a link that leads nowhere.
void CheckFree(const std::string& path);

/// Files in a directory that ReplaceFile has left behind, killed while it wrote: as "a.bag".
/// What is in them was never answered.
std::string LeftOver(const std::string& directory);

}  // namespace ros_interface
}  // namespace contact_flow
