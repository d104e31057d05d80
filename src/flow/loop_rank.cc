// SPDX-License-Identifier: BSD-3-Clause
// Closed loops that lose their rank on the way: bars that come to lie in one line may go on in
// several ways, and no step across that is told from one onto another branch.
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>

#include "contact_flow/flow/dense_step.h"
#include "contact_flow/flow/flow.h"
#include "dead_end.h"
#include "dependent_row.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

/// Part of a row below which its rank is lost; rows that change by less than the second part of
/// what they have keep it.
constexpr double kLost = 1e-7, kHardlyChanged = 0.25;
/// A step that ends nearer than that, by less than the second part of how near it began, leads
/// there. The run ends where such a step begins that near, or is so short, of max(1, t) [s]:
/// further on rounding chooses the branch.
constexpr double kNear = 1e-4, kNearer = 0.7, kThere = 1e-3, kSoon = 1e-5;
constexpr int kPlaces = 16, kBits = 26;  // half of all, as minima are found

/// Whether f, which is `begin` and `end` at the ends of [0, 1], vanishes inside, as far as known.
template <class F>
bool VanishesWithin(double begin, double end, const F& f, double known) {
  int lowest = 0;
  double least = begin;
  for (int k = 1; k < kPlaces; ++k) {
    const double here = f(static_cast<double>(k) / kPlaces);
    if (here < least) lowest = k;
    least = std::min(least, here);
  }
  const double low = std::max(0, lowest - 1), high = lowest + 1;
  using boost::math::tools::brent_find_minima;
  least = brent_find_minima(f, low / kPlaces, high / kPlaces, kBits).second;
  const double lost = std::clamp(known, kLost, kHardlyChanged);
  return least <= lost && least < 0.5 * std::min(begin, end);
}

}  // namespace

/// Whether bilateral rows become dependent inside the step that was tried, on all of its way. The
/// run ends where such a step begins near, or is short.
bool Flow::LosesLoop() {
  if (system_.num_bilateral() == 0) return false;
  const int nq = system_.num_positions(), d = system_.dof();
  const auto rows_at = [&](const Vector& x) -> Matrix {
    system_.Constraints(x.head(nq), x.tail(d), &terms_);
    return RowLayout(system_).Bilateral(terms_.jacobian);
  };
  const Matrix begin = rows_at(x_), end = rows_at(stepper_->end());
  if (begin == end) return false;  // gears
  const Vector size = begin.rowwise().norm();
  loop_size_ = loop_size_.size() > 0 ? loop_size_.cwiseMax(size).eval() : size;
  const auto part = [&](const Matrix& rows) { return MostDependent(rows, loop_size_).part; };
  const double at_begin = part(begin), at_end = part(end);
  const Vector change = (end - begin).rowwise().norm();
  const double changed = change.cwiseQuotient(loop_size_).maxCoeff();
  if (changed <= kHardlyChanged * std::min(at_begin, at_end)) return false;
  const bool nears = at_end <= kNear && at_end < kNearer * at_begin;
  const auto inside = [&](double theta) {
    if (!stepper_->extended()) stepper_->Extend();
    Vector x(nq + d);
    EvaluateDenseStep(stepper_->dense(), nq + d, theta, x.data());
    return part(rows_at(x));
  };
  const double known = kLeap * (options_.absolute_tolerance + options_.relative_tolerance);
  if (!nears && !VanishesWithin(at_begin, at_end, inside, known)) return false;
  if (at_begin <= kThere || stepper_->step() <= kSoon * std::max(1.0, t_)) {
    Stop(Outcome::kNonFinite,
         "closed loops lose their rank just ahead" + LostLoop(system_, x_, loop_size_));
  }
  return true;
}

}  // namespace contact_flow
