// SPDX-License-Identifier: BSD-3-Clause
#include "impact_lift.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace contact_flow {
namespace {

/// Of a sum, relative to its terms.
constexpr double kLiftRounding = 1e-13;

}  // namespace

ImpactLift::ImpactLift(const ContactDynamics& dynamics, const TouchingFrame& frame,
                       const Transition& transition, const Vector& scale, ClusterGeometry* geometry,
                       Impact impact)
    : system_(dynamics.system()), frame_(frame), scale_(scale), impact_(std::move(impact)) {
  const int d = system_.dof();
  const Variables& variables = dynamics.variables();
  const Vector q = transition.x_minus.head(system_.num_positions());
  const ConstraintSet hit = impact_.held.With(impact_.hit);
  fixed_ = (transition.mode_before - system_.compliant()) | hit;
  delay_ = impact_.hurry / std::abs(frame.Rate(impact_.hit, impact_.v));
  const ImpactResult result = frame.Impact(impact_.v, hit);
  const ImpactReset reset = geometry->Reset(impact_.v, result, hit, impact_.held);
  by_q_ = reset.ByConfiguration(d).transpose();
  turned_ = geometry->TurnedBy(result, impact_.v);
  const Matrix scaled = scale.asDiagonal() * by_q_ * scale.cwiseInverse().asDiagonal();
  const Eigen::RowVectorXd gradient = frame.A.row(frame.Row(impact_.hit));
  given_ = std::max(scaled.cwiseAbs().maxCoeff(),
                    delay_ * gradient.cwiseAbs().cwiseProduct(scale.transpose()).maxCoeff());
  num_parameters_ = static_cast<int>(variables.parameters.size());
  if (num_parameters_ == 0) return;
  by_p_ = reset.matrix().middleRows(d, d).rightCols(num_parameters_);
  const Vector none = Vector::Zero(result.impulse.size());
  system_.DifferentiateImpactByParameters(q, Vector::Zero(d), none, result.v_plus - impact_.v,
                                          variables.parameters, &by_parameter_);
}

ImpactLift::Change ImpactLift::At(int i) const {
  const int d = system_.dof();
  const Eigen::RowVectorXd normal = frame_.A.row(frame_.Row(i));
  Vector column = Vector::Zero(d), column_terms = Vector::Zero(d);
  for (int r = 0; r < d; ++r) {
    if (normal(r) == 0) continue;
    column += normal(r) * by_q_.col(r);
    column_terms += std::abs(normal(r)) * by_q_.col(r).cwiseAbs();
  }
  turned_.AddRow(i, 1, column);
  turned_.AddAbsRow(i, column_terms);
  const Eigen::RowVectorXd by_q = column.transpose();
  // Onto {a_K = 0}: δq = −Y G⁻¹ ∂a/∂p δp + (I − Y G⁻¹ A) δq.
  const ConstraintSet fixed = fixed_.With(i);
  const std::vector<int> rows = frame_.Rows(fixed);
  const int k = static_cast<int>(rows.size());
  Matrix A(k, d), Y(d, k);
  for (int row = 0; row < k; ++row) {
    A.row(row) = frame_.A.row(rows[row]);
    Y.col(row) = frame_.Y.col(rows[row]);
  }
  const Matrix G = A * Y;
  const Eigen::RowVectorXd along = G.ldlt().solve((by_q * Y).transpose()).transpose();
  Vector response = frame_.HeldResponse(i, impact_.held);
  response /= normal.dot(response);
  const double height = response.cwiseAbs().maxCoeff();
  const double scaled_height = response.cwiseQuotient(scale_).cwiseAbs().maxCoeff();

  Change change{0, 0};
  const auto add = [&](double slope, double terms, double given, double scale) {
    change.entry = std::max(change.entry, height * std::abs(slope));
    const double beyond = std::max(0.0, std::abs(slope) - kLiftRounding * terms);
    if (beyond == 0) return;
    const double limit = impact_.relative * given;
    change.share = std::max(change.share, scaled_height * beyond * scale / limit);
  };
  const Eigen::RowVectorXd slope = by_q - along * A;
  const Eigen::RowVectorXd terms = column_terms.transpose() + along.cwiseAbs() * A.cwiseAbs();
  for (int l = 0; l < d; ++l) add(slope(l), terms(l), given_, scale_(l));
  for (int l = 0; l < num_parameters_; ++l) {
    const Vector by_p = by_p_.col(l);
    const double turned = by_parameter_.constraint(i, l);
    double carried = 0, carried_terms = 0;
    int row = 0;
    for (int c : fixed) {
      const double term = along(row++) * by_parameter_.gap(c, l);
      carried += term;
      carried_terms += std::abs(term);
    }
    add(normal.dot(by_p) + turned - carried,
        normal.cwiseAbs().dot(by_p.cwiseAbs()) + std::abs(turned) + carried_terms,
        std::max(by_p.cwiseQuotient(scale_).cwiseAbs().maxCoeff(),
                 delay_ * std::abs(by_parameter_.gap(impact_.hit, l))),
        1);
  }
  return change;
}

}  // namespace contact_flow
