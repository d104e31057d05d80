// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace contact_flow {
namespace {

[[noreturn]] void Fail(const std::string& path, const std::string& reason) {
  throw std::invalid_argument(path + ": cannot be read: " + reason);
}

struct Descriptor {
  explicit Descriptor(int number) : fd(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  const int fd;
};

}  // namespace

std::string ReadTextFile(const std::string& path, std::size_t longest) {
  // Without O_NONBLOCK a FIFO would not even be opened.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (file.fd < 0) Fail(path, std::strerror(errno));
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) Fail(path, std::strerror(errno));
  if (!S_ISREG(status.st_mode)) Fail(path, "it is no regular file");
  std::string text;
  std::vector<char> part(1 << 16);
  while (text.size() <= longest) {
    const ssize_t n = ::read(file.fd, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) Fail(path, std::strerror(errno));
    if (n == 0) break;
    text.append(part.data(), static_cast<std::size_t>(n));
  }
  if (text.size() > longest + 1) text.resize(longest + 1);
  return text;
}

YAML::Node ParseYamlDocument(const std::string& text) {
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.empty()) return YAML::Node();
  if (documents.size() > 1) {
    const YAML::Mark mark = documents[1].Mark();
    throw std::invalid_argument("it holds " + std::to_string(documents.size()) +
                                " YAML documents, the second about line " +
                                std::to_string(mark.line + 1) + ": give one");
  }
  return documents.front();
}

}  // namespace contact_flow
