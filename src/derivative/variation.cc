// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/variation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "gauss_legendre.h"

namespace contact_flow {
namespace {

constexpr int S = GaussLegendre::kStages;
constexpr int kOrder = 2 * S;
/// For ẏ = λy with z = hλ the collocation polynomial leaves at the end of a step the defect
/// h·δ = z^{S+1} S!/(2S)!, and the step the error z^{2S+1} (S!)²/((2S)!(2S+1)!).
constexpr double kDefect = 720.0 / 479001600.0;
constexpr double kError = 720.0 * 720.0 / (479001600.0 * 6227020800.0);
constexpr double kSafety = 4;        // factor on the error estimate
constexpr double kLargestReach = 3;  // first step times the fastest rate of the tangents
constexpr long kMaxSteps = 1000000;

/// Error of a step whose largest defect, times h and relative to the tangents, is `defect`.
double ErrorOf(double defect) {
  return kSafety * kError * std::pow(defect / kDefect, (2.0 * S + 1) / (S + 1));
}

/// Steps of the variational equation along one arc.
class Propagation {
 public:
  Propagation(const MechanicalSystem& system, const VectorRef& u, const Arc& arc, double tolerance)
      : d_(system.dof()),
        arc_(arc),
        tolerance_(tolerance),
        rule_(GaussLegendre::Get()),
        dynamics_(system, u),
        x_(2 * d_),
        begin_(d_, 2 * d_),
        end_(d_, 2 * d_),
        system_matrix_(S * d_, S * d_),
        factor_(S * d_),
        accelerations_(S * d_, 2 * d_),
        step_(2 * d_, 2 * d_) {}

  Matrix Run(VariationStatistics* statistics) {
    Matrix phi = Matrix::Identity(2 * d_, 2 * d_), next(2 * d_, 2 * d_);
    double t = arc_.t_begin;
    if (t == arc_.t_end) return phi;
    Jacobian(t, &begin_);
    const double rate = std::sqrt(begin_.leftCols(d_).cwiseAbs().rowwise().sum().maxCoeff()) +
                        begin_.rightCols(d_).cwiseAbs().rowwise().sum().maxCoeff();
    double h = rate > 0 ? kLargestReach / rate : arc_.t_end - t;
    while (t < arc_.t_end) {
      const double rest = arc_.t_end - t;
      const double length = rest / std::ceil(std::max(1.0, rest / h - 1e-9));
      const double error = Step(t, length);
      const double factor =
          std::clamp(std::pow(tolerance_ / std::max(error, 1e-40), 1.0 / (kOrder + 1)), 0.3, 3.0);
      h = length * 0.95 * factor;
      if (!(error <= tolerance_)) {
        ++statistics->rejected_steps;
        if (!std::isfinite(error)) h = 0.1 * length;
        if (length < 1e-13 * std::max(1.0, arc_.t_end)) Fail(t);
        continue;
      }
      if (++statistics->steps > kMaxSteps) Fail(t);
      next.noalias() = step_ * phi;
      phi.swap(next);
      begin_.swap(end_);
      t = length == rest ? arc_.t_end : t + length;
    }
    statistics->jacobians += jacobians_;
    return phi;
  }

 private:
  [[noreturn]] static void Fail(double t) {
    std::ostringstream message;
    message << "the variational equation cannot be resolved at t = " << t << " s";
    throw std::domain_error(message.str());
  }

  /// [∂q̈/∂q, ∂q̈/∂v] [d×2d] at time t of the arc.
  void Jacobian(double t, Matrix* jacobian) {
    arc_.dense.Evaluate(t, x_.data());
    dynamics_.Differentiate(x_, arc_.mode);
    *jacobian = dynamics_.acceleration_jacobian();
    ++jacobians_;
  }

  /// The propagator of [t, t+h] into step_; returns its error estimate.
  double Step(double t, double h) {
    // Unknown accelerations Y_i of the tangents at the nodes:
    //   Y_i = K_i (Q₀ + c_i h V₀ + h² Σ_j (a²)_ij Y_j) + D_i (V₀ + h Σ_j a_ij Y_j).
    for (int i = 0; i < S; ++i) {
      Jacobian(t + rule_.c(i) * h, &node_);
      for (int j = 0; j < S; ++j) {
        auto block = system_matrix_.block(i * d_, j * d_, d_, d_);
        block.noalias() = (-h * h * rule_.twice(i, j)) * node_.leftCols(d_) -
                          (h * rule_.a(i, j)) * node_.rightCols(d_);
        if (i == j) block.diagonal().array() += 1;
      }
      auto known = accelerations_.middleRows(i * d_, d_);
      known = node_;
      known.rightCols(d_) += (rule_.c(i) * h) * node_.leftCols(d_);
    }
    factor_.compute(system_matrix_);
    accelerations_ = factor_.solve(accelerations_);
    step_.setIdentity();
    step_.topRightCorner(d_, d_).diagonal().array() += h;
    for (int j = 0; j < S; ++j) {
      const auto Y = accelerations_.middleRows(j * d_, d_);
      step_.topRows(d_) += (h * h * rule_.twice_end(j)) * Y;
      step_.bottomRows(d_) += (h * rule_.b(j)) * Y;
    }
    Jacobian(t + h, &end_);
    return ErrorOf(std::max(DefectAtBegin(h), DefectAtEnd(h)));
  }

  /// h · |ℓ-extrapolated acceleration − F_J's| relative to the propagator, at either end of the step.
  double DefectAtBegin(double h) {
    defect_ = -begin_;  // Q₀ = [I 0], V₀ = [0 I]
    for (int j = 0; j < S; ++j) {
      defect_ += rule_.at_begin(j) * accelerations_.middleRows(j * d_, d_);
    }
    return Relative(h);
  }
  double DefectAtEnd(double h) {
    defect_.noalias() = -end_ * step_;
    for (int j = 0; j < S; ++j) {
      defect_ += rule_.at_end(j) * accelerations_.middleRows(j * d_, d_);
    }
    return Relative(h);
  }
  double Relative(double h) const {
    return h * defect_.cwiseAbs().maxCoeff() / std::max(1.0, step_.cwiseAbs().maxCoeff());
  }

  const int d_;
  const Arc& arc_;
  const double tolerance_;
  const GaussLegendre& rule_;
  ContactDynamics dynamics_;
  Vector x_;
  Matrix node_;
  Matrix begin_;  // [K D] at the beginning of the step
  Matrix end_;    // … and at its end
  Matrix system_matrix_;
  Eigen::PartialPivLU<Matrix> factor_;
  Matrix accelerations_;  // Y_1 … Y_S, stacked [Sd×2d]
  Matrix step_;
  Matrix defect_;
  long jacobians_ = 0;
};

}  // namespace

Matrix PropagateArc(const MechanicalSystem& system, const VectorRef& u, const Arc& arc,
                    double tolerance, VariationStatistics* statistics) {
  if (arc.dense.Empty() && arc.t_end > arc.t_begin) {
    throw std::logic_error("differentiation needs a trajectory made with SimulateOptions::dense");
  }
  VariationStatistics unused;
  return Propagation(system, u, arc, tolerance)
      .Run(statistics != nullptr ? statistics : &unused);
}

}  // namespace contact_flow
