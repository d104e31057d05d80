// SPDX-License-Identifier: BSD-3-Clause
// How the steps of an arc are chosen.
#include "arc_tangents.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/budget.h"
#include "flow_law.h"
#include "motion_pace.h"
#include "propagation_verdict.h"

namespace contact_flow {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// As in variation.cc:
constexpr double kStiffReach = 3, kSlackening = 0.6, kReach = 0.9, kBaseReach = 8, kShape = 30;
constexpr long kMaxSteps = 1000000;
constexpr double kSmallestStep = 1e-13, kJacobianCost = 50, kGolden = 0.6180339887498949;
/// Steps longer than this beside the fastest rate are factorized; others take about so many rounds.
constexpr double kFactorized = 1.5, kRounds = 15;
/// Columns that are followed: a tangent with a part in all, F, and one of the variables.
constexpr int kTangent = 0, kField = 1, kSource = 2;

/// ±(0.6 … 1.4), without symmetries.
double Mixed(int i) {
  return (i % 3 == 1 ? -1 : 1) * (0.6 + std::fmod(kGolden * (i + 1), 0.8));
}

}  // namespace

/// Makes the steps of one arc.
class ArcTangentsMaker {
 public:
  ArcTangentsMaker(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                   const RunCost* cost, ArcTangents* made)
      : system_(dynamics->system()),
        dynamics_(*dynamics),
        arc_(arc),
        d_(system_.dof()),
        k_(dynamics->num_variables()),
        tolerance_(tolerance),
        cost_(cost != nullptr && cost->running ? cost : nullptr),
        made_(*made),
        jacobian_(dynamics, arc),
        pace_(arc.dense),
        law_(tolerance),
        followed_(Matrix::Zero(2 * d_ + k_, k_ > 0 ? 3 : 2)) {
    for (Place* place : {&begin_, &end_, &between_}) place->jacobian.resize(d_, 2 * d_ + k_);
  }

  void Make(VariationStatistics* statistics) {
    Begin();
    const double end = jacobian_.duration();
    double t = 0, rate = GuessRate();
    while (t < end) {
      AskBudget();
      const double rest = end - t;
      const double length = ChooseStep(t, rest, rate);
      CollocationStep step(d_, k_, *rule_, length);
      const double error = Try(t, &step);
      if (std::isfinite(error)) {
        const int s = rule_->stages;
        const double seen = std::pow(error / rule_->error, 1.0 / (2 * s + 1)) / length;
        rate = std::max(seen, kSlackening * rate);
      }
      const bool small = error <= tolerance_;
      if (!small) rate *= std::isfinite(error) ? 1.1 : 10;
      if (!small || !ObeysLaw(t, length)) {
        ++statistics->rejected_steps;
        if (length < kSmallestStep * end) RefuseUnresolved(jacobian_.Time(t));
        continue;
      }
      if (++statistics->steps > kMaxSteps) RefuseUnresolved(jacobian_.Time(t));
      Accept(error, &step);
      t = length == rest ? end : t + length;
      if (t < end) fastest_ = FastestRate(begin_.jacobian.leftCols(2 * d_));
    }
    made_.end_ = {begin_.system_field, begin_.rate.value};
    statistics->jacobians += jacobian_.count();
    statistics->push_reach = jacobian_.push_reach();
    statistics->flow_law_residual = std::max(statistics->flow_law_residual, law_.total());
    statistics->error_estimate = std::max(statistics->error_estimate, error_ + law_.total());
    JudgeFlowLaw(arc_, law_);
    if (!followed_.allFinite()) RefuseOverflow(arc_);
  }

 private:
  /// What is known where the Jacobian was looked at.
  struct Place {
    Matrix jacobian;      // [K D S] [d × 2d+k]
    Vector field;         // in the units of the arc
    Vector system_field;  // … of the system
    CostRate rate;
    Vector by_tangent;    // ∂l by (y, ẏ) [2d]
  };

  void Look(double t, double* KD, double* S) { jacobian_.At(t, KD, S); }
  void Look(double t, Place* place) {
    Look(t, place->jacobian.data(), place->jacobian.data() + 2 * d_ * d_);
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
    cost_->running(jacobian_.Time(t), x, arc_.u, &rate);
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
    jacobian_.ChooseTime(FastestRate(KDS.leftCols(2 * d_)), &KDS);
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
    law_.Begin(begin_.field, jacobian_.FreeSize());
    fastest_ = FastestRate(KDS.leftCols(2 * d_));
    if (k_ > 0) least_sources_ = jacobian_.LeastSources();
    for (int i = 0; i < 2 * d_; ++i) followed_(i, kTangent) = Mixed(i);
    followed_.col(kField).head(2 * d_) = begin_.field;
    cost_size_ = std::abs(begin_.rate.value);
    NoteSlope(begin_, followed_.col(kTangent).head(2 * d_));
  }

  double GuessRate() const {
    const double base_step = jacobian_.duration() / static_cast<double>(arc_.dense.NumSteps());
    const double base_rate = kBaseReach * std::pow(tolerance_, 1.0 / 8) / base_step;
    return std::max(fastest_, std::min(base_rate, 2 * fastest_));
  }

  /// As in PropagateArc, by what few tangents cost.
  double ChooseStep(double t, double rest, double rate) {
    double least = kInfinity, length = rest;
    for (int s = GaussLegendre::kMinStages; s <= GaussLegendre::kMaxStages; ++s) {
      const GaussLegendre& rule = GaussLegendre::WithStages(s);
      const double angle = kReach * std::pow(tolerance_ / rule.error, 1.0 / (2 * s + 1));
      double reach = std::min(longest_, jacobian_.Units(pace_.Reach(jacobian_.Time(t), s)));
      if (rate > 0) reach = std::min(reach, angle / rate);
      if (fastest_ > 0) reach = std::min(reach, kStiffReach * angle / fastest_);
      const double steps = std::ceil(std::max(1.0, rest / reach));
      const double n = s * d_;
      const bool factorized =
          n <= CollocationStep::kDirect || rest / steps * fastest_ > kFactorized;
      const double solution = factorized ? n * n * n / 3 : kRounds * n * 4 * d_;
      const double cost = steps * (solution + (s + 2) * kJacobianCost * 2 * d_ * d_);
      if (cost < least) {
        least = cost;
        length = rest / steps;
        rule_ = &rule;
      }
    }
    return length;
  }

  /// Fills the step from t on and follows it; its error.
  double Try(double t, CollocationStep* step) {
    const GaussLegendre& rule = *rule_;
    const int s = rule.stages;
    const double h = step->length();
    nodes_.resize(static_cast<std::size_t>(s));
    Matrix gradients(cost_ != nullptr ? 2 * d_ : 0, s);
    for (int i = 0; i < s; ++i) {
      AskBudget();
      const double at = t + rule.c(i) * h;
      Look(at, step->Node(i).data(), step->Source(i).data());
      if (cost_ == nullptr) continue;
      LookAtCost(at, &nodes_[static_cast<std::size_t>(i)]);
      gradients.col(i) = jacobian_.units().time * h * rule.b(i) *
                         nodes_[static_cast<std::size_t>(i)].by_tangent;
    }
    if (cost_ != nullptr) step->SetCost(gradients);
    if (k_ > 0 && made_.steps_.empty()) BeginSources(step);
    if (!step->Solve(followed_, &accelerations_)) return kInfinity;
    next_ = followed_;
    step->Advance(&next_, accelerations_);
    Look(t + h, &end_);
    golden_ += kGolden;
    golden_ -= std::floor(golden_);
    const GaussLegendre::Point& point = rule.between[static_cast<std::size_t>(golden_ * (s - 1))];
    Look(t + point.at * h, &between_);
    size_ = std::max(1.0, next_.col(kTangent).head(2 * d_).cwiseAbs().maxCoeff());
    if (k_ > 0) {
      source_size_ = std::max(1.0, next_.col(kSource).head(2 * d_).cwiseAbs().maxCoeff());
    }
    const Matrix at_end = Defect(end_, next_, rule.at_end);
    const Matrix at_begin = Defect(begin_, followed_, rule.begin.value);
    Matrix tangents = followed_;
    tangents.topRows(2 * d_) =
        step->Tangents(followed_, accelerations_, point.at, point.once, point.twice);
    const Matrix inside = Defect(between_, tangents, point.value);
    const double ends = h * std::max(Relative(at_begin), Relative(at_end));
    const double middle = h * Relative(inside);
    const double relative = std::max(ends, middle / point.weight);
    double error = rule.error * std::pow(relative / rule.defect, (2.0 * s + 1) / (s + 1));
    if (middle / point.weight > kShape * ends) error = std::max(error, middle);
    if (cost_ != nullptr) error = std::max(error, CostError(*step, point, tangents));
    return error;
  }

  /// The variables in units in which the largest entry of their sources is 1, but for rounding.
  void BeginSources(CollocationStep* step) {
    Vector largest = least_sources_;
    largest = largest.cwiseMax(
        begin_.jacobian.rightCols(k_).cwiseAbs().colwise().maxCoeff().transpose());
    for (int i = 0; i < rule_->stages; ++i) {
      largest = largest.cwiseMax(step->Source(i).cwiseAbs().colwise().maxCoeff().transpose());
    }
    for (int i = 0; i < k_; ++i) {
      followed_(2 * d_ + i, kSource) = largest(i) > 0 ? Mixed(i) / largest(i) : 0;
    }
  }

  /// Accelerations of the collocation polynomial against those of the equation, of all
  /// that is followed.
  Matrix Defect(const Place& place, const Matrix& tangents, const Vector& value) const {
    Matrix defect(d_, followed_.cols());
    const Eigen::Index c = followed_.cols();
    Eigen::Map<Vector>(defect.data(), d_ * c).noalias() =
        Eigen::Map<const Matrix>(accelerations_.data(), d_ * c, rule_->stages).lazyProduct(value);
    defect.noalias() -= place.jacobian.lazyProduct(tangents);
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
  double CostError(const CollocationStep& step, const GaussLegendre::Point& point,
                   const Matrix& tangents) {
    const int s = rule_->stages;
    Matrix values(s, 2);
    for (int i = 0; i < s; ++i) {
      const Place& node = nodes_[static_cast<std::size_t>(i)];
      const Matrix there = step.Tangents(followed_, accelerations_, rule_->c(i),
                                         rule_->a.row(i).transpose(),
                                         rule_->twice.row(i).transpose());
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
    const double ends =
        std::max(off(begin_, rule_->begin.value, followed_.col(kTangent).head(d2)),
                 off(end_, rule_->at_end, next_.col(kTangent).head(d2)));
    const double inside = off(between_, point.value, tangents.col(kTangent).head(d2));
    const double relative = std::max(ends, inside / point.weight);
    const double error = rule_->error * std::pow(relative / rule_->defect, 2);
    return inside / point.weight > kShape * ends ? std::max(error, inside * inside) : error;
  }
  void NoteSlope(const Place& place, const Vector& tangent) {
    if (cost_ == nullptr) return;
    slope_size_ = std::max(slope_size_, std::abs(place.by_tangent.dot(tangent)));
  }

  bool ObeysLaw(double t, double h) {
    law_.Residual(Vector(next_.col(kField).head(2 * d_)), end_.field, size_);
    const double state = std::max(1.0, arc_.x_end.lpNorm<Eigen::Infinity>());
    if (law_.Holds(end_.jacobian.leftCols(2 * d_), state * jacobian_.StateUnit())) return true;
    if (h <= jacobian_.Units(pace_.StateStep(jacobian_.Time(t))) / 2) {
      law_.Excuse();
      return true;
    }
    longest_ = h / 2;
    return false;
  }

  void Accept(double error, CollocationStep* step) {
    error_ += error;
    law_.Accept();
    longest_ *= 2;
    followed_.swap(next_);
    std::swap(begin_, end_);
    followed_.col(kField).head(2 * d_) = begin_.field;
    if (cost_ != nullptr) AddCost(step->length());
    made_.steps_.push_back(std::move(*step));
  }

  void AddCost(double h) {
    const double seconds = jacobian_.units().time * h;
    const bool inputs = dynamics_.variables().inputs;
    if (made_.by_variables_.size() == 0) made_.by_variables_ = Vector::Zero(k_);
    for (int i = 0; i < rule_->stages; ++i) {
      const CostRate& rate = nodes_[static_cast<std::size_t>(i)].rate;
      const double weight = seconds * rule_->b(i);
      made_.cost_ += weight * rate.value;
      made_.drift_ += weight * rate.by_time;
      if (inputs) made_.by_variables_.head(rate.by_input.size()) += weight * rate.by_input;
    }
  }

  const MechanicalSystem& system_;
  ContactDynamics& dynamics_;
  const Arc& arc_;
  const int d_, k_;
  const double tolerance_;
  const RunCost* cost_;
  ArcTangents& made_;
  ArcJacobian jacobian_;
  MotionPace pace_;
  FlowLaw law_;
  const GaussLegendre* rule_ = nullptr;
  Place begin_, end_, between_;
  std::vector<Place> nodes_;  // costs alone
  Matrix followed_, next_;    // [2d+k × 2 or 3]
  Matrix accelerations_;
  Vector least_sources_;  // [k]
  double fastest_ = 0, longest_ = kInfinity, error_ = 0, golden_ = 0;
  double size_ = 1, source_size_ = 1, cost_size_ = 0, slope_size_ = 0;
};

void ArcTangents::Make(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                       const RunCost* cost, VariationStatistics* statistics) {
  ArcTangentsMaker(dynamics, arc, tolerance, cost, this).Make(statistics);
}

}  // namespace contact_flow
