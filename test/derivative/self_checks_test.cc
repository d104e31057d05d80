// SPDX-License-Identifier: BSD-3-Clause
// What is wrong on purpose is refused by the law that it breaks, with its name.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// A system that says its forces change with positions by `factor` times what they do.
class Mistaken final : public MechanicalSystem {
 public:
  Mistaken(std::unique_ptr<MechanicalSystem> system, double factor)
      : system_(std::move(system)), factor_(factor) {
    description_ = system_->description();
    nominal_ = system_->nominal();
    space_ = system_->space();
    restitution_ = system_->restitution();
  }
  bool HasConstantMass() const override { return system_->HasConstantMass(); }
  bool HasAffineConstraints() const override { return system_->HasAffineConstraints(); }
  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, const ContactMode& mode,
                Matrix* mass, Vector* force) const override {
    system_->Dynamics(q, v, u, mode, mass, force);
  }
  void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const override {
    system_->Constraints(q, v, terms);
  }
  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* jacobian) const override {
    system_->DifferentiateDynamics(q, v, u, mode, acceleration, force, jacobian);
    jacobian->momentum_q *= factor_;
  }
  void DifferentiateImpact(const VectorRef& q, const VectorRef& jump, const VectorRef& impulse,
                           const VectorRef& s, ResidualJacobian* jacobian) const override {
    system_->DifferentiateImpact(q, jump, impulse, s, jacobian);
  }
  void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                         const ContactMode& mode, const VectorRef& acceleration,
                                         const VectorRef& force, const std::vector<int>& parameters,
                                         ParameterJacobian* jacobian) const override {
    system_->DifferentiateDynamicsByParameters(q, v, u, mode, acceleration, force, parameters,
                                               jacobian);
  }
  void DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       const std::vector<int>& parameters,
                                       ParameterJacobian* jacobian) const override {
    system_->DifferentiateImpactByParameters(q, jump, impulse, s, parameters, jacobian);
  }

 private:
  const std::unique_ptr<MechanicalSystem> system_;
  const double factor_;
};

void ExpectRefused(const BDerivative& B, const std::string& name) {
  EXPECT_EQ(Outcome::kNotDifferentiable, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find(name)) << B.status.message;
  EXPECT_THROW(B(Vector::Zero(14)), std::domain_error);
}

class SelfChecks : public testing::Test {
 protected:
  SelfChecks() {
    const NominalRun& nominal = system->nominal();
    run = Simulate(*system, nominal.x, nominal.u, nominal.duration);
  }
  std::unique_ptr<MechanicalSystem> system = MakeModel("soft_biped");
  Trajectory run;
};

TEST_F(SelfChecks, PassWhereNothingIsWrong) {
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Mistaken right(MakeModel("soft_biped"), 1);
  EXPECT_TRUE(DifferentiateOutcome(right, run).status.ok());
}

TEST_F(SelfChecks, SeeADerivativeOfForcesThatIsWrong) {
  const Mistaken wrong(MakeModel("soft_biped"), 1.01);
  ExpectRefused(DifferentiateOutcome(wrong, run), "do not carry the field along");
}

TEST_F(SelfChecks, SeeAStateBehindAnImpactThatIsNotItsOutcome) {
  run.transitions.front().x_plus(9) += 1e-3;
  ExpectRefused(DifferentiateOutcome(*system, run), "B(F⁻) = F⁺");
}

TEST_F(SelfChecks, SeeAnImpulseThatIsNotThatOfTheJump) {
  run.transitions.front().impulse *= 1.001;
  ExpectRefused(DifferentiateOutcome(*system, run), "M (v⁺ − v⁻) = Daᵀ p");
}

}  // namespace
}  // namespace contact_flow
