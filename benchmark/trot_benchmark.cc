// SPDX-License-Identifier: BSD-3-Clause
//
//   trot_benchmark                                          prints the report
//   trot_benchmark --loop plain|fehlberg78|jacobian A|B N   does one thing N times, for a profiler
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

#include "peer.h"
#include "sections.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kLoopTolerance = 1e-10;
constexpr double kLargestJacobianA = 9, kLargestJacobianB = 4.5;  // [plain runs]

int Loop(const std::string& what, const Scenario& scenario, int count) {
  std::unique_ptr<Peer> peer;
  if (what == "plain") peer = MakeContactFlow(scenario);
  if (what == "fehlberg78") peer = MakeOdeintFehlberg78(scenario);
  const auto jacobian = what == "jacobian" ? MakeContactFlowJacobian(scenario) : nullptr;
  if (peer == nullptr && jacobian == nullptr) {
    std::fprintf(stderr, "--loop takes plain, fehlberg78 or jacobian, not '%s'\n", what.c_str());
    return 2;
  }
  for (int k = 0; k < count; ++k) {
    if (peer != nullptr) peer->Run(kLoopTolerance);
    if (jacobian != nullptr) jacobian->Run(kLoopTolerance);
  }
  return 0;
}

int Report() {
#ifndef NDEBUG
  std::printf("NOTE: built without NDEBUG; the figures mean something in a Release build only\n");
#endif
  const Scenario A = TiltedTrot(), B = OscillatingTrot(), simultaneous = SimultaneousTrot();
  Requirements requirements;
  ReportPlainRuns(B, &requirements);
  ReportPlainRuns(A, &requirements);
  ReportJacobians(A, kLargestJacobianA, &requirements);
  ReportJacobians(B, kLargestJacobianB, &requirements);
  ReportPieces(simultaneous, &requirements);
  ReportAllocations(A, &requirements);
  ReportAllocations(B, &requirements);
  requirements.Print();
  return 0;
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  namespace benchmark = contact_flow::benchmark;
  if (argc == 5 && std::strcmp(argv[1], "--loop") == 0) {
    const bool first = std::strcmp(argv[3], "A") == 0;
    return benchmark::Loop(argv[2], first ? benchmark::TiltedTrot() : benchmark::OscillatingTrot(),
                           std::atoi(argv[4]));
  }
  if (argc != 1) {
    std::fprintf(stderr, "usage: %s [--loop plain|fehlberg78|jacobian A|B N]\n", argv[0]);
    return 2;
  }
  return benchmark::Report();
}
