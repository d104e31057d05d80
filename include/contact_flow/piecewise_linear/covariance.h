// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How moments were had.
enum class CovarianceMethod {
  kLinear = 0,  ///< one linear map: exact
  kTruncation =
      1,  ///< two pieces on half-spaces: exact, by the moments of a truncated normal variable
  kCubature = 2,  ///< points on the sphere: approximate, see the errors
};

/// "linear", …
const char* CovarianceMethodName(CovarianceMethod method);

/// Settings of the propagation.
struct CovarianceOptions {
  int rotations = 1000;  ///< of the cubature rule, 2·rank(P) points each
  unsigned seed = 1;     ///< of the rotations: the same seed gives the same answer
};

/// First and second moments of f(w).
struct OutcomeCovariance {
  CovarianceMethod method = CovarianceMethod::kLinear;  ///< how it was computed
  Vector mean;                                          ///< E f(w) [r]; not 0 where f is kinked
  Matrix covariance;            ///< E (f(w) − mean)(f(w) − mean)ᵀ [r×r]
  double mean_error = 0;        ///< largest standard error over the entries, 0 where exact
  double covariance_error = 0;  ///< the same
  long points = 0;              ///< at which f was evaluated
};

/// The covariance of f(w), w normal with mean 0 and covariance P [n×n] (positive semidefinite), for
/// f piecewise linear: estimation through contact, by saltation matrices at isolated events, by
/// cones at clusters.
///   One piece:       A P Aᵀ.
///   Two half-spaces: f(w) = A w + k max(n·w, 0), σ² = nᵀPn:  mean k σ/√(2π),
///                    covariance A P Aᵀ + ½(A P n kᵀ + k nᵀP Aᵀ) + k kᵀ σ² (½ − 1/(2π)).
///   Otherwise w = P^{1/2} ρ s with s on the unit sphere: f(w) = ρ f(P^{1/2} s), so that the radius
///   ρ is integrated exactly and s by the rule {±Q e_i}, averaged over rotations Q. The rule is
///   exact for linear f.
/// Throws std::invalid_argument unless P is symmetric and positive semidefinite, and for rotations
/// below 1.
OutcomeCovariance PropagateCovariance(const PiecewiseLinearMap& map, const MatrixRef& P,
                                      const CovarianceOptions& options = {});

}  // namespace contact_flow
