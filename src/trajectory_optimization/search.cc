// SPDX-License-Identifier: BSD-3-Clause
#include "search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kArmijo = 1e-4, kLongStep = 0.25;  // shares of the promised decrease
constexpr int kMaxHalvings = 30, kMaxDampings = 8;
/// Steps are halved this often for a run that meets all constraints that the one before met, and
/// taken where the cost falls by this part of what it falls by otherwise.
constexpr int kHalvingsToKeep = 4;
constexpr double kPartToKeep = 0.5;

/// Whether all constraints are met that were.
bool Keeps(const FacePoint& from, const FacePoint& to) {
  for (std::size_t i = 0; i < from.met.size() && i < to.met.size(); ++i) {
    if (from.met[i] > 0 && to.met[i] == 0) return false;
  }
  return true;
}

/// Whether to go to `kept` rather than to `other`, where a constraint is no longer met.
bool Prefers(const FacePoint& from, const FacePoint& kept, const FacePoint& other) {
  return !std::isfinite(other.cost) ||
         from.cost - kept.cost >= kPartToKeep * (from.cost - other.cost);
}
constexpr double kFirstDamping = 1e-3;  // of the diagonal of H
/// Curvature is asked where the promised decrease, relative to 1 + L, is below the first, and less
/// than the second part of it has come: H may be too small. It may be too large as well, which
/// keeps all that it promises, where more than the third part of what was promised before still is.
constexpr double kNear = 1e-4, kWellPromised = 0.5, kSlow = 0.1;
/// Of a cost that is small beside 1, decreases that are promised count down to this part of it, for
/// so many steps that make it smaller; below 1e-20 they are rounding.
constexpr double kFine = 1e-8, kRounding = 1e-20;
constexpr int kMaxFine = 20;

/// Why a piece has no step, or all have none; empty where they have. A piece that no step leads
/// into does not count beside others.
std::string Unsolved(const std::vector<PieceStep>& steps) {
  std::string unreachable;
  bool any = false;
  for (const PieceStep& step : steps) {
    any = any || step.solved;
    if (step.solved) continue;
    if (step.reachable) return step.failure;
    unreachable = step.failure;
  }
  return any ? "" : unreachable;
}

double PromisedBy(const std::vector<PieceStep>& steps) {
  double promised = 0;
  for (const PieceStep& step : steps) {
    if (step.solved) promised = std::max(promised, step.decrease);
  }
  return promised;
}

}  // namespace

FacePoint Search::At(const Vector& y) {
  return Evaluate(unknowns_, multipliers_, y, {}, &result_.simulations);
}

PieceModels Search::ModelsAt(const Vector& y) {
  ++result_.derivatives;
  PieceModels models;
  try {
    models = MakePieceModels(unknowns_, y, options_.max_pieces, multipliers_);
  } catch (const std::invalid_argument& refusal) {
    models.status = {Outcome::kNotDifferentiable, refusal.what()};
  } catch (const std::domain_error& refusal) {
    models.status = {Outcome::kNotDifferentiable, refusal.what()};
  }
  CheckBudget(models.status);
  return models;
}

/// The point is an iterate; false where the search is to end.
bool Search::Take(const FacePoint& point, double step, int pieces, KinkStatus kink) {
  if (point.cost < best_.cost) best_ = point;
  const int number = static_cast<int>(result_.iterations.size());
  result_.iterations.push_back(
      {number, point.plain, best_.plain, point.violation, step, pieces, kink});
  if (options_.progress && !options_.progress(result_.iterations.back(), point.y)) {
    End(TrajectoryVerdict::kCancelled, "the caller asked to stop");
    return false;
  }
  if (number >= options_.max_iterations) {
    End(TrajectoryVerdict::kMaxIterations,
        "max_iterations = " + std::to_string(options_.max_iterations) + " were made");
    return false;
  }
  return true;
}

bool Search::Ended() const {
  return result_.verdict == TrajectoryVerdict::kCancelled ||
         result_.verdict == TrajectoryVerdict::kMaxIterations;
}

bool Search::IsMinimum() const {
  return result_.verdict == TrajectoryVerdict::kValley ||
         result_.verdict == TrajectoryVerdict::kSmoothMinimum;
}

void Search::Descend(FacePoint point) {
  double damping = 0, undamped = 0;                         // what is promised without
  double before = std::numeric_limits<double>::infinity();  // … by the iterate before
  int fine = 0;
  for (;;) {
    AskBudget();
    const PieceModels models = ModelsAt(point.y);
    no_derivative_ = !models.status.ok();
    if (no_derivative_) {
      const bool first = result_.iterations.size() <= 1;
      return End(first ? TrajectoryVerdict::kUndefined : TrajectoryVerdict::kStalled,
                 models.status.message);
    }
    const std::vector<PieceStep> steps = StepsOf(models, point.y, damping);
    if (damping == 0) {
      std::vector<Vector> multipliers;
      for (const PieceStep& step : steps) multipliers.push_back(step.multipliers);
      curvature_.Learn(point.y, models, multipliers);
    }
    const double promised = PromisedBy(steps);
    const bool slow = damping == 0 && promised > kSlow * before;
    if (damping == 0) undamped = before = promised;
    const double none = tolerance_ * (1 + std::abs(point.cost));
    const TrajectoryVerdict verdict = Verdict(models, steps);
    const bool all_solved = verdict != TrajectoryVerdict::kStalled;
    const bool is_least = promised <= none && damping == 0 && all_solved;
    const bool is_fine = is_least && fine < kMaxFine && IsWorthFineSteps(point, promised);
    if (is_least && !is_fine && !MayGoOn()) return End(verdict, "");
    FacePoint next = point;
    KinkStatus kink = KinkStatus::kNone;
    bool steps_on = false;
    if (!is_least || is_fine) {
      steps_on = Step(models, steps, point, none, damping, &next, &kink);
    }
    const bool near = damping == 0 && promised <= kNear * (1 + std::abs(point.cost));
    const auto try_curved = [&](const PieceModels& curved) {
      FacePoint other;
      KinkStatus its_kink = KinkStatus::kNone;
      const std::vector<PieceStep> its_steps = StepsOf(curved, point.y, 0);
      if (is_least && !is_fine && !(PromisedBy(its_steps) > none)) return;
      if (!Step(curved, its_steps, point, none, 0, &other, &its_kink)) return;
      if (steps_on && !(other.cost < next.cost)) return;
      next = other;
      kink = its_kink;
      steps_on = true;
    };
    if (near && (!is_least || is_fine) &&
        !(steps_on && point.cost - next.cost >= kWellPromised * promised)) {
      PieceModels curved = models;
      if (curvature_.Add(&curved)) try_curved(curved);
    }
    if (damping == 0 && (slow || is_least)) {
      PieceModels curved = models;
      if (curvature_.Replace(&curved)) try_curved(curved);
    }
    // What the learnt curvature promises beyond H counts where it comes.
    if (is_least && !is_fine && !(steps_on && point.cost - next.cost > none)) {
      return End(verdict, "");
    }
    if (steps_on) {
      const double length = (next.y - point.y).cwiseAbs().maxCoeff();
      point = next;
      damping = damping > kFirstDamping ? damping / 10 : 0;
      if (!Take(point, length, static_cast<int>(models.pieces.size()), kink)) return;
      if (is_fine) ++fine;
      continue;
    }
    if (is_least) return End(verdict, "");
    damping = damping == 0 ? kFirstDamping : 10 * damping;
    if (damping > std::pow(10.0, kMaxDampings) * kFirstDamping) {
      // Where more than what was asked for is tried, for the conditions, what is found counts.
      if (undamped <= options_.tolerance * (1 + std::abs(point.cost)) && all_solved) {
        return End(verdict, "");
      }
      return End(TrajectoryVerdict::kStalled,
                 all_solved ? "no step makes the cost smaller" : Unsolved(steps));
    }
  }
}

/// Whether a promise that counts as none beside 1 is much of the cost. With conditions multipliers
/// ask for more by themselves.
bool Search::IsWorthFineSteps(const FacePoint& point, double promised) const {
  return MayGoOn() && unknowns_.problem().conditions.empty() &&
         promised > std::max(kFine * std::abs(point.cost), kRounding);
}

/// Whether steps beyond a minimum are asked for.
bool Search::MayGoOn() const {
  return options_.certify && tolerance_ > 0 &&
         static_cast<int>(result_.iterations.size()) < options_.max_iterations;
}

std::vector<PieceStep> Search::StepsOf(const PieceModels& models, const Vector& y,
                                       double damping) const {
  std::vector<PieceStep> steps;
  for (const PieceModel& piece : models.pieces) {
    steps.push_back(
        SolvePiece(piece, y, unknowns_.lower(), unknowns_.upper(), OrderRule::kKeep, {}, damping));
  }
  return steps;
}

TrajectoryVerdict Search::Verdict(const PieceModels& models,
                                  const std::vector<PieceStep>& steps) const {
  if (!Unsolved(steps).empty()) return TrajectoryVerdict::kStalled;
  return models.pieces.size() > 1 ? TrajectoryVerdict::kValley : TrajectoryVerdict::kSmoothMinimum;
}

/// Rows of a piece that a step ends on.
std::vector<int> Search::Active(const PieceModel& piece, const PieceStep& step,
                                bool only_near) const {
  std::vector<int> active;
  for (std::size_t r = 0; r < piece.orders.size(); ++r) {
    const bool near = std::abs(piece.orders[r].slack) <= 2 * unknowns_.problem().kink_interval;
    const bool is = step.multipliers(static_cast<Eigen::Index>(r)) > 0;
    if (is && (near || !only_near)) active.push_back(static_cast<int>(r));
  }
  return active;
}

/// A point with a smaller cost, by the pieces in the order of what they promise. Where a shorter
/// step still meets what is met, it is taken: without it the cost may depend on nothing more.
bool Search::Step(const PieceModels& models, const std::vector<PieceStep>& steps,
                  const FacePoint& point, double none, double damping, FacePoint* next,
                  KinkStatus* kink) {
  FacePoint other;  // that does not meet one of them
  if (models.pieces.size() == 1 && LongStep(models.pieces.front(), point, damping, next)) {
    if (Keeps(point, *next)) return true;
    other = *next;
  }
  std::vector<std::size_t> order(steps.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return steps[a].decrease > steps[b].decrease;
  });
  const long falling = std::count_if(steps.begin(), steps.end(), [&](const PieceStep& step) {
    return step.solved && step.decrease > none;
  });
  for (std::size_t i : order) {
    const PieceStep& step = steps[i];
    if (!step.solved || !(step.decrease > 0)) continue;
    if (!LineSearch(models.pieces[i], step, point, next)) continue;
    if (!Prefers(point, *next, other)) break;
    if (models.pieces.size() > 1) {
      const bool follows = !Active(models.pieces[i], step, true).empty();
      *kink = follows       ? KinkStatus::kFollowed
              : falling > 1 ? KinkStatus::kRidge
                            : KinkStatus::kPassed;
    }
    return true;
  }
  if (!std::isfinite(other.cost)) return false;
  *next = other;
  return true;
}

/// Beyond the piece, where the cost keeps what the model promises.
bool Search::LongStep(const PieceModel& piece, const FacePoint& point, double damping,
                      FacePoint* next) {
  const PieceStep step = SolvePiece(piece, point.y, unknowns_.lower(), unknowns_.upper(),
                                    OrderRule::kIgnore, {}, damping);
  if (!step.solved || !(step.decrease > 0)) return false;
  const FacePoint trial = At(Clamped(point.y + step.d));
  if (!(point.cost - trial.cost >= kLongStep * step.decrease)) return false;
  *next = trial;
  return true;
}

bool Search::LineSearch(const PieceModel& piece, const PieceStep& step, const FacePoint& point,
                        FacePoint* next) {
  FacePoint other;  // that does not meet one of them
  double alpha = 1;
  for (int halving = 0; halving < kMaxHalvings; ++halving, alpha /= 2) {
    AskBudget();
    if (halving > kHalvingsToKeep && std::isfinite(other.cost)) break;
    const std::vector<int> active = Active(piece, step, halving > 0);
    FacePoint trial;
    if (active.empty()) {
      trial = At(Clamped(point.y + alpha * step.d));
    } else {
      trial = PutOntoFace(unknowns_, multipliers_, piece, active, step.bounded,
                          Clamped(point.y + alpha * step.d), &result_.simulations);
    }
    if (!(point.cost - trial.cost >= kArmijo * alpha * step.decrease)) continue;
    if (Keeps(point, trial)) {
      *next = Prefers(point, trial, other) ? trial : other;
      return true;
    }
    if (!std::isfinite(other.cost)) other = trial;
  }
  *next = other;
  return std::isfinite(other.cost);
}

Vector Search::Clamped(const Vector& y) const {
  return y.cwiseMax(unknowns_.lower()).cwiseMin(unknowns_.upper());
}

void Search::End(TrajectoryVerdict verdict, const std::string& reason) {
  if (verdict == TrajectoryVerdict::kValley) ++result_.valleys;
  result_.verdict = verdict;
  reason_ = reason;
}

}  // namespace contact_flow
