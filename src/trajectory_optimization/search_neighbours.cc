// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "search.h"

namespace contact_flow {
namespace {

constexpr int kMaxHalvings = 30, kMaxOnFace = 40;
/// Costs that differ by less, relative to 1 + J, are the same valley.
constexpr double kSame = 1e-12;

}  // namespace

/// From the valley that was found, valleys at adjacent instants of the grid,
/// as long as one is lower.
void Search::TryNeighbours() {
  bool found = true;
  while (found && result_.verdict == TrajectoryVerdict::kValley) {
    found = false;
    const FacePoint valley = best_;
    const Multipliers multipliers = multipliers_;
    const std::string reason = reason_;
    const auto back = [&] {  // the best is still that valley
      best_ = valley;
      multipliers_ = multipliers;
    };
    for (const Coincidence& pair : CoincidencesAt(ModelsAt(valley.y),
                                                  unknowns_.problem().kink_interval)) {
      for (int to : {pair.instant - 1, pair.instant + 1}) {
        if (to < 1 || to >= static_cast<int>(unknowns_.problem().inputs.grid.size())) continue;
        const FacePoint point = MinimumOnFace(valley, pair.contact, to);
        if (!std::isfinite(point.cost)) continue;
        const double length = (point.y - valley.y).cwiseAbs().maxCoeff();
        if (!Take(point, length, 2, KinkStatus::kNeighbour)) return back();
        Solve(point);
        const bool holds = best_.violation <= std::max(unknowns_.problem().condition_tolerance,
                                                       valley.violation);
        found = holds && best_.plain < valley.plain - kSame * (1 + std::abs(valley.plain));
        if (Ended()) {
          if (!found) back();
          return;
        }
        if (found) break;
        back();
        result_.verdict = TrajectoryVerdict::kValley;
        reason_ = reason;
      }
      if (found) break;
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
    for (int halving = 0; halving < kMaxHalvings; ++halving, alpha /= 2) {
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
