// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <sstream>

#include "contact_flow/analysis/orbit_sizes.h"

namespace contact_flow {
namespace {

constexpr double kSameWay = 1e-4;  // of one return and the next, beside the size of the motion
constexpr double kGrown = 10;  // … or so many times what DP makes of the distance from the orbit

/// The largest growth of a tangent by DP, in sizes.
double GrowthOf(const PiecewiseLinearMap& map, const Vector& sizes) {
  double growth = 1;
  for (const LinearPiece& piece : map.pieces()) {
    const Matrix scaled = sizes.cwiseInverse().asDiagonal() * piece.matrix.leftCols(sizes.size()) *
                          sizes.asDiagonal();
    growth = std::max(growth, scaled.cwiseAbs().rowwise().sum().maxCoeff());
  }
  return growth;
}

}  // namespace

std::string NextReturnDiffers(const MechanicalSystem& system, const PoincareMap& map,
                              const VectorRef& x, const PoincareReturn& one,
                              const MatrixRef& neutral) {
  const Matrix none(2 * system.dof(), 0);
  if (neutral.cols() == 0 || OffOrbit(system, x, one, none) <= kOnOrbit) return "";
  const PoincareReturn next = map.Return(one.x, false);
  if (!next.returned()) return "there is no next return: " + next.message;
  const OrbitSizes sizes = SizesOf(system, one.trajectory);
  const Vector way = system.Separation(one.x, x), next_way = system.Separation(next.x, one.x);
  const double apart =
      std::max(sizes.Compare(next_way - way), std::abs(next.time - one.time) / sizes.time);
  const double off = OffOrbit(system, x, one, neutral);
  if (apart <= std::max(kSameWay, kGrown * GrowthOf(one.map, sizes.Larger()) * off)) return "";
  std::ostringstream text;
  text.precision(3);
  text << "the next return differs by " << apart << ", relative";
  return text.str();
}

}  // namespace contact_flow
