// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/model_registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "contact_flow/model/model_library.h"
#include "contact_flow/model/model_plugin.h"
#include "test/refusal.h"

namespace contact_flow {
namespace {

/// A factory that gives what another model is.
ModelFactory Another(const std::string& model) {
  return [model](const ParameterValues& parameters) { return MakeModel(model, parameters); };
}

std::string Rejected(const std::vector<ModelEntry>& entries) {
  return test::RefusalOf([&] { RegisterModels(entries, "a test"); });
}

bool Knows(const std::string& name) {
  const std::vector<std::string> names = ModelNames();
  return std::count(names.begin(), names.end(), name) == 1;
}

// Names are not taken away again: each test has its own.

TEST(ModelRegistry, MakesWhatWasAdded) {
  EXPECT_FALSE(Knows("added_ball"));
  RegisterModels({{"added_ball", Another("bouncing_ball")}}, "a test");
  EXPECT_TRUE(Knows("added_ball"));
  EXPECT_EQ(0.25, MakeModel("added_ball", {{"restitution", 0.25}})->restitution()(0));
}

TEST(ModelRegistry, RefusesNamesThatAreTaken) {
  EXPECT_EQ("a test: model 'soft_biped' exists already, by contact_flow",
            Rejected({{"soft_biped", Another("bouncing_ball")}}));
  RegisterModels({{"taken_ball", Another("bouncing_ball")}}, "the first library");
  EXPECT_EQ("a test: model 'taken_ball' exists already, by the first library",
            Rejected({{"taken_ball", Another("corner")}}));
  EXPECT_EQ("a test: model 'twin_ball' is named twice",
            Rejected({{"twin_ball", Another("corner")}, {"twin_ball", Another("corner")}}));
  EXPECT_FALSE(Knows("twin_ball"));
}

TEST(ModelRegistry, AddsAllOrNothing) {
  EXPECT_NE("", Rejected({{"half_ball", Another("corner")}, {"corner", Another("corner")}}));
  EXPECT_FALSE(Knows("half_ball"));
}

TEST(ModelRegistry, RefusesWhatIsNoName) {
  for (const std::string name : {"", "1ball", "a ball", "../ball", "ball-2", "_ball", "b\n"}) {
    EXPECT_NE(std::string::npos, Rejected({{name, Another("corner")}}).find("is no name")) << name;
  }
  EXPECT_NE("", Rejected({{std::string(65, 'a'), Another("corner")}}));
  EXPECT_EQ("a test: model 'empty_ball' has no factory", Rejected({{"empty_ball", nullptr}}));
}

TEST(ModelRegistry, IsAddedToWhileOthersRead) {
  std::thread reader([] {
    for (int i = 0; i < 200; ++i) EXPECT_GE(ModelNames().size(), 16u);
  });
  for (int i = 0; i < 50; ++i) {
    RegisterModels({{"ball_" + std::to_string(i), Another("corner")}}, "a test");
  }
  reader.join();
  EXPECT_TRUE(Knows("ball_49"));
}

/// As a library may be that was compiled with other headers: what it returns must not be looked at.
class OtherPlugin : public ModelPlugin {
 public:
  explicit OtherPlugin(ModelAbi abi) : ModelPlugin(abi) {}
  std::vector<ModelEntry> Entries() const override {
    asked = true;
    return {{"plugin_ball", Another("bouncing_ball")}};
  }
  mutable bool asked = false;
};

TEST(ModelPlugin, IsRefusedWhereItsAbiDiffers) {
  for (int field = 0; field < 5; ++field) {
    ModelAbi abi = kModelAbi;
    if (field == 0) ++abi.version;
    if (field == 1) ++abi.eigen;
    if (field == 2) abi.alignment *= 2;
    if (field == 3) abi.system += 8;
    if (field == 4) abi.entry += 8;
    const OtherPlugin plugin(abi);
    try {
      RegisterModelsOf(plugin, "other/Models");
      ADD_FAILURE() << "taken: " << ToString(abi);
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(ToString(abi))) << error.what();
    }
    EXPECT_FALSE(plugin.asked);
  }
  EXPECT_FALSE(Knows("plugin_ball"));
  RegisterModelsOf(OtherPlugin(kModelAbi), "other/Models");
  EXPECT_TRUE(Knows("plugin_ball"));
}

}  // namespace
}  // namespace contact_flow
