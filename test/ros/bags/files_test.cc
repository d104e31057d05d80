// SPDX-License-Identifier: BSD-3-Clause
// Where bags are written, and what becomes of them when the disk is full.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "src/ros/recording/bag_file.h"
#include "src/ros/recording/recorder.h"
#include "src/ros/simulator/stream_recorder.h"
#include "test/ros/bags/sample.h"

namespace contact_flow {
namespace ros_interface {
namespace {

namespace fs = std::filesystem;

std::string What(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

class Files : public testing::Test {
 protected:
  Files() {
    std::string name = testing::TempDir() + "filesXXXXXX";
    root_ = ::mkdtemp(&name[0]);
    inside_ = root_ + "/inside";
    fs::create_directory(inside_);
    std::ofstream(root_ + "/precious") << "precious";
  }
  ~Files() override { fs::remove_all(root_); }

  RecordingPlan Plan() { return RecordingPlan("online", "/node", &connections_); }
  std::string Precious() { return ReadRegularFile(root_ + "/precious"); }

  std::string root_, inside_;
  BagConnections connections_{"/node"};
};

/// No file grows beyond `bytes` while this lives: a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_;
};

TEST_F(Files, LinksAndPipesOfTheSameNameAreRefused) {
  const std::string path = inside_ + "/a.bag";
  for (const bool dangling : {false, true}) {
    fs::create_symlink(dangling ? root_ + "/nothing" : root_ + "/precious", path);
    Recorder recorder(inside_);
    EXPECT_NE(What([&] { recorder.Start("a", Plan(), ros::Time(1, 0)); }).find("exists"),
              std::string::npos);
    StreamRecorder stream(inside_);
    EXPECT_NE(What([&] { stream.Start("a", Plan(), ros::Time(1, 0)); }).find("exists"),
              std::string::npos);
    fs::remove(path);
  }
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  Recorder recorder(inside_);
  EXPECT_NE(What([&] { recorder.Start("a", Plan(), ros::Time(1, 0)); }).find("exists"),
            std::string::npos);
  EXPECT_EQ(Precious(), "precious");
  EXPECT_FALSE(fs::exists(root_ + "/nothing"));
}

// What once was the temporary name is no way out, either; and nothing blocks on it.
TEST_F(Files, NamesOfTemporariesCannotBeForeseen) {
  fs::create_symlink(root_ + "/precious", inside_ + "/a.bag.writing");
  ASSERT_EQ(::mkfifo((inside_ + "/b.bag.writing").c_str(), 0600), 0);
  for (const char* name : {"a", "b"}) {
    Recorder recorder(inside_);
    recorder.Start(name, Plan(), ros::Time(1, 0));
    recorder.Write({SampleEntry(&connections_, 1)}, ros::Time(2, 0));
    EXPECT_EQ(recorder.Stop().error, "");
    EXPECT_EQ(Complaint(ReadRegularFile(inside_ + "/" + name + ".bag")), "");
  }
  EXPECT_EQ(Precious(), "precious");
}

TEST_F(Files, ALinkPutThereLaterIsNotFollowed) {
  Recorder recorder(inside_);
  recorder.Start("a", Plan(), ros::Time(1, 0));
  fs::remove(inside_ + "/a.bag");
  fs::create_symlink(root_ + "/precious", inside_ + "/a.bag");
  EXPECT_NE(What([&] {
              recorder.Write({SampleEntry(&connections_, 1)}, ros::Time(2, 0));
            }).find("no regular file"),
            std::string::npos);
  EXPECT_EQ(Precious(), "precious");
}

TEST_F(Files, WhatWasLeftOverIsTold) {
  EXPECT_EQ(LeftOver(inside_), "");
  std::ofstream(inside_ + "/a.bag.writing.0123456789abcdef") << "#ROSBAG";
  EXPECT_EQ(LeftOver(inside_), "a.bag.writing.0123456789abcdef");
  const NewFile busy(inside_ + "/b.bag.writing.0123456789abcdef");  // somebody is writing
  EXPECT_EQ(LeftOver(inside_), "a.bag.writing.0123456789abcdef");
}

TEST_F(Files, ADirectoryThatMayNotBeWrittenIsSaid) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  fs::permissions(inside_, fs::perms::owner_read | fs::perms::owner_exec);
  Recorder recorder(inside_);
  EXPECT_NE(What([&] { recorder.Start("a", Plan(), ros::Time(1, 0)); }).find("Permission denied"),
            std::string::npos);
}

TEST_F(Files, AFullDiskLeavesTheResultsBefore) {
  Recorder recorder(inside_);
  recorder.Start("a", Plan(), ros::Time(1, 0));
  recorder.Write({SampleEntry(&connections_, 1)}, ros::Time(2, 0));
  const std::string path = inside_ + "/a.bag";
  const std::string before = ReadRegularFile(path);
  {
    const FullDisk full(before.size() + 10);
    EXPECT_EQ(What([&] { recorder.Write({SampleEntry(&connections_, 2)}, ros::Time(3, 0)); }),
              path + ": disk full (File too large)");
    EXPECT_EQ(ReadRegularFile(path), before);
  }
  recorder.Write({SampleEntry(&connections_, 4)}, ros::Time(4, 0));
  EXPECT_EQ(recorder.Stop().error, "");
  EXPECT_EQ(Complaint(ReadRegularFile(path)), "");
  EXPECT_EQ(std::distance(fs::directory_iterator(inside_), {}), 1);
}

TEST_F(Files, ResultsThatComeTogetherHaveOneLink) {
  Recorder recorder(inside_);
  recorder.Start("a", Plan(), ros::Time(1, 0));
  const std::string path = inside_ + "/a.bag";
  const auto links = [&] {
    const std::string bytes = ReadRegularFile(path);
    int count = 0;
    for (const BagMessage& message : ReadBag(bytes).messages) count += Is<RecordingLink>(message);
    return count;
  };
  const int before = links();
  const std::vector<Recorder::Result> three = {{{SampleEntry(&connections_, 1)}, ros::Time(2, 0)},
                                               {{SampleEntry(&connections_, 2)}, ros::Time(3, 0)},
                                               {{SampleEntry(&connections_, 3)}, ros::Time(4, 0)}};
  recorder.Write(three);
  EXPECT_EQ(links(), before + 1);
  const std::string kept = ReadRegularFile(path);
  {
    const FullDisk full(kept.size() + 10);
    EXPECT_NE(What([&] { recorder.Write(three); }).find("disk full"), std::string::npos);
  }
  EXPECT_EQ(ReadRegularFile(path), kept) << "none of them";
  const Recorder::Summary summary = recorder.Stop();
  EXPECT_EQ(summary.error, "");
  EXPECT_EQ(summary.results, 3u);
  EXPECT_EQ(links(), before + 2) << "and that of the end";
  EXPECT_EQ(Complaint(ReadRegularFile(path)), "");
}

TEST_F(Files, AFullDiskEndsAStreamAndSaysWhatIsMissing) {
  StreamRecorder stream(inside_);
  const std::string path = stream.Start("a", Plan(), ros::Time(1, 0));
  std::size_t written = 0;
  {
    const FullDisk full(30000);
    while (stream.Recording() && written < 100000) {
      stream.Write(ros::Time(2, static_cast<unsigned>(written)), SampleEntry(&connections_, 1));
      ++written;
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
    for (int k = 0; k < 10; ++k) stream.Write(ros::Time(9, 0), SampleEntry(&connections_, 1));
  }
  const std::string error = stream.Error();
  EXPECT_NE(error.find(path + ": disk full"), std::string::npos) << error;
  EXPECT_NE(error.find("NOT RECORDED"), std::string::npos) << error;
  EXPECT_NE(What([&] { stream.Stop(); }).find("disk full"), std::string::npos);
  // What there is can be read, and what is there and what is lost is everything.
  const std::string bytes = ReadRegularFile(path);
  std::size_t found = 0;
  for (const BagMessage& message : ReadBag(bytes).messages) found += Is<SimulatorInput>(message);
  const std::size_t lost = std::stoul(error.substr(error.find("; ", error.find("ends here")) + 2));
  EXPECT_EQ(found + lost, written + 10);
  EXPECT_EQ(Complaint(bytes).compare(0, 3, "gap"), 0);
  // And it can begin anew.
  stream.Start("b", Plan(), ros::Time(20, 0));
  stream.Write(ros::Time(21, 0), SampleEntry(&connections_, 1));
  EXPECT_EQ(stream.Stop().size(), 1u);
  EXPECT_EQ(Complaint(ReadRegularFile(inside_ + "/b.bag")), "");
}

TEST_F(Files, AStreamIsEndedByOneThreadAndWrittenByAnother) {
  StreamRecorder stream(inside_);
  EXPECT_EQ(What([&] { stream.Close(); }), "not recording");
  stream.Start("a", Plan(), ros::Time(1, 0));
  for (unsigned k = 0; k < 100; ++k) stream.Write(ros::Time(2, k), SampleEntry(&connections_, 1));
  stream.Close();
  stream.Write(ros::Time(3, 0), SampleEntry(&connections_, 1));  // too late: no part of it
  EXPECT_FALSE(stream.Recording());
  EXPECT_EQ(What([&] { stream.Close(); }), "not recording");
  EXPECT_NE(What([&] { stream.Start("b", Plan(), ros::Time(4, 0)); }).find("still being written"),
            std::string::npos);
  std::vector<std::string> paths;
  std::thread([&] { paths = stream.Finish(); }).join();
  ASSERT_EQ(paths.size(), 1u);
  const std::string bytes = ReadRegularFile(paths.front());
  std::size_t found = 0;
  for (const BagMessage& message : ReadBag(bytes).messages) found += Is<SimulatorInput>(message);
  EXPECT_EQ(found, 100u);
  EXPECT_EQ(Complaint(bytes), "");
  stream.Start("b", Plan(), ros::Time(4, 0));
  EXPECT_EQ(stream.Stop().size(), 1u);
}

TEST_F(Files, PartsOfAStreamAreOneChain) {
  StreamRecorder stream(inside_, 20000);
  stream.Start("a", Plan(), ros::Time(1, 0));
  for (unsigned k = 0; k < 300; ++k) stream.Write(ros::Time(2, k), SampleEntry(&connections_, 1));
  const std::vector<std::string> paths = stream.Stop();
  ASSERT_GT(paths.size(), 2u);
  ChainCheck whole(nullptr), without(nullptr);
  for (const std::string& path : paths) {
    const std::string bytes = ReadRegularFile(path);
    const BagContent bag = ReadBag(bytes);
    const ChainCheck::Report report = whole.Take(bag);
    EXPECT_TRUE(report.differences.empty() && report.gaps.empty()) << path;
    if (path != paths[1]) {
      const ChainCheck::Report later = without.Take(bag);
      EXPECT_EQ(later.gaps.empty(), path != paths[2]) << path;
      EXPECT_EQ(later.sound, path == paths[0] ? bag.messages.size() : 0) << path;
    }
  }
  EXPECT_EQ(whole.End(), "");
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
