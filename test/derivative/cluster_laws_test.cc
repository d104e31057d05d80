// SPDX-License-Identifier: BSD-3-Clause
// The laws of the B-derivative at every cluster met by the models, and one-sided
// difference quotients.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "test/reference_case.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// A system with a run through its clusters.
struct Scenario {
  std::string name;
  std::shared_ptr<MechanicalSystem> system;
  Vector x;
  double duration;
  ImpactLaw law = ImpactLaw::kComplementarity;
};

std::vector<Scenario> Scenarios() {
  std::vector<Scenario> scenarios;
  for (const std::string& name : test::ReferenceNames()) {
    if (name.rfind("rigid_biped", 0) == 0) continue;  // at or next to a discontinuity
    test::ReferenceCase reference(name);
    scenarios.push_back({name, std::move(reference.system), reference.x, reference.duration});
  }
  const auto add = [&](const std::string& name, std::shared_ptr<MechanicalSystem> system) {
    scenarios.push_back({name, system, system->nominal().x, system->nominal().duration});
  };
  // Foot by foot, contacts that are not orthogonal: the first foot lets go at the
  // impact of the second.
  std::shared_ptr<MechanicalSystem> rigid = MakeModel("rigid_biped");
  Vector tilted = rigid->nominal().x;
  tilted(2) = 0.1;
  scenarios.push_back({"rigid_biped_tilted", rigid, tilted, 1.4});
  using ThreeLegs = ModelSystem<test::LegRow<3>>;
  add("three_legs_plastic", std::make_shared<ThreeLegs>(ParameterValues{}));
  add("three_legs_elastic", std::make_shared<ThreeLegs>(ParameterValues{{"restitution", 0.4}}));
  const std::size_t count = scenarios.size();
  for (std::size_t k = 0; k < count; ++k) {
    scenarios.push_back(scenarios[k]);
    scenarios.back().name += "_projection";
    scenarios.back().law = ImpactLaw::kProjection;
  }
  return scenarios;
}

class ClusterLaws : public testing::TestWithParam<Scenario> {
 protected:
  ClusterLaws() {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    options.impact_law = GetParam().law;
    run = Simulate(*GetParam().system, GetParam().x, u, GetParam().duration, options);
    BDerivativeOptions tight;
    tight.tolerance = 1e-12;
    B = DifferentiateOutcome(*GetParam().system, run, tight);
  }
  Vector RandomDirection() {
    std::normal_distribution<double> normal;
    Vector w(GetParam().x.size());
    for (int i = 0; i < w.size(); ++i) w(i) = normal(generator);
    return ProjectAdmissible(*GetParam().system, GetParam().x, run.arcs.front().mode, w);
  }
  /// All orders of one event's activations.
  static std::vector<std::vector<int>> Orders(const EventMap& event) {
    std::vector<std::vector<int>> orders;
    std::vector<int> order = event.activated();
    do orders.push_back(order);
    while (std::next_permutation(order.begin(), order.end()));
    return orders;
  }

  const Vector u = Vector::Zero(GetParam().system->num_inputs());
  Trajectory run;
  BDerivative B;
  std::mt19937 generator{5};
};

/// Rounding through a handful of products of matrices of size ~10 and condition ~1e2.
constexpr double kProductRounding = 1e-10;

TEST_P(ClusterLaws, EverySelectionCarriesTheFieldAcross) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const MechanicalSystem& system = *GetParam().system;
  ContactDynamics dynamics(system, u);
  for (std::size_t k = 0; k < B.events.size(); ++k) {
    const Transition& transition = run.transitions[k];
    const Vector before = dynamics.Field(transition.x_minus, transition.mode_before);
    const Vector after = dynamics.Field(transition.x_plus, transition.mode_after);
    for (const std::vector<int>& order : Orders(B.events[k])) {
      const Vector carried = B.events[k].Selection(order) * before;
      EXPECT_LE((carried - after).cwiseAbs().maxCoeff(),
                kProductRounding * (1 + after.cwiseAbs().maxCoeff()));
    }
  }
}

TEST_P(ClusterLaws, DeterminantsAreProductsOfSquaredRestitutions) {
  const Vector gamma = GetParam().system->restitution();
  for (const EventMap& event : B.events) {
    double product = 1;
    for (int i : event.activated()) product *= gamma(i) * gamma(i);
    for (const std::vector<int>& order : Orders(event)) {
      EXPECT_NEAR(product, event.Selection(order).determinant(), 1e-9);
    }
  }
}

TEST_P(ClusterLaws, PiecesAgreeWithDirectionsAndOnFaces) {
  const PiecewiseLinearMap map = B.Pieces();
  std::size_t words = 1;
  for (const EventMap& event : B.events) words *= Orders(event).size();
  EXPECT_EQ(words, map.pieces().size());
  for (int trial = 0; trial < 50; ++trial) {
    const Vector w = RandomDirection();
    const Vector value = B(w);
    const double scale = 1 + value.cwiseAbs().maxCoeff();
    EXPECT_LE((map(w) - value).cwiseAbs().maxCoeff(), kProductRounding * scale);
    EXPECT_LE((B(2.5 * w) - 2.5 * value).cwiseAbs().maxCoeff(), kProductRounding * scale);
    // Onto a face between two pieces: every piece whose closed cone holds the point
    // has the same value.
    const Matrix& cone = map.pieces()[map.PieceAt(w)].cone;
    if (cone.rows() == 0) continue;
    const Vector normal = cone.row(trial % cone.rows()).transpose();
    const Vector face = w - normal.dot(w) * normal;
    const Vector there = map(face);
    for (const LinearPiece& piece : map.pieces()) {
      if (piece.Margin(face) < -1e-12) continue;
      EXPECT_LE((piece.matrix * face - there).cwiseAbs().maxCoeff(), kProductRounding * scale);
    }
  }
}

TEST_P(ClusterLaws, ConesCoverTheSpaceOnce) {
  const PiecewiseLinearMap map = B.Pieces();
  for (int trial = 0; trial < 200; ++trial) {
    const Vector w = RandomDirection();
    int inside = 0;
    for (const LinearPiece& piece : map.pieces()) inside += piece.Margin(w) >= 0;
    EXPECT_EQ(1, inside);
  }
}

/// Two selections differ by D (τ_1 − τ_2), D the defect of F̂ from being modular.
TEST_P(ClusterLaws, TwoSelectionsDifferByTheModularityDefect) {
  const MechanicalSystem& system = *GetParam().system;
  for (std::size_t k = 0; k < B.events.size(); ++k) {
    const EventMap& event = B.events[k];
    if (event.num_activations() != 2) continue;
    const Transition& transition = run.transitions[k];
    const Vector v = transition.x_minus.tail(system.dof());
    ConstraintTerms terms;
    system.Constraints(transition.x_minus.head(system.num_positions()), v, &terms);
    const int i = event.activated()[0], j = event.activated()[1];
    const Matrix& Da = terms.jacobian;
    const Vector times = Da.row(j) / Da.row(j).dot(v) - Da.row(i) / Da.row(i).dot(v);
    const Matrix difference = event.Selection({i, j}) - event.Selection({j, i});
    const double scale = 1 + event.Selection({i, j}).cwiseAbs().maxCoeff();
    EXPECT_NEAR(difference.cwiseAbs().maxCoeff(),
                event.AssessModularity().defect * times.cwiseAbs().maxCoeff(), 1e-8 * scale);
  }
}

TEST_P(ClusterLaws, DifferentiableMeansAllSelectionsAreEqual) {
  const PiecewiseLinearMap map = B.Pieces();
  double scale = 1;
  for (const LinearPiece& piece : map.pieces()) {
    scale = std::max(scale, piece.matrix.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(B.IsDifferentiable(), map.Kink() <= 1e-8 * scale);
}

TEST_P(ClusterLaws, OneSidedQuotientsConvergeWithSlopeOne) {
  int measured = 0;
  SimulateOptions options;
  options.impact_law = GetParam().law;
  for (int trial = 0; trial < 6; ++trial) {
    const Vector w = RandomDirection().normalized();
    const QuotientReport report =
        CompareWithQuotients(*GetParam().system, GetParam().x, u, GetParam().duration, w, B(w),
                             {3e-4, 1e-4, 3e-5, 1e-5, 3e-6}, options);
    ASSERT_EQ(5u, report.samples.size());
    for (const QuotientSample& sample : report.samples) {
      ASSERT_TRUE(sample.status.ok()) << sample.status.message;
    }
    // O(α) with a constant that the largest α measures, down to the resolution of the runs.
    const double rate = report.samples.front().error / report.samples.front().alpha;
    for (const QuotientSample& sample : report.samples) {
      EXPECT_LE(sample.error, 3 * rate * sample.alpha + 20 * report.resolution / sample.alpha);
    }
    if (std::isnan(report.slope)) continue;  // an outcome that is linear in this direction
    EXPECT_NEAR(1, report.slope, 0.15);
    ++measured;
  }
  EXPECT_GT(measured, 0) << "no direction has curvature";
}

/// D(δt, 0) = F: the outcome at T + δt against the outcome at T.
TEST_P(ClusterLaws, TimeDerivativeIsTheField) {
  constexpr double kStep = 1e-5;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.impact_law = GetParam().law;
  const Vector later =
      Simulate(*GetParam().system, GetParam().x, u, GetParam().duration + kStep, options)
          .FinalState();
  const Vector quotient = (later - run.FinalState()) / kStep;
  const Vector predicted = B(1, Vector::Zero(later.size()));
  EXPECT_LE((quotient - predicted).cwiseAbs().maxCoeff(),
            100 * kStep * (1 + predicted.cwiseAbs().maxCoeff()));
}

INSTANTIATE_TEST_SUITE_P(AllClusters, ClusterLaws, testing::ValuesIn(Scenarios()),
                         [](const testing::TestParamInfo<Scenario>& info) {
                           return info.param.name;
                         });

}  // namespace
}  // namespace contact_flow
