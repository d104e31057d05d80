// SPDX-License-Identifier: BSD-3-Clause
// Compiled for AVX-512 (cmake/core.cmake), and called where the machine has it.
#include "lanes.h"

#if defined(__AVX512F__) && !defined(__clang__)
#include "lane_models.h"
#endif

namespace contact_flow {

LaneStepperMaker FindLanesAvx512(const char* model) {
#if defined(__AVX512F__) && !defined(__clang__)
  return FindLanes<8>(model);
#else
  return model == nullptr ? nullptr : nullptr;
#endif
}

}  // namespace contact_flow
