// SPDX-License-Identifier: BSD-3-Clause
// The only file that knows Ipopt, by its C interface.
#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>

#include "contact_flow/trajectory_optimization/multiple_shooting.h"
#include "nonlinear_program.h"
#if CONTACT_FLOW_HAVE_IPOPT
#include <IpStdCInterface.h>
#endif

namespace contact_flow {

#if CONTACT_FLOW_HAVE_IPOPT

bool HaveIpopt() { return true; }

namespace {

// Those of Ipopt's interface, whose own names are deprecated since 3.14.
using Index = int;
using Number = double;

constexpr double kNoBound = 2e19;  // what Ipopt takes for infinite is 1e19

/// One search, with the last point that was looked at.
struct Session {
  const NonlinearProgram& program;
  Vector x, rows, gradient, entries;
  double f = 0;
  bool seen = false, fine = false, differentiated = false, smooth = false, stopped = false;
  std::exception_ptr error;

  /// f and rows at x; false where there are none.
  bool Look(int n, const double* at) {
    const Eigen::Map<const Vector> given(at, n);
    if (seen && given == x) return fine;
    x = given;
    seen = true;
    differentiated = false;
    return fine = Try([&] { return program.evaluate(x, &f, &rows); }) && Finite(rows);
  }
  bool Differentiate(int n, const double* at) {
    if (!Look(n, at)) return false;
    if (differentiated) return smooth;
    differentiated = true;
    return smooth = Try([&] { return program.differentiate(x, &gradient, &entries); }) &&
                    gradient.allFinite() && Finite(entries);
  }
  bool Finite(const Vector& values) const { return std::isfinite(f) && values.allFinite(); }
  /// Nothing is thrown through Ipopt.
  template <class Body>
  bool Try(const Body& body) {
    if (error) return false;
    try {
      return body();
    } catch (...) {
      error = std::current_exception();
      return false;
    }
  }
};

Session& Of(UserDataPtr data) { return *static_cast<Session*>(data); }

Bool Cost(Index n, Number* x, Bool, Number* f, UserDataPtr data) {
  Session& session = Of(data);
  if (!session.Look(n, x)) return 0;
  *f = session.f;
  return 1;
}

Bool Gradient(Index n, Number* x, Bool, Number* gradient, UserDataPtr data) {
  Session& session = Of(data);
  if (!session.Differentiate(n, x)) return 0;
  std::copy_n(session.gradient.data(), n, gradient);
  return 1;
}

Bool Rows(Index n, Number* x, Bool, Index count, Number* rows, UserDataPtr data) {
  Session& session = Of(data);
  if (!session.Look(n, x)) return 0;
  std::copy_n(session.rows.data(), count, rows);
  return 1;
}

Bool Jacobian(Index n, Number* x, Bool, Index, Index count, Index* row, Index* column,
              Number* values, UserDataPtr data) {
  Session& session = Of(data);
  if (values == nullptr) {
    for (Index i = 0; i < count; ++i) {
      row[i] = session.program.pattern[static_cast<std::size_t>(i)].first;
      column[i] = session.program.pattern[static_cast<std::size_t>(i)].second;
    }
    return 1;
  }
  if (!session.Differentiate(n, x)) return 0;
  std::copy_n(session.entries.data(), count, values);
  return 1;
}

Bool NoHessian(Index, Number*, Bool, Number, Index, Number*, Bool, Index, Index*, Index*, Number*,
               UserDataPtr) {
  return 0;
}

Bool Progress(Index, Index iteration, Number f, Number violation, Number, Number, Number, Number,
              Number, Number, Index, UserDataPtr data) {
  Session& session = Of(data);
  const bool on = session.Try([&] {
    return !session.program.progress ||
           session.program.progress(iteration, f, violation, session.x);
  });
  session.stopped = !on;
  return on ? 1 : 0;
}

/// Bounds as Ipopt takes them.
Vector Bounds(const Vector& values) { return values.cwiseMax(-kNoBound).cwiseMin(kNoBound); }

void Explain(int end_code, NonlinearSolution* solution);

}  // namespace

NonlinearSolution SolveByIpopt(const NonlinearProgram& program) {
  const auto n = static_cast<Index>(program.start.size());
  const auto m = static_cast<Index>(program.row_lower.size());
  Vector lower = Bounds(program.lower), upper = Bounds(program.upper);
  Vector row_lower = Bounds(program.row_lower), row_upper = Bounds(program.row_upper);
  const IpoptProblem ipopt =
      CreateIpoptProblem(n, lower.data(), upper.data(), m, row_lower.data(), row_upper.data(),
                         static_cast<Index>(program.pattern.size()), 0, 0, &Cost, &Rows, &Gradient,
                         &Jacobian, &NoHessian);
  if (ipopt == nullptr) throw std::runtime_error("Ipopt refuses the problem");
  const auto text = [&](const char* name, const char* value) {
    AddIpoptStrOption(ipopt, const_cast<char*>(name), const_cast<char*>(value));
  };
  text("hessian_approximation", "limited-memory");
  text("sb", "yes");
  AddIpoptIntOption(ipopt, const_cast<char*>("print_level"), 0);
  AddIpoptIntOption(ipopt, const_cast<char*>("max_iter"), program.max_iterations);
  AddIpoptIntOption(ipopt, const_cast<char*>("limited_memory_max_history"), 30);
  AddIpoptNumOption(ipopt, const_cast<char*>("tol"), program.tolerance);
  AddIpoptNumOption(ipopt, const_cast<char*>("constr_viol_tol"), program.tolerance);
  AddIpoptNumOption(ipopt, const_cast<char*>("bound_relax_factor"), 0);
  AddIpoptIntOption(ipopt, const_cast<char*>("acceptable_iter"), 0);
  SetIntermediateCallback(ipopt, &Progress);
  Session session{program, {}, {}, {}, {}, 0, false, false, false, false, false, nullptr};
  NonlinearSolution solution;
  solution.x = program.start;
  solution.multipliers = Vector::Zero(m);
  Vector rows(m), below(n), above(n);
  double f = 0;
  const int end_code =
      IpoptSolve(ipopt, solution.x.data(), rows.data(), &f, solution.multipliers.data(),
                 below.data(), above.data(), &session);
  FreeIpoptProblem(ipopt);
  if (session.error) std::rethrow_exception(session.error);
  Explain(end_code, &solution);
  return solution;
}

namespace {

void Explain(int end_code, NonlinearSolution* solution) {
  using Status = NonlinearSolution::Status;
  switch (end_code) {
    case Solve_Succeeded:
      solution->status = Status::kConverged;
      solution->message = "converged";
      break;
    case Infeasible_Problem_Detected:
      solution->status = Status::kInfeasible;
      solution->message = "the conditions contradict one another nearby";
      break;
    case Maximum_Iterations_Exceeded:
      solution->status = Status::kMaxIterations;
      solution->message = "max_iterations were made";
      break;
    case User_Requested_Stop:
      solution->status = Status::kCancelled;
      solution->message = "the caller asked to stop";
      break;
    case Invalid_Number_Detected:
      solution->status = Status::kUndefined;
      solution->message = "a segment, or its derivative, is not to be had at the start";
      break;
    default:
      solution->status = Status::kStalled;
      solution->message = "Ipopt ended with its code " + std::to_string(end_code);
  }
}

}  // namespace

#else

bool HaveIpopt() { return false; }

NonlinearSolution SolveByIpopt(const NonlinearProgram&) {
  throw std::runtime_error(
      "multiple shooting needs Ipopt: install it (coinor-libipopt-dev) and build again");
}

#endif

}  // namespace contact_flow
