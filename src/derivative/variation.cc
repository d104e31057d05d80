// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/variation.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "arc_jacobian.h"
#include "collocation.h"
#include "contact_flow/budget.h"
#include "contact_flow/fixed_size.h"
#include "decayed_defect.h"
#include "propagation_errors.h"
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

/// What a slip in space leaves of the flow law is that of the state, but for so many tolerances.
constexpr double kLawOfTangents = 10;

/// What a step may lose of a tangent to rows that count as rounding, of its tolerance.
constexpr double kLost = 1e-2;

/// Steps of the variational equation along one arc.
class Propagation {
 public:
  Propagation(ContactDynamics* dynamics, const Arc& arc, double tolerance)
      : d_(dynamics->system().dof()),
        k_(dynamics->num_variables()),
        arc_(arc),
        tolerance_(tolerance),
        jacobian_(dynamics, arc),
        control_(&jacobian_, arc, tolerance),
        collocation_(d_, k_),
        begin_(d_, 2 * d_ + k_),
        end_(d_, 2 * d_ + k_),
        between_(d_, 2 * d_ + k_),
        step_(2 * d_ + k_, 2 * d_ + k_),
        tangent_(Mixture(2 * d_ + k_, 0, 2 * d_)),
        source_(Mixture(2 * d_ + k_, 2 * d_, k_)),
        law_left_(Vector::Zero(2 * d_)) {}

  Matrix Run(VariationStatistics* statistics, PropagationErrors* errors) {
    phi_.setIdentity(step_.rows(), step_.cols());
    if (arc_.t_begin == arc_.t_end) return phi_;
    collocation_.LoseAtMost(kLost * tolerance_);
    Begin();
    control_.Walk(begin_, field_begin_, this, statistics);
    TakeErrors(errors);
    jacobian_.ToVelocities(&phi_);
    if (!phi_.allFinite()) RefuseOverflow(arc_);
    return phi_;
  }

  // As StepControl asks for:

  /// A factorization for s times the independent rows, its solution for the independent columns.
  double Cost(const CollocationRule& rule, double /*length*/, double /*fastest*/) const {
    const double n = rule.stages * collocation_.num_rows();
    return n * n * (n / 3 + 2 * collocation_.num_columns() + k_);
  }

  /// The propagator of [t, t+h] into step_, and up to its end into next_.
  double Try(double t, double h, const CollocationRule& rule) {
    collocation_.SetRule(rule);
    t_ = t;
    h_ = h;
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
    // Defect at the end, or at the beginning where the end is a node: the collocation polynomial's
    // acceleration against the equation's. Of what has decayed before, as the fast modes of a stiff
    // damper, nothing is left to be wrong by.
    if (rule.stiff) {
      defect_ = -begin_;
      collocation_.AddAccelerations(1, rule.begin.value, defect_);
    } else {
      MultiplyFewRows(-1, end_, step_, &defect_);
      collocation_.AddAccelerations(1, rule.at_end, defect_);
    }
    decays_ = control_.Decays(rule);
    if (decays_) {
      decayed_.At(begin_, h);
      decayed_.Apply(&defect_);
    }
    // And inside, where the nodes do not look.
    const CollocationRule::Point& point = control_.NextGap(rule);
    jacobian_.At(t + point.at * h, between_.data(), between_.data() + 2 * d_ * d_);
    const Defects mixed = MixedDefects(h, point);
    return control_.Error(rule, h * std::max(Relative(moved), mixed.begin), h * mixed.inside,
                          point);
  }

  void NoteLaw(FlowLaw* law) {
    law->Residual(step_, field_begin_, field_end_, size_);
    flow_law_ = law;
  }
  const Matrix& End() const { return end_; }

  void Accept() {
    phi_.swap(next_);
    if (jacobian_.slips_in_space()) NoteErrors();
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
    jacobian_.ChooseUnits(jacobian_.LastingRate(&begin_), &begin_);
    jacobian_.Field(&field_begin_);
    field_first_ = field_begin_;
    collocation_.FindSpan(begin_.leftCols(2 * d_), begin_.rightCols(k_));
  }

  /// Of a step that is accepted.
  void NoteErrors() {
    parts_.Add(jacobian_.Time(t_), jacobian_.Time(t_ + h_), step_, phi_);
    const double sign = MixedEntry(steps_++) > 0 ? 1 : -1;
    law_left_ =
        (step_.topLeftCorner(2 * d_, 2 * d_).lazyProduct(law_left_) + sign * flow_law_->Defect())
            .eval();
  }

  /// In the coordinates and units of the system. What is left of the law is for the tangents of the
  /// size of F, where those of coordinates and of rates are of one kind by the length of the arc.
  void TakeErrors(PropagationErrors* errors) {
    if (errors == nullptr) return;
    errors->relative = control_.error() + flow_law_->total();
    if (!jacobian_.slips_in_space()) return;
    const double law = kLawOfTangents * control_.tolerance();
    errors->relative = control_.error() + std::min(flow_law_->total(), law);
    Vector entries = Mixture(step_.cols(), 0, 2 * d_).cwiseSign();
    entries.segment(d_, d_) *= jacobian_.duration();
    const double size = entries.head(2 * d_).cwiseProduct(field_first_).lpNorm<1>();
    errors->law = Matrix::Zero(step_.rows(), step_.cols());
    errors->law.topRows(2 * d_) =
        law_left_ / std::max(size, flow_law_->size()) * entries.transpose();
    jacobian_.ToVelocities(&errors->law);
    errors->parts = parts_.Take(arc_.t_begin, arc_.t_end, phi_);
    const auto velocity = [&](double t) {
      Vector x = arc_.x_begin;
      arc_.dense.Evaluate(t, x.data());
      return Vector(x.tail(d_));
    };
    for (ArcPart& part : errors->parts) {
      jacobian_.ToVelocities(&part.phi, velocity(part.t_begin), velocity(part.t_end));
    }
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
  Defects MixedDefects(double h, const CollocationRule::Point& point) {
    const Defects mixed = DefectsOf(tangent_, h, point, size_);
    if (k_ == 0) return mixed;
    const Defects source = DefectsOf(source_, h, point, source_size_);
    return {std::max(mixed.begin, source.begin), std::max(mixed.inside, source.inside)};
  }

  Defects DefectsOf(const Vector& tangent, double h, const CollocationRule::Point& point,
                    double size) {
    collocation_.Follow(tangent);
    const CollocationRule::Point& begin = collocation_.rule().begin;
    return {DefectAt(begin, begin_, tangent, h) / size,
            DefectAt(point, between_, tangent, h) / size};
  }

  /// Of the tangent that is followed, at a point where [K D S] is `jacobian`.
  double DefectAt(const CollocationRule::Point& point, const Matrix& jacobian,
                  const Vector& tangent, double h) {
    collocation_.Tangent(h, point, &there_);
    collocation_.Acceleration(point.value, &bend_);
    bend_.noalias() -= jacobian.leftCols(2 * d_).lazyProduct(there_);
    if (k_ > 0) bend_.noalias() -= jacobian.rightCols(k_).lazyProduct(tangent.tail(k_));
    if (decays_) {
      decayed_.At(jacobian, h);
      decayed_.Apply(&bend_);
    }
    return bend_.cwiseAbs().maxCoeff();
  }

  const int d_;
  const int k_;
  const Arc& arc_;
  const double tolerance_;
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
  Vector field_first_;      // F at the beginning of the arc
  Vector law_left_;         // what steps left of the law, carried on [2d]
  const FlowLaw* flow_law_ = nullptr;
  ArcParts parts_;
  double t_ = 0, h_ = 0;  // the step that was tried
  bool decays_ = false;   // defects count by what the step leaves of them
  DecayedDefect decayed_;
  int steps_ = 0;  // accepted
  Vector there_;
  Vector bend_;
  Matrix defect_;
  Matrix carried_;  // defect_ · phi_
};

}  // namespace

Matrix PropagateArc(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                    VariationStatistics* statistics) {
  return PropagateArc(dynamics, arc, tolerance, statistics, nullptr);
}

Matrix PropagateArc(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                    VariationStatistics* statistics, PropagationErrors* errors) {
  if (arc.dense.Empty() && arc.t_end > arc.t_begin) {
    throw std::logic_error("differentiation needs a trajectory made with SimulateOptions::dense");
  }
  VariationStatistics unused;
  return Propagation(dynamics, arc, tolerance)
      .Run(statistics != nullptr ? statistics : &unused, errors);
}

}  // namespace contact_flow
