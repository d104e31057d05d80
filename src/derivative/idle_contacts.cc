// SPDX-License-Identifier: BSD-3-Clause
#include "idle_contacts.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "contact_flow/budget.h"
#include "contact_flow/flow/corner_functions.h"
#include "contact_flow/model/row_layout.h"
#include "held_tangents.h"

namespace contact_flow {
namespace {

/// Forces this small beside what they are made of are zero; so are parts of gradients.
constexpr double kIdleForce = 1e-9, kNoGradient = 1e-7;
/// A slip is none below this part of the velocity.
constexpr double kNoSlipPart = 1e-9;

/// What the force of contact i is made of [N], by its gradient and what it is the gradient by; an
/// input counts as 1 at least, so that one that is rounding is none.
double SizeOf(const ContactDynamics& dynamics, const Vector& gradient, const Vector& x) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof();
  Vector values = Vector::Zero(gradient.size());
  values.segment(d, d) = x.tail(d);
  if (dynamics.variables().inputs) {
    values.segment(2 * d, dynamics.u().size()) = dynamics.u().cwiseAbs().cwiseMax(1);
  }
  const std::vector<int>& parameters = dynamics.variables().parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    values(values.size() - static_cast<Eigen::Index>(parameters.size() - k)) =
        system.description().parameters[static_cast<std::size_t>(parameters[k])].value;
  }
  return gradient.cwiseAbs().dot(values.cwiseAbs()) + gradient.head(d).cwiseAbs().maxCoeff();
}

/// Where forces may begin to vanish: an arc as a whole, where f has no corners, else its steps.
std::vector<std::pair<double, double>> SpansOf(const MechanicalSystem& system, const Arc& arc,
                                               double instant) {
  if (CornerFunctions(system).Empty()) return {{arc.t_begin, arc.t_end}};
  std::vector<std::pair<double, double>> spans;
  for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(k));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k));
    if (end - begin > instant) spans.emplace_back(begin, end);
  }
  return spans;
}

/// The mode with contact i, as it has it, or as the slip at x makes it.
ContactMode Holding(const MechanicalSystem& system, const ConstraintTerms& terms, const Vector& v,
                    ContactMode mode, int i) {
  if (mode.Contains(i) || !system.HasFriction()) return mode.With(i);
  const Friction& friction = system.friction()[static_cast<std::size_t>(i)];
  if (friction.dimension == 0) return mode.With(i);
  const Vector slip = terms.jacobian.middleRows(friction.row, friction.dimension) * v;
  const bool still = slip.norm() <= kNoSlipPart * v.norm();
  mode.Set(i, still || friction.coefficient == Friction::kNoSlip ? Letter::kStick
              : friction.dimension > 1                           ? Letter::kSlip
              : slip(0) > 0                                      ? Letter::kForward
                                                                 : Letter::kBackward);
  return mode;
}

/// Whether contact i is idle at x, and its force, were it held, may take either sign.
bool IsUndecided(ContactDynamics* dynamics, const ArcInRun& run, const Vector& x, ContactMode mode,
                 int i) {
  const MechanicalSystem& system = dynamics->system();
  const Vector q = x.head(system.num_positions()), v = x.tail(system.dof());
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  if (!(std::abs(terms.gap(i)) <= run.gap_tolerance)) return false;
  if (!(std::abs(terms.jacobian.row(i).dot(v)) <= run.speed_tolerance)) return false;  // passes
  const RowLayout layout(system);
  std::vector<int> closed = layout.Closed((mode - system.compliant()).Without(i)), still;
  layout.AddTangential(mode.Sticking().Without(i), &still);
  Matrix rows(static_cast<Eigen::Index>(closed.size() + still.size()), system.dof());
  Eigen::Index count = 0;
  for (const std::vector<int>& all : {closed, still}) {
    for (int row : all) rows.row(count++) = terms.jacobian.row(row);
  }
  const Vector own = terms.jacobian.row(i).transpose();
  if (WithoutSpan(rows, own).norm() <= kNoGradient * own.norm()) return false;  // they hold it, too
  closed.push_back(i);
  const ContactMode held = Holding(system, terms, v, mode, i);
  const double rate = dynamics->ForceRate(x, held, i);
  dynamics->Differentiate(x, held);
  const Vector gradient = dynamics->force_jacobian().row(i).transpose();
  const double force = dynamics->force()(i);
  const double size = SizeOf(*dynamics, gradient, x);
  if (!gradient.allFinite() || !(std::abs(force) <= kIdleForce * size)) return false;
  // It has just begun, or is about to end: in an arc as short as that it is not yet more.
  if (!(std::abs(rate) * run.duration <= kNoGradient * size)) return false;
  const Vector free = WithoutSpan(HeldTangents(*dynamics, terms, closed, still, q, v), gradient);
  return free.cwiseAbs().maxCoeff() > kNoGradient * gradient.cwiseAbs().maxCoeff();
}

}  // namespace

Status CheckIdleContacts(ContactDynamics* dynamics, const Arc& arc, const ArcInRun& run) {
  const MechanicalSystem& system = dynamics->system();
  if (arc.dense.Empty() || !(arc.t_begin < arc.t_end)) return {};
  const int n = system.num_constraints(), nq = system.num_positions();
  Vector x = arc.x_begin;
  double largest = 1;  // IsUndecided looks closer
  ConstraintTerms terms;
  for (const auto& [begin, end] : SpansOf(system, arc, run.instant)) {
    AskBudget();
    arc.dense.Evaluate(0.5 * (begin + end), x.data());
    system.Constraints(x.head(nq), x.tail(system.dof()), &terms);
    if (!arc.mode.Empty()) dynamics->Evaluate(x, arc.mode);
    const Vector force = arc.mode.Empty() ? Vector::Zero(n) : Vector(dynamics->force().head(n));
    if (n > 0) largest = std::max(largest, force.cwiseAbs().maxCoeff());
    for (int i = 0; i < n; ++i) {
      if (system.compliant().Contains(i)) continue;
      if (arc.mode.Contains(i) ? !(std::abs(force(i)) <= kIdleForce * largest)
                               : !(std::abs(terms.gap(i)) <= run.gap_tolerance)) {
        continue;
      }
      bool idle = true;
      for (const double part : {0.5, 0.25, 0.75}) {
        arc.dense.Evaluate(begin + part * (end - begin), x.data());
        idle = idle && IsUndecided(dynamics, run, x, arc.mode, i);
      }
      if (!idle) continue;
      std::ostringstream message;
      message.precision(12);
      message << "from t = " << begin << " s to " << end << " s contact '"
              << system.description().constraints[static_cast<std::size_t>(i)]
              << "' touches, and is neither pressed nor lifted: perturbed runs may do either";
      return {Outcome::kNotDifferentiable, message.str()};
    }
  }
  return {};
}

}  // namespace contact_flow
