// SPDX-License-Identifier: BSD-3-Clause
#include "known_pads.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "row_units.h"

namespace contact_flow {
namespace {

/// Rows that depend on each other have the same accelerations up to this, relative.
constexpr double kSameRate = 1e-7;

/// Pressed by more than what it is known to, or than this part of the largest.
constexpr double kKnownPress = 10, kLeastPress = 1e-6;

/// Whether contact i, which stands alone, does not come to open.
bool IsPressed(const FrictionProblem& problem, std::size_t i) {
  const int row = problem.Row(i);
  if (problem.slack.size() > 0) {
    return problem.b(row) < -kKnownPress * problem.slack(static_cast<Eigen::Index>(i));
  }
  const Vector size = problem.b.cwiseQuotient(problem.G.diagonal().cwiseSqrt());
  return size(row) < -kLeastPress * size.cwiseAbs().maxCoeff();
}

/// Whether the tangential row of pad i is that of the joint of contact k, which has no friction.
bool IsStopOf(const FrictionProblem& problem, std::size_t k, std::size_t i) {
  const int stop = problem.Row(k);
  return problem.contacts[k].dimension == 0 && problem.G(stop, stop) > 0 &&
         !(Independence(problem.G, {stop}, problem.Row(i) + 1) > kDependentRow);
}

}  // namespace

KnownPads::KnownPads(const FrictionProblem& whole) : whole_(whole) {
  if (whole.b.size() == 0 || !whole.G.allFinite() || !whole.b.allFinite()) return;
  for (std::size_t i = 0; i < whole.contacts.size(); ++i) {
    const FrictionContact& contact = whole.contacts[i];
    const int row = whole.Row(i);
    Pad pad{i, 0, 0, -1, 0};
    if (contact.dimension == 1 && StandsAlone(whole, i) && IsPressed(whole, i)) {
      pad.pressed = -whole.b(row) / whole.G(row, row);
      pad.stop = contact.slips ? -1 : StopOf(i);
      if (contact.slips) pad.sign = contact.direction(0);
      if (pad.stop >= 0) {
        const int stop = whole.Row(static_cast<std::size_t>(pad.stop));
        pad.ratio = whole.G(row + 1, stop) / whole.G(stop, stop);
        pad.sign = std::copysign(1.0, pad.ratio);
      }
    }
    if (pad.sign != 0) {
      pads_.push_back(pad);
      continue;
    }
    kept_.push_back(i);
    for (int k = 0; k <= contact.dimension; ++k) rows_.push_back(row + k);
  }
  if (!Any()) return;
  Vector push = Vector::Zero(whole.b.size());
  for (const Pad& pad : pads_) {
    const double most = whole.contacts[pad.contact].coefficient * pad.pressed;
    push(whole.Row(pad.contact) + 1) = -most * pad.sign;
  }
  const Vector b = whole.b + whole.G * push;
  const auto m = static_cast<Eigen::Index>(rows_.size());
  rest_.G.resize(m, m);
  rest_.b.resize(m);
  if (whole.rounding.size() > 0) rest_.rounding.resize(m);
  for (Eigen::Index r = 0; r < m; ++r) {
    const int row = rows_[static_cast<std::size_t>(r)];
    rest_.b(r) = b(row);
    if (whole.rounding.size() > 0) rest_.rounding(r) = whole.rounding(row);
    for (Eigen::Index c = 0; c < m; ++c) {
      rest_.G(r, c) = whole.G(row, rows_[static_cast<std::size_t>(c)]);
    }
  }
  if (whole.slack.size() > 0) rest_.slack.resize(static_cast<Eigen::Index>(kept_.size()));
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    rest_.contacts.push_back(whole.contacts[kept_[k]]);
    if (whole.slack.size() == 0) continue;
    rest_.slack(static_cast<Eigen::Index>(k)) = whole.slack(static_cast<Eigen::Index>(kept_[k]));
  }
}

int KnownPads::StopOf(std::size_t i) const {
  const Matrix& G = whole_.G;
  const int row = whole_.Row(i) + 1;
  const double scale = whole_.b.cwiseAbs().cwiseQuotient(G.diagonal().cwiseSqrt()).maxCoeff();
  for (std::size_t k = 0; k < whole_.contacts.size(); ++k) {
    if (!IsStopOf(whole_, k, i)) continue;
    const int stop = whole_.Row(k);
    const double ratio = G(row, stop) / G(stop, stop);
    const double apart = std::abs(whole_.b(row) - ratio * whole_.b(stop)) / std::sqrt(G(row, row));
    if (apart <= kSameRate * scale) return static_cast<int>(k);
  }
  return -1;
}

std::vector<Letter> KnownPads::LettersOf(const std::vector<Letter>& whole) const {
  if (!Any() || whole.empty()) return whole;
  std::vector<Letter> letters;
  letters.reserve(kept_.size());
  for (std::size_t i : kept_) letters.push_back(whole[i]);
  return letters;
}

FrictionSolution KnownPads::Whole(const FrictionSolution& rest) const {
  if (!Any()) return rest;
  FrictionSolution whole = rest;
  whole.letters.assign(whole_.contacts.size(), Letter::kOpen);
  whole.directions.assign(whole_.contacts.size(), Eigen::Vector2d::Zero());
  whole.force = Vector::Zero(whole_.b.size());
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    whole.letters[kept_[k]] = rest.letters[k];
    whole.directions[kept_[k]] = rest.directions[k];
  }
  Vector inside = whole.force;
  bool shares = rest.interior.size() > 0;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const auto k = static_cast<Eigen::Index>(r);
    whole.force(rows_[r]) = rest.force(k);
    inside(rows_[r]) = shares ? rest.interior(k) : rest.force(k);
  }
  for (const Pad& pad : pads_) {
    const int row = whole_.Row(pad.contact);
    const double most = whole_.contacts[pad.contact].coefficient * pad.pressed;
    whole.force(row) = inside(row) = pad.pressed;
    const auto stop = static_cast<std::size_t>(pad.stop);
    if (pad.stop < 0 || whole.letters[stop] == Letter::kOpen) {
      whole.letters[pad.contact] = pad.sign > 0 ? Letter::kForward : Letter::kBackward;
      whole.directions[pad.contact] = {pad.sign, 0};
      whole.force(row + 1) = inside(row + 1) = -most * pad.sign;
      continue;
    }
    whole.letters[pad.contact] = Letter::kStick;
    // ρ λ_t between −|ρ| c and what the stop holds: the smallest sum of squares, and the middle.
    const int pressing = whole_.Row(stop);
    const auto share = [&](Vector* force, bool middle) {
      const double ratio = pad.ratio, least = -std::abs(ratio) * most;
      const double held = (*force)(pressing) + least;  // by both, along the stop's row
      const double largest = std::max(least, std::min(-least, held));
      const double smallest = held * ratio * ratio / (1 + ratio * ratio);
      const double own =
          middle ? 0.5 * (least + largest) : std::max(least, std::min(smallest, largest));
      (*force)(row + 1) = own / ratio;
      (*force)(pressing) = held - own;
    };
    share(&whole.force, false);
    share(&inside, true);
    shares = true;
  }
  if (shares) whole.interior = inside;
  whole.result = whole_.G * whole.force + whole_.b;
  return whole;
}

ConstraintSet SharedBesidePads(const MechanicalSystem& system, const Vector& x,
                               const ContactMode& mode, const ConstraintSet& shared) {
  const InverseInertia inertia(system, x.head(system.num_positions()), x.tail(system.dof()));
  const FrictionFrame frame(system, inertia, shared);
  const FrictionProblem& problem = frame.problem();
  std::vector<int> held;  // rows
  ConstraintSet others = shared;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const int contact = frame.constraints()[i];
    const bool sticks = mode.LetterOf(contact) == Letter::kStick;
    bool known = false;
    for (std::size_t k = 0; sticks && !known && k < problem.contacts.size(); ++k) {
      known =
          problem.contacts[i].dimension == 1 && StandsAlone(problem, i) && IsStopOf(problem, k, i);
    }
    if (known) {
      others.Erase(contact);
      continue;
    }
    for (int k = 0; k <= (sticks ? problem.contacts[i].dimension : 0); ++k) {
      held.push_back(problem.Row(i) + k);
    }
  }
  std::vector<int> basis;
  for (int row : held) {
    if (!(Independence(problem.G, basis, row) > kDependentRow)) return others;
    basis.push_back(row);
  }
  return {};
}

}  // namespace contact_flow
