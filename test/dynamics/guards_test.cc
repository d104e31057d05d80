// SPDX-License-Identifier: BSD-3-Clause
// Kinds, signs, rates and gradients of guards, for every model of the library in modes of one
// contact, by its letters.
#include "contact_flow/dynamics/guards.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/flow/event_locator.h"
#include "contact_flow/model/model_library.h"
#include "src/dynamics/guard_gradients.h"
#include "test/model/model_names.h"

namespace contact_flow {
namespace {

/// Central differences: error h² f''' + 1e-16 f/h ~ 1e-9, times the size of third derivatives.
constexpr double kGuardStep = 1e-6, kGuardError = 1e-5;

class GuardLaws : public testing::TestWithParam<std::string> {
 protected:
  GuardLaws() : system(MakeModel(GetParam())), guards(*system) {
    variables.parameters.clear();
    for (std::size_t p = 0; p < system->description().parameters.size(); ++p) {
      variables.parameters.push_back(static_cast<int>(p));
    }
    std::mt19937 generator{11};
    std::normal_distribution<double> normal;
    Vector w(2 * system->dof());
    for (double& entry : w) entry = 0.3 * normal(generator);
    x = system->Perturb(system->nominal().x, w);
  }

  /// The letters of a contact: what never slips holds, or is open.
  std::vector<Letter> Letters(int i) const {
    if (!system->HasFriction() || system->friction()[i].dimension == 0) return {Letter::kSlip};
    if (std::isinf(system->friction()[i].coefficient)) return {Letter::kStick};
    if (system->friction()[i].dimension == 2) return {Letter::kStick, Letter::kSlip};
    return {Letter::kStick, Letter::kForward, Letter::kBackward};
  }
  std::vector<ContactMode> Modes() const {
    std::vector<ContactMode> modes = {ContactMode()};
    for (int i = 0; i < system->num_constraints(); ++i) {
      for (Letter letter : Letters(i)) {
        modes.emplace_back();
        modes.back().Set(i, letter);
      }
    }
    return modes;
  }

  ConstraintSet Watching(ContactMode mode) const {
    ConstraintSet watching = guards.OfGaps(mode) | guards.OfForces(mode, {}) | guards.OfSlips(mode);
    for (int i : mode - mode.Sticking()) {
      if (!system->HasFriction() || system->friction()[i].dimension != 2) continue;
      watching.Insert(guards.OfFriction(i));
    }
    return watching;
  }

  std::unique_ptr<MechanicalSystem> system;
  const Guards guards;
  Variables variables;
  Vector x;
};

TEST_P(GuardLaws, RatesAreGradientsAlongTheMotion) {
  ContactDynamics dynamics(*system, system->nominal().u, variables);
  for (const ContactMode mode : Modes()) {
    const GuardGradients gradients(&dynamics, x, mode);
    const Vector& field = gradients.field();
    ConstraintTerms terms;
    GapSample motion;
    SampleGaps(*system, x, field.segment(system->dof(), system->dof()), &terms, &motion);
    for (int guard : Watching(mode)) {
      const std::string name = "guard " + std::to_string(guard) + ", mode " +
                               mode.ToString(system->description().constraints);
      const GuardGradients::Value of = gradients.At(guard);
      const GuardJet at = guards.At(guard, &dynamics, x, mode);
      const double size = of.gradient.cwiseAbs().dot(field.cwiseAbs());
      EXPECT_NEAR(at.value, of.value, 1e-12 * (1 + std::abs(of.value))) << name;
      EXPECT_NEAR(at.rate, of.gradient.dot(field), 1e-12 * (1 + size)) << name;
      if (IsOfForces(guards.KindOf(guard, mode))) continue;
      EXPECT_NEAR(guards.OfMotion(guard, mode, motion).value, at.value, 1e-12 * (1 + size)) << name;
      EXPECT_NEAR(guards.OfMotion(guard, mode, motion).rate, at.rate, 1e-12 * (1 + size)) << name;
    }
  }
}

TEST_P(GuardLaws, GradientsAreThoseOfTheValues) {
  ContactDynamics dynamics(*system, system->nominal().u, variables);
  const int states = 2 * system->dof();
  for (const ContactMode mode : Modes()) {
    const GuardGradients gradients(&dynamics, x, mode);
    const auto expect = [&](int guard, int column, double plus, double minus, double step) {
      const Eigen::RowVectorXd gradient = gradients.At(guard).gradient;
      EXPECT_NEAR((plus - minus) / (2 * step), gradient(column),
                  kGuardError * (1 + gradient.cwiseAbs().maxCoeff()))
          << "guard " << guard << ", mode " << mode.ToString(system->description().constraints)
          << ", column " << column;
    };
    for (int k = 0; k < states; ++k) {
      const Vector w = kGuardStep * Vector::Unit(states, k);
      for (int guard : Watching(mode)) {
        expect(guard, k, guards.At(guard, &dynamics, system->Perturb(x, w), mode).value,
               guards.At(guard, &dynamics, system->Perturb(x, -w), mode).value, kGuardStep);
      }
    }
    for (int p : variables.parameters) {
      const Parameter& parameter = system->description().parameters[static_cast<std::size_t>(p)];
      const double step = kGuardStep * std::max(1.0, std::abs(parameter.value));
      const auto with = [&](double value) {
        return MakeModel(GetParam(), {{parameter.name, value}});
      };
      const bool end = parameter.value == 0 || (parameter.value == 1 && parameter.unit.empty());
      if (end || !std::isfinite(parameter.value)) continue;  // of its range
      const auto plus = with(parameter.value + step), minus = with(parameter.value - step);
      ContactDynamics ahead(*plus, system->nominal().u), behind(*minus, system->nominal().u);
      for (int guard : Watching(mode)) {
        expect(guard, states + p, Guards(*plus).At(guard, &ahead, x, mode).value,
               Guards(*minus).At(guard, &behind, x, mode).value, step);
      }
    }
  }
}

/// A guard is positive where it has not happened: a compliant contact is left where a_i = 0.
TEST(Guards, OfACompliantMemberIsItsDepth) {
  const auto system = MakeModel("chair");
  const Guards guards(*system);
  ASSERT_TRUE(system->compliant().Contains(0));
  ContactMode pressed;
  pressed.Set(0, Letter::kSlip);
  ContactDynamics dynamics(*system, system->nominal().u);
  const Vector& x = system->nominal().x;
  EXPECT_EQ(guards.KindOf(0, pressed), GuardKind::kGap);
  const GuardJet open = guards.At(0, &dynamics, x, ContactMode());
  const GuardJet depth = guards.At(0, &dynamics, x, pressed);
  EXPECT_NE(open.value, 0);
  EXPECT_EQ(open.value, -depth.value);
  EXPECT_EQ(open.rate, -depth.rate);
}

INSTANTIATE_TEST_SUITE_P(All, GuardLaws, testing::ValuesIn(ModelNames()),
                         [](const testing::TestParamInfo<std::string>& info) {
                           return info.param;
                         });

}  // namespace
}  // namespace contact_flow
