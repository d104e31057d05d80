// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

/// What velocities of rows are known to, relative to those of the whole.
constexpr double kFrameRateRounding = 1e-12;

}  // namespace

FrictionFrame::FrictionFrame(const MechanicalSystem& system, const InverseInertia& inertia,
                             const ConstraintSet& contacts)
    : system_(system) {
  for (int i : contacts) {
    const Friction friction = system.HasFriction() ? system.friction()[i] : Friction();
    FrictionContact contact;
    contact.coefficient = friction.coefficient;
    contact.dimension = friction.coefficient > 0 ? friction.dimension : 0;
    constraints_.push_back(i);
    system_rows_.push_back(i);
    for (int k = 0; k < contact.dimension; ++k) system_rows_.push_back(friction.row + k);
    problem_.contacts.push_back(contact);
  }
  const auto m = static_cast<Eigen::Index>(system_rows_.size());
  rows_.resize(m, system.dof());
  bias_.resize(m);
  for (Eigen::Index r = 0; r < m; ++r) {
    rows_.row(r) = inertia.terms().jacobian.row(system_rows_[static_cast<std::size_t>(r)]);
    bias_(r) = inertia.terms().bias(system_rows_[static_cast<std::size_t>(r)]);
  }
  reach_ = inertia * rows_.transpose();
  problem_.G = rows_ * reach_;
}

Vector FrictionFrame::Impulse(const InverseInertia& inertia, const Vector& p) const {
  Vector all = Vector::Zero(system_.num_rows());
  for (std::size_t r = 0; r < system_rows_.size(); ++r) {
    all(system_rows_[r]) = p(static_cast<Eigen::Index>(r));
  }
  RowLayout(system_).Bilateral(all) = inertia.BilateralForce(Matrix(rows_.transpose() * p)).col(0);
  return all;
}

Vector FrictionFrame::RateRounding(const InverseInertia& inertia, const VectorRef& v,
                                   const ContactMode& before) const {
  // |A v| ≤ |√P Aᵀ| |√M v|, and what is driven by itself
  const Vector driven = v - Moved(inertia.mass(), v);
  Vector rounding =
      kFrameRateRounding * (KineticSpeed(inertia.mass(), v) * problem_.G.diagonal().cwiseSqrt() +
                            (rows_ * driven).cwiseAbs());
  for (std::size_t k = 0; k < constraints_.size(); ++k) {
    if (!before.Contains(constraints_[k])) continue;
    const int row = problem_.Row(k), dimension = problem_.contacts[k].dimension;
    rounding(row) = std::numeric_limits<double>::infinity();
    if (before.LetterOf(constraints_[k]) != Letter::kStick) continue;
    rounding.segment(row + 1, dimension).setConstant(std::numeric_limits<double>::infinity());
  }
  return rounding;
}

}  // namespace contact_flow
