// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

/// What tells apart words of contacts that all fit.
namespace contact_flow {

/// Motions that differ by less than this, relative, are one.
constexpr double kSameMotion = 1e-8;
/// Accelerations that differ by less than this a look ahead, relative, are one motion.
constexpr double kSameAhead = 1e-11;

/// The guards of one word that hold at a touching contact: what has to stay positive.
struct Slack {
  int constraint;
  double value;
  bool cone = false;  // of a contact that sticks
};

/// What becomes of the slacks of a word that are nearly used up.
struct Trend {
  double growth = std::numeric_limits<double>::infinity();  // the smallest, in roundings
  Matrix accelerations;                                     // now, and a little later
};

/// Whether the words of these trends are one motion, now and a little later.
inline bool SameMotion(const std::vector<Trend>& trends) {
  for (const Trend& trend : trends) {
    const Matrix& first = trends.front().accelerations;
    const double size = first.cwiseAbs().maxCoeff();
    const Matrix apart = (trend.accelerations - first).cwiseAbs();
    if (!(apart.col(0).maxCoeff() <= kSameMotion * size)) return false;
    if (!(apart.col(1).maxCoeff() <= kSameAhead * size)) return false;
  }
  return !trends.empty();
}

/// With the fewest in contact, and of these with the most that stick.
inline ContactMode Simplest(const std::vector<ContactMode>& words) {
  return *std::min_element(
      words.begin(), words.end(), [](const ContactMode& a, const ContactMode& b) {
        return a.Size() != b.Size() ? a.Size() < b.Size()
                                    : a.Sticking().Size() > b.Sticking().Size();
      });
}

/// With the most that stick, and of these with the most in contact.
inline ContactMode MostSticking(const std::vector<ContactMode>& words) {
  return *std::max_element(words.begin(), words.end(),
                           [](const ContactMode& a, const ContactMode& b) {
                             const int stick = a.Sticking().Size() - b.Sticking().Size();
                             return stick != 0 ? stick < 0 : a.Size() < b.Size();
                           });
}

}  // namespace contact_flow
