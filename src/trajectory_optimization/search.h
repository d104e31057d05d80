// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "curvature.h"
#include "face.h"
#include "piece_step.h"

namespace contact_flow {

/// One search for a trajectory. Its descents are those of L under the multipliers of the time.
class Search {
 public:
  Search(const MechanicalSystem& system, const TrajectoryProblem& problem,
         const TrajectoryOptions& options);

  TrajectoryOptimum Go();

 private:
  // search.cc: from a point to a minimum of L, or wherever it ends.
  FacePoint At(const Vector& y);
  PieceModels ModelsAt(const Vector& y);
  bool Take(const FacePoint& point, double step, int pieces, KinkStatus kink);
  bool Ended() const;
  bool IsMinimum() const;
  bool IsWorthFineSteps(const FacePoint& point, double promised) const;
  bool MayGoOn() const;
  void Descend(FacePoint point);
  TrajectoryVerdict Verdict(const PieceModels& models, const std::vector<PieceStep>& steps) const;
  std::vector<int> Active(const PieceModel& piece, const PieceStep& step, bool only_near) const;
  bool Step(const PieceModels& models, const std::vector<PieceStep>& steps, const FacePoint& point,
            double none, double damping, FacePoint* next, KinkStatus* kink);
  std::vector<PieceStep> StepsOf(const PieceModels& models, const Vector& y, double damping) const;
  bool LongStep(const PieceModel& piece, const FacePoint& point, double damping, FacePoint* next);
  bool LineSearch(const PieceModel& piece, const PieceStep& step, const FacePoint& point,
                  FacePoint* next);
  Vector Clamped(const Vector& y) const;
  void End(TrajectoryVerdict verdict, const std::string& reason);

  // search_conditions.cc: descents with better and better multipliers.
  void Solve(FacePoint point);
  bool BeginMultipliers(const FacePoint& point);
  void Raise(const Vector& before, const Vector& after);
  std::string WorstCondition() const;

  // search_neighbours.cc: from a valley to those beside it.
  std::vector<std::pair<EventName, int>> Beside(const PieceModels& models, const Vector& y) const;
  void TryNeighbours();
  FacePoint MinimumOnFace(FacePoint point, const EventName& contact, int to);

  // search_curvature.cc: from a stationary point that is no minimum.
  bool Escape(FacePoint* point);

  void Conclude();

  const Unknowns unknowns_;
  const TrajectoryOptions& options_;
  double tolerance_;         // of descents
  Multipliers multipliers_;  // those of the descent
  Vector first_rho_;
  Curvature curvature_;
  FacePoint best_;
  std::string reason_;
  bool no_derivative_ = false;  // ended the last descent
  TrajectoryOptimum result_;
};

}  // namespace contact_flow
