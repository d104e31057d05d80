// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/parser.h>

#include <cerrno>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace contact_flow {
namespace {

[[noreturn]] void Fail(const std::string& path, const std::string& reason) {
  throw std::invalid_argument(path + ": cannot be read: " + reason);
}

/// Throws where a line up to this one, counted from 0, is indented by a tab.
void RefuseTabs(const std::string& text, int last) {
  std::istringstream lines(text);
  std::string line;
  for (int k = 0; k <= last && std::getline(lines, line); ++k) {
    const std::size_t indented = line.find_first_not_of(" \t");
    if (indented == std::string::npos || line.find('\t') > indented) continue;
    throw std::invalid_argument("line " + std::to_string(k + 1) +
                                " is indented by a tab: YAML takes spaces alone");
  }
}

/// Remembers where the last document began.
class SecondDocument : public YAML::EventHandler {
 public:
  int line() const { return line_; }

  void OnDocumentStart(const YAML::Mark& mark) override { line_ = mark.line; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  int line_ = 0;
};

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
  // Not YAML::LoadAll: of some damaged texts it makes empty documents without end.
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  SecondDocument look;
  try {
    for (int document = 0; document < 2 && parser.HandleNextDocument(look); ++document) {
      if (document == 0) continue;
      throw std::invalid_argument("it holds more than one YAML document, the second about line " +
                                  std::to_string(look.line() + 1) + ": give one");
    }
    return YAML::Load(text);
  } catch (const YAML::ParserException& error) {
    RefuseTabs(text, error.mark.line);
    throw;
  }
}

}  // namespace contact_flow
