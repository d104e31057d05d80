// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/recipes.h"

#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {

const std::vector<std::pair<std::string, RecipeMaker>>& Recipes() {
  static const std::vector<std::pair<std::string, RecipeMaker>> makers = {
      {"blocks",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kBlocks;
         r.hits = 1 + d->Below(4);
         r.rests = d->Below(3);
         return r;
       }},
      {"orthogonal",
       [](Draw* d) {
         Recipe r;
         r.hits = 1 + d->Below(4);
         r.rests = d->Below(3);
         r.others = d->Below(2);
         return r;
       }},
      {"attracting",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kAttracting;
         r.hits = 1 + d->Below(3);
         r.rests = d->Below(3);
         r.plastic = 0.95;
         return r;
       }},
      {"any",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kAny;
         r.hits = 1 + d->Below(3);
         r.rests = d->Below(4);
         return r;
       }},
      {"one_hits_resting",
       [](Draw* d) {
         Recipe r;
         r.coupling = d->Chance(0.5) ? Coupling::kAny : Coupling::kAttracting;
         r.hits = 1;
         r.rests = 1 + d->Below(4);
         r.plastic = 0.7;
         return r;
       }},
      {"degenerate",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kDegenerate;
         r.hits = 1;
         r.rests = 2 + d->Below(2);
         if (d->Chance(0.3)) std::swap(r.hits, r.rests);
         r.plastic = 0.8;
         r.curvature = r.mass_slope = d->Chance(0.5) ? 0 : 0.2;
         return r;
       }},
      {"weak",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kWeak;
         r.hits = 1 + d->Below(2);
         r.rests = d->Below(2) + (r.hits == 1 ? 1 : 0);
         r.curvature = r.mass_slope = d->Chance(0.4) ? 0 : d->Log(1e-6, 1e-2);
         return r;
       }},
      {"parallel",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kParallel;
         r.hits = 2;
         r.rests = d->Below(2);
         r.plastic = 0.9;
         return r;
       }},
      {"nearly_together",
       [](Draw* d) {
         Recipe r;
         r.coupling = d->Chance(0.5) ? Coupling::kOrthogonal : Coupling::kAttracting;
         if (d->Chance(0.3)) r.coupling = Coupling::kAny;
         r.hits = 2 + d->Below(2);
         r.rests = d->Below(2);
         r.plastic = 0.8;
         r.delays = true;
         return r;
       }},
      {"gusts_in_space",
       [](Draw* d) {
         Recipe r;
         r.hits = d->Below(3);
         r.rests = d->Below(2);
         r.others = r.hits + r.rests == 0 ? 1 : d->Below(2);
         r.bumps = 1 + d->Below(3);
         r.waves = d->Below(2);
         return r;
       }},
      {"gusts_in_time",
       [](Draw* d) {
         Recipe r;
         r.hits = d->Below(3);
         r.rests = d->Below(3);
         r.clock = true;
         r.bumps = 1 + d->Below(3);
         r.waves = d->Below(2);
         return r;
       }},
      {"height_fields",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kBlocks;
         r.hits = d->Below(2);
         r.rests = d->Below(2);
         r.others = 1 + d->Below(2);
         r.hills = d->Below(3);
         r.ripples = 1 + d->Below(2);
         return r;
       }},
      {"starts",
       [](Draw* d) {
         Recipe r;
         const Coupling kinds[] = {Coupling::kOrthogonal, Coupling::kAttracting, Coupling::kAny};
         r.coupling = kinds[d->Below(3)];
         r.start = true;
         r.hits = 0;
         r.rests = d->Below(4);
         r.touches = 1 + d->Below(2);
         r.others = d->Below(2);
         return r;
       }},
      {"vanishing",
       [](Draw* d) {
         Recipe r;
         const Coupling kinds[] = {Coupling::kOrthogonal, Coupling::kAttracting, Coupling::kAny};
         r.coupling = kinds[d->Below(3)];
         r.hits = d->Below(2);
         r.rests = 1 + d->Below(3);
         r.vanish = true;
         return r;
       }},
      {"inputs",
       [](Draw* d) {
         Recipe r;
         r.hits = 1 + d->Below(2);
         r.rests = d->Below(3);
         r.inputs = true;
         return r;
       }},
      {"bouncing",
       [](Draw* d) {
         Recipe r;
         r.hits = 1 + d->Below(2);
         r.plastic = 0.1;
         r.press = d->Log(1, 20);
         r.after = 1.5;
         return r;
       }},
      {"grazing",
       [](Draw* d) {
         Recipe r;
         r.hits = 1 + d->Below(2);
         r.rests = d->Below(2);
         r.graze = true;
         return r;
       }},
      {"long",
       [](Draw* d) {
         Recipe r;
         r.coupling = d->Chance(0.5) ? Coupling::kBlocks : Coupling::kAttracting;
         r.hits = 1 + d->Below(3);
         r.rests = d->Below(2);
         r.others = d->Below(3);
         r.after = 2;
         r.plastic = 0.9;
         r.press = 3;
         return r;
       }},
      {"touching",
       [](Draw* d) {
         Recipe r;
         r.coupling = d->Chance(0.3) ? Coupling::kOrthogonal : Coupling::kAny;
         r.hits = 1;
         r.start = false;
         r.rests = d->Below(3);
         r.touches = 0;
         r.vanish = r.rests > 0;
         r.plastic = 0.8;
         return r;
       }},
      {"regained",
       [](Draw* d) {
         Recipe r;
         r.hits = 3 + d->Below(2);
         r.rests = d->Below(2);
         r.plastic = 0.95;
         r.press = 0.5;
         r.gyration = 3;
         r.curvature = r.mass_slope = 0;
         return r;
       }},
      {"chains",
       [](Draw* d) {
         Recipe r;
         r.coupling = Coupling::kAttracting;
         r.hits = 1;
         r.rests = 1 + d->Below(3);
         r.idle = true;
         r.press = d->Chance(0.5) ? 0 : d->Log(1e-9, 1);
         r.curvature = r.mass_slope = 0;
         r.plastic = 0.5;
         return r;
       }},
      {"brushing",
       [](Draw* d) {
         Recipe r;
         r.coupling = d->Chance(0.5) ? Coupling::kOrthogonal : Coupling::kAny;
         r.hits = 1 + d->Below(2);
         r.rests = d->Below(2);
         r.touches = 1;
         r.plastic = 0.8;
         return r;
       }},
      {"coarse_gusts",
       [](Draw* d) {
         Recipe r;
         r.hits = 0;
         r.rests = d->Below(2);
         r.others = 1;
         r.clock = d->Chance(0.5);
         r.bumps = 1 + d->Below(2);
         r.before = 0.5;
         r.after = 0.5;
         return r;
       }},
  };
  return makers;
}

const std::vector<std::string>& GeneratorNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, maker] : Recipes()) all.push_back(name);
    return all;
  }();
  return names;
}

}  // namespace adversary
}  // namespace contact_flow
