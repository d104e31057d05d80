// SPDX-License-Identifier: BSD-3-Clause
#include "shooting_segments.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "contact_flow/budget.h"
#include "contact_flow/trajectory_optimization/merit.h"
#include "contact_flow/trajectory_optimization/piece_models.h"

namespace contact_flow {
namespace {

using Kind = TrajectoryCondition::Kind;

constexpr double kClear = 1e-3;  // segments begin by themselves where gaps are larger
constexpr std::size_t kMostSegments = 20;

void RequireShooting(bool fine, const std::string& what) {
  if (!fine) throw std::invalid_argument("multiple shooting: " + what);
}

}  // namespace

ShootingSegments::ShootingSegments(const MechanicalSystem& system, const TrajectoryProblem& problem,
                                   const ShootingOptions& shooting, std::size_t max_pieces)
    : system_(system),
      problem_(problem),
      shooting_(shooting),
      max_pieces_(max_pieces),
      whole_(system, problem),
      size_(system.state_size()) {
  Check();
  PlaceSegments();
}

void ShootingSegments::Check() const {
  RequireShooting(problem_.choose_inputs, "inputs are to be chosen");
  RequireShooting(problem_.choose_parameters.empty(), "parameters cannot be chosen");
  RequireShooting(problem_.choose_durations.empty(), "lengths of intervals cannot be chosen");
  RequireShooting(system_.num_positions() == system_.dof(), "positions are no ℝᵈ");
  for (const TrajectoryCondition& condition : problem_.conditions) {
    RequireShooting(condition.kind == Kind::kState, "a touchdown cannot be a condition");
  }
  const int count = static_cast<int>(problem_.inputs.grid.size());
  int last = 0;
  for (int begin : shooting_.segments) {
    RequireShooting(begin > last && begin < count, "segments has " + std::to_string(begin) +
                                                       ": increasing numbers of instants, 1 to " +
                                                       std::to_string(count - 1) + ", are needed");
    last = begin;
  }
  const Matrix& states = shooting_.states;
  RequireShooting(
      states.size() == 0 ||
          (!shooting_.segments.empty() && states.rows() == size_ && states.allFinite() &&
           states.cols() == static_cast<Eigen::Index>(shooting_.segments.size())),
      "states must be finite, with a column for each of segments");
  RequireShooting(shooting_.tolerance > 0 && std::isfinite(shooting_.tolerance),
                  "tolerance must be finite and > 0");
}

/// Where the first run touches nothing, and where it is there.
void ShootingSegments::PlaceSegments() {
  begins_ = shooting_.segments;
  Matrix states = shooting_.states;
  if (states.size() == 0) {
    const Vector y = whole_.Start();
    const Trajectory run = whole_.Run(y, problem_.simulate.simultaneity_tolerance, false);
    ++simulations;
    RequireShooting(run.status.ok(),
                    "the run that it begins with ends early, and `states` are not given");
    const Matrix all = whole_.States(run);
    if (begins_.empty()) ChooseBegins(all);
    states.resize(size_, static_cast<Eigen::Index>(begins_.size()));
    for (std::size_t j = 0; j < begins_.size(); ++j) {
      states.col(static_cast<Eigen::Index>(j)) = whole_.WithoutClock(all.col(begins_[j] - 1));
    }
  }
  count_ = whole_.size();
  for (std::size_t j = 0; j <= begins_.size(); ++j) AddSegment(j, states);
}

void ShootingSegments::ChooseBegins(const Matrix& states) {
  const int count = static_cast<int>(problem_.inputs.grid.size());
  std::vector<int> clear;
  for (int k = 1; k < count; ++k) {
    ConstraintTerms terms;
    const Vector x = whole_.WithoutClock(states.col(k - 1));
    system_.Constraints(x.head(system_.num_positions()), x.tail(system_.dof()), &terms);
    bool touches = false;
    for (int i = 0; i < system_.num_constraints(); ++i) {
      touches = touches || (!system_.compliant().Contains(i) && !(terms.gap(i) > kClear));
    }
    if (!touches) clear.push_back(k);
  }
  const std::size_t every = clear.size() / kMostSegments + 1;
  for (std::size_t i = every - 1; i < clear.size(); i += every) begins_.push_back(clear[i]);
}

void ShootingSegments::AddSegment(std::size_t j, const Matrix& states) {
  const int begin = Begin(j), end = End(j), d2 = 2 * system_.dof();
  auto segment = std::make_unique<Segment>();
  TrajectoryProblem& part = segment->problem;
  part = problem_;
  const std::vector<double>& grid = problem_.inputs.grid;
  const auto slice = [&](const auto& all) {
    return std::decay_t<decltype(all)>(all.begin() + begin, all.begin() + end);
  };
  part.inputs.grid = slice(grid);
  part.inputs.values = slice(problem_.inputs.values);
  const auto next = static_cast<std::size_t>(end);
  part.duration = (IsLast(j) ? grid.front() + problem_.duration : grid[next]) - part.inputs.grid[0];
  if (problem_.linear_inputs && !IsLast(j)) part.input_end = problem_.inputs.values[next];
  const auto columns = [&](const Matrix& all) -> Matrix {
    return all.size() > 0 ? Matrix(all.middleCols(begin, end - begin)) : Matrix();
  };
  part.input_path = columns(problem_.input_path);
  part.path_reference = columns(problem_.path_reference);
  if (!IsLast(j)) part.weight.setZero();
  part.conditions.clear();
  for (std::size_t i = 0; i < problem_.conditions.size(); ++i) {
    TrajectoryCondition condition = problem_.conditions[i];
    if (condition.number <= begin || condition.number > end) continue;
    condition.number -= begin;
    part.conditions.push_back(condition);
    segment->conditions.push_back(static_cast<int>(i));
  }
  for (int i = 0; i < size_ && !IsLast(j); ++i) {
    part.conditions.push_back({Kind::kState, i, end - begin, 0, 0});
  }
  if (j > 0) {
    part.x = states.col(static_cast<Eigen::Index>(j - 1));
    part.initial_lower = part.initial_upper = Vector();
    part.choose_initial.clear();
    for (int i = 0; i < d2; ++i) part.choose_initial.push_back(i);
    segment->state = count_;
    count_ += d2;
  }
  try {
    segment->unknowns = std::make_unique<Unknowns>(system_, part);
  } catch (const std::invalid_argument& reason) {
    throw std::invalid_argument("multiple shooting: the segment from instant " +
                                std::to_string(begin) + " of the grid on: " + reason.what());
  }
  Place(begin, segment.get());
  segments_.push_back(std::move(segment));
}

/// Its unknowns are inputs, and a state of its own or that of the whole.
void ShootingSegments::Place(int begin, Segment* segment) const {
  const Unknowns& its = *segment->unknowns;
  segment->places.resize(static_cast<std::size_t>(its.size()));
  const int states = static_cast<int>(segment->problem.choose_initial.size());
  const int inputs = its.size() - states;
  for (int i = 0; i < its.size(); ++i) {
    int& place = segment->places[static_cast<std::size_t>(i)];
    if (i < inputs) {
      place = begin * whole_.num_inputs() + i;
    } else if (segment->state < 0) {
      place = whole_.Initial(static_cast<std::size_t>(i - inputs));
    } else {
      place = segment->state + i - inputs;
    }
  }
}

Vector ShootingSegments::PartOf(const Segment& segment, const Vector& z) const {
  Vector y(static_cast<Eigen::Index>(segment.places.size()));
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    y(i) = z(segment.places[static_cast<std::size_t>(i)]);
  }
  return y;
}

std::vector<std::pair<int, int>> ShootingSegments::Pattern() const {
  std::vector<std::pair<int, int>> pattern;
  for (std::size_t j = 0; j < segments_.size(); ++j) {
    const Segment& segment = *segments_[j];
    const auto add = [&](int row) {
      for (int place : segment.places) pattern.emplace_back(row, place);
    };
    for (int i : segment.conditions) add(i);
    for (int i = 0; i < size_ && !IsLast(j); ++i) {
      add(RowOfJoint(j) + i);
      pattern.emplace_back(RowOfJoint(j) + i, segments_[j + 1]->state + i);
    }
  }
  return pattern;
}

bool ShootingSegments::Evaluate(const Vector& z, double* f, Vector* rows) {
  *f = 0;
  rows->setZero(this->rows());
  for (std::size_t j = 0; j < segments_.size(); ++j) {
    AskBudget();
    const Segment& segment = *segments_[j];
    const Unknowns& its = *segment.unknowns;
    const Vector y = PartOf(segment, z);
    ++simulations;
    try {
      const Trajectory run =
          its.Run(y, problem_.simulate.simultaneity_tolerance, its.HasRunningCost());
      if (run.status.outcome == Outcome::kBudgetExceeded) AskBudget();
      if (!run.status.ok()) return false;
      *f += its.Cost(y, run);
      const Vector values = ConditionValues(its, run, its.States(run));
      const std::size_t own = segment.conditions.size();
      for (std::size_t i = 0; i < own; ++i) {
        (*rows)(segment.conditions[i]) = values(static_cast<Eigen::Index>(i));
      }
      if (IsLast(j)) continue;
      const Segment& next = *segments_[j + 1];
      rows->segment(RowOfJoint(j), size_) =
          values.tail(size_) - next.problem.x - z.segment(next.state, size_);
    } catch (const std::invalid_argument&) {  // a start that is none
      return false;
    }
  }
  return true;
}

bool ShootingSegments::Differentiate(const Vector& z, Vector* gradient, Vector* entries) {
  gradient->setZero(count_);
  std::vector<double> all;
  for (std::size_t j = 0; j < segments_.size(); ++j) {
    AskBudget();
    const Segment& segment = *segments_[j];
    ++derivatives;
    PieceModels models;
    try {
      models = MakePieceModels(*segment.unknowns, PartOf(segment, z), max_pieces_);
    } catch (const std::invalid_argument&) {
      return false;
    } catch (const std::domain_error&) {
      return false;
    }
    if (!models.status.ok()) {
      reason_ = models.status.message;
      return false;
    }
    const PieceModel& piece = models.pieces.front();
    for (std::size_t i = 0; i < segment.places.size(); ++i) {
      (*gradient)(segment.places[i]) += piece.gradient(static_cast<Eigen::Index>(i));
    }
    const auto own = static_cast<Eigen::Index>(segment.conditions.size());
    for (Eigen::Index i = 0; i < piece.conditions.rows(); ++i) {
      for (Eigen::Index c = 0; c < piece.conditions.cols(); ++c) {
        all.push_back(piece.conditions(i, c));
      }
      if (i >= own) all.push_back(-1);
    }
  }
  *entries = Eigen::Map<const Vector>(all.data(), static_cast<Eigen::Index>(all.size()));
  return true;
}

}  // namespace contact_flow
