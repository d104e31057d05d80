// SPDX-License-Identifier: BSD-3-Clause
#include "xacro.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "src/model/rigid_body/urdf_xacro.h"

extern char** environ;

namespace contact_flow {
namespace {

constexpr int kSeconds = 60;

struct Pipe {
  int end[2] = {-1, -1};
  ~Pipe() {
    for (int k = 0; k < 2; ++k) Close(k);
  }
  void Close(int k) {
    if (end[k] >= 0) ::close(end[k]);
    end[k] = -1;
  }
};

/// Reads both pipes to their end; false when it takes too long or says too much.
bool Drain(const Pipe (&pipes)[2], std::string (&texts)[2]) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(kSeconds);
  bool open[2] = {true, true};
  while (open[0] || open[1]) {
    pollfd polled[2];
    for (int k = 0; k < 2; ++k) polled[k] = {open[k] ? pipes[k].end[0] : -1, POLLIN, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    if (::poll(polled, 2, static_cast<int>(left.count())) < 0 && errno != EINTR) return false;
    for (int k = 0; k < 2; ++k) {
      if (!open[k] || polled[k].revents == 0) continue;
      char part[4096];
      const ssize_t n = ::read(pipes[k].end[0], part, sizeof part);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) {
        open[k] = false;
      } else {
        texts[k].append(part, static_cast<std::size_t>(n));
      }
      if (texts[k].size() > kMaxUrdfBytes) return false;
    }
  }
  return true;
}

/// Whether xacro has something to do; of a text that is no XML, whether there is a tag of xacro
/// outside of comments.
bool UsesXacro(const std::string& text) {
  if (text.find("<xacro:") == std::string::npos) return false;
  try {
    CheckUrdfText(text);
    return FindXacro(ReadXml(text)).runs;
  } catch (const std::invalid_argument&) {  // xacro tells of it
  }
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; ++at) {
    if (text.compare(at, 7, "<xacro:") == 0) return true;
    if (text.compare(at, 4, "<!--") == 0) at = text.find("-->", at);
    if (at == std::string::npos) break;
  }
  return false;
}

}  // namespace

bool IsXacro(const std::string& path, const std::string& text) {
  const std::string ending = ".xacro";
  return (path.size() > ending.size() &&
          path.compare(path.size() - ending.size(), ending.size(), ending) == 0) ||
         UsesXacro(text);
}

std::string RunXacro(const std::string& path) {
  Pipe pipes[2];  // of its output and its complaints
  for (Pipe& pipe : pipes) {
    if (::pipe2(pipe.end, O_CLOEXEC) != 0) {
      throw std::invalid_argument(path + ": xacro: " + std::strerror(errno));
    }
  }
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, pipes[0].end[1], 1);
  ::posix_spawn_file_actions_adddup2(&actions, pipes[1].end[1], 2);
  std::string program = "xacro", file = path;
  char* arguments[] = {&program[0], &file[0], nullptr};
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, "xacro", &actions, nullptr, arguments, environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    throw std::invalid_argument(
        path + " is xacro, and xacro cannot be run (" + std::strerror(failed) +
        "): install it (ros-noetic-xacro, or pip install xacro), or run `xacro " + path +
        " > robot.urdf` elsewhere");
  }
  for (Pipe& pipe : pipes) pipe.Close(1);
  std::string texts[2];
  const bool whole = Drain(pipes, texts);
  if (!whole) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (!whole) {
    throw std::invalid_argument(path + ": xacro took longer than " + std::to_string(kSeconds) +
                                " s, or answered with more than a URDF may hold");
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::invalid_argument(path + ": xacro failed: " + texts[1].substr(0, 1000));
  }
  return texts[0];
}

}  // namespace contact_flow
