// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/verification/printable.h"

#include <gtest/gtest.h>

#include <ostream>
#include <sstream>

namespace contact_flow {
namespace ros_interface {
namespace {

TEST(Printable, LeavesTextAndTellsBytes) {
  EXPECT_EQ("a line\n\tof π, → and 𝔹", Printable("a line\n\tof π, → and 𝔹"));
  EXPECT_EQ("\\x1b[2J\\x07\\x00\\x7f\\x0d", Printable(std::string("\x1b[2J\x07\0\x7f\r", 8)));
  EXPECT_EQ("\\x8f\\xff\\xc3", Printable("\x8f\xff\xc3"));  // no UTF-8, or half of it
  EXPECT_EQ("\\xc2\\x9b", Printable("\xc2\x9b"));           // a control of Latin-1
  EXPECT_EQ("\\xc0\\xaf\\xe0\\x80\\x80", Printable("\xc0\xaf\xe0\x80\x80"));  // too long
  EXPECT_EQ("\\xed\\xa0\\x80", Printable("\xed\xa0\x80"));                    // a surrogate
}

TEST(Printable, BufferKeepsCharactersTogether) {
  std::ostringstream out;
  PrintableBuffer buffer(out.rdbuf());
  std::ostream stream(&buffer);
  stream << '\xcf' << '\x80' << " \x1b\nand";
  EXPECT_EQ("π \\x1b\n", out.str());
  stream << std::flush;
  EXPECT_EQ("π \\x1b\nand", out.str());
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
