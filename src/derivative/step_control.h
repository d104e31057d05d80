// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "arc_jacobian.h"
#include "collocation_rule.h"
#include "contact_flow/budget.h"
#include "contact_flow/derivative/variation.h"
#include "flow_law.h"
#include "motion_pace.h"
#include "propagation_verdict.h"

namespace contact_flow {

/// Entry i of a tangent without symmetries: ±(0.6 … 1.4).
double MixedEntry(int i);

/// The steps of the tangents along an arc: stages and length of each, whether it is good enough,
/// and when the arc is refused. PropagateArc and ArcTangents walk by it. Their walker W has
///   double Cost(const CollocationRule& rule, double length, double fastest): multiplications for
///     one such step without its Jacobians, where the fastest mode has that rate;
///   double Try(double t, double length, const CollocationRule& rule): makes the step, not yet to
///     be relied on; its error, infinite where it is not determined;
///   void NoteLaw(FlowLaw* law): the residual of that step;
///   const Matrix& End(): [K D S] where it ends;
///   void Accept(): takes it over;
///   const Matrix& PassBreak(double t): the next step begins where [K D S] jumps; the one behind.
class StepControl {
 public:
  /// `tolerance` is for the error of a step, relative to the largest entry of the tangents.
  StepControl(ArcJacobian* jacobian, const Arc& arc, double tolerance);

  /// Walks from the beginning of the arc, where [K D S] is `begin` and F is `field`, to its end.
  /// Refuses as propagation_verdict.h says.
  template <class W>
  void Walk(const Matrix& begin, const Vector& field, W* walker, VariationStatistics* statistics);

  /// Σ of the estimated errors of the steps.
  double error() const { return error_; }
  /// What a step may be wrong by: more than was asked where a slow slip in space held steps up.
  double tolerance() const { return tolerance_; }

  /// Whether defects count by what a step of this rule leaves of them: see DecayedDefect.
  bool Decays(const CollocationRule& rule) const;
  /// One of the gaps between the nodes, another one each time.
  const CollocationRule::Point& NextGap(const CollocationRule& rule);
  /// Error of a step that leaves the defect h·δ `ends` at its ends and `inside` at `point`, both
  /// relative to the tangents.
  double Error(const CollocationRule& rule, double ends, double inside,
               const CollocationRule::Point& point) const;
  /// Whether a defect inside has not the shape that it has where all is smooth, so that collocation
  /// has not its order.
  static bool Shapeless(double ends, double inside, const CollocationRule::Point& point);

 private:
  /// One Jacobian, with its part of the linear system, costs about as much as this many
  /// multiplications for each of its entries (measured).
  static constexpr double kJacobianCost = 50;
  /// Rules for decays that are fast beside the step are taken where others cost so much more.
  static constexpr double kStiffGain = 2;
  /// So many steps before a stiff rule is tried, twice as many each time that it fails, and how
  /// much longer its step is.
  static constexpr int kPatience = 8;
  static constexpr double kProbe = 8;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  void Begin(const Matrix& begin, const Vector& field);
  /// The error of a step is taken for Factor·(r h)^Power: that of its rule. Stiff rules have less
  /// than their order in what decays within the step: there it is the defect itself, but for the
  /// one turn of a slip in space, whose rate is beyond what a defect resolves (1e12/s).
  double Factor(const CollocationRule& rule) const;
  double Power(const CollocationRule& rule) const;
  /// The longest step with this rule at t.
  double Reach(double t, const CollocationRule& rule) const;
  /// Chooses stages and length of the next step so that what is left of the arc costs least.
  template <class W>
  double ChooseStep(double t, double rest, const W& walker);
  /// Whether steps have been short beside what is left for so long that one of a stiff rule, which
  /// does not follow what is fast, is to be tried, kProbe times as long. Where a slip in space is
  /// slow, rounding hides that nothing else is as fast as its turns.
  bool IsProbe() const { return held_ >= patience_; }
  /// Counts the steps that are held up.
  void NoteStiffness(bool probe, bool good, double length, double rest);
  /// Learns the rate of the tangents from a step; whether its error is small enough. A probe's rate
  /// is taken as it is, if its error is, and tells nothing of other rules if not.
  bool Learn(double error, double length, bool probe);
  /// Whether the step obeys the flow law, as well as the state allows it. If not, the next one is
  /// to be shorter; steps that are short beside those of the state resolve all that it knows.
  bool ObeysLaw(double t, double length, const Matrix& end);
  /// Counts a step that is taken or not; refuses where they are too short or too many.
  void CountAccepted(double t, double error, VariationStatistics* statistics);
  void CountRejected(double t, double length, VariationStatistics* statistics) const;
  void Finish(VariationStatistics* statistics) const;

  const Arc& arc_;
  ArcJacobian& jacobian_;
  double tolerance_;
  const int d_;
  MotionPace pace_;
  FlowLaw law_;
  const CollocationRule* rule_ = nullptr;
  double rate_ = 0;             // r of the tangents: a step's error is error·(r h)^power
  double fastest_ = 0;          // rate of a mode at the beginning of the step
  double longest_ = kInfinity;  // step that the flow law allows
  double error_ = 0;            // Σ of the estimates of the steps
  double golden_ = 0;           // goes round the gaps between nodes
  int held_ = 0;                // steps in a row that were short
  int patience_ = kPatience;    // so many before a stiff rule is tried
};

template <class W>
void StepControl::Walk(const Matrix& begin, const Vector& field, W* walker,
                       VariationStatistics* statistics) {
  Begin(begin, field);
  const double end = jacobian_.duration();
  double t = 0;  // from the beginning of the arc on, in its units
  while (t < end) {
    AskBudget();
    const double stop = jacobian_.NextBreak(t);
    const double rest = stop - t;
    const bool probe = IsProbe();
    const double length = ChooseStep(t, rest, *walker);
    const double error = walker->Try(t, length, *rule_);
    if (std::isnan(error)) RefuseNoError(jacobian_.Time(t));
    bool good = Learn(error, length, probe);
    if (good) {
      walker->NoteLaw(&law_);
      good = ObeysLaw(t, length, walker->End());
    }
    NoteStiffness(probe, good, length, rest);
    if (!good) {
      CountRejected(t, length, statistics);
      continue;
    }
    CountAccepted(t, error, statistics);
    t = length == rest ? stop : t + length;
    if (t < stop) fastest_ = FastestRate(walker->End().leftCols(2 * d_));
    walker->Accept();
    if (t == stop && t < end) fastest_ = FastestRate(walker->PassBreak(t).leftCols(2 * d_));
  }
  Finish(statistics);
}

template <class W>
double StepControl::ChooseStep(double t, double rest, const W& walker) {
  double least = kInfinity, length = rest;
  const auto consider = [&](const CollocationRule& rule, double factor) {
    const double steps = std::ceil(std::max(1.0, rest / Reach(t, rule)));
    const double jacobians = (rule.stages + 2) * kJacobianCost * 2 * d_ * d_;
    const double cost = factor * steps * (walker.Cost(rule, rest / steps, fastest_) + jacobians);
    if (!(cost < least)) return;
    least = cost;
    length = rest / steps;
    rule_ = &rule;
  };
  constexpr int kFirst = CollocationRule::kMinStages, kLast = CollocationRule::kMaxStages;
  for (int s = kFirst; s <= kLast; ++s) consider(CollocationRule::GaussLegendre(s), 1);
  // No length is known where rates are not finite.
  if (!(least < kInfinity)) RefuseUnresolved(jacobian_.Time(t));
  if (IsProbe()) {
    rule_ = &CollocationRule::RadauIIA(kLast);
    return std::min(rest, kProbe * length);
  }
  if (rest <= kStiffGain * length) return length;
  for (int s = kFirst; s <= kLast; ++s) consider(CollocationRule::RadauIIA(s), kStiffGain);
  return length;
}

}  // namespace contact_flow
