// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/types.h"

namespace contact_flow {

/// A [n×n] ← its LU factors, B [n×columns] ← A⁻¹ B, by row pivots; with vectors of four numbers and
/// fused products where the machine has them, which halves to quarters the time.
void SolveDense(Matrix* A, Matrix* B);

/// The same of arrays, column by column, for machines with AVX2 and FMA (dense_solve_avx2.cc).
void SolveDenseAvx2(double* A, double* B, int n, int columns);

}  // namespace contact_flow
