// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/assumptions.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/model/driven.h"
#include "src/piecewise_linear/cone_interior.h"

namespace contact_flow {
namespace {

/// Eigenvalues of the scaled Delassus matrix below this count as zero.
constexpr double kDependent = 1e-10;
constexpr int kNewtonSteps = 30;
constexpr double kNewtonTolerance = 1e-10;

double Condition(const Matrix& symmetric) {
  if (symmetric.size() == 0) return 1;
  if (!symmetric.allFinite()) return std::numeric_limits<double>::infinity();
  const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(symmetric).eigenvalues();
  const double smallest = eigenvalues.minCoeff(), largest = eigenvalues.maxCoeff();
  return smallest > kDependent * largest ? largest / smallest
                                         : std::numeric_limits<double>::infinity();
}

/// A matrix without these rows and columns.
Matrix Without(const std::vector<int>& some, const Matrix& all) {
  std::vector<int> rest;
  for (int j = 0; j < all.rows(); ++j) {
    if (std::find(some.begin(), some.end(), j) == some.end()) rest.push_back(j);
  }
  const auto size = static_cast<Eigen::Index>(rest.size());
  return Matrix::NullaryExpr(size, size, [&](Eigen::Index i, Eigen::Index j) {
    return all(rest[static_cast<std::size_t>(i)], rest[static_cast<std::size_t>(j)]);
  });
}

/// Da over the members of a set, with rows of unit length.
Matrix UnitNormals(const Matrix& jacobian, ConstraintSet touching) {
  Matrix normals(touching.Size(), jacobian.cols());
  int row = 0;
  for (int i : touching) {
    const double length = jacobian.row(i).norm();
    normals.row(row++) = jacobian.row(i) / (length > 0 ? length : 1);
  }
  return normals;
}

/// Moves q onto a_i = a_j = 0 by the shortest steps in the kinetic metric; false when that fails.
bool MoveOntoPair(const MechanicalSystem& system, int i, int j, const VectorRef& u, Vector* x) {
  const int d = system.dof(), nq = system.num_positions();
  for (int step = 0; step < kNewtonSteps; ++step) {
    const InverseInertia inertia(system, x->head(nq), x->tail(d), u, ContactMode());
    const ConstraintTerms& terms = inertia.terms();
    const Eigen::Vector2d gap(terms.gap(i), terms.gap(j));
    if (!gap.allFinite()) return false;
    if (gap.cwiseAbs().maxCoeff() <= kNewtonTolerance) return true;
    Matrix A(2, d);
    A << terms.jacobian.row(i), terms.jacobian.row(j);
    const Matrix Y = inertia * A.transpose();
    const Matrix G = A * Y;
    if (!std::isfinite(Condition(G))) return false;
    x->head(nq) = system.space().Retract(x->head(nq), -Y * G.ldlt().solve(gap));
    if (HasStateManifold(system) && !ProjectState(system, x)) return false;
  }
  return false;
}

}  // namespace

double AssumptionReport::LargestCoupling() const {
  double largest = 0;
  for (const Coupling& coupling : couplings) largest = std::max(largest, std::abs(coupling.value));
  return largest;
}

AssumptionReport AssessAssumptions(const MechanicalSystem& system, const VectorRef& x,
                                   const VectorRef& u, ConstraintSet touching) {
  if (system.HasFriction()) {
    throw std::invalid_argument("system '" + system.description().name +
                                "' has friction: Assumptions 2 to 4 are for contacts without");
  }
  const int d = system.dof(), k = touching.Size();
  AssumptionReport report;
  report.touching = touching;
  Matrix mass;
  Vector force;
  ConstraintTerms terms;
  const int nq = system.num_positions();
  system.Dynamics(x.head(nq), x.tail(d), u, ContactMode(), &mass, &force);
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const std::vector<int> driven = Driven(mass);
  report.mass_condition = Condition(Without(driven, mass));
  ContactDynamics dynamics(system, u);
  dynamics.Differentiate(x, ContactMode());
  report.smooth = std::isfinite(report.mass_condition) && force.allFinite() &&
                  terms.gap.allFinite() && terms.jacobian.allFinite() &&
                  dynamics.acceleration_jacobian().allFinite();
  if (!report.smooth) return report;

  Matrix G;
  Vector unused;
  Delassus(system, x, u, touching, &G, &unused);
  const Vector scale = G.diagonal().cwiseSqrt().cwiseInverse();
  G = scale.asDiagonal() * G * scale.asDiagonal();
  report.condition = Condition(G);
  if (k > 0 && G.allFinite()) {
    const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(G).eigenvalues();
    report.rank = static_cast<int>((eigenvalues.array() > kDependent).count());
  }
  // Independence implies the qualification; otherwise a linear program decides.
  for (int j : driven) terms.jacobian.col(j).setZero();  // which nothing pushes
  report.qualified = report.independent() || HasInterior(UnitNormals(terms.jacobian, touching));
  int row = 0;
  for (int i : touching) {
    int column = 0;
    for (int j : touching) {
      if (column > row) report.couplings.push_back({i, j, G(row, column)});
      ++column;
    }
    ++row;
  }
  report.contact_class = report.independent() ? ClassifyCouplings(system, x.head(nq), touching)
                                              : ContactClass::kDependent;
  return report;
}

std::vector<AssumptionReport> AssessTransitions(const MechanicalSystem& system,
                                                const Trajectory& trajectory) {
  BudgetStage stage("the assumptions at events", trajectory.transitions.size());
  std::vector<AssumptionReport> reports;
  for (std::size_t k = 0; k < trajectory.transitions.size(); ++k) {
    AskBudget();
    stage.Next();
    const Transition& transition = trajectory.transitions[k];
    reports.push_back(AssessAssumptions(system, transition.x_minus, trajectory.arcs[k].u,
                                        transition.activated | transition.mode_before));
    AssumptionReport& report = reports.back();
    if (!report.smooth || !report.independent()) continue;
    ContactDynamics dynamics(system, trajectory.arcs[k].u);
    const ContactClass found = ClassifyCluster(&dynamics, transition).contact_class;
    if (found != ContactClass::kSingle) report.contact_class = found;
  }
  return reports;
}

RegionReport AssessRegion(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                          const VectorRef& half_width, int samples, unsigned seed) {
  const int d = system.dof(), n = system.num_constraints();
  const int nq = system.num_positions();
  if (x.size() != nq + d || half_width.size() != 2 * d) {
    throw std::invalid_argument("state and half_width need " + std::to_string(nq + d) + " and " +
                                std::to_string(2 * d) + " entries");
  }
  if (!(half_width.array() >= 0).all() || !half_width.allFinite()) {
    throw std::invalid_argument("half_width must be finite and not negative");
  }
  RegionReport report;
  report.samples = samples;
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) report.pairs.push_back({i, j, 0, 0, 0, ContactClass::kSingle});
  }
  std::mt19937 generator(seed);
  BudgetStage stage("the samples of the region", static_cast<std::size_t>(std::max(0, samples)));
  for (int s = 0; s < samples; ++s, stage.Next()) {
    AskBudget();
    Vector step(2 * d);
    for (int c = 0; c < 2 * d; ++c) {
      // Not std::uniform_real_distribution, whose values differ between standard libraries.
      const double uniform = static_cast<double>(generator()) / std::mt19937::max();
      step(c) = (2 * uniform - 1) * half_width(c);
    }
    Vector state = system.Perturb(x, step);
    if (HasStateManifold(system) && !ProjectState(system, &state)) continue;
    const AssumptionReport free = AssessAssumptions(system, state, u, ConstraintSet());
    report.smooth += free.smooth;
    report.largest_mass_condition = std::max(report.largest_mass_condition, free.mass_condition);
    for (PairInRegion& pair : report.pairs) {
      AskBudget();
      Vector touching = state;
      if (!free.smooth || !MoveOntoPair(system, pair.first, pair.second, u, &touching)) continue;
      ConstraintTerms terms;
      system.Constraints(touching.head(nq), touching.tail(d), &terms);
      if (terms.gap.head(n).minCoeff() < -kNewtonTolerance) continue;
      const AssumptionReport met =
          AssessAssumptions(system, touching, u, ConstraintSet({pair.first, pair.second}));
      if (!met.smooth) continue;
      const double value = met.couplings.front().value;
      pair.smallest = pair.met > 0 ? std::min(pair.smallest, value) : value;
      pair.largest = pair.met > 0 ? std::max(pair.largest, value) : value;
      pair.worst = std::max(pair.worst, met.contact_class);
      ++pair.met;
    }
  }
  return report;
}

}  // namespace contact_flow
