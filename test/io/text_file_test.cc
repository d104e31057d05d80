// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/text_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "contact_flow/io/configuration.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "test/refusal.h"

namespace contact_flow {
namespace {

using test::RefusalOf;

TEST(TextFile, ReadsRegularFilesUpToALength) {
  const std::string path = testing::TempDir() + "/text_file_test";
  std::ofstream(path) << std::string(100, 'x');
  EXPECT_EQ(100u, ReadTextFile(path, 1000).size());
  EXPECT_EQ(11u, ReadTextFile(path, 10).size()) << "one more, so that it is seen to be too long";
  ::unlink(path.c_str());
  EXPECT_NE("", RefusalOf([&] { ReadTextFile(path, 10); }));
}

/// A FIFO without a writer keeps whoever opens it waiting for ever: the start hung.
TEST(TextFile, AFifoIsRefusedAtOnce) {
  const std::string path = testing::TempDir() + "/fifo";
  ::unlink(path.c_str());
  ASSERT_EQ(0, ::mkfifo(path.c_str(), 0600));
  const std::string expected = path + ": cannot be read: it is no regular file";
  EXPECT_EQ(expected, RefusalOf([&] { ReadRobotTexts(path); }));
  EXPECT_EQ(expected, RefusalOf([&] { LoadConfiguration(path); }));
  ::unlink(path.c_str());
  EXPECT_NE("", RefusalOf([] { ReadTextFile("/", 10); }));
  EXPECT_NE("", RefusalOf([] { ReadTextFile("/dev/zero", 10); }));
}

TEST(YamlDocument, ASecondOneIsNotIgnored) {
  EXPECT_TRUE(ParseYamlDocument("").IsNull());
  EXPECT_TRUE(ParseYamlDocument("---\na: 1\n...\n").IsMap());
  EXPECT_NE(std::string::npos, RefusalOf([] {
                                 ParseYamlDocument("a: 1\n---\nb: 2\n");
                               }).find("more than one YAML document"));
}

/// 50 000 attributes of one element took 19 s.
TEST(UrdfText, AttributesOfAnElementAreCounted) {
  std::string urdf = "<robot name=\"r\"><link name=\"a\"";
  for (int k = 0; k < 50000; ++k) urdf += " a" + std::to_string(k) + "=\"\"";
  urdf += "/></robot>";
  EXPECT_NE(std::string::npos,
            RefusalOf([&] { CheckUrdfText(urdf); }).find("more than 100 attributes"));
}

}  // namespace
}  // namespace contact_flow
