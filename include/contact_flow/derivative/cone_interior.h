// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/types.h"

namespace contact_flow {

/// True when the linear-programming library (Clp) is compiled in.
bool HaveLinearPrograms();

/// Does {w : cone·w ≥ 0} have interior? Decided by the linear program
///   max t  subject to  cone·w ≥ t,  |w_k| ≤ 1,  t ≤ 1,
/// whose optimum must exceed 1e-9 (rows are unit normals). Without the library: always true.
bool HasInterior(const Matrix& cone);

}  // namespace contact_flow
