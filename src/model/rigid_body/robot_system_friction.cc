// SPDX-License-Identifier: BSD-3-Clause
// The tangential rows T = W Z: W of an element, Z of the tree.
#include <algorithm>

#include "robot_scratch.h"

namespace contact_flow {

void RobotSystem::DescribeFriction() {
  int row = static_cast<int>(all_constraints_.size());
  const int first = row;
  for (std::size_t i = 0; i < all_constraints_.size(); ++i) {
    const int rows = constraint(static_cast<int>(i)).slip.rows;
    slip_rows_.push_back(rows > 0 ? row : -1);
    row += rows;
  }
  num_tangential_ = row - first;
  if (num_tangential_ == 0) {
    slip_rows_.clear();
    return;
  }
  for (int i = 0; i < num_constraints(); ++i) {
    const ConstraintElement& element = constraint(i);
    const double coefficient = element.no_slip ? Friction::kNoSlip : element.friction.value;
    friction_.push_back({coefficient, std::max(slip_rows_[i], 0), element.slip.rows});
  }
}

void RobotSystem::AddSlipTerms(int i, Scratch* s, ConstraintTerms* terms) const {
  const ConstraintElement& element = constraint(i);
  const ElementGeometry& geometry = constraint_geometry_[i];
  const std::vector<int>& columns = geometry.columns();
  const int row = slip_rows_[i], size = geometry.size();
  element.SlipMap(s->motion.z, s->slip_map);
  element.SlipRate(s->motion.z, s->motion.rate, s->motion.acceleration, s->number);
  for (int r = 0; r < element.slip.rows; ++r) {
    terms->bias(row + r) = s->number[r];
    for (std::size_t c = 0; c < columns.size(); ++c) {
      double sum = 0;
      for (int k = 0; k < size; ++k) sum += s->slip_map[r * size + k] * s->rows.z_q(k, c);
      terms->jacobian(row + r, columns[c]) = sum;
    }
  }
}

/// − Zᵀ ∂(Wᵀλ)/∂z Z: Z itself is differentiated along the tree, at these forces.
void RobotSystem::SubtractSlipHessian(int i, const VectorRef& force, Scratch* s,
                                      Matrix* momentum_q) const {
  const ConstraintElement& element = constraint(i);
  const int row = slip_rows_[i], rows = element.slip.rows;
  if (element.IsSlipAffine() || force.segment(row, rows).isZero(0)) return;
  const ElementGeometry& geometry = constraint_geometry_[i];
  const std::vector<int>& columns = geometry.columns();
  const auto count = static_cast<Eigen::Index>(columns.size());
  const int size = geometry.size();
  const double lambda[] = {force(row), rows > 1 ? force(row + 1) : 0};
  element.SlipHessian(s->motion.z, lambda, s->by_z);
  const auto z_q = s->rows.z_q.topLeftCorner(size, count);
  auto change = s->product.topLeftCorner(size, count);
  change = Eigen::Map<const Matrix>(s->by_z, size, size).lazyProduct(z_q);
  for (Eigen::Index c = 0; c < count; ++c) {
    for (Eigen::Index r = 0; r < count; ++r) {
      (*momentum_q)(columns[r], columns[c]) -= z_q.col(r).dot(change.col(c));
    }
  }
}

void RobotSystem::DifferentiateSlip(int i, const VectorRef& force, Scratch* s,
                                    ResidualJacobian* jacobian) const {
  const ConstraintElement& element = constraint(i);
  const ElementGeometry& geometry = constraint_geometry_[i];
  const std::vector<int>& columns = geometry.columns();
  const int row = slip_rows_[i], size = geometry.size();
  const ElementMotion& motion = s->motion;
  element.SlipMap(motion.z, s->slip_map);
  const ElementRows& rows = s->rows;
  for (int r = 0; r < element.slip.rows; ++r) {
    const double* map = s->slip_map + r * size;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      double by_q = 0, by_v = 0;
      for (int k = 0; k < size; ++k) {
        by_q += map[k] * rows.acceleration_q(k, c);
        by_v += map[k] * rows.acceleration_v(k, c);
      }
      jacobian->constraint_q(row + r, columns[c]) = by_q;
      jacobian->constraint_v(row + r, columns[c]) = by_v;
    }
  }
  if (element.IsSlipAffine()) return;
  element.DifferentiateSlip(motion.z, motion.rate, motion.acceleration, s->slip_rate_z,
                            s->slip_rate_rate, s->slip_z);
  for (int r = 0; r < element.slip.rows; ++r) {
    const double *by_z = s->slip_rate_z + r * size, *by_rate = s->slip_rate_rate + r * size;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      double by_q = 0, by_v = 0;
      for (int k = 0; k < size; ++k) {
        by_q += by_z[k] * rows.z_q(k, c) + by_rate[k] * rows.rate_q(k, c);
        by_v += by_rate[k] * rows.z_q(k, c);
      }
      jacobian->constraint_q(row + r, columns[c]) += by_q;
      jacobian->constraint_v(row + r, columns[c]) += by_v;
    }
  }
  SubtractSlipHessian(i, force, s, &jacobian->momentum_q);
}

void RobotSystem::DifferentiateSlipAtImpact(int i, const VectorRef& impulse, Scratch* s,
                                            ResidualJacobian* jacobian) const {
  const ConstraintElement& element = constraint(i);
  const ElementGeometry& geometry = constraint_geometry_[i];
  const std::vector<int>& columns = geometry.columns();
  const int row = slip_rows_[i], size = geometry.size();
  const ElementMotion& motion = s->motion;
  element.SlipMap(motion.z, s->slip_map);
  element.DifferentiateSlip(motion.z, motion.rate, motion.acceleration, s->slip_rate_z,
                            s->slip_rate_rate, s->slip_z);
  for (int r = 0; r < element.slip.rows; ++r) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      double sum = 0;
      for (int k = 0; k < size; ++k) {
        sum += s->slip_map[r * size + k] * s->rows.rate_q(k, c) +
               s->slip_z[r * size + k] * s->rows.z_q(k, c);
      }
      jacobian->constraint_q(row + r, columns[c]) = sum;
    }
  }
  SubtractSlipHessian(i, impulse, s, &jacobian->momentum_q);
}

void RobotSystem::DifferentiateSlipByNumber(int i, int number, const VectorRef& force,
                                            const double* speed, Scratch* s, int column,
                                            ParameterJacobian* jacobian) const {
  const ConstraintElement& element = constraint(i);
  const ElementGeometry& geometry = constraint_geometry_[i];
  const int row = slip_rows_[i], size = geometry.size();
  const double still[ElementMotion::kMaxSize] = {};
  const ElementMotion& motion = s->motion;
  element.DifferentiateSlipByNumber(motion.z, speed == nullptr ? motion.rate : still,
                                    speed == nullptr ? motion.acceleration : still, number,
                                    s->slip_map, s->number);
  for (int r = 0; r < element.slip.rows; ++r) {
    if (speed == nullptr) jacobian->constraint(row + r, column) += s->number[r];
    for (std::size_t c = 0; c < geometry.columns().size(); ++c) {
      const int j = geometry.columns()[c];
      double change = 0;
      for (int k = 0; k < size; ++k) change += s->slip_map[r * size + k] * s->rows.z_q(k, c);
      jacobian->momentum(j, column) -= force(row + r) * change;
      if (speed != nullptr) jacobian->constraint(row + r, column) += change * speed[j];
    }
  }
}

Matrix RobotSystem::DifferentiateFriction(const std::vector<int>& parameters) const {
  Matrix by = Matrix::Zero(num_constraints(), static_cast<Eigen::Index>(parameters.size()));
  for (Eigen::Index p = 0; p < by.cols(); ++p) {
    for (const NumberPlace& place :
         robot_.parameters.at(static_cast<std::size_t>(parameters[p])).places) {
      if (place.owner == NumberPlace::Owner::kFriction) by(place.index, p) = 1;
    }
  }
  return by;
}

}  // namespace contact_flow
