// SPDX-License-Identifier: BSD-3-Clause
// The target under libFuzzer: robot_fuzzer CORPUS -max_total_time=600; --seeds CORPUS writes the
// seeds there.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "test/fuzz/robot_input.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc == 3 && std::strcmp((*argv)[1], "--seeds") == 0) {
    int k = 0;
    for (const std::string& seed : contact_flow::fuzz::Seeds()) {
      std::ofstream((*argv)[2] + std::string("/seed_") + std::to_string(k++)) << seed;
    }
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  contact_flow::fuzz::Load(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
