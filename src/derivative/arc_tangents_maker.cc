// SPDX-License-Identifier: BSD-3-Clause
// How the steps of an arc are made.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "arc_tangents.h"
#include "contact_flow/budget.h"
#include "decayed_defect.h"
#include "propagation_verdict.h"
#include "step_control.h"

namespace contact_flow {
namespace {

/// Steps longer than this beside the fastest rate are factorized; others take about so many rounds.
constexpr double kFactorized = 1.5, kRounds = 15;
/// Columns that are followed: a tangent with a part in all, F, and one of the variables.
constexpr int kTangent = 0, kField = 1, kSource = 2;

}  // namespace

/// Makes the steps of one arc.
class ArcTangentsMaker {
 public:
  ArcTangentsMaker(ContactDynamics* dynamics, const Arc& arc, double tolerance, const RunCost* cost,
                   ArcTangents* made)
      : system_(dynamics->system()),
        dynamics_(*dynamics),
        arc_(arc),
        d_(system_.dof()),
        k_(dynamics->num_variables()),
        cost_(cost != nullptr && cost->HasRate() ? cost : nullptr),
        made_(*made),
        jacobian_(dynamics, arc),
        control_(&jacobian_, arc, tolerance),
        followed_(Matrix::Zero(2 * d_ + k_, k_ > 0 ? 3 : 2)) {
    for (Place* place : {&begin_, &end_, &between_}) place->jacobian.resize(d_, 2 * d_ + k_);
  }

  void Make(VariationStatistics* statistics) {
    Begin();
    control_.Walk(begin_.jacobian, begin_.field, this, statistics);
    made_.end_ = {begin_.system_field, begin_.rate.value};
    if (!followed_.allFinite()) RefuseOverflow(arc_);
  }

  // As StepControl asks for:

  /// What few tangents cost: a factorization, or some rounds.
  double Cost(const CollocationRule& rule, double length, double fastest) const {
    const double n = rule.stages * d_;
    const bool factorized = n <= CollocationStep::kDirect || length * fastest > kFactorized;
    return factorized ? n * n * n / 3 : kRounds * n * 4 * d_;
  }

  /// Fills the step from t on and follows it.
  double Try(double t, double h, const CollocationRule& rule) {
    const int s = rule.stages;
    step_ = std::make_unique<CollocationStep>(d_, k_, rule, h);
    nodes_.resize(static_cast<std::size_t>(s));
    Matrix gradients(cost_ != nullptr ? 2 * d_ : 0, s);
    for (int i = 0; i < s; ++i) {
      AskBudget();
      const double at = t + rule.c(i) * h;
      Look(at, step_->Node(i).data(), step_->Source(i).data());
      if (cost_ == nullptr) continue;
      LookAtCost(at, &nodes_[static_cast<std::size_t>(i)]);
      gradients.col(i) =
          jacobian_.units().time * h * rule.b(i) * nodes_[static_cast<std::size_t>(i)].by_tangent;
    }
    if (cost_ != nullptr) step_->SetCost(gradients);
    if (k_ > 0 && made_.steps_.empty()) BeginSources();
    if (!step_->Solve(followed_, &accelerations_)) return std::numeric_limits<double>::infinity();
    next_ = followed_;
    step_->Advance(&next_, accelerations_);
    Look(t + h, &end_);
    const CollocationRule::Point& point = control_.NextGap(rule);
    Look(t + point.at * h, &between_);
    size_ = std::max(1.0, next_.col(kTangent).head(2 * d_).cwiseAbs().maxCoeff());
    if (k_ > 0) {
      source_size_ = std::max(1.0, next_.col(kSource).head(2 * d_).cwiseAbs().maxCoeff());
    }
    const Matrix at_end = Defect(end_, next_, rule.at_end);
    const Matrix at_begin = Defect(begin_, followed_, rule.begin.value);
    Matrix tangents = followed_;
    tangents.topRows(2 * d_) =
        step_->Tangents(followed_, accelerations_, point.at, point.once, point.twice);
    const Matrix inside = Defect(between_, tangents, point.value);
    const double error = control_.Error(rule, h * std::max(Relative(at_begin), Relative(at_end)),
                                        h * Relative(inside), point);
    return cost_ != nullptr ? std::max(error, CostError(point, tangents)) : error;
  }

  void NoteLaw(FlowLaw* law) const {
    law->Residual(Vector(next_.col(kField).head(2 * d_)), end_.field, size_);
  }
  const Matrix& End() const { return end_.jacobian; }

  void Accept() {
    followed_.swap(next_);
    std::swap(begin_, end_);
    followed_.col(kField).head(2 * d_) = begin_.field;
    if (cost_ != nullptr) AddCost();
    made_.steps_.push_back(std::move(*step_));
  }

  const Matrix& PassBreak(double t) {
    Look(t, &begin_, true);
    return begin_.jacobian;
  }

 private:
  /// What is known where the Jacobian was looked at.
  struct Place {
    Matrix jacobian;      // [K D S] [d × 2d+k]
    Vector field;         // in the units of the arc
    Vector system_field;  // … of the system
    CostRate rate;
    Vector by_tangent;  // ∂l by (y, ẏ) [2d]
  };

  void Look(double t, double* KD, double* S) { jacobian_.At(t, KD, S); }
  void Look(double t, Place* place, bool behind = false) {
    jacobian_.At(t, place->jacobian.data(), place->jacobian.data() + 2 * d_ * d_, behind);
    jacobian_.Field(&place->field);
    place->system_field = jacobian_.SystemField();
    LookAtCost(t, place);
  }
  /// l at the state that was looked at.
  void LookAtCost(double t, Place* place) {
    if (cost_ == nullptr) return;
    const Vector& x = jacobian_.state();
    CostRate& rate = place->rate;
    rate.by_state = Vector::Zero(x.size());
    rate.by_input = Vector::Zero(arc_.u.size());
    cost_->Rate(jacobian_.Time(t), x, arc_.u, arc_.mode, &rate);
    Vector& by_tangent = place->by_tangent;
    by_tangent = ByTangents(system_, x, rate.by_state);
    if (!system_.space().IsFlat()) {  // δv = ẏ + ad_v y
      by_tangent.head(d_) += system_.space().Bracket(x.tail(d_)).transpose() * by_tangent.tail(d_);
    }
    by_tangent = by_tangent.cwiseQuotient(made_.unit_.head(2 * d_));
  }

  void Begin() {
    Matrix& KDS = begin_.jacobian;
    Look(0, KDS.data(), KDS.data() + 2 * d_ * d_);
    jacobian_.ChooseTime(jacobian_.LastingRate(&KDS), &KDS);
    jacobian_.Field(&begin_.field);
    begin_.system_field = jacobian_.SystemField();
    const ArcUnits& units = jacobian_.units();
    made_.unit_.resize(2 * d_ + k_);
    made_.unit_ << units.length, units.time * units.length, units.source;
    if (!system_.space().IsFlat()) {
      made_.bracket_begin_ = system_.space().Bracket(arc_.x_begin.tail(d_));
      made_.bracket_end_ = system_.space().Bracket(arc_.x_end.tail(d_));
    }
    LookAtCost(0, &begin_);
    made_.begin_ = {begin_.system_field, begin_.rate.value};
    if (k_ > 0) least_sources_ = jacobian_.LeastSources();
    for (int i = 0; i < 2 * d_; ++i) followed_(i, kTangent) = MixedEntry(i);
    followed_.col(kField).head(2 * d_) = begin_.field;
    cost_size_ = std::abs(begin_.rate.value);
    NoteSlope(begin_, followed_.col(kTangent).head(2 * d_));
  }

  /// The variables in units in which the largest entry of their sources is 1, but for rounding.
  void BeginSources() {
    Vector largest = least_sources_;
    largest =
        largest.cwiseMax(begin_.jacobian.rightCols(k_).cwiseAbs().colwise().maxCoeff().transpose());
    for (int i = 0; i < step_->rule().stages; ++i) {
      largest = largest.cwiseMax(step_->Source(i).cwiseAbs().colwise().maxCoeff().transpose());
    }
    for (int i = 0; i < k_; ++i) {
      followed_(2 * d_ + i, kSource) = largest(i) > 0 ? MixedEntry(i) / largest(i) : 0;
    }
  }

  /// Accelerations of the collocation polynomial against those of the equation, of all
  /// that is followed.
  Matrix Defect(const Place& place, const Matrix& tangents, const Vector& value) const {
    Matrix defect(d_, followed_.cols());
    const Eigen::Index c = followed_.cols();
    Eigen::Map<Vector>(defect.data(), d_ * c).noalias() =
        Eigen::Map<const Matrix>(accelerations_.data(), d_ * c, step_->rule().stages)
            .lazyProduct(value);
    defect.noalias() -= place.jacobian.lazyProduct(tangents);
    if (control_.Decays(step_->rule())) {
      DecayedDefect decayed;
      decayed.At(place.jacobian, step_->length());
      decayed.Apply(&defect);
    }
    return defect;
  }
  double Relative(const Matrix& defect) const {
    double relative = defect.col(kTangent).cwiseAbs().maxCoeff() / size_;
    if (k_ > 0) {
      relative = std::max(relative, defect.col(kSource).cwiseAbs().maxCoeff() / source_size_);
    }
    return relative;
  }

  /// l, and what it changes by along the tangent, as the nodes interpolate them: their quadrature
  /// is off by about the square of that.
  double CostError(const CollocationRule::Point& point, const Matrix& tangents) {
    const CollocationRule& rule = step_->rule();
    const int s = rule.stages;
    Matrix values(s, 2);
    for (int i = 0; i < s; ++i) {
      const Place& node = nodes_[static_cast<std::size_t>(i)];
      const Matrix there =
          step_->Tangents(followed_, accelerations_, rule.c(i), rule.a.row(i).transpose(),
                          rule.twice.row(i).transpose());
      values(i, 0) = node.rate.value;
      values(i, 1) = node.by_tangent.dot(there.col(kTangent));
      cost_size_ = std::max(cost_size_, std::abs(values(i, 0)));
      slope_size_ = std::max(slope_size_, std::abs(values(i, 1)));
    }
    const auto off = [&](const Place& place, const Vector& value, const Vector& tangent) {
      const double l = place.rate.value - value.dot(values.col(0));
      const double slope = place.by_tangent.dot(tangent) - value.dot(values.col(1));
      return std::max(cost_size_ > 0 ? std::abs(l) / cost_size_ : 0,
                      slope_size_ > 0 ? std::abs(slope) / slope_size_ : 0);
    };
    const Eigen::Index d2 = 2 * d_;
    const double ends = std::max(off(begin_, rule.begin.value, followed_.col(kTangent).head(d2)),
                                 off(end_, rule.at_end, next_.col(kTangent).head(d2)));
    const double inside = off(between_, point.value, tangents.col(kTangent).head(d2));
    const double relative = std::max(ends, inside / point.weight);
    const double error =
        rule.error * std::pow(relative / rule.defect, rule.stiff ? 2 - 1.0 / rule.stages : 2);
    return StepControl::Shapeless(ends, inside, point) ? std::max(error, inside * inside) : error;
  }
  void NoteSlope(const Place& place, const Vector& tangent) {
    if (cost_ == nullptr) return;
    slope_size_ = std::max(slope_size_, std::abs(place.by_tangent.dot(tangent)));
  }

  void AddCost() {
    const CollocationRule& rule = step_->rule();
    const double seconds = jacobian_.units().time * step_->length();
    const bool inputs = dynamics_.variables().inputs;
    if (made_.by_variables_.size() == 0) made_.by_variables_ = Vector::Zero(k_);
    for (int i = 0; i < rule.stages; ++i) {
      const CostRate& rate = nodes_[static_cast<std::size_t>(i)].rate;
      const double weight = seconds * rule.b(i);
      made_.cost_ += weight * rate.value;
      made_.drift_ += weight * rate.by_time;
      if (inputs) made_.by_variables_.head(rate.by_input.size()) += weight * rate.by_input;
    }
  }

  const MechanicalSystem& system_;
  ContactDynamics& dynamics_;
  const Arc& arc_;
  const int d_, k_;
  const RunCost* cost_;
  ArcTangents& made_;
  ArcJacobian jacobian_;
  StepControl control_;
  std::unique_ptr<CollocationStep> step_;  // that is tried
  Place begin_, end_, between_;
  std::vector<Place> nodes_;  // costs alone
  Matrix followed_, next_;    // [2d+k × 2 or 3]
  Matrix accelerations_;
  Vector least_sources_;  // [k]
  double size_ = 1, source_size_ = 1, cost_size_ = 0, slope_size_ = 0;
};

void ArcTangents::Make(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                       const RunCost* cost, VariationStatistics* statistics) {
  ArcTangentsMaker(dynamics, arc, tolerance, cost, this).Make(statistics);
}

}  // namespace contact_flow
