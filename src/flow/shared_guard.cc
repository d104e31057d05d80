// SPDX-License-Identifier: BSD-3-Clause
#include "shared_guard.h"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <utility>
#include <vector>

namespace contact_flow {
namespace {

constexpr int kSharedPieces = 2, kMaxSamples = 400;
/// Pieces are not halved below this length.
constexpr double kShortestPiece = 1e-13;
/// A sign change counts where forces are straight to this part of the margin's change.
constexpr double kStraight = 0.1;
/// Of the margin, relative to forces: a cone program is solved to this.
constexpr double kSharedRounding = 1e-13;

/// What the bend of the forces makes of the margin.
double Bend(const SharedMargin& a, const SharedMargin& m, const SharedMargin& b) {
  const double s = (m.theta - a.theta) / (b.theta - a.theta);
  const Vector bend = m.force - (1 - s) * a.force - s * b.force;
  return std::max({std::abs(a.gradient.dot(bend)), std::abs(m.gradient.dot(bend)),
                   std::abs(b.gradient.dot(bend))});
}

}  // namespace

void SearchSharedMargin(int guard, double floor,
                        const std::function<SharedMargin(double theta)>& sample,
                        LocatedEvent* event) {
  int samples = 0;
  const auto at = [&](double theta) {
    ++samples;
    return sample(theta);
  };
  std::vector<SharedMargin> ends;  // of the pieces, the last one first
  for (int k = kSharedPieces; k >= 0; --k)
    ends.push_back(at(static_cast<double>(k) / kSharedPieces));
  SharedMargin begin = std::move(ends.back());
  ends.pop_back();
  while (!ends.empty() && begin.theta < event->theta) {
    const SharedMargin& end = ends.back();
    const double length = end.theta - begin.theta;
    SharedMargin middle = at(begin.theta + 0.5 * length);
    const double known = begin.value + middle.value + end.value;
    if (samples > kMaxSamples || !std::isfinite(known)) {
      event->found = false;
      event->theta = begin.theta;
      event->constraint = guard;
      return;
    }
    const double lowest = std::min({begin.value, middle.value, end.value});
    const double highest = std::max({begin.value, middle.value, end.value});
    const double bend = Bend(begin, middle, end);
    const double noise = std::max(floor, kSharedRounding * end.force.cwiseAbs().maxCoeff());
    const bool clear = lowest - bend > -noise;
    const bool resolved = bend <= std::max(kStraight * (highest - lowest), noise);
    if (!clear && !resolved && length > kShortestPiece) {
      ends.push_back(std::move(middle));
      continue;
    }
    // Clear, or too short to tell; what is amiss at the begin alone was taken for none there.
    if (!(std::min(middle.value, end.value) < -noise)) {
      begin = std::move(ends.back());
      ends.pop_back();
      continue;
    }
    const SharedMargin& low = middle.value < -noise ? middle : end;
    const SharedMargin& high = middle.value < -noise ? begin : middle;
    double root = high.theta;
    if (high.value > 0) {
      boost::uintmax_t iterations = 60;
      const auto bracket = boost::math::tools::toms748_solve(
          [&](double theta) { return at(theta).value; }, high.theta, low.theta, high.value,
          low.value, boost::math::tools::eps_tolerance<double>(48), iterations);
      root = 0.5 * (bracket.first + bracket.second);
    }
    if (root > event->theta || (root == event->theta && event->found)) return;
    event->found = true;
    event->theta = root;
    event->constraint = guard;
    event->touch = false;
    return;
  }
}

}  // namespace contact_flow
