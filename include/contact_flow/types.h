// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// contact_flow: what happens, to first order, to a robot that makes and breaks contact.
///
/// Notation of Pace & Burden, "Piecewise-differentiable trajectory outcomes in mechanical systems
/// subject to unilateral constraints" (HSCC 2017), called "the paper" in every comment:
///   d   number of coordinates,  n  number of unilateral constraints,  m  number of inputs
///   x = (q, v)                  state, stacked [2d]
///   w = (δq, δv)                tangent vector at a state, stacked [2d]
///   (δt, δq, δv, δu)            the order of every derivative that crosses the public border
/// Units are SI, angles are radians.
namespace contact_flow {

/// A vector of any length.
using Vector = Eigen::VectorXd;
/// A matrix of any size.
using Matrix = Eigen::MatrixXd;
/// A vector that is read, without a copy.
using VectorRef = Eigen::Ref<const Vector>;
/// A matrix that is read, without a copy.
using MatrixRef = Eigen::Ref<const Matrix>;

}  // namespace contact_flow
