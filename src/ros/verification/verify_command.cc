// SPDX-License-Identifier: BSD-3-Clause
// The command verify_bag.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <string>
#include <vector>

#include "contact_flow/ros/model_plugins.h"
#include "printable.h"
#include "verify.h"

#ifdef CONTACT_FLOW_COVERAGE
extern "C" void __gcov_dump();  // writes gcov's counters
#endif

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr int kVerified = 0, kDiffers = 1, kWrongUse = 2, kIncomplete = 3;

const char kHelp[] =
    "Usage: verify_bag [--key PUBLIC.pem] [--max-seconds S] [--max-megabytes M]\n"
    "                  [--plugin PACKAGE/CLASS] BAG...\n"
    "Follows the hash chain of bags recorded by contact_flow_node, computes everything in them\n"
    "again and compares it bit for bit. Parts of a recording are given together, in their order.\n"
    "  --key            Ed25519 key (openssl pkey -pubout) that must have signed every link\n"
    "  --max-seconds    for repeating one result, 3600 by default\n"
    "  --max-megabytes  of memory, 8192 by default\n"
    "  --plugin         class of pluginlib with models, as the node's ~model_plugins; repeatable\n"
    "Exit code: 0 when something was verified, nothing differs or is missing; 1 when something\n"
    "differs or is damaged, a bag cannot be read, or there is nothing to verify; 2 for wrong use;\n"
    "3 when nothing differs, but not everything could be verified: INCOMPLETE.\n";

struct Command {
  BagVerifier::Options options;
  double max_megabytes = 8192;
  std::vector<std::string> plugins;
  std::vector<std::string> paths;
};

double Number(const std::string& option, const std::string& text) {
  std::size_t end = 0;
  double value = 0;
  try {
    value = std::stod(text, &end);
  } catch (const std::logic_error&) {
  }
  if (end != text.size() || !(value > 0) || !(value <= 1e9)) {
    throw std::invalid_argument(option + " is '" + text + "', expected a number up to 1e9");
  }
  return value;
}

Command Read(const std::vector<std::string>& arguments) {
  Command command;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument.compare(0, 2, "--") != 0) {
      command.paths.push_back(argument);
      continue;
    }
    if (argument != "--key" && argument != "--max-seconds" && argument != "--max-megabytes" &&
        argument != "--plugin") {
      throw std::invalid_argument(argument + " is no option");
    }
    if (i + 1 == arguments.size()) throw std::invalid_argument(argument + " wants a value");
    const std::string& value = arguments[++i];
    if (argument == "--key") command.options.key = SigningKey::ReadPublic(value);
    if (argument == "--max-seconds") command.options.max_seconds = Number(argument, value);
    if (argument == "--plugin") command.plugins.push_back(value);
    if (argument == "--max-megabytes") command.max_megabytes = Number(argument, value);
  }
  if (command.paths.empty()) throw std::invalid_argument("no bag is given");
  return command;
}

int Verify(const Command& command) {
  BagVerifier verifier(&std::cout, command.options);
  bool readable = true;
  for (const std::string& path : command.paths) {
    try {
      verifier.Take(path);
    } catch (const std::exception& error) {
      std::cout << path << ": " << error.what() << "\n";
      readable = false;
    }
  }
  const Verification total = verifier.Finish();
  std::cout << total.verified << " verified, " << total.differing << " differ, " << total.skipped
            << " skipped: ";
  if (!readable || total.differing > 0) {
    std::cout << "NOT what was recorded" << std::endl;
    return kDiffers;
  }
  if (total.verified == 0) {
    std::cout << "nothing to verify" << std::endl;
    return kDiffers;
  }
  if (total.gaps > 0) {
    std::cout << "INCOMPLETE, for " << total.gaps << " reasons" << std::endl;
    return kIncomplete;
  }
  std::cout << "all is as recorded" << std::endl;
  return kVerified;
}

/// Ends a child, which has no business with what others do at exit.
[[noreturn]] void Leave(int code) {
  std::cout.flush();
#ifdef CONTACT_FLOW_COVERAGE
  __gcov_dump();
#endif
  ::_exit(code);
}

/// Whatever a file makes of the process that reads it, this one answers.
int VerifyInChild(const Command& command) {
  std::cout.flush();
  const pid_t child = ::fork();
  if (child < 0) {
    std::cout << "fork: " << std::strerror(errno) << std::endl;
    return kDiffers;
  }
  if (child == 0) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadows are larger
    const auto bytes = static_cast<rlim_t>(command.max_megabytes * (1 << 20));
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &limit);
#endif
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    static PrintableBuffer printable(std::cout.rdbuf());  // names are those of the file
    std::cout.rdbuf(&printable);
    int code = kDiffers;
    try {
      LoadModelPlugins(command.plugins);
    } catch (const std::invalid_argument& error) {
      std::cout << error.what() << std::endl;
      Leave(kWrongUse);
    }
    try {
      code = Verify(command);
    } catch (const std::exception& error) {
      std::cout << error.what() << std::endl;
    }
    Leave(code);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  std::cout << "the verification ended by signal " << WTERMSIG(status) << " ("
            << ::strsignal(WTERMSIG(status)) << "): NOTHING is verified" << std::endl;
  return kDiffers;
}

}  // namespace

int RunVerifyBag(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  for (const std::string& argument : arguments) {
    if (argument != "--help" && argument != "-h") continue;
    std::cout << kHelp;
    return kVerified;
  }
  try {
    return VerifyInChild(Read(arguments));
  } catch (const std::invalid_argument& error) {
    std::cerr << error.what() << "\n" << kHelp;
    return kWrongUse;
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
