// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_parse.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <mutex>
#include <stdexcept>

namespace contact_flow {
namespace {

/// Keeps what urdfdom would print.
class LogKeeper : public console_bridge::OutputHandler {
 public:
  LogKeeper() { console_bridge::useOutputHandler(this); }
  ~LogKeeper() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && text_.size() < 1000) {
      text_ += (text_.empty() ? "" : "; ") + text;
    }
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct SilentLog {
  SilentLog() { console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE); }
  ~SilentLog() { console_bridge::setLogLevel(level); }
  const console_bridge::LogLevel level = console_bridge::getLogLevel();
};

/// Parses once, under the log's lock; what urdfdom complains of is an error.
urdf::ModelInterfaceSharedPtr ParseLoudly(const std::string& text) {
  LogKeeper log;
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
  if (!model) FailUrdf(log.text().empty() ? "it cannot be parsed" : log.text());
  if (!log.text().empty()) FailUrdf(log.text());
  return model;
}

}  // namespace

void FailUrdf(const std::string& what) { throw std::invalid_argument("URDF: " + what); }

urdf::ModelInterfaceSharedPtr ParseByUrdfdom(const std::string& text) {
  static std::mutex mutex;  // urdfdom's log is one for all threads
  const std::lock_guard<std::mutex> lock(mutex);
  try {
    if (text.find('%') == std::string::npos) return ParseLoudly(text);
    // urdfdom takes some texts of the file for format strings of its log: it only gets to complain
    // of a copy without them, and reads the file itself with its log shut.
    std::string harmless = text;
    std::replace(harmless.begin(), harmless.end(), '%', '_');
    ParseLoudly(harmless);
    const SilentLog silent;
    const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
    if (!model) FailUrdf("it cannot be parsed");
    return model;
  } catch (const std::invalid_argument&) {
    throw;
  } catch (const std::exception& error) {
    FailUrdf(error.what());
  }
}

}  // namespace contact_flow
