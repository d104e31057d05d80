// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <streambuf>
#include <string>

namespace contact_flow {
namespace ros_interface {

/// Text of a file, for a terminal: bytes that are no UTF-8, and control characters but for the end
/// of a line and tabs, become \xHH.
std::string Printable(const std::string& text);

/// A stream's buffer that passes on what it is given as Printable, line by line.
class PrintableBuffer : public std::streambuf {
 public:
  /// `out` has to outlive it.
  explicit PrintableBuffer(std::streambuf* out) : out_(out) {}
  ~PrintableBuffer() override { sync(); }
  PrintableBuffer(const PrintableBuffer&) = delete;
  PrintableBuffer& operator=(const PrintableBuffer&) = delete;

 protected:
  int_type overflow(int_type character) override;
  int sync() override;

 private:
  std::streambuf* out_;
  std::string line_;
};

}  // namespace ros_interface
}  // namespace contact_flow
