// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "certificate.h"
#include "contact_flow/budget.h"
#include "contact_flow/trajectory_optimization/piece_step.h"
#include "face.h"

namespace contact_flow {
namespace {

constexpr double kArmijo = 1e-4, kLongStep = 0.25;  // shares of the promised decrease
constexpr int kMaxHalvings = 30, kMaxDampings = 8;
constexpr double kFirstDamping = 1e-3;  // of the mean diagonal of H
constexpr int kMaxOnFace = 40;
/// Costs that differ by less, relative to 1 + J, are the same valley.
constexpr double kSame = 1e-12;

class Search {
 public:
  Search(const MechanicalSystem& system, const TrajectoryProblem& problem,
         const TrajectoryOptions& options)
      : unknowns_(system, problem), options_(options) {}

  TrajectoryOptimum Go() {
    const BudgetStage stage("the search for a trajectory");
    best_.y = unknowns_.Start();
    best_.cost = std::numeric_limits<double>::infinity();
    try {
      FacePoint start = At(best_.y);
      if (!std::isfinite(start.cost)) {
        End(TrajectoryVerdict::kUndefined, "the run that it begins with ends early");
      } else if (Take(start, 0, 0, KinkStatus::kNone)) {
        Descend(start);
        if (options_.neighbours) TryNeighbours();
      }
    } catch (const BudgetExceeded& reason) {
      End(TrajectoryVerdict::kCancelled, reason.what());
    }
    Conclude();
    return std::move(result_);
  }

 private:
  FacePoint At(const Vector& y) { return Evaluate(unknowns_, y, {}, &result_.simulations); }

  PieceModels ModelsAt(const Vector& y) {
    ++result_.derivatives;
    PieceModels models;
    try {
      models = MakePieceModels(unknowns_, y, options_.max_pieces);
    } catch (const std::invalid_argument& refusal) {
      models.status = {Outcome::kNotDifferentiable, refusal.what()};
    } catch (const std::domain_error& refusal) {
      models.status = {Outcome::kNotDifferentiable, refusal.what()};
    }
    CheckBudget(models.status);
    return models;
  }

  /// The point is an iterate; false where the search is to end.
  bool Take(const FacePoint& point, double step, int pieces, KinkStatus kink) {
    if (point.cost < best_.cost) best_ = point;
    const int number = static_cast<int>(result_.iterations.size());
    result_.iterations.push_back({number, point.cost, best_.cost, step, pieces, kink});
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

  bool Ended() const {
    return result_.verdict == TrajectoryVerdict::kCancelled ||
           result_.verdict == TrajectoryVerdict::kMaxIterations;
  }

  /// From a point to a minimum, or wherever it ends.
  void Descend(FacePoint point) {
    double damping = 0;
    for (;;) {
      AskBudget();
      const PieceModels models = ModelsAt(point.y);
      if (!models.status.ok()) {
        const bool first = result_.iterations.size() <= 1;
        return End(first ? TrajectoryVerdict::kUndefined : TrajectoryVerdict::kStalled,
                   models.status.message);
      }
      std::vector<PieceStep> steps;
      double promised = 0;
      for (const PieceModel& piece : models.pieces) {
        steps.push_back(SolvePiece(piece, point.y, unknowns_.lower(), unknowns_.upper(),
                                   OrderRule::kKeep, {}, damping));
        if (steps.back().solved) promised = std::max(promised, steps.back().decrease);
      }
      const double none = options_.tolerance * (1 + std::abs(point.cost));
      if (promised <= none && damping == 0) {
        const TrajectoryVerdict verdict = Verdict(models, steps);
        return End(verdict, verdict == TrajectoryVerdict::kStalled
                                ? "the steps of a piece contradict its order of events"
                                : "");
      }
      FacePoint next = point;
      KinkStatus kink = KinkStatus::kNone;
      if (Step(models, steps, point, none, damping, &next, &kink)) {
        const double length = (next.y - point.y).cwiseAbs().maxCoeff();
        point = next;
        damping = damping > kFirstDamping * MeanCurvature(models) ? damping / 10 : 0;
        if (!Take(point, length, static_cast<int>(models.pieces.size()), kink)) return;
        continue;
      }
      const double first = kFirstDamping * MeanCurvature(models);
      damping = damping == 0 ? first : 10 * damping;
      if (damping > std::pow(10.0, kMaxDampings) * first) {
        return End(TrajectoryVerdict::kStalled, "no step makes the cost smaller");
      }
    }
  }

  static double MeanCurvature(const PieceModels& models) {
    return std::max(models.pieces.front().hessian.diagonal().mean(), 1e-12);
  }

  TrajectoryVerdict Verdict(const PieceModels& models, const std::vector<PieceStep>& steps) const {
    for (const PieceStep& step : steps) {
      if (!step.solved) return TrajectoryVerdict::kStalled;
    }
    return models.pieces.size() > 1 ? TrajectoryVerdict::kValley
                                    : TrajectoryVerdict::kSmoothMinimum;
  }

  /// Rows of a piece that a step ends on.
  std::vector<int> Active(const PieceModel& piece, const PieceStep& step, bool only_near) const {
    std::vector<int> active;
    for (std::size_t r = 0; r < piece.orders.size(); ++r) {
      const bool near = std::abs(piece.orders[r].slack) <= 2 * unknowns_.problem().kink_interval;
      const bool is = step.multipliers(static_cast<Eigen::Index>(r)) > 0;
      if (is && (near || !only_near)) active.push_back(static_cast<int>(r));
    }
    return active;
  }

  /// A point with a smaller cost, by the pieces in the order of what they promise.
  bool Step(const PieceModels& models, const std::vector<PieceStep>& steps, const FacePoint& point,
            double none, double damping, FacePoint* next, KinkStatus* kink) {
    if (models.pieces.size() == 1 && LongStep(models.pieces.front(), point, damping, next)) {
      return true;
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
      if (models.pieces.size() > 1) {
        const bool follows = !Active(models.pieces[i], step, true).empty();
        *kink = follows ? KinkStatus::kFollowed
                        : falling > 1 ? KinkStatus::kRidge : KinkStatus::kPassed;
      }
      return true;
    }
    return false;
  }

  /// Beyond the piece, where the cost keeps what the model promises.
  bool LongStep(const PieceModel& piece, const FacePoint& point, double damping, FacePoint* next) {
    const PieceStep step = SolvePiece(piece, point.y, unknowns_.lower(), unknowns_.upper(),
                                      OrderRule::kIgnore, {}, damping);
    if (!step.solved || !(step.decrease > 0)) return false;
    const FacePoint trial = At(Clamped(point.y + step.d));
    if (!(point.cost - trial.cost >= kLongStep * step.decrease)) return false;
    *next = trial;
    return true;
  }

  bool LineSearch(const PieceModel& piece, const PieceStep& step, const FacePoint& point,
                  FacePoint* next) {
    double alpha = 1;
    for (int halving = 0; halving < kMaxHalvings; ++halving, alpha /= 2) {
      AskBudget();
      const std::vector<int> active = Active(piece, step, halving > 0);
      FacePoint trial;
      if (active.empty()) {
        trial = At(Clamped(point.y + alpha * step.d));
      } else {
        trial = PutOntoFace(unknowns_, piece, active, step.bounded,
                            Clamped(point.y + alpha * step.d), &result_.simulations);
      }
      if (point.cost - trial.cost >= kArmijo * alpha * step.decrease) {
        *next = trial;
        return true;
      }
    }
    return false;
  }

  Vector Clamped(const Vector& y) const {
    return y.cwiseMax(unknowns_.lower()).cwiseMin(unknowns_.upper());
  }

  /// From the valley that was found, valleys at adjacent instants of the grid,
  /// as long as one is lower.
  void TryNeighbours() {
    bool found = true;
    while (found && result_.verdict == TrajectoryVerdict::kValley) {
      found = false;
      const FacePoint valley = best_;
      const TrajectoryVerdict verdict = result_.verdict;
      const std::string reason = reason_;
      for (const Coincidence& pair : CoincidencesAt(ModelsAt(valley.y),
                                                    unknowns_.problem().kink_interval)) {
        for (int to : {pair.instant - 1, pair.instant + 1}) {
          if (to < 1 || to >= static_cast<int>(unknowns_.problem().inputs.grid.size())) continue;
          const FacePoint point = MinimumOnFace(valley, pair.contact, to);
          if (!std::isfinite(point.cost)) continue;
          const double length = (point.y - valley.y).cwiseAbs().maxCoeff();
          if (!Take(point, length, 2, KinkStatus::kNeighbour)) return;
          Descend(point);
          if (Ended()) return;
          found = best_.cost < valley.cost - kSame * (1 + std::abs(valley.cost));
          if (found) break;
          result_.verdict = verdict;  // still that of the best
          reason_ = reason;
        }
        if (found) break;
      }
    }
  }

  /// The least cost with touchdown `contact` at instant `to` of the grid; infinite where
  /// it is not reached.
  FacePoint MinimumOnFace(FacePoint point, const EventName& contact, int to) {
    FacePoint none;
    bool reached = false;
    for (int i = 0; i < kMaxOnFace; ++i) {
      AskBudget();
      const PieceModels models = ModelsAt(point.y);
      if (!models.status.ok()) return none;
      PieceModel piece = models.pieces.front();
      if (!AddFace(unknowns_, contact, to, &piece)) return none;
      const int face = static_cast<int>(piece.orders.size()) - 1;
      const PieceStep step = SolvePiece(piece, point.y, unknowns_.lower(), unknowns_.upper(),
                                        OrderRule::kIgnore, {face});
      if (!step.solved) return none;
      if (reached && step.decrease <= options_.tolerance * (1 + std::abs(point.cost))) return point;
      double alpha = 1;
      FacePoint trial;
      for (int halving = 0; halving < kMaxHalvings; ++halving, alpha /= 2) {
        trial = PutOntoFace(unknowns_, piece, {face}, step.bounded,
                            Clamped(point.y + alpha * step.d), &result_.simulations);
        if (trial.on_face && (!reached || trial.cost < point.cost)) break;
      }
      if (!trial.on_face || !(trial.cost < point.cost || !reached)) {
        return reached ? point : none;
      }
      point = trial;
      reached = true;
    }
    return point;
  }

  void End(TrajectoryVerdict verdict, const std::string& reason) {
    if (verdict == TrajectoryVerdict::kValley) ++result_.valleys;
    result_.verdict = verdict;
    reason_ = reason;
  }

  void Conclude() {
    result_.y = best_.y;
    result_.cost = best_.cost;
    result_.x = unknowns_.InitialState(best_.y);
    result_.inputs = unknowns_.Inputs(best_.y);
    const bool minimum = result_.verdict == TrajectoryVerdict::kValley ||
                         result_.verdict == TrajectoryVerdict::kSmoothMinimum;
    if (minimum) {
      try {
        Certify(unknowns_, ModelsAt(best_.y), best_.y, &result_);
      } catch (const BudgetExceeded& reason) {
        End(TrajectoryVerdict::kCancelled, reason.what());
      }
    }
    std::ostringstream message;
    message << VerdictName(result_.verdict);
    if (!result_.iterations.empty()) {
      message << " after " << result_.iterations.size() - 1 << " iterations, cost ";
      message.precision(10);
      message << best_.cost;
    }
    if (minimum && result_.certificate.size() > 1) {
      message << ", where " << result_.certificate.size() << " pieces meet";
    }
    if (!reason_.empty()) message << ": " << reason_;
    result_.message = message.str();
  }

  const Unknowns unknowns_;
  const TrajectoryOptions& options_;
  FacePoint best_;
  std::string reason_;
  TrajectoryOptimum result_;
};

}  // namespace

const char* VerdictName(TrajectoryVerdict verdict) {
  constexpr const char* kNames[] = {"smooth minimum", "valley",         "stalled",
                                    "undefined",      "max iterations", "cancelled"};
  return kNames[static_cast<int>(verdict)];
}

const char* KinkStatusName(KinkStatus status) {
  constexpr const char* kNames[] = {"none", "followed", "passed", "ridge", "neighbour"};
  return kNames[static_cast<int>(status)];
}

TrajectoryOptimum OptimizeTrajectory(const MechanicalSystem& system,
                                     const TrajectoryProblem& problem,
                                     const TrajectoryOptions& options) {
  if (!(options.tolerance >= 0) || options.max_iterations < 0) {
    throw std::invalid_argument("trajectory options: tolerance and max_iterations must be ≥ 0");
  }
  return Search(system, problem, options).Go();
}

}  // namespace contact_flow
