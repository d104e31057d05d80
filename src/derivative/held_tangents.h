// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The columns of w without their parts in the span of some rows.
Matrix WithoutSpan(const Matrix& rows, const Matrix& w);

/// What is held admits at (q, v): δa = 0 and δ(Da v) = 0 of rows that are closed, δ(T v) = 0 of
/// tangential ones that are still, as the rows of a matrix [rows × 2d+k] by the variables of
/// `dynamics`. `terms` are those at (q, v).
Matrix HeldTangents(const ContactDynamics& dynamics, const ConstraintTerms& terms,
                    const std::vector<int>& closed, const std::vector<int>& still, const Vector& q,
                    const Vector& v);

}  // namespace contact_flow
