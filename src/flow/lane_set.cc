// SPDX-License-Identifier: BSD-3-Clause
#include "lane_set.h"

#include <Eigen/Cholesky>
#include <typeinfo>

#include "../dynamics/solve_columns.h"
#include "contact_flow/dynamics/mass_factor.h"
#include "contact_flow/model/model_system.h"
#include "src/model/example/driven_ball.h"
#include "src/model/example/hopping_trot.h"
#include "src/model/example/soft_biped.h"
#include "src/model/example/steered_trot.h"
#include "src/model/example/wall_and_floor.h"

namespace contact_flow {
namespace {

template <class Model>
bool IsModel(const MechanicalSystem& system) {
  return typeid(system) == typeid(ModelSystem<Model>);
}

/// Whether the system is what lane_models.h knows by its name.
bool IsKnown(const MechanicalSystem& system) {
  return IsModel<example::SoftBiped>(system) || IsModel<example::HoppingTrot>(system) ||
         IsModel<example::SteeredTrot>(system) || IsModel<example::DrivenBall>(system) ||
         IsModel<example::WallAndFloor>(system);
}

LaneStepperMaker Find(const char* model, LaneSet set) {
  LaneStepperMaker maker = nullptr;
#if defined(__x86_64__) && defined(__GNUC__)
  const bool eight = set == LaneSet::kBest || set == LaneSet::kAvx512;
  if (eight && __builtin_cpu_supports("avx512f")) maker = FindLanesAvx512(model);
  const bool four = set == LaneSet::kBest || set == LaneSet::kAvx2;
  if (maker == nullptr && four && __builtin_cpu_supports("avx2")) maker = FindLanesAvx2(model);
#endif
  return maker;
}

}  // namespace

LanesOfSystem::LanesOfSystem(const MechanicalSystem& system, const SimulateOptions& options,
                             LaneSet set) {
  if (set == LaneSet::kNone) {
    why_ = "one run at a time was asked for";
  } else if (!IsKnown(system)) {
    why_ = "system '" + system.description().name +
           "' has no lanes: they need a template model of the library with constant M and Da and "
           "without friction";
  } else if (options.method == IntegrationMethod::kImplicit) {
    why_ = "method is implicit: lanes are explicit";
  } else {
    maker_ = Find(system.description().name.c_str(), set);
    if (maker_ == nullptr) why_ = "this machine or build has not the instructions";
  }
  if (maker_ == nullptr) return;
  ConstraintTerms terms;
  const Vector& x = system.nominal().x;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  jacobian_ = terms.jacobian;
  for (const Parameter& parameter : system.description().parameters) {
    parameters_.push_back(parameter.value);
  }
}

std::unique_ptr<LaneStepper> LanesOfSystem::Make() const {
  return std::unique_ptr<LaneStepper>(maker_(jacobian_.data(), parameters_.data()));
}

ModeMaps MapsOfMode(const MechanicalSystem& system, const Vector& x, const Vector& u,
                    ContactMode mode) {
  const int d = system.dof(), n = system.num_constraints(), k = mode.Size();
  Matrix mass(d, d);
  Vector force(d);
  ConstraintTerms terms;
  const auto q = x.head(system.num_positions()), v = x.tail(d);
  system.Dynamics(q, v, u, mode, &mass, &force);
  system.Constraints(q, v, &terms);
  MassFactor factor(d);
  factor.Compute(mass);
  ModeMaps maps;
  maps.mode = mode;
  maps.regular = factor.regular() && !factor.sparse();
  maps.inverse.setIdentity(d, d);
  maps.force_map.setZero(n, d);
  maps.gain.setZero(n);
  factor.Solve(&maps.inverse);
  if (k == 0) return maps;
  Matrix rows(k, d), reach(d, k), delassus(k, k), momentum_map(k, d), force_map(k, d);
  int row = 0;
  for (int i : mode) {
    rows.row(row) = terms.jacobian.row(i);
    reach.col(row) = rows.row(row);
    factor.SolveL(reach.col(row++));
  }
  delassus.noalias() = reach.transpose().lazyProduct(reach);
  const Eigen::LLT<Matrix> delassus_factor(delassus);
  maps.regular = maps.regular && delassus_factor.info() == Eigen::Success;
  delassus.setIdentity();
  momentum_map.noalias() = rows.lazyProduct(maps.inverse);
  SolveColumns(delassus_factor, &delassus);
  force_map.noalias() = delassus.lazyProduct(momentum_map);
  maps.inverse.noalias() -= momentum_map.transpose().lazyProduct(force_map);
  row = 0;
  for (int i : mode) {
    maps.gain(i) = reach.col(row).squaredNorm();
    maps.force_map.row(i) = force_map.row(row++);
  }
  return maps;
}

}  // namespace contact_flow
