// SPDX-License-Identifier: BSD-3-Clause
#include "section_crossing.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr int kSamples = 16;           // of a step of the integrator
constexpr double kProbe = 1e-3;        // of a part of a step, at which its rates are seen
constexpr double kContinuous = 1e-12;  // relative change at an event that is none
constexpr int kHalvings = 60;
constexpr double kGolden = 0.6180339887498949;

class Search {
 public:
  Search(int number, const Section& section, double from, int size)
      : number_(number), section_(section), from_(from), x_(size) {}

  /// False: the arc has no crossing, which is then the first that is left.
  bool Pass(const Arc& arc) {
    arc_ = &arc;
    known_ = known_ && Continuous(arc.x_begin);
    for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
      AskBudget();
      const double begin = arc.dense.StepBegin(k), length = arc.dense.StepLength(k);
      for (int sample = 0; sample <= kSamples; ++sample) {
        const double t = std::min(arc.t_end, begin + length * sample / kSamples);
        if (t < from_) continue;
        if (!known_) Keep(std::max(from_, std::max(arc.t_begin, Before(begin, length, sample))));
        if (Part(t)) return true;
      }
    }
    end_ = arc.x_end(number_);
    return false;
  }

  double time() const { return time_; }

 private:
  static double Before(double begin, double length, int sample) {
    return sample > 0 ? begin + length * (sample - 1) / kSamples : begin;
  }

  bool Continuous(const Vector& x) const {
    const double begin = x(number_);
    return section_.kind == Section::Kind::kCoordinate ||
           std::abs(begin - end_) <= kContinuous * std::max(std::abs(begin), std::abs(end_));
  }

  double Height(double t) {
    arc_->dense.Evaluate(t, x_.data());
    return x_(number_) - section_.value;
  }

  void Keep(double t) {
    known_ = true;
    t_ = t;
    height_ = Height(t);
  }

  bool Counts(double before, double now) const {
    return (before < 0 && now >= 0 && section_.sign >= 0) ||
           (before > 0 && now <= 0 && section_.sign <= 0);
  }

  /// From t_ to t; goes on to there where nothing is crossed.
  bool Part(double t) {
    const double before = t_, height = height_;
    Keep(t);
    if (Counts(height, height_)) return Halve(before, height, t);
    if (!(t > before) || !(height * height_ > 0)) return false;
    const double probe = kProbe * (t - before);
    const double sign = height > 0 ? 1 : -1;
    if (!(sign * (Height(before + probe) - height) < 0) ||
        !(sign * (height_ - Height(t - probe)) > 0)) {
      return false;
    }
    const double turn = Turn(before, t, sign);
    const double least = Height(turn);
    if (!(sign * least < 0)) return false;
    if (Counts(height, least)) return Halve(before, height, turn);
    return Counts(least, height_) && Halve(turn, least, t);
  }

  /// Where the height, of one sign at both ends, comes next to zero or furthest beyond it.
  double Turn(double low, double high, double sign) {
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = sign * Height(a), at_b = sign * Height(b);
    for (int k = 0; k < kHalvings && a < b; ++k) {
      if (at_a < 0) return a;
      if (at_b < 0) return b;
      if (at_a < at_b) {
        high = b, b = a, at_b = at_a;
        a = high - kGolden * (high - low);
        at_a = sign * Height(a);
      } else {
        low = a, a = b, at_a = at_b;
        b = low + kGolden * (high - low);
        at_b = sign * Height(b);
      }
    }
    return 0.5 * (low + high);
  }

  bool Halve(double low, double at_low, double high) {
    for (int k = 0; k < kHalvings && high - low > 1e-16 * high; ++k) {
      const double middle = 0.5 * (low + high);
      ((at_low < 0) == (Height(middle) < 0) ? low : high) = middle;
    }
    time_ = 0.5 * (low + high);
    return true;
  }

  const int number_;
  const Section& section_;
  const double from_;
  Vector x_;
  const Arc* arc_ = nullptr;
  bool known_ = false;
  double t_ = 0, height_ = 0;  // the last one that is known
  double end_ = 0;             // of the arc before
  double time_ = 0;
};

}  // namespace

bool FirstCrossing(const MechanicalSystem& system, const Section& section, const Trajectory& run,
                   double from, double* time) {
  const bool velocity = section.kind == Section::Kind::kVelocity;
  const int number = section.index + (velocity ? system.num_positions() : 0);
  Search search(number, section, from, system.state_size());
  for (const Arc& arc : run.arcs) {
    if (!search.Pass(arc)) continue;
    *time = search.time();
    return true;
  }
  return false;
}

}  // namespace contact_flow
