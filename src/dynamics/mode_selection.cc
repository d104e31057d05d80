// SPDX-License-Identifier: BSD-3-Clause
#include "mode_selection.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/row_layout.h"
#include "coordinate_reach.h"
#include "effort_modes.h"
#include "felt_contacts.h"

namespace contact_flow {
namespace {

constexpr double kForceRounding = 1e-13;
/// A force or acceleration below this part of the largest one may vanish at the
/// instant; others cannot.
constexpr double kNearZero = 1e-4;
/// dλ/dt below this part of what it is the sum of vanishes.
constexpr double kRateRounding = 1e-11;
/// Rates of dependent rows: the part that no forces change is rounding up to this part of them;
/// what is not above it by this factor vanishes.
constexpr double kTornPart = 1e-6, kAboveNoise = 10;
/// Half the distance of the difference quotient for d²λ/dt², as a part of |v|/|v̇|, and what counts
/// as zero there.
constexpr double kQuotientStep = 1e-4, kQuotientRounding = 1e-9;

/// Where the effort does not depend on the mode: forces first, then their rates. Rows are those of
/// the candidates, in increasing order.
class ForceModes {
 public:
  /// `inertia` is that at q; `applied` and `bias` are f + c v [d] and Ȧ v [n+l] at x.
  ForceModes(ContactDynamics* dynamics, const InverseInertia& inertia, const Vector& applied,
             const Vector& bias, const VectorRef& x, const ConstraintSet& candidates,
             const ForceTolerance& tolerance, const ContactMode& beside)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        x_(x),
        beside_(beside),
        tolerance_(tolerance) {
    members_.reserve(static_cast<std::size_t>(candidates.Size()));
    for (int i : candidates) members_.push_back(i);
    const Matrix A = inertia.Rows(candidates);
    Vector free = inertia * applied;
    if (system_.num_bilateral() > 0) {
      free += inertia.Correction(RowLayout(system_).Bilateral(bias));
    }
    Matrix moved = inertia * A.transpose();
    G_ = A * moved;
    felt_ = FeltContacts(G_, std::move(moved));
    b_ = A * free;
    size_ = A.cwiseAbs() * free.cwiseAbs();
    // Where forces balance, their sum does not tell how large they are: those that are felt may.
    balance_ = Vector(rows());
    for (int row = 0; row < rows(); ++row) {
      balance_(row) = felt_.Largest(row, applied) / A.row(row).cwiseAbs().maxCoeff();
      b_(row) += bias(members_[row]);
      size_(row) += std::abs(bias(members_[row]));
    }
  }

  ModeSelection Find() {
    const std::optional<ComplementaritySolution> found = SolveComplementarity(G_, b_);
    if (!found) Refuse();
    const ComplementaritySolution& solution = *found;
    std::vector<int> basis;
    for (int row : solution.support) basis.push_back(row);
    // λ_i of the members, and (up to coupling) of the others what their force would be.
    const Vector gain = G_.diagonal();
    const Vector w = G_ * solution.z + b_;
    const Vector force = solution.z - w.cwiseQuotient(gain);
    const Vector scale = (size_ + G_.cwiseAbs() * solution.z).cwiseQuotient(gain) + balance_;
    const double doubtful =
        kNearZero * (1 + std::max(scale.maxCoeff(), force.cwiseAbs().maxCoeff()));
    std::vector<int> near;
    for (int row = 0; row < rows(); ++row) {
      const bool presses = std::count(basis.begin(), basis.end(), row) > 0;
      if (std::abs(force(row)) <= doubtful) {
        near.push_back(row);
      } else if (presses) {
        pressing_.push_back(row);
      }
    }
    if (!near.empty()) {
      DecideByRates(Vanishing(near, basis, kForceRounding * scale));
    }
    ModeSelection selection;
    selection.mode = Mode(pressing_);
    for (int row : degenerate_) selection.degenerate.Insert(members_[row]);
    for (int row : near) {
      const bool dependent = Independence(G_, pressing_, row) <= kDependentRow;
      if (dependent && !selection.mode.Contains(members_[row])) {
        selection.implied.Insert(members_[row]);
      }
    }
    return selection;
  }

 private:
  int rows() const { return static_cast<int>(members_.size()); }

  ContactMode Mode(const std::vector<int>& rows) const {
    ContactMode mode = beside_;
    for (int row : rows) mode.Insert(members_[row]);
    return mode;
  }

  [[noreturn]] void Refuse() const {
    if (!G_.allFinite() || !b_.allFinite()) {
      throw std::domain_error("the contact forces are not finite (a singular or indefinite mass?)");
    }
    ConstraintSet candidates;
    for (int i : members_) candidates.Insert(i);
    throw UndecidedMode("no forces λ ≥ 0 of the contacts " +
                        candidates.ToString(system_.description().constraints) +
                        " keep them from penetrating: they are dependent and jam (Assumption 3)");
  }

  /// dλ/dt of a row in mode α ∪ {row}, and what it is the sum of.
  double Rate(int row, double* sum) {
    std::vector<int> with = pressing_;
    with.push_back(row);
    const int i = members_[row], d = system_.dof();
    const double rate = dynamics_.ForceRate(x_, Mode(with), i);
    const auto gradient = dynamics_.force_jacobian().row(i).cwiseAbs();
    *sum = gradient.head(d).dot(x_.tail(d).cwiseAbs()) +
           gradient.segment(d, d).dot(dynamics_.acceleration().cwiseAbs());
    return rate;
  }

  /// β: those near zero that vanish within the tolerance. Others that press join α.
  std::vector<int> Vanishing(const std::vector<int>& near, const std::vector<int>& basis,
                             const Vector& rounding) {
    std::vector<int> vanishing;
    bool settled = false;
    while (!settled) {
      settled = true;
      vanishing.clear();
      rates_.clear();
      sums_.clear();
      for (int row : near) {
        if (std::count(pressing_.begin(), pressing_.end(), row) > 0) continue;
        if (Independence(G_, pressing_, row) <= kDependentRow) continue;
        double sum = 0;
        const double rate = Rate(row, &sum);
        const double force = dynamics_.force()(members_[row]);
        if (std::abs(force) <= tolerance_.Of(members_[row], rate) + rounding(row)) {
          vanishing.push_back(row);
          rates_.push_back(rate);
          sums_.push_back(sum);
        } else if (std::count(basis.begin(), basis.end(), row) > 0) {
          pressing_.push_back(row);
          settled = false;
          break;
        }
      }
    }
    return vanishing;
  }

  /// Adds those of β that hold to α.
  void DecideByRates(const std::vector<int>& vanishing) {
    const int k = static_cast<int>(vanishing.size());
    if (k == 0) return;
    Matrix G(k, k);
    Vector c(k);
    for (int col = 0; col < k; ++col) {
      Vector y;
      Independence(G_, pressing_, vanishing[col], &y);
      for (int row = 0; row < k; ++row) {
        G(row, col) = G_(vanishing[row], vanishing[col]);
        for (std::size_t j = 0; j < pressing_.size(); ++j) {
          G(row, col) -= G_(vanishing[row], pressing_[j]) * y(j);
        }
      }
      const bool still = std::abs(rates_[col]) <= kRateRounding * sums_[col];
      c(col) = still ? 0 : -G(col, col) * rates_[col];
    }
    G = 0.5 * (G + G.transpose()).eval();
    const Vector torn = Torn(G, c);
    const double noise = torn.cwiseAbs().maxCoeff();
    if (noise > 0 && noise <= std::max(kTornPart * c.cwiseAbs().maxCoeff(), RateNoise(vanishing))) {
      c -= torn;
      for (double& value : c) {
        if (std::abs(value) <= kAboveNoise * noise) value = 0;
      }
    }
    std::optional<ComplementaritySolution> found = SolveComplementarity(G, c);
    // Rates that jam are forces that jam at the next instant, which is where that is decided.
    if (!found) found = SolveComplementarity(G, c -= Torn(G, c));
    if (!found) Refuse();
    const ComplementaritySolution& solution = *found;
    const Vector w = G * solution.z + c;
    for (int row : solution.support) pressing_.push_back(vanishing[row]);
    for (int row = 0; row < k; ++row) {
      const double zero = kRateRounding * sums_[row];
      const bool decided = solution.z(row) > zero || w(row) > zero * G(row, row);
      if (!decided) degenerate_.push_back(vanishing[row]);
    }
    // Rows that are dependent may hold each other: a plate on four corners cannot turn about two.
    std::vector<int> independent = pressing_;
    bool dependent = false;
    for (int row : degenerate_) {
      if (std::count(independent.begin(), independent.end(), row) > 0) continue;
      if (Independence(G_, independent, row) > kDependentRow) {
        independent.push_back(row);
      } else {
        dependent = true;
      }
    }
    for (int row : degenerate_) {
      if (std::count(pressing_.begin(), pressing_.end(), row) > 0) continue;
      if (Independence(G_, pressing_, row) <= kDependentRow) continue;
      if (dependent || RateGrows(row)) pressing_.push_back(row);
    }
  }

  /// The part of c that no forces of β change: of rows that depend on others, 0 where they depend
  /// all along the motion (four corners of a plate), but for rounding.
  static Vector Torn(const Matrix& G, const Vector& c) {
    const Vector scale = G.diagonal().cwiseSqrt();
    if (c.size() < 2 || !(scale.array() > 0).all()) return Vector::Zero(c.size());
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(scale.cwiseInverse().asDiagonal() * G *
                                                      scale.cwiseInverse().asDiagonal());
    const Vector scaled = c.cwiseQuotient(scale);
    Vector torn = Vector::Zero(c.size());
    for (int k = 0; k < c.size() && eigen.eigenvalues()(k) <= kDependentRow; ++k) {
      torn += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).dot(scaled);
    }
    return torn.cwiseProduct(scale);
  }

  /// What rounding makes of the rates: forces that turn with the velocity.
  double RateNoise(const std::vector<int>& vanishing) {
    double noise = 0;
    for (int row : vanishing) {
      double force = 0;
      for (int other = 0; other < rows(); ++other) {
        if (!felt_.Feels(row, other)) continue;
        force = std::max(force, std::abs(dynamics_.force()(members_[other])));
      }
      noise = std::max(noise, G_(row, row) * force);
    }
    return kRateRounding * noise * x_.tail(system_.dof()).cwiseAbs().maxCoeff();
  }

  /// Whether d²λ/dt² > 0 in mode α ∪ {row}: a central difference of dλ/dt along the motion.
  bool RateGrows(int row) {
    double sum = 0;
    Rate(row, &sum);
    const int d = system_.dof();
    Vector tangent(2 * d);
    tangent << x_.tail(d), dynamics_.acceleration();
    const double step = kQuotientStep * TimeToMove(system_.space(), x_, tangent);
    std::vector<int> with = pressing_;
    with.push_back(row);
    const double after =
        dynamics_.ForceRate(system_.Perturb(x_, step * tangent), Mode(with), members_[row]);
    const double before =
        dynamics_.ForceRate(system_.Perturb(x_, -step * tangent), Mode(with), members_[row]);
    return after - before > kQuotientRounding * sum;
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector x_;
  const ContactMode beside_;
  const ForceTolerance& tolerance_;
  std::vector<int> members_;
  Matrix G_;
  Vector b_;
  Vector size_;  // what b is the sum of
  FeltContacts felt_;
  Vector balance_;             // the largest applied force, as one of each contact
  std::vector<int> pressing_;  // α, and in the end the mode
  std::vector<double> rates_;  // of β
  std::vector<double> sums_;   // what they are the sums of
  std::vector<int> degenerate_;
};

ModeSelection SelectBeside(ContactDynamics* dynamics, const VectorRef& x,
                           const ConstraintSet& candidates, const ForceTolerance& tolerance,
                           const ContactMode& beside, const InverseInertia* inertia) {
  ModeSelection selection;
  if (candidates.Empty()) {
    selection.mode = beside;
  } else if (dynamics->PushClearly(x, candidates, beside)) {
    selection.mode = ContactMode(candidates | beside);
  } else if (dynamics->system().HasContactEffort()) {
    selection.mode = SelectByEffort(dynamics, x, candidates, tolerance, beside);
  } else {
    const MechanicalSystem& system = dynamics->system();
    const auto q = x.head(system.num_positions()), v = x.tail(system.dof());
    if (inertia == nullptr) {
      const InverseInertia own(system, q, v, dynamics->u(), ContactMode());
      selection = ForceModes(dynamics, own, own.applied(), own.terms().bias, x, candidates,
                             tolerance, beside)
                      .Find();
    } else {
      Vector applied;
      ConstraintTerms terms;
      system.Dynamics(q, v, dynamics->u(), ContactMode(), nullptr, &applied);
      system.Constraints(q, v, &terms);
      selection =
          ForceModes(dynamics, *inertia, applied, terms.bias, x, candidates, tolerance, beside)
              .Find();
    }
  }
  return selection;
}

}  // namespace

ModeSelection SelectMode(ContactDynamics* dynamics, const VectorRef& x,
                         const ConstraintSet& candidates, const ForceTolerance& tolerance,
                         const ConstraintSet& pressed, const InverseInertia* inertia) {
  return SelectBeside(dynamics, x, candidates, tolerance, ContactMode(pressed), inertia);
}

ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x,
                              const ConstraintSet& candidates, const ForceTolerance& tolerance,
                              const ConstraintSet& pressed) {
  return SelectMode(dynamics, x, candidates, tolerance, pressed).mode;
}

ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x,
                              const ConstraintSet& candidates, const ForceTolerance& tolerance,
                              const ContactMode& beside) {
  return SelectBeside(dynamics, x, candidates, tolerance, beside, nullptr).mode;
}

}  // namespace contact_flow
