// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/variation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "arc_jacobian.h"
#include "block_solve.h"
#include "contact_flow/fixed_size.h"
#include "gauss_legendre.h"
#include "row_span.h"

namespace contact_flow {
namespace {

/// Beyond this many times the step that would resolve the fastest mode, collocation loses its order
/// in it, and the error estimate its truth (measured: config/robots against tolerance 1e-13).
constexpr double kStiffReach = 3;
constexpr double kSlackening = 0.6;  // most by which the rate falls from one step to the next
constexpr double kReach = 0.9;       // part of the longest acceptable step that is taken
/// DOP853 at tolerance ε takes steps of about ε^{1/8}·kBaseReach over the fastest rate it sees.
constexpr double kBaseReach = 8;
constexpr long kMaxSteps = 1000000;
constexpr double kSmallestStep = 1e-13;  // relative to max(1, t)
/// One Jacobian, with its part of the linear system, costs about as much as this many
/// multiplications for each of its entries (measured).
constexpr double kJacobianCost = 50;

/// Steps of the variational equation along one arc.
class Propagation {
 public:
  Propagation(ContactDynamics* dynamics, const Arc& arc, double tolerance)
      : d_(dynamics->system().dof()),
        k_(dynamics->num_variables()),
        arc_(arc),
        tolerance_(tolerance),
        jacobian_(dynamics, arc),
        nodes_(d_, 2 * d_ * GaussLegendre::kMaxStages),
        sources_(d_, k_ * GaussLegendre::kMaxStages),
        begin_(d_, 2 * d_ + k_),
        end_(d_, 2 * d_ + k_),
        step_(2 * d_ + k_, 2 * d_ + k_) {}

  Matrix Run(VariationStatistics* statistics) {
    double t = arc_.t_begin;
    phi_.setIdentity(step_.rows(), step_.cols());
    if (t == arc_.t_end) return phi_;
    jacobian_.At(t, begin_.data(), begin_.data() + 2 * d_ * d_);
    span_.Find(begin_.leftCols(2 * d_), begin_.rightCols(k_));
    fastest_ = FastestRate(begin_.leftCols(2 * d_));
    // The rate r of the tangents [1/s]: a step's error is error_s·(r h)^{2s+1}.
    double rate = GuessRate();
    while (t < arc_.t_end) {
      const double rest = arc_.t_end - t;
      const double length = ChooseStep(rest, rate);
      const double error = Step(t, length);
      if (std::isfinite(error)) {
        const double seen = std::pow(error / rule_->error, 1.0 / (2 * rule_->stages + 1)) / length;
        rate = std::max(seen, kSlackening * rate);
      }
      if (!(error <= tolerance_)) {
        ++statistics->rejected_steps;
        rate *= std::isfinite(error) ? 1.1 : 10;
        if (length < kSmallestStep * std::max(1.0, arc_.t_end)) Fail(t);
        continue;
      }
      if (++statistics->steps > kMaxSteps) Fail(t);
      phi_.swap(next_);
      begin_.swap(end_);
      t = length == rest ? arc_.t_end : t + length;
      if (t < arc_.t_end) fastest_ = FastestRate(begin_.leftCols(2 * d_));
    }
    statistics->jacobians += jacobian_.count();
    jacobian_.ToVelocities(&phi_);
    return phi_;
  }

 private:
  [[noreturn]] static void Fail(double t) {
    std::ostringstream message;
    message << "the variational equation cannot be resolved at t = " << t << " s";
    throw std::domain_error(message.str());
  }

  /// The fastest rate at the beginning, or what the steps of the run itself tell of the change of K
  /// and D.
  double GuessRate() const {
    const double base_step =
        (arc_.t_end - arc_.t_begin) / static_cast<double>(arc_.dense.NumSteps());
    const double base_rate = kBaseReach * std::pow(tolerance_, 1.0 / 8) / base_step;
    return std::max(fastest_, std::min(base_rate, 2 * fastest_));
  }

  /// Chooses stages and length of the next step so that what is left of the arc costs least: n
  /// equal steps of a factorization for s times the independent rows, its solution for the
  /// independent columns, and s+1 Jacobians each.
  double ChooseStep(double rest, double rate) {
    double least = std::numeric_limits<double>::infinity(), length = rest;
    for (int s = GaussLegendre::kMinStages; s <= GaussLegendre::kMaxStages; ++s) {
      const GaussLegendre& rule = GaussLegendre::WithStages(s);
      const double angle = kReach * std::pow(tolerance_ / rule.error, 1.0 / (2 * s + 1));
      const double reach = std::min(angle / rate, kStiffReach * angle / fastest_);
      const double steps = rate > 0 || fastest_ > 0 ? std::ceil(std::max(1.0, rest / reach)) : 1;
      const double n = s * rows_.size();
      const double cost = steps * (n * n * (n / 3 + 2 * columns_.size() + k_) +
                                   (s + 1) * kJacobianCost * 2 * d_ * d_);
      if (cost < least) {
        least = cost;
        length = rest / steps;
        rule_ = &rule;
      }
    }
    return length;
  }

  /// [K_i D_i] at node i.
  Eigen::Map<Matrix> Node(int i) { return {nodes_.data() + i * 2 * d_ * d_, d_, 2 * d_}; }
  /// … and what the variables add there.
  Eigen::Map<Matrix> Source(int i) { return {sources_.data() + i * k_ * d_, d_, k_}; }

  /// Only independent rows and columns enter the linear system. What holds on one step mostly does
  /// on the next.
  void FindSpans() {
    const int stages = rule_->stages, columns = stages * 2 * d_;
    const auto sources = sources_.leftCols(stages * k_);
    if (span_.Holds(nodes_.leftCols(columns), sources)) return;
    // Two mixtures: where a single [K D] has few rows, its columns depend on each other by chance.
    sample_.setZero(d_, 4 * d_);
    for (int i = 0; i < stages; ++i) {
      sample_.leftCols(2 * d_) += rule_->c(i) * Node(i);
      sample_.rightCols(2 * d_) += (1 - rule_->c(i)) * Node(i);
    }
    source_sample_.setZero(d_, 2 * k_);
    for (int i = 0; i < stages && k_ > 0; ++i) {
      source_sample_.leftCols(k_) += rule_->c(i) * Source(i);
      source_sample_.rightCols(k_) += (1 - rule_->c(i)) * Source(i);
    }
    span_.Find(sample_, source_sample_);
    if (!span_.Holds(nodes_.leftCols(columns), sources)) span_.SetAll(d_);
  }

  /// Fills the linear system for the accelerations Y_i of the tangents at the nodes,
  ///   Y_i = K_i (Q₀ + c_i h V₀ + h² Σ_j (a²)_ij Y_j) + D_i (V₀ + h Σ_j a_ij Y_j),  Q₀ = [I 0], V₀
  ///   = [0 I],
  /// over the independent rows and columns: Y_i = R Z_i Cᵀ; variables have a source of their own.
  void Assemble(double h) {
    const int s = rule_->stages, m = rows_.size(), n = s * m;
    system_matrix_.resize(n, n);
    accelerations_.resize(n, 2 * columns_.size() + k_);
    WithFixedSize(m, [&](auto rows) {
      for (int i = 0; i < s; ++i) AssembleNode(i, h, rows);
    });
    for (int i = 0; i < s; ++i) {
      for (int c = 0; c < k_; ++c) {
        for (int r = 0; r < m; ++r) {
          accelerations_(i * m + r, 2 * columns_.size() + c) = Source(i)(rows_.members()[r], c);
        }
      }
    }
    system_matrix_.diagonal().array() += 1;
  }

  /// The block row of node i; `m` is the number of independent rows, a compile-time constant when
  /// small.
  template <class Rows>
  void AssembleNode(int i, double h, Rows m) {
    const double* node = Node(i).data();
    const double ahead = rule_->c(i) * h;
    picked_.resize(m, 2 * d_);
    for (int c = 0; c < 2 * d_; ++c) {
      for (int r = 0; r < m; ++r) picked_(r, c) = node[c * d_ + rows_.members()[r]];
    }
    for (int l = 0; l < columns_.size(); ++l) {
      const int c = columns_.members()[l];
      const double *K = &picked_(0, c), *D = &picked_(0, d_ + c);
      double* __restrict q = &accelerations_(i * m, l);
      double* __restrict v = &accelerations_(i * m, columns_.size() + l);
      for (int r = 0; r < m; ++r) {
        q[r] = K[r];
        v[r] = D[r] + ahead * K[r];
      }
    }
    column_.resize(2 * m);
    for (int unknown = 0; unknown < m; ++unknown) {  // K R and D R
      double* __restrict K = column_.data();
      double* __restrict D = column_.data() + m;
      for (int r = 0; r < 2 * m; ++r) K[r] = 0;
      for (int c = 0; c < d_; ++c) {
        const double factor = rows_.combination()(c, unknown);
        if (factor == 0) continue;
        const double *left = &picked_(0, c), *right = &picked_(0, d_ + c);
        for (int r = 0; r < m; ++r) {
          K[r] += factor * left[r];
          D[r] += factor * right[r];
        }
      }
      for (int j = 0; j < rule_->stages; ++j) {
        double* __restrict block = &system_matrix_(i * m, j * m + unknown);
        const double on_q = -h * h * rule_->twice(i, j), on_v = -h * rule_->a(i, j);
        for (int r = 0; r < m; ++r) block[r] = on_q * K[r] + on_v * D[r];
      }
    }
  }

  /// Replaces the right-hand side in accelerations_ by the solution; false when the system is
  /// singular.
  bool SolveAccelerations() {
    const int m = rows_.size();
    if (m == 0) return true;
    bool solved = false;
    WithFixedSize(m, [&](auto rows) {
      if constexpr (std::is_same_v<decltype(rows), int>) {
        const Eigen::PartialPivLU<Eigen::Ref<Matrix>> factor(system_matrix_);  // in place
        accelerations_ = factor.solve(accelerations_);
        solved = true;
      } else {
        solved =
            BlockSolve<decltype(rows)>::Run(rows, rule_->stages, &system_matrix_, &accelerations_);
      }
    });
    return solved;
  }

  /// The propagator of [t, t+h] into step_; returns its error estimate.
  double Step(double t, double h) {
    const int s = rule_->stages;
    for (int i = 0; i < s; ++i) jacobian_.At(t + rule_->c(i) * h, Node(i).data(), Source(i).data());
    FindSpans();
    Assemble(h);
    if (!SolveAccelerations()) return std::numeric_limits<double>::infinity();
    step_.setIdentity();
    step_.block(0, d_, d_, d_).diagonal().array() += h;
    AddAccelerations(h * h, rule_->twice_end, step_.topRows(d_));
    AddAccelerations(h, rule_->b, step_.middleRows(d_, d_));
    jacobian_.At(t + h, end_.data(), end_.data() + 2 * d_ * d_);
    const bool moved = t > arc_.t_begin;  // else phi_ = I
    next_ = step_;
    if (moved) next_.noalias() = step_ * phi_;
    // Defect at either end: the collocation polynomial's acceleration against the equation's. Of
    // what has decayed before, as the fast modes of a stiff damper, nothing is left to be wrong by.
    defect_ = -begin_;
    AddAccelerations(1, rule_->at_begin, defect_);
    double relative = h * Relative(moved);
    defect_.noalias() = -end_ * step_;
    AddAccelerations(1, rule_->at_end, defect_);
    relative = std::max(relative, h * Relative(moved));
    return rule_->error * std::pow(relative / rule_->defect, (2.0 * s + 1) / (s + 1));
  }

  /// Largest entry of the defect relative to those of the propagator; tangents and variables each
  /// by themselves.
  double Relative(bool moved) {
    if (moved) {
      carried_.noalias() = defect_ * phi_;
      defect_.swap(carried_);
    }
    return std::max(RelativeSize(defect_, next_, 0, 2 * d_),
                    RelativeSize(defect_, next_, 2 * d_, k_));
  }

  /// target += scale · Σ_j weights_j Y_j = scale · R (Σ_j weights_j Z_j) Cᵀ  [d×2d].
  void AddAccelerations(double scale, const Vector& weights, Eigen::Ref<Matrix> target) {
    const int columns = columns_.size();
    const double* R = rows_.combination().data();
    const int all = 2 * columns + k_;
    sum_.resize(rows_.size(), all);
    spread_.resize(d_, all);
    WithFixedSize(rows_.size(), [&](auto m) {
      for (int c = 0; c < all; ++c) {
        double* __restrict sum = &sum_(0, c);
        for (int r = 0; r < m; ++r) sum[r] = 0;
        for (int j = 0; j < rule_->stages; ++j) {
          const double* __restrict Z = &accelerations_(j * m, c);
          const double weight = scale * weights(j);
          for (int r = 0; r < m; ++r) sum[r] += weight * Z[r];
        }
      }
    });
    WithFixedSize(d_, [&](auto d) {
      for (int c = 0; c < all; ++c) {
        double* __restrict out = &spread_(0, c);
        for (int r = 0; r < d; ++r) out[r] = 0;
        for (int k = 0; k < rows_.size(); ++k) {
          const double factor = sum_(k, c);
          for (int r = 0; r < d; ++r) out[r] += factor * R[k * d + r];
        }
      }
    });
    WithFixedSize(d_, [&](auto d) {
      for (int c = 0; c < 2 * d; ++c) {
        const int half = c / d;
        double* __restrict out = &target(0, c);
        for (int l = 0; l < columns; ++l) {
          const double factor = columns_.combination()(c % d, l);
          if (factor == 0) continue;
          const double* __restrict in = &spread_(0, half * columns + l);
          for (int r = 0; r < d; ++r) out[r] += factor * in[r];
        }
      }
    });
    if (k_ > 0) target.rightCols(k_) += spread_.rightCols(k_);
  }

  const int d_;
  const int k_;
  const Arc& arc_;
  const double tolerance_;
  const GaussLegendre* rule_ = nullptr;
  double fastest_ = 0;  // rate of a mode at the beginning of the step [1/s]
  ArcJacobian jacobian_;
  Matrix nodes_;    // [K_i D_i], i = 1 … s, side by side
  Matrix sources_;  // the variables' parts, likewise
  Matrix begin_;    // [K D] and the variables' part at the beginning of the step
  Matrix end_;      // … and at its end
  Matrix system_matrix_;
  JacobianSpan span_;
  const RowSpan& rows_ = span_.rows();        // R
  const RowSpan& columns_ = span_.columns();  // C
  Matrix sample_;
  Matrix source_sample_;
  Matrix picked_;  // the independent rows of one [K D]
  Vector column_;
  Matrix accelerations_;  // Z_1 … Z_s, stacked
  Matrix sum_;            // Σ_j weights_j Z_j
  Matrix spread_;         // R times it
  Matrix step_;
  Matrix phi_;   // up to the present step
  Matrix next_;  // … and through it
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
