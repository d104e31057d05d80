// SPDX-License-Identifier: BSD-3-Clause
#include "stopping_slips.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {
namespace {

/// A direction does not move a slip below this, relative to the terms that its rate is summed of.
constexpr double kUnmovedSlip = 1e-9;
constexpr double kSlipBorder = 1e-9;
/// In space: the part of a slip that one step takes, the part of its beginning at which it counts
/// as stopped, and the slip that tells directions, relative to the velocities.
constexpr double kSlipStep = 0.1;
constexpr double kStopped = 1e-3;
constexpr double kTelling = 1e-4;
constexpr int kStopsForEach = 200;  // contact, at most

/// The slips of first order of one direction, from stop to stop.
class StoppingSlips {
 public:
  StoppingSlips(ContactDynamics* dynamics, const Vector& x, ContactMode mode, ConstraintSet brushed,
                const Matrix& rate_jacobian, const Vector& w)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        x_(x),
        mode_(mode.Without(system_.compliant())),
        rate_jacobian_(rate_jacobian),
        d_(system_.dof()),
        nq_(system_.num_positions()) {
    system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
    for (int i : mode_) {
      const Friction& friction = system_.friction()[i];
      if (friction.dimension == 0 || !(friction.coefficient > 0)) continue;
      if (std::isinf(friction.coefficient)) continue;
      const bool sticks = mode_.LetterOf(i) == Letter::kStick;
      if (!sticks && !Begins(i)) continue;
      const auto rows = rate_jacobian_.middleRows(friction.row, friction.dimension);
      Vector slip = rows * w;
      if (slip.norm() <= kUnmovedSlip * (rows.cwiseAbs() * w.cwiseAbs()).norm()) slip.setZero();
      slips_.push_back({i, sticks, slip, slip.norm()});
    }
    for (int i : brushed) brushed_.push_back({i, rate_jacobian_.row(i).dot(w), 0});
  }

  bool Moving() const {
    return std::any_of(slips_.begin(), slips_.end(),
                       [](const Slip& slip) { return slip.sticks && !slip.value.isZero(0); });
  }

  void Follow() {
    const int limit = kStopsForEach * static_cast<int>(slips_.size());
    for (int round = 0; round < limit; ++round) {
      AskBudget();
      const Vector now = State();
      const ContactMode word = WordAt(now);
      for (int i : mode_ - word) Refuse(i, "lets go");
      if (!Moving()) {
        for (const Slip& slip : slips_) {
          if (slip.sticks && word.LetterOf(slip.constraint) != Letter::kStick) {
            Refuse(slip.constraint, "does not come to rest");
          }
        }
        return;
      }
      Advance(dynamics_.Field(now, word), word);
    }
    Refuse(mode_.Sticking(), "do not come to rest");
  }

 private:
  struct Slip {
    int constraint;
    bool sticks;   // at the base point; else it begins to slip there
    Vector value;  // of first order
    double begun;  // its size when it began
  };
  /// An open contact that leaves: what its gap becomes, of second order.
  struct Rising {
    int constraint;
    double rate;
    double gap;
  };

  /// Whether a contact that slips in the plane does so from rest.
  bool Begins(int i) const {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension != 1) return false;
    const auto row = terms_.jacobian.row(friction.row);
    const double size = row.cwiseAbs().dot(x_.tail(d_).cwiseAbs());
    return std::abs(row.dot(x_.tail(d_))) <= kUnmovedSlip * size;
  }

  /// x with the slips in space of the present directions, too small to matter otherwise.
  Vector State() const {
    Matrix rows(mode_.Size() + 2 * static_cast<Eigen::Index>(slips_.size()), d_);
    Vector rates = Vector::Zero(rows.rows());
    Eigen::Index used = 0;
    double largest = 0;
    for (int i : mode_) rows.row(used++) = terms_.jacobian.row(i);
    for (const Slip& slip : slips_) {
      const Friction& friction = system_.friction()[slip.constraint];
      rows.middleRows(used, friction.dimension) =
          terms_.jacobian.middleRows(friction.row, friction.dimension);
      if (friction.dimension == 2) {
        rates.segment(used, 2) = slip.value;
        largest = std::max(largest, slip.value.norm());
      }
      used += friction.dimension;
    }
    if (largest == 0) return x_;
    const double speed = std::max(x_.tail(d_).cwiseAbs().maxCoeff(), kTelling);
    Vector x = x_;
    x.tail(d_) += rows.topRows(used).completeOrthogonalDecomposition().solve(
        Vector(rates.head(used) * (kTelling * speed / largest)));
    return x;
  }

  ContactMode WordAt(const Vector& x) {
    TouchingContacts contacts;
    contacts.slipping = mode_.Without(mode_.Sticking());
    for (const Slip& slip : slips_) {
      const int i = slip.constraint;
      contacts.slipping.Erase(i);
      if (slip.value.isZero(0)) {
        contacts.still.Insert(i);
      } else if (slip.value.size() == 2) {
        contacts.slipping.Insert(i);
      } else {
        contacts.slipping.Set(i, slip.value(0) > 0 ? Letter::kForward : Letter::kBackward);
      }
    }
    for (int i : mode_.Sticking()) {
      if (!contacts.slipping.Contains(i)) contacts.still.Insert(i);
    }
    try {
      return SelectWord(&dynamics_, x, contacts, kSlipBorder);
    } catch (const FrictionRefusal& reason) {
      throw std::domain_error(Beginning() + ": " + reason.what());
    }
  }

  /// To the next stop, or for a part of the slips in space.
  void Advance(const Vector& field, ContactMode word) {
    std::vector<Vector> rates;
    double step = std::numeric_limits<double>::infinity();
    for (Slip& slip : slips_) {
      const Friction& friction = system_.friction()[slip.constraint];
      Vector rate = rate_jacobian_.middleRows(friction.row, friction.dimension) * field;
      if (slip.value.isZero(0) && word.LetterOf(slip.constraint) == Letter::kStick) rate.setZero();
      rates.push_back(rate);
      const double size = slip.value.norm(), towards = slip.value.dot(rate);
      if (size == 0) continue;
      if (friction.dimension == 2) {
        step = std::min(step, kSlipStep * size / rate.norm());
      } else if (towards < 0) {
        step = std::min(step, size / rate.norm());
      }
    }
    if (!std::isfinite(step)) Refuse(mode_.Sticking(), "do not come to rest");
    Rise(field, step);
    for (std::size_t k = 0; k < slips_.size(); ++k) {
      Slip& slip = slips_[k];
      const double size = slip.value.norm();
      const bool stops = slip.value.dot(rates[k]) < 0;
      slip.value += step * rates[k];
      slip.begun = std::max(slip.begun, slip.value.norm());
      const double rest = slip.value.size() == 2 ? kStopped * slip.begun : kUnmovedSlip * size;
      if (!stops || slip.value.norm() > rest) continue;
      if (!slip.sticks) Refuse(slip.constraint, "reverses the slip that begins there");
      slip.value.setZero();
    }
  }

  /// gap + r t + ä t²/2 stays positive on 0 < t ≤ step.
  void Rise(const Vector& field, double step) {
    for (Rising& contact : brushed_) {
      const double rate = contact.rate, turn = rate_jacobian_.row(contact.constraint).dot(field);
      double least = std::min(contact.gap, contact.gap + step * (rate + step * turn / 2));
      if (rate < 0 && turn > 0 && -rate < step * turn) {
        least = std::min(least, contact.gap - rate * rate / (2 * turn));
      }
      const double terms = contact.gap + step * (std::abs(rate) + step * std::abs(turn));
      if (least < -kUnmovedSlip * terms) Refuse(contact.constraint, "touches again");
      contact.gap += step * (rate + step * turn / 2);
      contact.rate += step * turn;
    }
  }

  std::string Beginning() const {
    return "while slips stop that the direction gives to contacts that stick";
  }
  [[noreturn]] void Refuse(int i, const std::string& what) const {
    throw std::domain_error(Beginning() + ", contact '" + system_.description().constraints[i] +
                            "' " + what + ": that is not followed");
  }
  [[noreturn]] void Refuse(ConstraintSet contacts, const std::string& what) const {
    throw std::domain_error(Beginning() + ", " +
                            contacts.ToString(system_.description().constraints) + " " + what +
                            ": that is not followed");
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Vector x_;
  const ContactMode mode_;
  const Matrix& rate_jacobian_;
  const int d_, nq_;
  ConstraintTerms terms_;
  std::vector<Slip> slips_;
  std::vector<Rising> brushed_;
};

}  // namespace

void CheckStops(ContactDynamics* dynamics, const Vector& x, ContactMode mode, ConstraintSet brushed,
                const Matrix& rate_jacobian, const Vector& w) {
  StoppingSlips slips(dynamics, x, mode, brushed, rate_jacobian, w);
  if (slips.Moving()) slips.Follow();
}

}  // namespace contact_flow
