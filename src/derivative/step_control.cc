// SPDX-License-Identifier: BSD-3-Clause
#include "step_control.h"

#include <algorithm>
#include <cmath>

#include "propagation_verdict.h"

namespace contact_flow {
namespace {

/// Beyond this many times the step that would resolve the fastest mode, collocation of Gauss and
/// Legendre loses its order in it, and the error estimate its truth (measured: config/robots
/// against tolerance 1e-13).
constexpr double kStiffReach = 3;
constexpr double kSlackening = 0.6;  // most by which the rate falls from one step to the next
constexpr double kReach = 0.9;       // part of the longest acceptable step that is taken
/// Rounding of a defect h·δ, relative to the tangents times h times the fastest rate.
constexpr double kDefectRounding = 1e-13;
/// DOP853 at tolerance ε takes steps of about ε^{1/8}·kBaseReach over the fastest rate it sees.
constexpr double kBaseReach = 8;
/// A step is held up where as many of it would not end the arc.
constexpr double kShort = 64;
/// Less is not asked for where a slow slip in space holds steps up: its rounding is above it, and
/// steps that follow that are as many as one has time for. Four times as much, up to the other, is
/// let pass each time that a longer step fails there.
constexpr double kLeastHeldUp = 1e-10, kMostHeldUp = 1e-8;
constexpr int kLongestPatience = 1024;
constexpr long kMaxSteps = 1000000;
constexpr double kSmallestStep = 1e-13;  // relative to the arc
/// The defect inside a step beside what it is at its ends, where collocation keeps its order.
constexpr double kShape = 30;
constexpr double kGolden = 0.6180339887498949;

}  // namespace

double MixedEntry(int i) {
  return (i % 3 == 1 ? -1 : 1) * (0.6 + std::fmod(kGolden * (i + 1), 0.8));
}

StepControl::StepControl(ArcJacobian* jacobian, const Arc& arc, double tolerance)
    : arc_(arc),
      jacobian_(*jacobian),
      tolerance_(tolerance),
      d_(static_cast<int>(jacobian->units().length.size())),
      pace_(arc.dense),
      law_(tolerance) {}

bool StepControl::Decays(const CollocationRule& rule) const {
  return rule.stiff && jacobian_.slips_in_space();
}
double StepControl::Factor(const CollocationRule& rule) const {
  return rule.stiff && !Decays(rule) ? rule.defect : rule.error;
}
double StepControl::Power(const CollocationRule& rule) const {
  return rule.stiff && !Decays(rule) ? rule.stages + 1 : rule.power;
}

void StepControl::Begin(const Matrix& begin, const Vector& field) {
  law_.Begin(field, jacobian_.FreeSize());
  fastest_ = FastestRate(begin.leftCols(2 * d_));
  // The fastest rate at the beginning, or what the steps of the run itself tell of the change of K
  // and D.
  const double base_step = jacobian_.duration() / static_cast<double>(arc_.dense.NumSteps());
  const double base_rate = kBaseReach * std::pow(tolerance_, 1.0 / 8) / base_step;
  rate_ = std::max(fastest_, std::min(base_rate, 2 * fastest_));
}

double StepControl::Reach(double t, const CollocationRule& rule) const {
  const double angle = kReach * std::pow(tolerance_ / Factor(rule), 1.0 / Power(rule));
  double reach = std::min(longest_, jacobian_.Units(pace_.Reach(jacobian_.Time(t), rule.stages)));
  if (rate_ > 0) reach = std::min(reach, angle / rate_);
  if (fastest_ > 0 && !rule.stiff) reach = std::min(reach, kStiffReach * angle / fastest_);
  return reach;
}

bool StepControl::Learn(double error, double length, bool probe) {
  const bool finite = std::isfinite(error), small = error <= tolerance_;
  if (probe && !small) return false;
  if (finite) {
    const double angle = std::pow(error / Factor(*rule_), 1.0 / Power(*rule_));
    // What has decayed in a step that is long beside it leaves rounding, which tells no rate.
    const double defect = rule_->defect * std::pow(angle, rule_->stages + 1.0);
    const bool tells = !small || defect > kDefectRounding * std::max(1.0, fastest_ * length);
    const double seen = angle / length;
    rate_ = std::max(tells ? seen : 0, probe ? 0 : kSlackening * rate_);
  }
  if (!small) rate_ = finite ? 1.1 * rate_ : std::max(10 * rate_, 1 / length);
  return small;
}

void StepControl::NoteStiffness(bool probe, bool good, double length, double rest) {
  if (probe) {  // of a slip in space
    held_ = 0;
    patience_ = good ? kPatience : std::min(2 * patience_, kLongestPatience);
    if (!good) tolerance_ = std::max(tolerance_, std::min(4 * tolerance_, kMostHeldUp));
    return;
  }
  if (!jacobian_.slips_in_space()) return;
  held_ = good && !rule_->stiff && kShort * length < rest ? held_ + 1 : 0;
  if (IsProbe()) tolerance_ = std::max(tolerance_, kLeastHeldUp);
}

bool StepControl::ObeysLaw(double t, double length, const Matrix& end) {
  const double state = std::max(1.0, arc_.x_end.lpNorm<Eigen::Infinity>());
  if (law_.Holds(end.leftCols(2 * d_), state * jacobian_.StateUnit())) return true;
  if (length <= jacobian_.Units(pace_.StateStep(jacobian_.Time(t))) / 2) {
    law_.Excuse();
    return true;
  }
  longest_ = length / 2;
  return false;
}

void StepControl::CountAccepted(double t, double error, VariationStatistics* statistics) {
  if (++statistics->steps > kMaxSteps) RefuseUnresolved(jacobian_.Time(t));
  error_ += error;
  law_.Accept();
  longest_ *= 2;
}

void StepControl::CountRejected(double t, double length, VariationStatistics* statistics) const {
  ++statistics->rejected_steps;
  if (length < kSmallestStep * jacobian_.duration()) RefuseUnresolved(jacobian_.Time(t));
}

void StepControl::Finish(VariationStatistics* statistics) const {
  statistics->jacobians += jacobian_.count();
  statistics->push_reach = jacobian_.push_reach();
  statistics->flow_law_residual = std::max(statistics->flow_law_residual, law_.total());
  statistics->error_estimate = std::max(statistics->error_estimate, error_ + law_.total());
  JudgeFlowLaw(arc_, law_);
}

const CollocationRule::Point& StepControl::NextGap(const CollocationRule& rule) {
  golden_ += kGolden;
  golden_ -= std::floor(golden_);
  return rule.between[static_cast<std::size_t>(golden_ * (rule.stages - 1))];
}

double StepControl::Error(const CollocationRule& rule, double ends, double inside,
                          const CollocationRule::Point& point) const {
  const double relative = std::max(ends, inside / point.weight);
  const double power = Power(rule) / (rule.stages + 1);
  const double error = Factor(rule) * std::pow(relative / rule.defect, power);
  return Shapeless(ends, inside, point) ? std::max(error, inside) : error;
}

bool StepControl::Shapeless(double ends, double inside, const CollocationRule::Point& point) {
  return inside / point.weight > kShape * ends;
}

}  // namespace contact_flow
