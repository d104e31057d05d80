// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "arc_units.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/corner_functions.h"
#include "contact_flow/flow/trajectory.h"
#include "fastest_rate.h"
#include "propagation_verdict.h"
#include "src/dynamics/slips_in_space.h"

namespace contact_flow {

/// The coefficients of the variational equation along an arc, in the coordinates (y, ẏ), y = δq, in
/// which it is of second order on every configuration space: ÿ = K y + D ẏ + S (δu, δp). All in the
/// units of the arc, times from its beginning on.
class ArcJacobian {
 public:
  ArcJacobian(ContactDynamics* dynamics, const Arc& arc)
      : dynamics_(*dynamics),
        space_(dynamics->system().space()),
        arc_(arc),
        d_(space_.dof()),
        k_(dynamics->num_variables()),
        x_(dynamics->system().state_size()),
        slips_in_space_(
            !(SlipsInSpace(dynamics->system(), arc.mode) - dynamics->system().compliant()).Empty()),
        units_(*dynamics, arc),
        push_reach_(Vector::Zero(dynamics->system().num_constraints())) {
    FindScale();
    FindBreaks();
  }

  /// The rate [1/s] of the tangents where the arc begins, [K D] being `begin`, by which their unit
  /// of time is chosen; or that in its middle if it is less, where the arc is long beside it: that
  /// of a slip that begins in space is gone at once.
  double LastingRate(Matrix* begin);
  /// Chooses the unit of time for tangents of this rate [1/s]: the length of the arc, unless it is
  /// far from the time in which they change; then those of the variables, by a few looks. `begin`
  /// is what At(0) gave before, and is what it gives now.
  void ChooseUnits(double rate, Matrix* begin) {
    if (k_ == 0) return ChooseTime(rate, begin);
    ChooseTime(rate);
    const Vector least = LeastSources();
    Vector largest = Vector::Zero(k_);
    for (const double part : {1.0, 0.5, 0.0}) {
      At(part * duration(), begin->data(), begin->data() + 2 * d_ * d_);
      largest = largest.cwiseMax(begin->rightCols(k_).cwiseAbs().colwise().maxCoeff().transpose());
    }
    for (int i = 0; i < k_; ++i) {
      const double unit = std::max(largest(i), least(i));  // looks may miss what is rounding
      units_.source(i) = unit > 0 ? unit : 1;
    }
    FindScale();
    begin->rightCols(k_) *= units_.source.cwiseInverse().asDiagonal();
  }
  /// The unit of time alone.
  void ChooseTime(double rate, Matrix* begin) {
    ChooseTime(rate);
    begin->leftCols(d_) *= units_.time * units_.time;
    begin->middleCols(d_, d_) *= units_.time;
    begin->rightCols(k_) *= units_.time * units_.time;
  }
  /// What is rounding of the variables' sources [k]: small beside those without contacts, beside
  /// what the contacts push, which cancels where they hold a body, and beside what a parameter of
  /// its value could do to the accelerations of the arc, which may be zero at one place. Looked at
  /// are its ends and its middle, and that of each piece between its breaks: an input may move
  /// nothing before one, where its effort is on a limit, and what is held behind it.
  Vector LeastSources() {
    constexpr double kSmall = 1e-6;
    Vector least = Vector::Zero(k_);
    double size = 0;
    const Vector scale = units_.time * units_.time * units_.length;
    const auto look = [&](double time) {
      arc_.dense.Evaluate(BesideBreak(time, false), x_.data());
      dynamics_.Differentiate(x_, arc_.mode);
      const Matrix pushes = PushChanges();
      dynamics_.Differentiate(x_, ContactMode());
      const Matrix& jacobian = dynamics_.acceleration_jacobian();
      size = std::max(size, scale.cwiseProduct(dynamics_.acceleration()).lpNorm<Eigen::Infinity>());
      for (int i = 0; i < k_; ++i) {
        const double free = scale.cwiseProduct(jacobian.col(2 * d_ + i)).lpNorm<Eigen::Infinity>();
        least(i) = std::max(least(i), kSmall * free);
        if (pushes.size() == 0) continue;
        const double cancelled = pushes.col(2 * d_ + i).maxCoeff();
        least(i) = std::max(least(i), kSmall * units_.time * units_.time * cancelled);
      }
    };
    look(arc_.t_begin);
    look(arc_.t_end);
    look(0.5 * (arc_.t_begin + arc_.t_end));
    for (std::size_t j = 0; j <= breaks_.size() && !breaks_.empty(); ++j) {
      const double begin = j == 0 ? arc_.t_begin : breaks_[j - 1];
      const double end = j == breaks_.size() ? arc_.t_end : breaks_[j];
      look(0.5 * (begin + end));
    }
    const auto& parameters = dynamics_.variables().parameters;
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const double value = dynamics_.system().description().parameters[parameters[j]].value;
      double& own = least(k_ - static_cast<int>(parameters.size() - j));
      if (value != 0) own = std::max(own, kSmall * size / std::abs(value));
    }
    return least;
  }
  /// The length of the arc, and a time [s], in these units, and back.
  double duration() const { return (arc_.t_end - arc_.t_begin) / units_.time; }
  double Units(double seconds) const { return seconds / units_.time; }
  double Time(double t) const { return std::min(arc_.t_begin + units_.time * t, arc_.t_end); }
  /// Where the coefficients jump next behind t, at a corner or knot; else duration().
  double NextBreak(double t) const {
    const double now = Time(t) + beside_;
    for (const double at : breaks_) {
      if (at > now) return Units(at - arc_.t_begin);
    }
    return duration();
  }
  /// What a state of size 1, in those of the system, is at most.
  double StateUnit() const { return units_.length.maxCoeff() * std::max(1.0, units_.time); }

  /// [K D] [d×2d] and S [d×k] at time t, column-major into `out` and `source`; where they jump
  /// those before it, or behind. Refuses where one is no number.
  void At(double t, double* out, double* source, bool behind = false) {
    arc_.dense.Evaluate(BesideBreak(Time(t), behind), x_.data());
    dynamics_.Differentiate(x_, arc_.mode);
    const Matrix& jacobian = dynamics_.acceleration_jacobian();
    if (!std::isfinite(jacobian.sum())) RefuseNoNumber(dynamics_, Time(t));
    Eigen::Map<Matrix> KD(out, d_, 2 * d_);
    KD = jacobian.leftCols(2 * d_);
    if (k_ > 0) Eigen::Map<Matrix>(source, d_, k_) = jacobian.rightCols(k_);
    if (!space_.IsFlat()) {  // δv = ẏ + ad_v y
      const Matrix bracket = space_.Bracket(x_.tail(d_));
      KD.leftCols(d_) += KD.rightCols(d_) * bracket - space_.Bracket(dynamics_.acceleration());
      KD.rightCols(d_) -= bracket;
    }
    KD = KD.cwiseProduct(scale_.leftCols(2 * d_));
    if (k_ > 0) {
      Eigen::Map<Matrix> S(source, d_, k_);
      S = S.cwiseProduct(scale_.rightCols(k_));
    }
    NotePushes();
    ++count_;
  }

  /// F there as a tangent: (v, v̇) [2d], alike in (δq, δv) and in (y, ẏ), since ad_v v = 0.
  void Field(Vector* field) const {
    const double tau = units_.time;
    field->resize(2 * d_);
    *field << tau * units_.length.cwiseProduct(x_.tail(d_)),
        tau * tau * units_.length.cwiseProduct(dynamics_.acceleration());
  }

  /// What F is the sum of where the arc begins: (v, v̇) without contacts. Where they hold all that
  /// moves, F is its rounding.
  double FreeSize() {
    if (arc_.mode.Empty()) return 0;
    const double tau = units_.time;
    const Vector free = dynamics_.Field(arc_.x_begin, ContactMode()).segment(d_, d_);
    return tau * tau * units_.length.cwiseProduct(free).lpNorm<1>();
  }

  /// A propagator of (y, ẏ) in these units becomes one of (δq, δv) in those of the system, from
  /// where the velocity is `begin` to where it is `end`: that of the whole arc, or of a part.
  void ToVelocities(Matrix* phi) const {
    const int d = d_;
    ToVelocities(phi, arc_.x_begin.tail(d), arc_.x_end.tail(d));
  }
  void ToVelocities(Matrix* phi, const VectorRef& begin, const VectorRef& end) const {
    Vector unit(2 * d_ + k_);
    unit << units_.length, units_.time * units_.length, units_.source;
    *phi = (unit.cwiseInverse().asDiagonal() * *phi * unit.asDiagonal()).eval();
    if (space_.IsFlat()) return;
    phi->middleRows(d_, d_) += space_.Bracket(end) * phi->topRows(d_);
    phi->leftCols(d_) -= phi->middleCols(d_, d_) * space_.Bracket(begin);
  }

  /// The state and F there as a tangent in the units of the system.
  const Vector& state() const { return x_; }
  Vector SystemField() const {
    Vector field(2 * d_);
    field << x_.tail(d_), dynamics_.acceleration();
    return field;
  }
  const ArcUnits& units() const { return units_; }
  bool slips_in_space() const { return slips_in_space_; }
  long count() const { return count_; }
  const Vector& push_reach() const { return push_reach_; }  ///< see VariationStatistics [n]

 private:
  void FindBreaks() {
    constexpr double kBeside = 1e-12, kRounding = 8 * std::numeric_limits<double>::epsilon();
    // Shorter pieces than this many times kBeside are part of the one before.
    constexpr double kApart = 100;
    const double length = arc_.t_end - arc_.t_begin;
    beside_ = std::max(kBeside * length, kRounding * std::abs(arc_.t_end));
    const CornerFunctions functions(dynamics_.system());
    may_jump_ = !functions.Empty() || std::isfinite(functions.TimeToKnot(arc_.x_begin));
    double last = arc_.t_begin;
    for (const double t : CornerInstants(dynamics_.system(), arc_)) {
      const double room = std::min(t - last, arc_.t_end - t);
      if (room > kApart * beside_) breaks_.push_back(last = t);
    }
  }
  double BesideBreak(double time, bool behind) const {
    if (!may_jump_) return time;
    for (const double at : breaks_) {
      if (std::abs(time - at) <= beside_) return behind ? at + beside_ : at - beside_;
    }
    // A corner may be where an event begins or ends the arc.
    const double last = std::max(arc_.t_begin, arc_.t_end - beside_);
    return std::clamp(time, std::min(arc_.t_begin + beside_, last), last);
  }
  void ChooseTime(double rate) {
    constexpr double kLongest = 10;  // of 1/rate
    const double length = arc_.t_end - arc_.t_begin;
    if (rate * length < 1 && rate <= RoundingRate()) rate = 0;
    units_.time = rate > 0 ? std::clamp(length, 1 / rate, kLongest / rate) : length;
    FindScale();
  }
  /// The rate [1/s] that rounding of [K D] makes where Differentiate was last: accelerations that
  /// an angle does not change are sums that it does; the changes of what constraints push,
  /// Σ_i |A_iᵀ| |Dλ_i|, cancel where they hold a body or let it slide.
  double RoundingRate() const {
    constexpr double kRounding = 64 * std::numeric_limits<double>::epsilon();
    const double turned =
        units_.length.cwiseProduct(dynamics_.acceleration()).lpNorm<Eigen::Infinity>() /
        units_.length.minCoeff();
    const Matrix sum = PushChanges();
    if (sum.size() == 0) return std::sqrt(kRounding * turned);
    const Vector unit = units_.length.cwiseInverse();
    const double position = (sum.leftCols(d_) * unit.asDiagonal()).maxCoeff();
    const double velocity = (sum.middleCols(d_, d_) * unit.asDiagonal()).maxCoeff();
    return std::max(std::sqrt(kRounding * std::max(turned, position)), kRounding * velocity);
  }
  /// (√M)⁻¹ Σ_i |A_iᵀ| |Dλ_i| where Differentiate was last, by (δq, δv) and the variables
  /// [d × 2d+k]; empty without contacts.
  Matrix PushChanges() const {
    if (arc_.mode.Empty() || dynamics_.force_jacobian().rows() == 0) return Matrix();
    ConstraintTerms terms;
    const MechanicalSystem& system = dynamics_.system();
    system.Constraints(x_.head(system.num_positions()), x_.tail(d_), &terms);
    return units_.length.cwiseInverse().asDiagonal() * terms.jacobian.cwiseAbs().transpose() *
           dynamics_.force_jacobian().cwiseAbs();
  }
  /// What the entries of [K D S] are multiplied by for the units: √M τ² (√M)⁻¹, … τ … and … τ² S⁻¹.
  void FindScale() {
    const double tau = units_.time;
    scale_.resize(d_, 2 * d_ + k_);
    for (int c = 0; c < d_; ++c) {
      const double inverse = 1 / units_.length(c);
      scale_.col(c) = units_.length * (tau * tau * inverse);
      scale_.col(d_ + c) = units_.length * (tau * inverse);
    }
    for (int c = 0; c < k_; ++c) {
      scale_.col(2 * d_ + c) = units_.length * (tau * tau * (1 / units_.source(c)));
    }
  }
  void NotePushes() {
    for (int i : arc_.mode - dynamics_.system().compliant()) {
      const double force = dynamics_.force()(i);
      const double change = dynamics_.force_jacobian().row(i).head(2 * d_).lpNorm<1>();
      if (force > push_reach_(i) * change) push_reach_(i) = force / change;
    }
    NoteSharedPushes();
  }
  /// What shares no force of its own may still be held by the others that it shares with.
  void NoteSharedPushes() {
    constexpr double kNoShare = 1e-6;  // of the largest force
    const Vector& force = dynamics_.force();
    for (int i : dynamics_.shared()) {
      if (force(i) > kNoShare * force.cwiseAbs().maxCoeff()) continue;
      const double margin = dynamics_.shared_margin();
      const auto moved = dynamics_.shared_gradient().transpose() * dynamics_.force_jacobian();
      const double change = moved.head(2 * d_).template lpNorm<1>();
      if (margin > push_reach_(i) * change) push_reach_(i) = margin / change;
    }
  }

  ContactDynamics& dynamics_;
  const ConfigurationSpace& space_;
  const Arc& arc_;
  const int d_;
  const int k_;
  Vector x_;
  const bool slips_in_space_;
  ArcUnits units_;
  Matrix scale_;  // [d × 2d+k]
  Vector push_reach_;
  std::vector<double> breaks_;  // [s]
  bool may_jump_ = false;       // the system has CornerFunctions, or knots of time
  double beside_ = 0;           // this far from them the state is on one side [s]
  long count_ = 0;
};

inline double ArcJacobian::LastingRate(Matrix* begin) {
  constexpr double kLong = 1e4;
  const double rate = FastestRate(begin->leftCols(2 * d_));
  if (rate * duration() < kLong) return rate;
  At(duration() / 2, begin->data(), begin->data() + 2 * d_ * d_);
  const double later = FastestRate(begin->leftCols(2 * d_));
  At(0, begin->data(), begin->data() + 2 * d_ * d_);
  return later > 0 ? std::min(rate, later) : rate;
}

}  // namespace contact_flow
