// SPDX-License-Identifier: BSD-3-Clause
// Compiled without contraction of a * b + c (cmake/core.cmake): the bits are those of any machine.
#include <cmath>
#include <limits>

#include "contact_flow/ensemble/philox.h"

namespace contact_flow {
namespace {

/// The coefficients of a numerator or denominator, highest power first.
template <int n>
double Polynomial(const double (&c)[n], double x) {
  double sum = c[0];
  for (int k = 1; k < n; ++k) sum = sum * x + c[k];
  return sum;
}

/// log x for x > 0, by x = m 2ᵉ, m ∈ [1/√2, √2): e log 2 + 2 artanh((m − 1)/(m + 1)). The series
/// ends where its next term is below 1e-18.
double Logarithm(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < 0.70710678118654752) {
    m *= 2;
    --exponent;
  }
  const double z = (m - 1) / (m + 1), square = z * z;
  double sum = 0;
  for (int k = 23; k >= 1; k -= 2) sum = sum * square + 1.0 / k;
  return exponent * 0.69314718055994531 + 2 * z * sum;
}

// Wichura, Algorithm AS 241, PPND16.
constexpr double kCentreUp[] = {2.5090809287301226727e3, 3.3430575583588128105e4,
                                6.7265770927008700853e4, 4.5921953931549871457e4,
                                1.3731693765509461125e4, 1.9715909503065514427e3,
                                1.3314166789178437745e2, 3.3871328727963666080e0};
constexpr double kCentreDown[] = {5.2264952788528545610e3, 2.8729085735721942674e4,
                                  3.9307895800092710610e4, 2.1213794301586595867e4,
                                  5.3941960214247511077e3, 6.8718700749205790830e2,
                                  4.2313330701600911252e1, 1};
constexpr double kMiddleUp[] = {7.74545014278341407640e-4, 2.27238449892691845833e-2,
                                2.41780725177450611770e-1, 1.27045825245236838258e0,
                                3.64784832476320460504e0,  5.76949722146069140550e0,
                                4.63033784615654529590e0,  1.42343711074968357734e0};
constexpr double kMiddleDown[] = {1.05075007164441684324e-9, 5.47593808499534494600e-4,
                                  1.51986665636164571966e-2, 1.48103976427480074590e-1,
                                  6.89767334985100004550e-1, 1.67638483018380384940e0,
                                  2.05319162663775882187e0,  1};
constexpr double kTailUp[] = {2.01033439929228813265e-7, 2.71155556874348757815e-5,
                              1.24266094738807843860e-3, 2.65321895265761230930e-2,
                              2.96560571828504891230e-1, 1.78482653991729133580e0,
                              5.46378491116411436990e0,  6.65790464350110377720e0};
constexpr double kTailDown[] = {2.04426310338993978564e-15, 1.42151175831644588870e-7,
                                1.84631831751005468180e-5,  7.86869131145613259100e-4,
                                1.48753612908506148525e-2,  1.36929880922735805310e-1,
                                5.99832206555887937690e-1,  1};

}  // namespace

double NormalQuantile(double p) {
  if (!(p >= 0 && p <= 1)) return std::numeric_limits<double>::quiet_NaN();
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * Polynomial(kCentreUp, r) / Polynomial(kCentreDown, r);
  }
  const double tail = q < 0 ? p : 1 - p;
  if (tail == 0)
    return q < 0 ? -std::numeric_limits<double>::infinity()
                 : std::numeric_limits<double>::infinity();
  const double r = std::sqrt(-Logarithm(tail));
  const double z = r <= 5 ? Polynomial(kMiddleUp, r - 1.6) / Polynomial(kMiddleDown, r - 1.6)
                          : Polynomial(kTailUp, r - 5) / Polynomial(kTailDown, r - 5);
  return q < 0 ? -z : z;
}

}  // namespace contact_flow
