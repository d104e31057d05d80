// SPDX-License-Identifier: BSD-3-Clause
#include "free_slips.h"

#include <algorithm>
#include <sstream>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// A slip is zero below this, relative to its terms.
constexpr double kSameSlip = 1e-9;
/// Of one step, each with at most one turn of a slip.
constexpr int kPieces = 8;
/// Of a piece, down to rounding.
constexpr int kBisections = 50;

/// s = T v of contact i, and s · ṡ.
struct Slip {
  Vector s;
  double rate;
  bool vanishes;
};

class SlipAlong {
 public:
  SlipAlong(const MechanicalSystem& system, const Arc& arc, int i)
      : system_(system), arc_(arc), row_(system.friction()[i]), dynamics_(system, arc.u) {}

  Slip At(const Vector& x) {
    const int d = system_.dof(), nq = system_.num_positions();
    ConstraintTerms terms;
    system_.Constraints(x.head(nq), x.tail(d), &terms);
    const Matrix T = terms.jacobian.middleRows(row_.row, row_.dimension);
    Slip slip;
    slip.s = T * x.tail(d);
    slip.vanishes = slip.s.norm() <= kSameSlip * (T.cwiseAbs() * x.tail(d).cwiseAbs()).norm();
    dynamics_.Evaluate(x, arc_.mode);
    const Vector bias = terms.bias.segment(row_.row, row_.dimension);
    slip.rate = slip.s.dot(T * dynamics_.acceleration() + bias);
    return slip;
  }
  Slip At(double t) {
    Vector x = arc_.x_begin;
    arc_.dense.Evaluate(t, x.data());
    return At(x);
  }

 private:
  const MechanicalSystem& system_;
  const Arc& arc_;
  const Friction row_;
  ContactDynamics dynamics_;
};

/// Whether s does not vanish along the arc, nor where |s| is least between samples, and keeps its
/// sign in the plane.
bool SlipsOneWay(const MechanicalSystem& system, const Arc& arc, int i) {
  SlipAlong slip(system, arc, i);
  const Slip begin = slip.At(arc.x_begin), end = slip.At(arc.x_end);
  const auto forward = [&](const Slip& at) {
    return !at.vanishes && (at.s.size() == 2 || begin.s.dot(at.s) > 0);
  };
  if (!forward(begin) || !forward(end)) return false;
  double left = arc.t_begin;
  bool falls = begin.rate < 0;
  const auto look = [&](double right, const Slip& at) {
    if (!forward(at)) return false;
    const bool still = at.rate < 0;
    if (falls && !still) {
      double low = left, high = right;
      for (int k = 0; k < kBisections; ++k) {
        const double middle = low + (high - low) / 2;
        (slip.At(middle).rate < 0 ? low : high) = middle;
      }
      if (!forward(slip.At(high))) return false;
    }
    falls = still;
    left = right;
    return true;
  };
  for (std::size_t step = 0; step < arc.dense.NumSteps(); ++step) {
    AskBudget();
    const double t = std::max(arc.dense.StepBegin(step), arc.t_begin);
    const double end = arc.dense.StepBegin(step) + arc.dense.StepLength(step);
    for (int piece = 1; piece <= kPieces; ++piece) {
      const double right = std::min(t + (end - t) * piece / kPieces, arc.t_end);
      if (!look(right, slip.At(right))) return false;
    }
  }
  return true;
}

}  // namespace

Status CheckFreeSlips(const ContactDynamics& dynamics, const Arc& arc) {
  const MechanicalSystem& system = dynamics.system();
  const std::vector<int>& parameters = dynamics.variables().parameters;
  if (!system.HasFriction() || parameters.empty() || arc.t_end == arc.t_begin) return {};
  const Matrix by_parameter = system.DifferentiateFriction(parameters);
  for (int i : arc.mode - system.compliant()) {
    const Friction& friction = system.friction()[i];
    if (friction.dimension == 0 || friction.coefficient > 0 || by_parameter.row(i).isZero(0)) {
      continue;
    }
    if (SlipsOneWay(system, arc, i)) continue;
    std::ostringstream message;
    message.precision(12);
    message << "from t = " << arc.t_begin << " s to " << arc.t_end << " s the contact '"
            << system.description().constraints[i]
            << "', whose friction is 0 and a variable, does not slip one way: which way friction "
               "would act is not decided";
    return {Outcome::kNotDifferentiable, message.str()};
  }
  return {};
}

}  // namespace contact_flow
