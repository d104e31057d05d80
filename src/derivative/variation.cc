// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/variation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "arc_jacobian.h"
#include "collocation.h"
#include "contact_flow/budget.h"
#include "contact_flow/fixed_size.h"
#include "flow_law.h"
#include "gauss_legendre.h"
#include "motion_pace.h"
#include "propagation_verdict.h"

namespace contact_flow {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Beyond this many times the step that would resolve the fastest mode, collocation loses its order
/// in it, and the error estimate its truth (measured: config/robots against tolerance 1e-13).
constexpr double kStiffReach = 3;
constexpr double kSlackening = 0.6;  // most by which the rate falls from one step to the next
constexpr double kReach = 0.9;       // part of the longest acceptable step that is taken
/// DOP853 at tolerance ε takes steps of about ε^{1/8}·kBaseReach over the fastest rate it sees.
constexpr double kBaseReach = 8;
constexpr long kMaxSteps = 1000000;
constexpr double kSmallestStep = 1e-13;  // relative to the arc
/// One Jacobian, with its part of the linear system, costs about as much as this many
/// multiplications for each of its entries (measured).
constexpr double kJacobianCost = 50;
/// Where the defect inside a step is this many times what it is at its ends, it has not the shape
/// that it has where all is smooth, and collocation not its order.
constexpr double kShape = 30;
constexpr double kGolden = 0.6180339887498949;

/// A tangent without symmetries: ±(0.6 … 1.4) in `count` entries from `first` on.
Vector Mixture(int size, int first, int count) {
  Vector mixture = Vector::Zero(size);
  for (int i = 0; i < count; ++i) {
    mixture(first + i) = (i % 3 == 1 ? -1 : 1) * (0.6 + std::fmod(kGolden * (i + 1), 0.8));
  }
  return mixture;
}

/// Steps of the variational equation along one arc.
class Propagation {
 public:
  Propagation(ContactDynamics* dynamics, const Arc& arc, double tolerance)
      : d_(dynamics->system().dof()),
        k_(dynamics->num_variables()),
        arc_(arc),
        tolerance_(tolerance),
        jacobian_(dynamics, arc),
        pace_(arc.dense),
        collocation_(d_, k_),
        law_(tolerance),
        begin_(d_, 2 * d_ + k_),
        end_(d_, 2 * d_ + k_),
        between_(d_, 2 * d_ + k_),
        step_(2 * d_ + k_, 2 * d_ + k_),
        tangent_(Mixture(2 * d_ + k_, 0, 2 * d_)),
        source_(Mixture(2 * d_ + k_, 2 * d_, k_)) {}

  Matrix Run(VariationStatistics* statistics) {
    double t = 0;  // from the beginning of the arc on, in its units
    phi_.setIdentity(step_.rows(), step_.cols());
    if (arc_.t_begin == arc_.t_end) return phi_;
    Begin();
    const double end = jacobian_.duration();
    // The rate r of the tangents [1/s]: a step's error is error_s·(r h)^{2s+1}.
    double rate = GuessRate();
    while (t < end) {
      AskBudget();
      const double rest = end - t;
      const double length = ChooseStep(t, rest, rate);
      const double error = Step(t, length);
      if (std::isfinite(error)) {
        const GaussLegendre& rule = collocation_.rule();
        const double seen = std::pow(error / rule.error, 1.0 / (2 * rule.stages + 1)) / length;
        rate = std::max(seen, kSlackening * rate);
      }
      const bool small = error <= tolerance_;
      if (!small) rate *= std::isfinite(error) ? 1.1 : 10;
      if (!small || !ObeysLaw(t, length)) {
        ++statistics->rejected_steps;
        if (length < kSmallestStep * end) Fail(t);
        continue;
      }
      if (++statistics->steps > kMaxSteps) Fail(t);
      Accept(error);
      t = length == rest ? end : t + length;
      if (t < end) fastest_ = FastestRate(begin_.leftCols(2 * d_));
    }
    statistics->jacobians += jacobian_.count();
    statistics->push_reach = jacobian_.push_reach();
    Judge(statistics);
    jacobian_.ToVelocities(&phi_);
    if (!phi_.allFinite()) RefuseOverflow(arc_);
    return phi_;
  }

 private:
  void Begin() {
    jacobian_.At(0, begin_.data(), begin_.data() + 2 * d_ * d_);
    jacobian_.ChooseUnits(FastestRate(begin_.leftCols(2 * d_)), &begin_);
    jacobian_.Field(&field_begin_);
    law_.Begin(field_begin_, jacobian_.FreeSize());
    collocation_.FindSpan(begin_.leftCols(2 * d_), begin_.rightCols(k_));
    fastest_ = FastestRate(begin_.leftCols(2 * d_));  // in the units chosen
  }

  [[noreturn]] void Fail(double t) const { RefuseUnresolved(jacobian_.Time(t)); }

  /// The fastest rate at the beginning, or what the steps of the run itself tell of the change of K
  /// and D.
  double GuessRate() const {
    const double base_step = jacobian_.duration() / static_cast<double>(arc_.dense.NumSteps());
    const double base_rate = kBaseReach * std::pow(tolerance_, 1.0 / 8) / base_step;
    return std::max(fastest_, std::min(base_rate, 2 * fastest_));
  }

  /// Chooses stages and length of the next step so that what is left of the arc costs least: n
  /// equal steps of a factorization for s times the independent rows, its solution for the
  /// independent columns, and s+2 Jacobians each.
  double ChooseStep(double t, double rest, double rate) {
    double least = kInfinity, length = rest;
    for (int s = GaussLegendre::kMinStages; s <= GaussLegendre::kMaxStages; ++s) {
      const GaussLegendre& rule = GaussLegendre::WithStages(s);
      const double angle = kReach * std::pow(tolerance_ / rule.error, 1.0 / (2 * s + 1));
      double reach = std::min(longest_, jacobian_.Units(pace_.Reach(jacobian_.Time(t), s)));
      if (rate > 0) reach = std::min(reach, angle / rate);
      if (fastest_ > 0) reach = std::min(reach, kStiffReach * angle / fastest_);
      const double steps = std::ceil(std::max(1.0, rest / reach));
      const double n = s * collocation_.num_rows();
      const double cost = steps * (n * n * (n / 3 + 2 * collocation_.num_columns() + k_) +
                                   (s + 2) * kJacobianCost * 2 * d_ * d_);
      if (cost < least) {
        least = cost;
        length = rest / steps;
        collocation_.SetRule(rule);
      }
    }
    return length;
  }

  /// The propagator of [t, t+h] into step_; returns its error estimate.
  double Step(double t, double h) {
    const GaussLegendre& rule = collocation_.rule();
    const int s = rule.stages;
    for (int i = 0; i < s; ++i) {
      AskBudget();
      jacobian_.At(t + rule.c(i) * h, collocation_.Node(i).data(), collocation_.Source(i).data());
    }
    if (!collocation_.Solve(h)) return kInfinity;
    collocation_.Propagator(h, &step_);
    jacobian_.At(t + h, end_.data(), end_.data() + 2 * d_ * d_);
    jacobian_.Field(&field_end_);
    const bool moved = t > 0;  // else phi_ = I
    next_ = step_;
    if (moved) next_.noalias() = step_ * phi_;
    size_ = std::max(1.0, next_.leftCols(2 * d_).cwiseAbs().maxCoeff());
    source_size_ = k_ > 0 ? std::max(1.0, next_.rightCols(k_).cwiseAbs().maxCoeff()) : 1;
    // Defect at the end: the collocation polynomial's acceleration against the equation's. Of what
    // has decayed before, as the fast modes of a stiff damper, nothing is left to be wrong by.
    MultiplyFewRows(-1, end_, step_, &defect_);
    collocation_.AddAccelerations(1, rule.at_end, defect_);
    // And inside, where the nodes do not look: at another of the gaps between them in every step.
    golden_ += kGolden;
    golden_ -= std::floor(golden_);
    const GaussLegendre::Point& point = rule.between[static_cast<std::size_t>(golden_ * (s - 1))];
    jacobian_.At(t + point.at * h, between_.data(), between_.data() + 2 * d_ * d_);
    const Defects mixed = MixedDefects(h, point);
    const double ends = h * std::max(Relative(moved), mixed.begin);
    const double inside = h * mixed.inside;
    const double relative = std::max(ends, inside / point.weight);
    const double error = rule.error * std::pow(relative / rule.defect, (2.0 * s + 1) / (s + 1));
    return inside / point.weight > kShape * ends ? std::max(error, inside) : error;
  }

  /// Largest entry of the defect relative to those of the propagator; tangents and variables each
  /// by themselves.
  double Relative(bool moved) {
    if (moved) {
      MultiplyFewRows(1, defect_, phi_, &carried_);
      defect_.swap(carried_);
    }
    return std::max(defect_.leftCols(2 * d_).cwiseAbs().maxCoeff() / size_,
                    k_ > 0 ? defect_.rightCols(k_).cwiseAbs().maxCoeff() / source_size_ : 0);
  }

  /// The same of one tangent that has a part in all, at the beginning of the step and inside.
  struct Defects {
    double begin, inside;
  };
  Defects MixedDefects(double h, const GaussLegendre::Point& point) {
    const Defects mixed = DefectsOf(tangent_, h, point, size_);
    if (k_ == 0) return mixed;
    const Defects source = DefectsOf(source_, h, point, source_size_);
    return {std::max(mixed.begin, source.begin), std::max(mixed.inside, source.inside)};
  }

  Defects DefectsOf(const Vector& tangent, double h, const GaussLegendre::Point& point,
                    double size) {
    collocation_.Follow(tangent);
    const GaussLegendre::Point& begin = collocation_.rule().begin;
    return {DefectAt(begin, begin_, tangent, h) / size,
            DefectAt(point, between_, tangent, h) / size};
  }

  /// Of the tangent that is followed, at a point where [K D S] is `jacobian`.
  double DefectAt(const GaussLegendre::Point& point, const Matrix& jacobian, const Vector& tangent,
                  double h) {
    collocation_.Tangent(h, point, &there_);
    collocation_.Acceleration(point.value, &bend_);
    bend_.noalias() -= jacobian.leftCols(2 * d_).lazyProduct(there_);
    if (k_ > 0) bend_.noalias() -= jacobian.rightCols(k_).lazyProduct(tangent.tail(k_));
    return bend_.cwiseAbs().maxCoeff();
  }

  /// Whether the step obeys the flow law, as well as the state allows it. If not, the next one is
  /// to be shorter; steps that are short beside those of the state resolve all that it knows.
  bool ObeysLaw(double t, double h) {
    law_.Residual(step_, field_begin_, field_end_, size_);
    const double state = std::max(1.0, arc_.x_end.lpNorm<Eigen::Infinity>());
    if (law_.Holds(end_.leftCols(2 * d_), state * jacobian_.StateUnit())) return true;
    if (h <= jacobian_.Units(pace_.StateStep(jacobian_.Time(t))) / 2) {
      law_.Excuse();
      return true;
    }
    longest_ = h / 2;
    return false;
  }

  void Accept(double error) {
    error_ += error;
    law_.Accept();
    longest_ *= 2;
    phi_.swap(next_);
    begin_.swap(end_);
    field_begin_.swap(field_end_);
    carried_.noalias() = step_ * tangent_;
    tangent_ = carried_;
    if (k_ == 0) return;
    carried_.noalias() = step_ * source_;
    source_ = carried_;
  }

  /// The residual of the flow law and the error of the whole.
  void Judge(VariationStatistics* statistics) {
    statistics->flow_law_residual = std::max(statistics->flow_law_residual, law_.total());
    statistics->error_estimate = std::max(statistics->error_estimate, error_ + law_.total());
    JudgeFlowLaw(arc_, law_);
  }

  const int d_;
  const int k_;
  const Arc& arc_;
  const double tolerance_;
  double fastest_ = 0;          // rate of a mode at the beginning of the step [1/s]
  double longest_ = kInfinity;  // step that the flow law allows [s]
  double error_ = 0;            // Σ of the estimates of the steps
  double golden_ = 0;           // goes round the gaps between nodes
  ArcJacobian jacobian_;
  MotionPace pace_;
  Collocation collocation_;
  FlowLaw law_;
  Matrix begin_;    // [K D] and the variables' part at the beginning of the step
  Matrix end_;      // … and at its end
  Matrix between_;  // … and inside
  Vector field_begin_;
  Vector field_end_;
  Matrix step_;
  Matrix phi_;              // up to the present step
  Matrix next_;             // … and through it
  double size_ = 1;         // its largest entry, or 1, for the tangents
  double source_size_ = 1;  // … and for the variables
  Vector tangent_;          // phi_ times a mixture of all directions (δq, δv)
  Vector source_;           // … of all variables
  Vector there_;
  Vector bend_;
  Matrix defect_;
  Matrix carried_;  // defect_ · phi_
};

}  // namespace

Matrix PropagateArc(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                    VariationStatistics* statistics) {
  if (arc.dense.Empty() && arc.t_end > arc.t_begin) {
    throw std::logic_error("differentiation needs a trajectory made with SimulateOptions::dense");
  }
  VariationStatistics unused;
  return Propagation(dynamics, arc, tolerance).Run(statistics != nullptr ? statistics : &unused);
}

}  // namespace contact_flow
