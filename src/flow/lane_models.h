// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstring>

#include "lane_model.h"
#include "src/model/example/driven_ball.h"
#include "src/model/example/hopping_trot.h"
#include "src/model/example/soft_biped.h"
#include "src/model/example/steered_trot.h"
#include "src/model/example/wall_and_floor.h"

namespace contact_flow {
namespace {

/// Of the models here the one with this name; lanes.cc checks that a system is of this type.
template <int W>
LaneStepperMaker FindLanes(const char* model) {
  const auto is = [model](const char* name) { return std::strcmp(model, name) == 0; };
  if (is(example::SoftBiped::kName)) return &MakeModelLanes<example::SoftBiped, W>;
  if (is(example::HoppingTrot::kName)) return &MakeModelLanes<example::HoppingTrot, W>;
  if (is(example::SteeredTrot::kName)) return &MakeModelLanes<example::SteeredTrot, W>;
  if (is(example::DrivenBall::kName)) return &MakeModelLanes<example::DrivenBall, W>;
  if (is(example::WallAndFloor::kName)) return &MakeModelLanes<example::WallAndFloor, W>;
  return nullptr;
}

}  // namespace
}  // namespace contact_flow
