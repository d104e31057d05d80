// SPDX-License-Identifier: BSD-3-Clause
// Systems without friction beside a puck with friction, which has nothing to do with them: whether
// it is far away, slips or sticks, their derivatives are what they are without it.
#include <gtest/gtest.h>

#include <iterator>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cluster_reading.h"
#include "test/adversary/draw.h"
#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {
namespace {

constexpr double kTolerance = 1e-9;

/// A system, and behind its coordinates x and z of a puck of unit mass and weight, whose contact
/// with a floor is the last.
class BesidePuck : public MechanicalSystem {
 public:
  BesidePuck(const MechanicalSystem& system, double clearance)
      : system_(system), d_(system.dof()), n_(system.num_constraints()), clearance_(clearance) {
    description_ = system.description();
    for (const char* name : {"puck_x", "puck_z"}) {
      description_.coordinates.emplace_back(name);
      description_.velocities.emplace_back(name);
      description_.units.emplace_back("m");
    }
    description_.constraints.emplace_back("puck");
    description_.parameters.clear();
    restitution_ = Vector::Zero(n_ + 1);
    restitution_.head(n_) = system.restitution();
    friction_.resize(static_cast<std::size_t>(n_ + 1));
    friction_.back() = {0.5, n_ + 1, 1};
    num_tangential_ = 1;
    space_ = ConfigurationSpace(d_ + 2);
    nominal_.x = Vector::Zero(2 * (d_ + 2));
    nominal_.u = system.nominal().u;
  }

  /// (δq, δv) of the system and of the puck.
  Vector Join(const Vector& own, const Vector& puck) const {
    Vector x(2 * (d_ + 2));
    x << own.head(d_), puck.head(2), own.tail(d_), puck.tail(2);
    return x;
  }
  Vector Own(const Vector& x) const {
    Vector own(2 * d_);
    own << x.head(d_), x.segment(d_ + 2, d_);
    return own;
  }

  bool HasConstantMass() const override { return system_.HasConstantMass(); }
  bool HasAffineConstraints() const override { return system_.HasAffineConstraints(); }
  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, const ContactMode& mode,
                Matrix* mass, Vector* force) const override {
    Matrix own;
    Vector f;
    system_.Dynamics(q.head(d_), v.head(d_), u, OwnOf(mode), mass ? &own : nullptr, &f);
    if (mass != nullptr) {
      mass->setIdentity(d_ + 2, d_ + 2);
      mass->topLeftCorner(d_, d_) = own;
    }
    force->setZero(d_ + 2);
    force->head(d_) = f;
    (*force)(d_ + 1) = -1;
  }
  void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const override {
    ConstraintTerms own;
    system_.Constraints(q.head(d_), v.head(d_), &own);
    terms->gap.setZero(n_ + 2);
    terms->bias.setZero(n_ + 2);
    terms->gap.head(n_) = own.gap;
    terms->bias.head(n_) = own.bias;
    terms->gap(n_) = q(d_ + 1) + clearance_;
    terms->jacobian.setZero(n_ + 2, d_ + 2);
    terms->jacobian.topLeftCorner(n_, d_) = own.jacobian;
    terms->jacobian(n_, d_ + 1) = terms->jacobian(n_ + 1, d_) = 1;
  }
  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* jacobian) const override {
    ResidualJacobian own;
    system_.DifferentiateDynamics(q.head(d_), v.head(d_), u, OwnOf(mode), acceleration.head(d_),
                                  force.head(n_), &own);
    Enlarge(own, jacobian);
  }
  void DifferentiateImpact(const VectorRef& q, const VectorRef& jump, const VectorRef& impulse,
                           const VectorRef& s, ResidualJacobian* jacobian) const override {
    ResidualJacobian own;
    system_.DifferentiateImpact(q.head(d_), jump.head(d_), impulse.head(n_), s.head(d_), &own);
    Enlarge(own, jacobian);
  }
  void DifferentiateDynamicsByParameters(const VectorRef&, const VectorRef&, const VectorRef&,
                                         const ContactMode&, const VectorRef&, const VectorRef&,
                                         const std::vector<int>&,
                                         ParameterJacobian*) const override {}
  void DifferentiateImpactByParameters(const VectorRef&, const VectorRef&, const VectorRef&,
                                       const VectorRef&, const std::vector<int>&,
                                       ParameterJacobian*) const override {}

 private:
  ContactMode OwnOf(ContactMode mode) const { return mode.Without(n_); }
  void Enlarge(const ResidualJacobian& own, ResidualJacobian* jacobian) const {
    const auto put = [&](const Matrix& part, Eigen::Index rows, Eigen::Index columns, Matrix* all) {
      all->setZero(rows, columns);
      all->topLeftCorner(part.rows(), part.cols()) = part;
    };
    put(own.momentum_q, d_ + 2, d_ + 2, &jacobian->momentum_q);
    put(own.momentum_v, d_ + 2, d_ + 2, &jacobian->momentum_v);
    put(own.momentum_u, d_ + 2, system_.num_inputs(), &jacobian->momentum_u);
    put(own.constraint_q, n_ + 2, d_ + 2, &jacobian->constraint_q);
    put(own.constraint_v, n_ + 2, d_ + 2, &jacobian->constraint_v);
  }

  const MechanicalSystem& system_;
  const int d_, n_;
  const double clearance_;
};

Trajectory RunOf(const MechanicalSystem& system, const Case& c, const Vector& x, double tolerance) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  return Simulate(system, x, c.schedule, c.duration, options);
}

double LargestEntry(const Vector& x) { return x.cwiseAbs().maxCoeff(); }

/// Seeds of which every one had another derivative beside a puck 100 m away than without it, or
/// none: contacts at rest that others' impacts hardly touch, and several that land at once.
TEST(BesideFriction, DerivativesAreThoseWithout) {
  constexpr double kStep = 1e-6, kQuotient = 2e-2, kSame = 1e-5;
  constexpr std::uint64_t kSeeds[] = {3024, 3030, 3238, 3291, 3362, 3438, 3546, 3869,
                                      4190, 4703, 4834, 4905, 5087, 5133, 5223, 5301,
                                      5341, 5439, 5485, 5524, 5869, 5901};
  struct Puck {
    const char* name;
    double clearance, speed;
  };
  int compared = 0;
  for (const std::uint64_t seed : kSeeds) {
    const Case c = Generate(seed);
    ASSERT_TRUE(c.skipped.empty()) << seed;
    const Trajectory alone = RunOf(*c.system, c, c.x, kTolerance);
    const BDerivative own = DifferentiateOutcome(*c.system, alone);
    ASSERT_TRUE(own.status.ok()) << seed << ": " << own.status.message;
    for (const Puck& puck : {Puck{"far", 100, 0}, Puck{"slips", 0, 10}, Puck{"sticks", 0, 0}}) {
      const std::string what = "seed " + std::to_string(seed) + ", the puck " + puck.name;
      const BesidePuck system(*c.system, puck.clearance);
      const Vector x = system.Join(c.x, Eigen::Vector4d(0, 0, puck.speed, 0));
      const Trajectory run = RunOf(system, c, x, kTolerance);
      ASSERT_TRUE(run.status.ok()) << what << ": " << run.status.message;
      const BDerivative B = DifferentiateOutcome(system, run);
      EXPECT_TRUE(B.status.ok()) << what << ": " << B.status.message;
      if (!B.status.ok()) continue;
      const Vector end = RunOf(system, c, x, 1e-12).FinalState();
      Draw draw(seed);
      for (int k = 0; k < 3; ++k) {
        Vector w(2 * c.system->dof());
        for (double& entry : w) entry = draw.Normal();
        w = ProjectAdmissible(*c.system, c.x, own.initial_mode, w);
        const Vector wide = system.Join(w, Vector::Zero(4));
        const Vector expected = own(w), found = system.Own(B(wide));
        EXPECT_LE(LargestEntry(found - expected), kSame * (1 + LargestEntry(expected))) << what;
        ++compared;
        if (ReadClusters(B, wide).inner_radius >= kStep) continue;  // in another order than B
        const Vector moved = RunOf(system, c, x + kStep * wide, 1e-12).FinalState();
        EXPECT_LE(LargestEntry(system.Own((moved - end) / kStep) - found),
                  kQuotient * (1 + LargestEntry(found)))
            << what;
      }
    }
  }
  EXPECT_EQ(compared, 9 * static_cast<int>(std::size(kSeeds)));
}

/// Seeds whose contacts, a rounding below their surfaces, approach and slow down as they do: they
/// were taken for contacts that let go, and fell through.
TEST(BesideFriction, RunsAreThoseWithout) {
  for (const std::uint64_t seed : {4406, 4626, 4713, 5201, 5683}) {
    for (const double tolerance : {1e-9, 1e-10, 1e-11}) {
      const Case c = Generate(seed);
      ASSERT_TRUE(c.skipped.empty()) << seed;
      const BesidePuck beside(*c.system, 100);
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      options.complete_zeno = true;
      const Trajectory alone = Simulate(*c.system, c.x, c.schedule, c.duration, options);
      const Vector x = beside.Join(c.x, Vector::Zero(4));
      const Trajectory run = Simulate(beside, x, c.schedule, c.duration, options);
      ASSERT_TRUE(alone.status.ok()) << seed << ": " << alone.status.message;
      ASSERT_TRUE(run.status.ok()) << seed << ": " << run.status.message;
    }
  }
}

}  // namespace
}  // namespace adversary
}  // namespace contact_flow
