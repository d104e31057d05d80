// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "contact_flow/autodiff.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Heights z(x, y) of a terrain that are given on a regular grid, between by a bicubic spline with
/// continuous second derivatives: it takes the given heights on the grid, is straight across its
/// borders and goes on straight beyond them.
class HeightGrid {
 public:
  struct Frame {
    double x = 0, y = 0;    ///< of the first height [m]
    double dx = 1, dy = 1;  ///< steps along x and y [m]
  };

  /// `heights` [columns along x × rows along y], [m]. Throws std::invalid_argument where there are
  /// fewer than two each way, steps that are not positive, or heights that are not finite.
  HeightGrid(const Frame& frame, const Matrix& heights);

  const Frame& frame() const { return frame_; }
  /// Heights along x and y.
  int nx() const { return static_cast<int>(weight_.rows()) - 2; }
  int ny() const { return static_cast<int>(weight_.cols()) - 2; }

  /// z at (x, y), and its slopes.
  template <class S>
  void At(const S& x, const S& y, S* height, S* slope_x, S* slope_y) const {
    S px[4], dx[4], py[4], dy[4];
    const int i = Weights(S((x - frame_.x) / frame_.dx), nx(), px, dx);
    const int j = Weights(S((y - frame_.y) / frame_.dy), ny(), py, dy);
    *height = *slope_x = *slope_y = S(0.0);
    for (int b = 0; b < 4; ++b) {
      S along = S(0.0), rise = S(0.0);
      for (int a = 0; a < 4; ++a) {
        along += px[a] * weight_(i + a, j + b);
        rise += dx[a] * weight_(i + a, j + b);
      }
      *height += py[b] * along;
      *slope_x += py[b] * rise / frame_.dx;
      *slope_y += dy[b] * along / frame_.dy;
    }
  }

 private:
  static double Plain(double t) { return t; }
  template <class S, int N>
  static double Plain(const Dual<S, N>& t) {
    return Plain(t.value);
  }
  /// The first of the four B-splines that are not zero at s, in steps from the first of n heights;
  /// their values and rates. Beyond the border these go on as straight lines.
  template <class S>
  static int Weights(const S& s, int n, S* value, S* rate) {
    const double at = Plain(s);
    const bool below = !(at >= 0), above = at > n - 1;  // NaN has a cell, too
    const int cell = below ? 0 : above ? n - 2 : std::min(static_cast<int>(at), n - 2);
    const S t = below ? S(0.0) : above ? S(1.0) : S(s - static_cast<double>(cell));
    const S r = 1.0 - t;
    value[0] = r * r * r / 6.0;
    value[1] = (4.0 + t * t * (3.0 * t - 6.0)) / 6.0;
    value[2] = (4.0 + r * r * (3.0 * r - 6.0)) / 6.0;
    value[3] = t * t * t / 6.0;
    rate[0] = -0.5 * (r * r);
    rate[1] = t * (1.5 * t - 2.0);
    rate[2] = -(r * (1.5 * r - 2.0));
    rate[3] = 0.5 * (t * t);
    if (below || above) {
      const S beyond = below ? s : S(s - static_cast<double>(n - 1));
      for (int k = 0; k < 4; ++k) value[k] += beyond * rate[k];
    }
    return cell;
  }

  Frame frame_;
  Matrix weight_;  // of the B-splines about each height and one beyond each border
};

}  // namespace contact_flow
