// SPDX-License-Identifier: BSD-3-Clause
// Compiled for AVX2 and FMA. Its Eigen has another name, so that no function compiled here takes
// the place of one that all machines run; nothing else of the library is included.
#if CONTACT_FLOW_HAVE_AVX2

#define Eigen EigenForAvx2
#include <Eigen/LU>

namespace contact_flow {

void SolveDenseAvx2(double* A, double* B, int n, int columns) {
  using Matrix = Eigen::MatrixXd;
  Eigen::Map<Matrix> given(A, n, n), asked(B, n, columns);
  // Copies begin at multiples of 32 bytes: last digits would else depend on where A and B lie.
  Matrix left = given, right = asked;
  const Eigen::PartialPivLU<Eigen::Ref<Matrix>> factors(left);  // in place
  factors.permutationP().applyThisOnTheLeft(right);
  factors.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(right);
  factors.matrixLU().triangularView<Eigen::Upper>().solveInPlace(right);
  given = left;
  asked = right;
}

}  // namespace contact_flow

#undef Eigen
#endif
