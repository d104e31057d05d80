// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "contact_flow/budget.h"
#include "search.h"

namespace contact_flow {
namespace {

constexpr int kMaxNeighbourHalvings = 30, kMaxOnFace = 40;
/// Costs that differ by less, relative to 1 + J, are the same valley.
constexpr double kSame = 1e-12;

}  // namespace

/// Touchdowns of the valley and the instants of the grid beside them. Inputs that are led have no
/// valleys there, but minima of their own between any two instants.
std::vector<std::pair<EventName, int>> Search::Beside(const PieceModels& models,
                                                      const Vector& y) const {
  std::vector<std::pair<EventName, int>> beside;
  if (!unknowns_.problem().linear_inputs) {
    for (const Coincidence& pair : CoincidencesAt(models, unknowns_.problem().kink_interval)) {
      beside.emplace_back(pair.contact, pair.instant - 1);
      beside.emplace_back(pair.contact, pair.instant + 1);
    }
    return beside;
  }
  if (models.pieces.empty()) return beside;
  const std::vector<double> grid = unknowns_.Inputs(y).grid;
  for (const EventTime& event : models.pieces.front().times) {
    if (event.name.constraint < 0) continue;
    const auto next = std::upper_bound(grid.begin(), grid.end(), event.t) - grid.begin();
    beside.emplace_back(event.name, static_cast<int>(next) - 1);
    beside.emplace_back(event.name, static_cast<int>(next));
  }
  return beside;
}

/// From the minimum that was found those at adjacent instants of the grid, as long as one of them
/// is lower.
void Search::TryNeighbours() {
  const auto is_minimum = [this] {
    return result_.verdict == TrajectoryVerdict::kValley ||
           (result_.verdict == TrajectoryVerdict::kSmoothMinimum &&
            unknowns_.problem().linear_inputs);
  };
  bool found = true;
  while (found && is_minimum()) {
    found = false;
    const TrajectoryVerdict verdict = result_.verdict;
    const FacePoint valley = best_;
    const Multipliers multipliers = multipliers_;
    const std::string reason = reason_;
    const auto back = [&] {  // the best is still that valley
      best_ = valley;
      multipliers_ = multipliers;
    };
    const auto is_lower = [&] {
      const double allowed = std::max(unknowns_.problem().condition_tolerance, valley.violation);
      return best_.violation <= allowed &&
             best_.plain < valley.plain - kSame * (1 + std::abs(valley.plain));
    };
    for (const auto& [contact, to] : Beside(ModelsAt(valley.y), valley.y)) {
      if (to < 1 || to >= static_cast<int>(unknowns_.problem().inputs.grid.size())) continue;
      const FacePoint point = MinimumOnFace(valley, contact, to);
      if (!std::isfinite(point.cost)) continue;
      const double length = (point.y - valley.y).cwiseAbs().maxCoeff();
      const bool taken = Take(point, length, 2, KinkStatus::kNeighbour);
      try {
        if (taken) Solve(point);
      } catch (const BudgetExceeded&) {
        if (!is_lower()) back();
        throw;
      }
      found = taken && is_lower();
      if (Ended()) {
        if (found) return;
        back();
        if (result_.verdict == TrajectoryVerdict::kCancelled) return;
        result_.verdict = verdict;  // that has been shown
        reason_ = "not all neighbours were tried: " + reason_;
        return;
      }
      if (found) break;
      back();
      result_.verdict = verdict;
      reason_ = reason;
    }
  }
}

/// The least cost with touchdown `contact` at instant `to` of the grid; infinite where
/// it is not reached.
FacePoint Search::MinimumOnFace(FacePoint point, const EventName& contact, int to) {
  FacePoint none;
  bool reached = false;
  for (int i = 0; i < kMaxOnFace; ++i) {
    AskBudget();
    const PieceModels models = ModelsAt(point.y);
    if (!models.status.ok()) return none;
    PieceModel piece = models.pieces.front();
    if (!AddFace(unknowns_, point.y, contact, to, &piece)) return none;
    const int face = static_cast<int>(piece.orders.size()) - 1;
    const PieceStep step = SolvePiece(piece, point.y, unknowns_.lower(), unknowns_.upper(),
                                      OrderRule::kIgnore, {face});
    if (!step.solved) return none;
    if (reached && step.decrease <= tolerance_ * (1 + std::abs(point.cost))) return point;
    double alpha = 1;
    FacePoint trial;
    for (int halving = 0; halving < kMaxNeighbourHalvings; ++halving, alpha /= 2) {
      trial = PutOntoFace(unknowns_, multipliers_, piece, {face}, step.bounded,
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

}  // namespace contact_flow
