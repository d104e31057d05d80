// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/configuration.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

namespace contact_flow {
namespace {

/// What reading the text throws; "" when it reads.
std::string Error(const std::string& text) {
  try {
    ParseConfiguration(YAML::Load(text));
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

testing::AssertionResult Says(const std::string& text, const std::vector<std::string>& parts) {
  const std::string error = Error(text);
  for (const std::string& part : parts) {
    if (error.find(part) == std::string::npos) {
      return testing::AssertionFailure() << "'" << error << "' does not say '" << part << "'";
    }
  }
  return testing::AssertionSuccess();
}

TEST(Configuration, NothingAskedIsTheDefault) {
  const Configuration c = ParseConfiguration(YAML::Load(""));
  EXPECT_EQ(c.model, "soft_biped");
  EXPECT_TRUE(c.parameters.empty());
  EXPECT_EQ(c.options.relative_tolerance, SimulateOptions().relative_tolerance);
  EXPECT_EQ(c.derivative_options.max_pieces, BDerivativeOptions().max_pieces);
}

TEST(Configuration, ReadsEveryKindOfNumber) {
  const Configuration c = ParseConfiguration(YAML::Load(R"(
model: rigid_biped
parameters: {body_mass: 2, gravity: "9.81", leg_length: 5e-1}
options: {relative_tolerance: 1e-10, absolute_tolerance: '1e-11', max_steps: 1e5,
          impact_law: projection, method: implicit}
derivative_options: {tolerance: 1e-8, max_activations_for_pieces: 5}
)"));
  EXPECT_EQ(c.model, "rigid_biped");
  EXPECT_EQ(c.parameters,
            (ParameterValues{{"body_mass", 2}, {"gravity", 9.81}, {"leg_length", 0.5}}));
  EXPECT_EQ(c.options.relative_tolerance, 1e-10);
  EXPECT_EQ(c.options.absolute_tolerance, 1e-11);
  EXPECT_EQ(c.options.max_steps, 100000);
  EXPECT_EQ(c.options.impact_law, ImpactLaw::kProjection);
  EXPECT_EQ(c.options.method, IntegrationMethod::kImplicit);
  EXPECT_EQ(c.derivative_options.tolerance, 1e-8);
  EXPECT_EQ(c.derivative_options.max_activations_for_pieces, 5);
}

TEST(Configuration, NamesTheUnknownKeyTheNearestAndTheLine) {
  EXPECT_TRUE(Says("modell: soft_biped", {"modell", "'model'", "line 1"}));
  EXPECT_TRUE(Says("model: soft_biped\noptions:\n  relative_tolerence: 1e-9\n",
                   {"options", "relative_tolerence", "'relative_tolerance'", "line 3"}));
  EXPECT_TRUE(
      Says("options: {impact_law: projektion}", {"impact_law", "projektion", "projection"}));
  EXPECT_TRUE(Says("options: {method: implizit}", {"method", "implizit", "implicit"}));
}

TEST(Configuration, NamesTheKeyOfAWrongValue) {
  EXPECT_TRUE(
      Says("parameters: {stiffness: soft}", {"parameters/stiffness", "'soft'", "a number"}));
  EXPECT_TRUE(Says("parameters: {stiffness: .nan}", {"parameters/stiffness", ".nan"}));
  EXPECT_TRUE(Says("parameters: {stiffness: 1e999}", {"parameters/stiffness", "finite"}));
  EXPECT_TRUE(Says("parameters: {stiffness: true}", {"parameters/stiffness", "'true'"}));
  EXPECT_TRUE(Says("parameters: {stiffness: [1, 2]}", {"parameters/stiffness", "a list"}));
  EXPECT_TRUE(Says("parameters: [1]", {"parameters", "a list", "expected a map"}));
  EXPECT_TRUE(Says("parameters: {stiffness: 1, stiffness: 2}", {"stiffness", "twice"}));
  EXPECT_TRUE(Says("options: {max_steps: 1.5}", {"options/max_steps", "1.5", "whole number"}));
  EXPECT_TRUE(Says("options: {max_steps: 0}", {"options/max_steps", "0"}));
  EXPECT_TRUE(Says("options: {relative_tolerance: -1}", {"relative_tolerance", "-1"}));
  EXPECT_TRUE(Says("options: {max_seconds: 1e9}", {"max_seconds", "3600"}));
  EXPECT_TRUE(Says("derivative_options: {max_activations_for_pieces: 99}", {"max_activations"}));
  EXPECT_TRUE(Says("derivative_options: {tolerance: 0}", {"derivative_options/tolerance", "0"}));
}

TEST(Configuration, ReadsOnTopOfAnother) {
  Configuration base;
  base.model = "rigid_biped";
  base.parameters = {{"gravity", 2}, {"body_mass", 3}};
  base.options.max_step = 0.5;
  MapReader reader(YAML::Load("parameters: {gravity: 4}"), "");
  const Configuration c = ReadConfiguration(&reader, base);
  EXPECT_EQ(c.model, "rigid_biped");
  EXPECT_EQ(c.parameters, (ParameterValues{{"gravity", 4}, {"body_mass", 3}}));
  EXPECT_EQ(c.options.max_step, 0.5);
}

TEST(Configuration, MalformedFileNamesPathAndLine) {
  const std::string path = testing::TempDir() + "malformed.yaml";
  std::ofstream(path) << "model: soft_biped\nparameters: {stiffness: 1\noptions: }\n";
  try {
    LoadConfiguration(path);
    FAIL() << "malformed YAML was read";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("line 3"), std::string::npos) << error.what();
  }
  std::remove(path.c_str());
  EXPECT_THROW(LoadConfiguration("/nowhere/at/all.yaml"), std::invalid_argument);
}

/// The files of config/ say every parameter of their model, each with its default.
TEST(Configuration, ShippedFilesAreComplete) {
  for (const std::string& name : ModelNames()) {
    const std::string path =
        std::string(CONTACT_FLOW_TEST_DATA) + "/../../config/" + name + ".yaml";
    SCOPED_TRACE(path);
    const Configuration c = LoadConfiguration(path);
    EXPECT_EQ(c.model, name);
    const auto system = MakeModel(name);
    EXPECT_EQ(c.parameters.size(), system->description().parameters.size());
    for (const Parameter& p : system->description().parameters) {
      ASSERT_TRUE(c.parameters.count(p.name)) << p.name;
      EXPECT_EQ(c.parameters.at(p.name), p.value) << p.name;
    }
    EXPECT_NO_THROW(MakeModel(c.model, c.parameters));
  }
}

TEST(Configuration, ShippedOptionsAreTheDefaults) {
  const Configuration c =
      LoadConfiguration(std::string(CONTACT_FLOW_TEST_DATA) + "/../../config/options.yaml");
  const SimulateOptions o;
  EXPECT_EQ(c.options.relative_tolerance, o.relative_tolerance);
  EXPECT_EQ(c.options.absolute_tolerance, o.absolute_tolerance);
  EXPECT_EQ(c.options.max_step, o.max_step);
  EXPECT_EQ(c.options.simultaneity_tolerance, o.simultaneity_tolerance);
  EXPECT_EQ(c.options.gap_tolerance, o.gap_tolerance);
  EXPECT_EQ(c.options.speed_tolerance, o.speed_tolerance);
  EXPECT_EQ(c.options.zeno_interval, o.zeno_interval);
  EXPECT_EQ(c.options.max_steps, o.max_steps);
  EXPECT_EQ(c.options.max_events, o.max_events);
  EXPECT_EQ(c.options.max_seconds, o.max_seconds);
  EXPECT_EQ(c.options.impact_law, o.impact_law);
  EXPECT_EQ(c.options.method, o.method);
  const BDerivativeOptions b;
  EXPECT_EQ(c.derivative_options.tolerance, b.tolerance);
  EXPECT_EQ(c.derivative_options.kink_tolerance, b.kink_tolerance);
  EXPECT_EQ(c.derivative_options.max_activations_for_pieces, b.max_activations_for_pieces);
  EXPECT_EQ(c.derivative_options.max_pieces, b.max_pieces);
}

}  // namespace
}  // namespace contact_flow
