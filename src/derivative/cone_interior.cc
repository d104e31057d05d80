// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/cone_interior.h"

#if CONTACT_FLOW_HAVE_CLP
#include <coin/ClpSimplex.hpp>
#include <vector>
#endif

namespace contact_flow {

#if CONTACT_FLOW_HAVE_CLP

bool HaveLinearPrograms() { return true; }

bool HasInterior(const Matrix& cone) {
  constexpr double kInterior = 1e-9;
  const int rows = static_cast<int>(cone.rows()), n = static_cast<int>(cone.cols());
  if (rows == 0) return true;
  // Columns w_1 … w_n, t; Clp minimizes −t subject to cone·w − t ≥ 0.
  std::vector<CoinBigIndex> start;
  std::vector<int> index;
  std::vector<double> value;
  for (int c = 0; c <= n; ++c) {
    start.push_back(static_cast<CoinBigIndex>(index.size()));
    for (int r = 0; r < rows; ++r) {
      index.push_back(r);
      value.push_back(c < n ? cone(r, c) : -1);
    }
  }
  start.push_back(static_cast<CoinBigIndex>(index.size()));
  std::vector<double> lower(n + 1, -1), upper(n + 1, 1), objective(n + 1, 0);
  objective[n] = -1;
  const std::vector<double> row_lower(rows, 0), row_upper(rows, COIN_DBL_MAX);
  ClpSimplex problem;
  problem.setLogLevel(0);
  problem.loadProblem(n + 1, rows, start.data(), index.data(), value.data(), lower.data(),
                      upper.data(), objective.data(), row_lower.data(), row_upper.data());
  problem.primal();
  return !problem.isProvenOptimal() || -problem.objectiveValue() > kInterior;
}

#else

bool HaveLinearPrograms() { return false; }
bool HasInterior(const Matrix&) { return true; }

#endif

}  // namespace contact_flow
