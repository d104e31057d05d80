// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/periodic_orbit.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "clock_rates.h"
#include "contact_flow/analysis/orbit_sizes.h"
#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/section.h"
#include "retraction.h"
#include "tangent_map.h"

namespace contact_flow {
namespace {

constexpr double kApart = 1e-13;    // events that are no further apart than this part of the period
constexpr double kRunErrors = 100;  // tolerances of a step that those of a run add up to

bool IsEvent(const OrbitCondition& condition) {
  return condition.kind == OrbitCondition::Kind::kTouchdown ||
         condition.kind == OrbitCondition::Kind::kLiftOff;
}

/// P(x) ⊟ x and the conditions, as an equation for (x, p), each beside its size on the motion that
/// the search starts with: neither the steps nor their end are matters of units.
class OrbitEquation {
 public:
  OrbitEquation(const OrbitProblem& problem, const OrbitOptions& options)
      : problem_(problem), options_(options.poincare) {
    system_ = problem.factory(problem.parameters);
    const SystemDescription& names = system_->description();
    options_.derivative.variables = {};
    options_.derivative.variables.parameters = ParameterIndices(names, problem.unknown_parameters);
    for (const Parameter& parameter : names.parameters) {
      values_[parameter.name] = parameter.value;
    }
    options_.events.clear();
    for (const OrbitCondition& condition : problem.conditions) AddEvents(condition);
    PoincareMap check(*system_, problem.u, problem.section, options_);
    if (problem.x.size() != system_->state_size()) {
      throw std::invalid_argument("the start has " + std::to_string(problem.x.size()) +
                                  " entries, the state " + std::to_string(system_->state_size()));
    }
  }

  /// The unknowns of the start.
  Vector Start() const {
    Vector y(problem_.x.size() + count());
    y.head(problem_.x.size()) = problem_.x;
    for (int k = 0; k < count(); ++k) {
      y(problem_.x.size() + k) = values_.at(problem_.unknown_parameters[k]);
    }
    return y;
  }

  EquationValue operator()(const Vector& y, bool with_map) {
    EquationValue value;
    try {
      SetParameters(y.tail(count()));
    } catch (const std::invalid_argument& range) {
      value.defined = false;
      value.message = range.what();
      return value;
    }
    const Vector x = y.head(problem_.x.size());
    if (row_.size() == 0 && !FindSizes(x, &value)) return value;
    // The residual tells nearly simultaneous events apart, so that it is continuous; the derivative
    // takes them as one, so that it has the pieces of all orders.
    PoincareOptions apart = options_;
    apart.simulate.simultaneity_tolerance = kApart * period_;
    PoincareReturn orbit =
        PoincareMap(*system_, problem_.u, problem_.section, apart).Return(x, false);
    value.message = orbit.message;
    value.defined = orbit.returned() && orbit.event_times.allFinite();
    if (!value.defined) {
      if (orbit.returned()) value.message = MissingEvent(orbit.event_times);
      return value;
    }
    value.residual = Residual(x, orbit).cwiseQuotient(row_);
    value.error = Error(x).cwiseQuotient(row_);
    if (!with_map) return value;
    orbit = PoincareMap(*system_, problem_.u, problem_.section, options_).Return(x);
    value.has_map = orbit.status == ReturnStatus::kReturned;
    value.message = orbit.message;
    if (!value.has_map) return value;
    mode_ = orbit.trajectory.arcs.front().mode;
    touching_ = {};
    if (problem_.section.kind == Section::Kind::kEvent) {
      touching_ = TouchingAt(*system_, x, options_.simulate.gap_tolerance);
    }
    const Matrix basis = AdmissibleBasis(*system_, x, mode_, options_.derivative.variables,
                                         touching_, KeptRows(orbit.trajectory));
    // Steps are short, and singular values small, beside the sizes of the unknowns.
    const Matrix in_sizes = column_.cwiseInverse().asDiagonal() * basis;
    const Matrix orthonormal = Eigen::HouseholderQR<Matrix>(in_sizes).householderQ() *
                               Matrix::Identity(basis.rows(), basis.cols());
    basis_ = column_.asDiagonal() * orthonormal;
    value.map = InBases(Rows(x, orbit), row_.cwiseInverse().asDiagonal().toDenseMatrix(), basis_);
    return value;
  }

  /// (x, p) ⊞ basis·z, moved back onto the constraints of the start.
  Vector Add(const Vector& y, const Vector& z) {
    const Vector w = basis_ * z;
    const int n = 2 * system_->dof();
    Vector moved(y.size());
    moved.tail(count()) = y.tail(count()) + w.tail(count());
    moved.head(problem_.x.size()) = system_->Perturb(y.head(problem_.x.size()), w.head(n));
    try {
      SetParameters(moved.tail(count()));
    } catch (const std::invalid_argument&) {
      return moved;  // out of range, which its evaluation says
    }
    Vector x = moved.head(problem_.x.size());
    Retract(*system_, mode_, &x, touching_);
    moved.head(problem_.x.size()) = x;
    return moved;
  }

  /// Throws BudgetExceeded where that ends the last run; all but that run is there then.
  void Finish(const Vector& y, OrbitSolution* solution) {
    SetParameters(y.tail(count()));
    solution->x = y.head(problem_.x.size());
    if (row_.size() == solution->newton.residual.size()) {
      solution->newton.residual = solution->newton.residual.cwiseProduct(row_);
    }
    solution->parameters = values_;
    solution->system = std::move(system_);
    options_.derivative.variables = {};
    solution->orbit =
        PoincareMap(*solution->system, problem_.u, problem_.section, options_).Return(solution->x);
    if (!BudgetEndWasTold()) return;
    std::string sentence;
    const BudgetEnd end = LookAtBudget(&sentence);
    throw BudgetExceeded(end, sentence);
  }

 private:
  /// Rows of (δq, δv) that steps keep: the slice of the symmetry, and rates of clocks that no
  /// condition asks for, which are no unknowns.
  Matrix KeptRows(const Trajectory& run) const {
    std::vector<int> clocks = ClockRates(*system_, run);
    const auto asked = [this](int j) {
      return std::any_of(problem_.conditions.begin(), problem_.conditions.end(),
                         [j](const OrbitCondition& condition) {
                           return condition.kind == OrbitCondition::Kind::kVelocity &&
                                  condition.index == j;
                         });
    };
    clocks.erase(std::remove_if(clocks.begin(), clocks.end(), asked), clocks.end());
    const Matrix slice = problem_.section.symmetry.Slice(*system_);
    Matrix rows(slice.rows() + static_cast<Eigen::Index>(clocks.size()), 2 * system_->dof());
    rows << slice, RateRows(clocks, system_->dof());
    return rows;
  }

  int count() const { return static_cast<int>(problem_.unknown_parameters.size()); }

  void AddEvents(const OrbitCondition& condition) {
    const int sizes[] = {1, system_->num_positions(), system_->dof(), system_->num_constraints(),
                         system_->num_constraints()};
    const int size = sizes[static_cast<int>(condition.kind)];
    if (condition.index < 0 || condition.index >= size || condition.other >= size ||
        !std::isfinite(condition.value)) {
      throw std::invalid_argument("a condition has no such index, or a value that is not finite");
    }
    if (!IsEvent(condition)) return;
    const bool release = condition.kind == OrbitCondition::Kind::kLiftOff;
    options_.events.push_back({condition.index, release, condition.occurrence});
    if (condition.other >= 0) {
      options_.events.push_back({condition.other, release, condition.occurrence});
    }
  }

  std::string MissingEvent(const Vector& times) const {
    Eigen::Index k = 0;
    while (std::isfinite(times(k))) ++k;
    return EventName(*system_, options_.events[static_cast<std::size_t>(k)]) +
           " does not happen before the return";
  }

  /// Throws std::invalid_argument, and changes nothing, for values the model refuses.
  void SetParameters(const Vector& p) {
    ParameterValues values = values_;
    for (int k = 0; k < count(); ++k) values[problem_.unknown_parameters[k]] = p(k);
    if (values == values_) return;
    system_ = problem_.factory(values);
    values_ = std::move(values);
  }

  /// The sizes of equations and unknowns, by the first return; false where there is none.
  bool FindSizes(const Vector& x, EquationValue* value) {
    const PoincareReturn orbit =
        PoincareMap(*system_, problem_.u, problem_.section, options_).Return(x, false);
    value->message = orbit.message;
    value->defined = orbit.returned();
    if (!value->defined) return false;
    const OrbitSizes sizes = SizesOf(*system_, orbit.trajectory);
    const int n = 2 * system_->dof();
    period_ = sizes.time;
    column_ = Vector::Ones(n + count());
    column_.head(n) = sizes.tangent;
    for (int k = 0; k < count(); ++k) {
      const double size = std::abs(values_.at(problem_.unknown_parameters[k]));
      if (size > 0) column_(n + k) = size;
    }
    row_ = Vector::Constant(n + static_cast<Eigen::Index>(problem_.conditions.size()), period_);
    row_.head(n) = sizes.tangent;
    int row = n;
    for (const OrbitCondition& condition : problem_.conditions) {
      if (OfState(condition)) row_(row) = sizes.Of(Gradient(condition, x));
      ++row;
    }
    return true;
  }

  /// What the tolerances of the runs let be known of P(x) ⊟ x: no orbit is found more exactly.
  Vector Error(const Vector& x) const {
    const int d = system_->dof();
    const SimulateOptions& run = options_.simulate;
    Vector size = Vector::Zero(row_.size());
    if (system_->num_positions() == d) size.head(d) = x.head(d);
    size.segment(d, d) = x.tail(d);
    size = size.cwiseAbs().cwiseMax(row_);
    return kRunErrors * (run.relative_tolerance * size.array() + run.absolute_tolerance).matrix();
  }

  Vector Residual(const Vector& x, const PoincareReturn& orbit) const {
    const int n = 2 * system_->dof();
    Vector residual(n + static_cast<Eigen::Index>(problem_.conditions.size()));
    residual.head(n) = system_->Separation(orbit.x, x);
    int row = n, event = 0;
    for (const OrbitCondition& condition : problem_.conditions) {
      double value = 0;
      if (condition.kind == OrbitCondition::Kind::kPeriod) value = orbit.time;
      if (condition.kind == OrbitCondition::Kind::kCoordinate) value = x(condition.index);
      if (condition.kind == OrbitCondition::Kind::kVelocity) {
        value = x(system_->num_positions() + condition.index);
      }
      if (IsEvent(condition)) {
        value = orbit.event_times(event++);
        if (condition.other >= 0) value -= orbit.event_times(event++);
      }
      residual(row++) = value - condition.value;
    }
    return residual;
  }

  static bool OfState(const OrbitCondition& condition) {
    return condition.kind == OrbitCondition::Kind::kCoordinate ||
           condition.kind == OrbitCondition::Kind::kVelocity;
  }

  /// Of the coordinate or velocity of a condition [2d].
  Vector Gradient(const OrbitCondition& condition, const Vector& x) const {
    const bool position = condition.kind == OrbitCondition::Kind::kCoordinate;
    const Section value{position ? Section::Kind::kCoordinate : Section::Kind::kVelocity,
                        condition.index, 0, 0};
    Vector gradient;
    value.Height(*system_, x, &gradient);
    return gradient;
  }

  /// The residual's derivative by (δq, δv, δp), L·extended + R, in units.
  PiecewiseLinearMap Rows(const Vector& x, const PoincareReturn& orbit) const {
    const int n = 2 * system_->dof(), columns = orbit.extended.cols();
    const auto rows = n + static_cast<Eigen::Index>(problem_.conditions.size());
    Matrix L = Matrix::Zero(rows, orbit.extended.rows()), R = Matrix::Zero(rows, columns);
    L.topLeftCorner(n, n).setIdentity();
    R.topLeftCorner(n, n) = -Matrix::Identity(n, n);
    int row = n, event = n + 1;
    for (const OrbitCondition& condition : problem_.conditions) {
      if (condition.kind == OrbitCondition::Kind::kPeriod) L(row, n) = 1;
      if (OfState(condition)) R.row(row).head(n) = Gradient(condition, x);
      if (IsEvent(condition)) {
        L(row, event++) = 1;
        if (condition.other >= 0) L(row, event++) = -1;
      }
      ++row;
    }
    std::vector<LinearPiece> pieces = orbit.extended.pieces();
    for (LinearPiece& piece : pieces) piece.matrix = (L * piece.matrix + R).eval();
    return PiecewiseLinearMap(std::move(pieces));
  }

  const OrbitProblem& problem_;
  PoincareOptions options_;
  ParameterValues values_;
  std::unique_ptr<MechanicalSystem> system_;
  double period_ = 0;    // of the first return, which decides …
  Vector row_, column_;  // … the sizes of the equations, and of (δq, δv, δp)
  Matrix basis_;
  ContactMode mode_;        // of the last start with a derivative, as …
  ConstraintSet touching_;  // … what touches there
};

}  // namespace

OrbitSolution FindOrbit(const OrbitProblem& problem, const OrbitOptions& options) {
  OrbitEquation equation(problem, options);
  NewtonOptions newton = options.newton;
  newton.add = [&](const Vector& y, const Vector& z) { return equation.Add(y, z); };
  OrbitSolution solution;
  solution.newton =
      SolveEquation([&](const Vector& y, bool with_map) { return equation(y, with_map); },
                    equation.Start(), newton);
  try {
    equation.Finish(solution.newton.x, &solution);
  } catch (const BudgetExceeded& reason) {
    if (solution.newton.status == NewtonStatus::kCancelled) return solution;
    solution.newton.status = NewtonStatus::kCancelled;
    solution.newton.message += std::string("; the last run: ") + reason.what();
  }
  return solution;
}

}  // namespace contact_flow
