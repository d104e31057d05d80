// SPDX-License-Identifier: BSD-3-Clause
#include "dense_solve.h"

#include <Eigen/LU>

namespace contact_flow {

void SolveDense(Matrix* A, Matrix* B) {
#if CONTACT_FLOW_HAVE_AVX2
  static const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (wide) {
    SolveDenseAvx2(A->data(), B->data(), static_cast<int>(A->rows()), static_cast<int>(B->cols()));
    return;
  }
#endif
  const Eigen::PartialPivLU<Eigen::Ref<Matrix>> factors(*A);  // in place
  *B = factors.solve(*B);
}

}  // namespace contact_flow
