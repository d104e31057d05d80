// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/variation.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "arc_jacobian.h"
#include "collocation.h"
#include "contact_flow/budget.h"
#include "contact_flow/fixed_size.h"
#include "propagation_verdict.h"
#include "step_control.h"

namespace contact_flow {
namespace {

/// A tangent without symmetries in `count` entries from `first` on, else 0.
Vector Mixture(int size, int first, int count) {
  Vector mixture = Vector::Zero(size);
  for (int i = 0; i < count; ++i) mixture(first + i) = MixedEntry(i);
  return mixture;
}

/// Steps of the variational equation along one arc.
class Propagation {
 public:
  Propagation(ContactDynamics* dynamics, const Arc& arc, double tolerance)
      : d_(dynamics->system().dof()),
        k_(dynamics->num_variables()),
        arc_(arc),
        jacobian_(dynamics, arc),
        control_(&jacobian_, arc, tolerance),
        collocation_(d_, k_),
        begin_(d_, 2 * d_ + k_),
        end_(d_, 2 * d_ + k_),
        between_(d_, 2 * d_ + k_),
        step_(2 * d_ + k_, 2 * d_ + k_),
        tangent_(Mixture(2 * d_ + k_, 0, 2 * d_)),
        source_(Mixture(2 * d_ + k_, 2 * d_, k_)) {}

  Matrix Run(VariationStatistics* statistics) {
    phi_.setIdentity(step_.rows(), step_.cols());
    if (arc_.t_begin == arc_.t_end) return phi_;
    Begin();
    control_.Walk(begin_, field_begin_, this, statistics);
    jacobian_.ToVelocities(&phi_);
    if (!phi_.allFinite()) RefuseOverflow(arc_);
    return phi_;
  }

  // As StepControl asks for:

  /// A factorization for s times the independent rows, its solution for the independent columns.
  double Cost(const GaussLegendre& rule, double /*length*/, double /*fastest*/) const {
    const double n = rule.stages * collocation_.num_rows();
    return n * n * (n / 3 + 2 * collocation_.num_columns() + k_);
  }

  /// The propagator of [t, t+h] into step_, and up to its end into next_.
  double Try(double t, double h, const GaussLegendre& rule) {
    collocation_.SetRule(rule);
    for (int i = 0; i < rule.stages; ++i) {
      AskBudget();
      jacobian_.At(t + rule.c(i) * h, collocation_.Node(i).data(), collocation_.Source(i).data());
    }
    if (!collocation_.Solve(h)) return std::numeric_limits<double>::infinity();
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
    // And inside, where the nodes do not look.
    const GaussLegendre::Point& point = control_.NextGap(rule);
    jacobian_.At(t + point.at * h, between_.data(), between_.data() + 2 * d_ * d_);
    const Defects mixed = MixedDefects(h, point);
    return StepControl::Error(rule, h * std::max(Relative(moved), mixed.begin), h * mixed.inside,
                              point);
  }

  void NoteLaw(FlowLaw* law) const { law->Residual(step_, field_begin_, field_end_, size_); }
  const Matrix& End() const { return end_; }

  void Accept() {
    phi_.swap(next_);
    begin_.swap(end_);
    field_begin_.swap(field_end_);
    carried_.noalias() = step_ * tangent_;
    tangent_ = carried_;
    if (k_ == 0) return;
    carried_.noalias() = step_ * source_;
    source_ = carried_;
  }

  const Matrix& PassBreak(double t) {
    jacobian_.At(t, begin_.data(), begin_.data() + 2 * d_ * d_, true);
    jacobian_.Field(&field_begin_);
    return begin_;
  }

 private:
  void Begin() {
    jacobian_.At(0, begin_.data(), begin_.data() + 2 * d_ * d_);
    jacobian_.ChooseUnits(FastestRate(begin_.leftCols(2 * d_)), &begin_);
    jacobian_.Field(&field_begin_);
    collocation_.FindSpan(begin_.leftCols(2 * d_), begin_.rightCols(k_));
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

  const int d_;
  const int k_;
  const Arc& arc_;
  ArcJacobian jacobian_;
  StepControl control_;
  Collocation collocation_;
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
