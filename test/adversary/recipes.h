// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "test/adversary/draw.h"
#include "test/adversary/rescaled_system.h"

namespace contact_flow {
namespace adversary {

/// How the constraints of an event are coupled in the kinetic metric.
enum class Coupling { kBlocks, kOrthogonal, kAttracting, kAny, kDegenerate, kWeak, kParallel };

/// What a generator asks for; the rest is drawn.
struct Recipe {
  Coupling coupling = Coupling::kOrthogonal;
  int hits = 2, rests = 0, touches = 0, others = 0;  // constraints
  double plastic = 0.5;                              // share of systems with γ = 0
  double curvature = 0.2;                            // of gaps
  double mass_slope = 0.1;
  bool clock = false;
  int bumps = 0, waves = 0;           // forces
  int hills = 0, ripples = 0;         // of gaps: bumps, waves
  bool delays = false;                // the hits come one after another, nearly
  bool vanish = false;                // forces of resting contacts vanish at the event
  bool start = false;                 // the run starts at the event
  bool inputs = false;                // change at or near the event
  bool graze = false;                 // one constraint is hit slowly
  double before = 0.25, after = 0.3;  // [s]
  double press = 1;                   // typical load on contacts
  bool idle = false;                  // no forces but the load on contacts
  double gyration = 0;                // forces linear in velocities, which release contacts
};

/// G of k constraints, normalized to G_ii = 1: positive definite [k×k].
Matrix DrawCoupling(Coupling kind, int k, Draw* draw);
/// 0 where plastic; else 0, 1e-6, 1, or anything between 0.1 and 1.
double DrawRestitution(bool plastic, Draw* draw);
/// For half of the cases, the same units; for others, units up to 1e8 times as large or small, or
/// masses of very different size; then coordinates and constraints change places.
Units DrawUnits(int d, int n, Draw* draw);

/// By name, what each generator asks for.
using RecipeMaker = Recipe (*)(Draw*);
const std::vector<std::pair<std::string, RecipeMaker>>& Recipes();

}  // namespace adversary
}  // namespace contact_flow
