// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/model_library.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "test/refusal.h"

namespace contact_flow {
namespace {

std::string Refused(const std::string& name, const ParameterValues& parameters) {
  return test::RefusalOf([&] { MakeModel(name, parameters); });
}

TEST(ModelLibrary, SetsParametersByName) {
  const auto system = MakeModel("soft_biped", {{"stiffness", 30}});
  for (const Parameter& parameter : system->description().parameters) {
    const double wanted = parameter.name == "stiffness" ? 30 : parameter.value;
    EXPECT_EQ(wanted, parameter.value) << parameter.name;
  }
  EXPECT_EQ(0.2, MakeModel("ball_in_corner", {{"restitution", 0.2}})->restitution()(1));
}

TEST(ModelLibrary, RefusesUnknownNamesWithTheNearest) {
  EXPECT_EQ("unknown model 'soft_bipod'; did you mean 'soft_biped'?", Refused("soft_bipod", {}));
  EXPECT_EQ("model 'soft_biped': unknown parameter 'stifness'; did you mean 'stiffness'?",
            Refused("soft_biped", {{"stifness", 1}}));
}

TEST(ModelLibrary, RefusesValuesOutOfRange) {
  EXPECT_NE(std::string::npos, Refused("soft_biped", {{"body_mass", -2}}).find("'body_mass'"));
  EXPECT_NE(std::string::npos, Refused("soft_biped", {{"body_mass", -2}}).find("-2"));
  EXPECT_NE("", Refused("ball_in_corner", {{"restitution", 1.5}}));
  EXPECT_NE("", Refused("ball_in_corner", {{"gravity", std::nan("")}}));
  EXPECT_NE("", Refused("ball_in_corner", {{"gravity", std::numeric_limits<double>::infinity()}}));
}

}  // namespace
}  // namespace contact_flow
