// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/limit_locator.h"

#include <algorithm>
#include <cmath>

namespace contact_flow {
namespace {

/// A share this near to a limit is on neither side of it.
constexpr double kAt = 1e-12;
/// Part of a step along which a rate is a quotient.
constexpr double kQuotient = 1e-6;
/// A cubic that stays this far within a piece, relative to its range, excludes a passing.
constexpr double kRoom = 0.1;
constexpr int kMaxHalvings = 100;

std::optional<EffortPiece> PieceOf(double share) {
  if (std::abs(std::abs(share) - 1) <= kAt) return std::nullopt;
  return share > 1 ? EffortPiece::kUpper : share < -1 ? EffortPiece::kLower : EffortPiece::kFree;
}

/// The limit that is passed first on the way between two pieces.
double FirstBound(EffortPiece from, EffortPiece to) {
  if (from == EffortPiece::kFree) return static_cast<int>(to);
  return static_cast<int>(from);
}

}  // namespace

const char* EffortPieceName(EffortPiece piece) {
  static constexpr const char* kNames[] = {"lower", "free", "upper"};
  return kNames[static_cast<int>(piece) + 1];
}

LimitLocator::LimitLocator(const MechanicalSystem& system)
    : system_(system), limits_(dynamic_cast<const EffortLimits*>(&system)) {
  if (limits_ == nullptr) return;
  const auto count = static_cast<Eigen::Index>(limits_->limited_efforts().size());
  if (count == 0) limits_ = nullptr;
  x_.resize(system.state_size());
  samples_.resize(count, kSamples);
}

void LimitLocator::Shares(const Vector& x, Vector* share) {
  limits_->EffortShares(x.head(system_.num_positions()), x.tail(system_.dof()), u_, mode_, share);
}

void LimitLocator::SharesAndRates(const Vector& x, const VectorRef& xdot, double h, Vector* share,
                                  Vector* rate) {
  Shares(x, share);
  x_ = x + kQuotient * h * xdot;
  Shares(x_, &moved_);
  *rate = (moved_ - *share) / kQuotient;
}

/// Whether the cubics of values and rates at the ends leave it open.
bool LimitLocator::MayPass() {
  for (Eigen::Index i = 0; i < begin_.size(); ++i) {
    const double b[] = {begin_(i), begin_(i) + begin_rate_(i) / 3, end_(i) - end_rate_(i) / 3,
                        end_(i)};
    const auto [low, high] = std::minmax_element(b, b + 4);
    const double room = kRoom * (*high - *low);
    for (const double bound : {-1.0, 1.0}) {
      if (*low - room < bound && bound < *high + room) return true;
    }
  }
  return false;
}

double LimitLocator::ShareAt(Stepper* stepper, int effort, double theta) {
  stepper->Interpolate(theta, x_.data());
  Shares(x_, &share_);
  return share_(effort);
}

/// Of r − bound, which has different signs at the ends, by the Illinois method.
double LimitLocator::Root(Stepper* stepper, int effort, double bound, double begin, double end) {
  double low = ShareAt(stepper, effort, begin) - bound;
  double high = ShareAt(stepper, effort, end) - bound;
  int kept = 0;
  for (int k = 0; k < kMaxHalvings && end - begin > kAt; ++k) {
    double at = begin + (end - begin) * low / (low - high);
    if (!(at > begin && at < end)) at = 0.5 * (begin + end);
    const double value = ShareAt(stepper, effort, at) - bound;
    if (std::abs(value) <= 0.1 * kAt) return at;
    if ((value > 0) == (high > 0)) {
      end = at;
      high = value;
      if (kept == 1) low *= 0.5;
      kept = 1;
    } else {
      begin = at;
      low = value;
      if (kept == -1) high *= 0.5;
      kept = -1;
    }
  }
  return 0.5 * (begin + end);
}

/// Where the parabola through sample j and its neighbours turns, in samples from j on, if it does
/// so on another piece; else 0.
double LimitLocator::Turn(int effort, int j) const {
  if (j == 0 || j + 1 == kSamples) return 0;
  const double here = samples_(effort, j);
  const double before = samples_(effort, j - 1), behind = samples_(effort, j + 1);
  const double bend = before - 2 * here + behind, slope = 0.5 * (behind - before);
  const double turn = -slope / bend;
  if (!(std::abs(turn) < 1)) return 0;
  return PieceOf(here + 0.5 * slope * turn) != PieceOf(here) ? turn : 0;
}

std::optional<LimitLocator::Zero> LimitLocator::FirstZero(Stepper* stepper, int effort) {
  constexpr double kStep = 1.0 / (kSamples - 1);
  std::optional<EffortPiece> last;
  double known = 0;  // where `last` was
  std::optional<Zero> zero;
  const auto look = [&](double theta, double share) {
    const std::optional<EffortPiece> piece = PieceOf(share);
    if (zero || !piece) return;
    if (last && *last != *piece) {
      const double bound = FirstBound(*last, *piece);
      zero = Zero{effort, bound, Root(stepper, effort, bound, known, theta)};
    }
    last = piece;
    known = theta;
  };
  for (int j = 0; j < kSamples; ++j) {
    const double turn = Turn(effort, j), theta = (j + turn) * kStep;
    if (turn < 0) look(theta, ShareAt(stepper, effort, theta));
    look(j * kStep, samples_(effort, j));
    if (turn > 0) look(theta, ShareAt(stepper, effort, theta));
  }
  return zero;
}

std::optional<LimitLocator::Zero> LimitLocator::Locate(Stepper* stepper, const VectorRef& u,
                                                       ContactMode mode) {
  u_ = u;
  mode_ = mode;
  const double h = stepper->step();
  SharesAndRates(stepper->begin(), stepper->begin_field(), h, &begin_, &begin_rate_);
  SharesAndRates(stepper->end(), stepper->end_field(), h, &end_, &end_rate_);
  if (!end_.allFinite() || !end_rate_.allFinite() || !MayPass()) return std::nullopt;
  if (!stepper->extended()) stepper->Extend();
  for (int j = 0; j < kSamples; ++j) {
    stepper->Interpolate(j / (kSamples - 1.0), x_.data());
    Shares(x_, &share_);
    samples_.col(j) = share_;
  }
  std::optional<Zero> first;
  for (int i = 0; i < samples_.rows(); ++i) {
    const std::optional<Zero> zero = FirstZero(stepper, i);
    if (zero && (!first || zero->theta < first->theta)) first = zero;
  }
  return first;
}

double LimitLocator::AtEnd(const Stepper& stepper, const Zero& zero, const VectorRef& u,
                           ContactMode mode, double* rate) {
  u_ = u;
  mode_ = mode;
  const double h = stepper.step();
  SharesAndRates(stepper.end(), stepper.end_field(), h, &end_, &end_rate_);
  *rate = end_rate_(zero.effort) / h;
  return end_(zero.effort) - zero.bound;
}

std::vector<LimitPassing> LimitPassings(const MechanicalSystem& system, const Arc& arc) {
  std::vector<LimitPassing> passings;
  const auto* limits = dynamic_cast<const EffortLimits*>(&system);
  if (limits == nullptr || limits->limited_efforts().empty()) return passings;
  std::vector<std::optional<EffortPiece>> last(limits->limited_efforts().size());
  Vector x(system.state_size()), share;
  for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(k));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k));
    if (!(begin < end)) continue;
    arc.dense.Evaluate(0.5 * (begin + end), x.data());
    limits->EffortShares(x.head(system.num_positions()), x.tail(system.dof()), arc.u, arc.mode,
                         &share);
    for (std::size_t i = 0; i < last.size(); ++i) {
      const std::optional<EffortPiece> piece = PieceOf(share(static_cast<Eigen::Index>(i)));
      if (!piece) continue;
      if (last[i] && *last[i] != *piece) {
        passings.push_back({begin, static_cast<int>(i), *last[i], *piece});
      }
      last[i] = piece;
    }
  }
  return passings;
}

}  // namespace contact_flow
