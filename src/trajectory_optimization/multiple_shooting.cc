// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/multiple_shooting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/trajectory_optimization/merit.h"
#include "nonlinear_program.h"
#include "piece_step.h"
#include "shooting_segments.h"

namespace contact_flow {
namespace {

/// A decrease that pieces promise, relative to 1 + J, beyond which a point is no minimum.
constexpr double kPromisedByPieces = 1e-8;

/// One search.
class Shooting {
 public:
  Shooting(const MechanicalSystem& system, const TrajectoryProblem& problem,
           const TrajectoryOptions& options, const ShootingOptions& shooting)
      : problem_(problem),
        options_(options),
        shooting_(shooting),
        segments_(system, problem, shooting, options.max_pieces),
        whole_(segments_.whole()) {}

  TrajectoryOptimum Go() {
    const BudgetStage stage("multiple shooting");
    NonlinearProgram program = Program();
    NonlinearSolution solution;
    solution.x = program.start;
    try {
      solution = SolveByIpopt(program);
    } catch (const BudgetExceeded& reason) {
      solution.status = NonlinearSolution::Status::kCancelled;
      solution.message = reason.what();
      if (last_.size() > 0) solution.x = last_;
    }
    return Conclude(solution);
  }

 private:
  NonlinearProgram Program() {
    NonlinearProgram program;
    const double infinity = std::numeric_limits<double>::infinity();
    program.start = Vector::Zero(segments_.count());
    program.start.head(whole_.size()) = whole_.Start();
    program.lower = Vector::Constant(segments_.count(), -infinity);
    program.upper = Vector::Constant(segments_.count(), infinity);
    program.lower.head(whole_.size()) = whole_.lower();
    program.upper.head(whole_.size()) = whole_.upper();
    const int rows = segments_.rows();
    program.row_lower = program.row_upper = Vector::Zero(rows);
    for (std::size_t i = 0; i < problem_.conditions.size(); ++i) {
      program.row_lower(static_cast<Eigen::Index>(i)) = problem_.conditions[i].lower;
      program.row_upper(static_cast<Eigen::Index>(i)) = problem_.conditions[i].upper;
    }
    program.pattern = segments_.Pattern();
    program.tolerance = shooting_.tolerance;
    program.max_iterations = options_.max_iterations;
    program.evaluate = [this](const Vector& z, double* f, Vector* values) {
      return segments_.Evaluate(z, f, values);
    };
    program.differentiate = [this](const Vector& z, Vector* gradient, Vector* entries) {
      return segments_.Differentiate(z, gradient, entries);
    };
    program.progress = [this](int iteration, double f, double violation, const Vector& z) {
      last_ = z;
      TrajectoryIteration at;
      at.iteration = iteration;
      at.cost = f;
      at.best = f;
      at.violation = violation;
      result_.iterations.push_back(at);
      return !options_.progress || options_.progress(at, z.head(whole_.size()));
    };
    return program;
  }

  TrajectoryOptimum Conclude(const NonlinearSolution& solution) {
    using Status = NonlinearSolution::Status;
    result_.y = solution.x.head(whole_.size());
    result_.y = result_.y.cwiseMax(whole_.lower()).cwiseMin(whole_.upper());
    switch (solution.status) {
      case Status::kConverged:
        result_.verdict = TrajectoryVerdict::kSmoothMinimum;
        break;
      case Status::kInfeasible:
        result_.verdict = TrajectoryVerdict::kInfeasible;
        break;
      case Status::kMaxIterations:
        result_.verdict = TrajectoryVerdict::kMaxIterations;
        break;
      case Status::kCancelled:
        result_.verdict = TrajectoryVerdict::kCancelled;
        break;
      case Status::kUndefined:
        result_.verdict = TrajectoryVerdict::kUndefined;
        break;
      case Status::kStalled:
        result_.verdict = TrajectoryVerdict::kStalled;
        break;
    }
    result_.x = whole_.WithoutClock(whole_.InitialState(result_.y));
    result_.inputs = whole_.Inputs(result_.y);
    const std::size_t count = result_.inputs.grid.size();
    for (std::size_t k = 0; k < count; ++k) result_.inputs.values[k] = whole_.InputAt(result_.y, k);
    if (problem_.linear_inputs) result_.input_end = whole_.InputAt(result_.y, count);
    result_.duration = problem_.duration;
    result_.multipliers = solution.multipliers.head(std::min<Eigen::Index>(
        solution.multipliers.size(), static_cast<Eigen::Index>(problem_.conditions.size())));
    std::ostringstream message;
    message << solution.message << " by Ipopt, " << segments_.size() << " segments, after "
            << std::max<std::size_t>(result_.iterations.size(), 1) - 1 << " iterations";
    AddRun(&message);
    AskPieces(&message);
    if (solution.status != Status::kConverged && !segments_.reason().empty())
      message << ": " << segments_.reason();
    result_.message = message.str();
    result_.simulations = segments_.simulations;
    result_.derivatives = segments_.derivatives;
    return std::move(result_);
  }

  /// Cost and conditions of one run through all segments.
  void AddRun(std::ostringstream* message) {
    const Trajectory run =
        whole_.Run(result_.y, problem_.simulate.simultaneity_tolerance, whole_.HasRunningCost());
    ++segments_.simulations;
    if (!run.status.ok()) {
      result_.cost = std::numeric_limits<double>::infinity();
      *message << "; but one run through all segments ends early, " << run.status.message;
      if (result_.verdict == TrajectoryVerdict::kSmoothMinimum) {
        result_.verdict = TrajectoryVerdict::kStalled;
      }
      return;
    }
    result_.cost = whole_.Cost(result_.y, run);
    result_.condition_values = ConditionValues(whole_, run, whole_.States(run));
    message->precision(10);
    *message << ", cost " << result_.cost;
    if (problem_.conditions.empty()) return;
    const double missed =
        Violations(whole_.problem().conditions, result_.condition_values).maxCoeff();
    if (missed <= problem_.condition_tolerance) return;
    *message << "; one run through all segments misses a condition by " << missed;
  }

  /// Ipopt converges beside the largest gradient that it has seen: what is left for others is asked
  /// of the pieces there. With conditions these would need multipliers of their own.
  void AskPieces(std::ostringstream* message) {
    if (result_.verdict != TrajectoryVerdict::kSmoothMinimum || !problem_.conditions.empty())
      return;
    const PieceModels models = MakePieceModels(whole_, result_.y, options_.max_pieces);
    ++segments_.derivatives;
    if (!models.status.ok()) return;
    double promised = 0;
    for (const PieceModel& piece : models.pieces) {
      const PieceStep step =
          SolvePiece(piece, result_.y, whole_.lower(), whole_.upper(), OrderRule::kKeep);
      if (step.solved) promised = std::max(promised, step.decrease);
    }
    if (promised <= kPromisedByPieces * (1 + std::abs(result_.cost))) return;
    result_.verdict = TrajectoryVerdict::kStalled;
    *message << "; it is no minimum yet: pieces promise to lower the cost by " << promised
             << ", which method pieces would do from here";
  }

  const TrajectoryProblem& problem_;
  const TrajectoryOptions& options_;
  const ShootingOptions& shooting_;
  ShootingSegments segments_;
  const Unknowns& whole_;
  Vector last_;
  TrajectoryOptimum result_;
};

}  // namespace

TrajectoryOptimum OptimizeByShooting(const MechanicalSystem& system,
                                     const TrajectoryProblem& problem,
                                     const TrajectoryOptions& options,
                                     const ShootingOptions& shooting) {
  if (!HaveIpopt()) SolveByIpopt({});
  if (options.max_iterations < 0) {
    throw std::invalid_argument("trajectory options: max_iterations must be ≥ 0");
  }
  return Shooting(system, problem, options, shooting).Go();
}

}  // namespace contact_flow
