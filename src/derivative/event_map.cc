// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/event_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace contact_flow {
namespace {

/// First-order times that differ by less than this, relative, coincide.
constexpr double kTie = 1e-8;
constexpr int kMaxModularActivations = 12;

}  // namespace

double EventMap::TimeTo(int i, const Stage& stage, const Vector& w) const {
  return -guards_.row(i).dot(w) / guards_.row(i).dot(stage.field);
}

Eigen::RowVectorXd EventMap::TimeRow(int i, const Stage& stage) const {
  return -guards_.row(i) / guards_.row(i).dot(stage.field);
}

Vector EventMap::operator()(const VectorRef& direction) const {
  Vector w = direction;
  ContactMode S;
  double elapsed = 0;
  const Stage* stage = &StageAt(S);
  while (S != events_) {
    int next = -1;
    double earliest = std::numeric_limits<double>::infinity();
    for (int i : events_ - S) {
      const double tau = TimeTo(i, *stage, w);
      if (tau < earliest || next < 0) {
        earliest = tau;
        next = i;
      }
    }
    const Matrix* reset = nullptr;
    w += earliest * stage->field;
    elapsed += earliest;
    stage = &Activate(S, next, &reset);
    w = *reset * w;
    S.Insert(next);
  }
  return w - elapsed * stage->field;
}

double EventMap::GapAcceleration(int i, const Vector& v, const Vector& field) const {
  ConstraintTerms terms;
  system_->Constraints(q_, v, &terms);
  return terms.jacobian.row(i).dot(field.segment(v.size(), v.size())) + terms.bias(i);
}

std::vector<PerturbedEvent> EventMap::PerturbedEvents(const VectorRef& direction) const {
  using Kind = PerturbedEvent::Kind;
  struct Opening {
    double gap = 0, rate = 0, acceleration = 0;
    double Closes() const {  // first positive root of gap + rate t + acceleration t²/2
      if (!(acceleration < 0)) return std::numeric_limits<double>::infinity();
      return (rate + std::sqrt(rate * rate - 2 * acceleration * gap)) / -acceleration;
    }
    void Advance(double t) {
      gap += t * (rate + acceleration * t / 2);
      rate += acceleration * t;
    }
  };
  Vector w = direction;
  ContactMode S, pending = transition_.vanishing - events_, mode = transition_.mode_before;
  std::map<int, Opening> openings;
  std::vector<PerturbedEvent> events;
  const Stage* stage = &StageAt(S);
  double elapsed = 0;
  for (;;) {
    dynamics_->Differentiate(State(stage->v), mode);
    const Matrix force_gradient = dynamics_->force_jacobian();
    const Vector field = dynamics_->Field(State(stage->v), mode);
    PerturbedEvent next;
    next.constraint = -1;
    double earliest = std::numeric_limits<double>::infinity();
    const auto offer = [&](Kind kind, int i, double tau) {
      if (next.constraint >= 0 && !(tau < earliest)) return;
      earliest = tau;
      next.kind = kind;
      next.constraint = i;
    };
    for (int i : events_ - S) offer(Kind::kActivation, i, TimeTo(i, *stage, w));
    for (int i : pending& mode) {
      offer(Kind::kRelease, i, -force_gradient.row(i).dot(w) / force_gradient.row(i).dot(field));
    }
    for (auto& [i, opening] : openings) {
      opening.acceleration = GapAcceleration(i, stage->v, field);
      if (stage->mode.Contains(i)) offer(Kind::kClosing, i, opening.Closes());
    }
    if (next.constraint < 0 || !std::isfinite(earliest)) return events;

    for (auto& [i, opening] : openings) opening.Advance(earliest);
    w += earliest * field;
    elapsed += earliest;
    const int i = next.constraint;
    switch (next.kind) {
      case Kind::kRelease:
        pending.Erase(i);
        mode.Erase(i);
        break;
      case Kind::kClosing:
        openings.erase(i);
        mode.Insert(i);
        break;
      case Kind::kActivation: {
        const Matrix* reset = nullptr;
        const ContactMode before = mode;
        stage = &Activate(S, i, &reset);
        w = *reset * w;
        S.Insert(i);
        mode = stage->mode | Resting(stage->v, pending & mode, ContactMode());
        for (int j : Resting(stage->v, (before - mode).Without(i), ContactMode())) openings[j] = {};
        for (auto it = openings.begin(); it != openings.end();) {
          // This impact closes what it pushes, and what has had no time to open.
          const bool open = decoupled_ && it->second.rate > 0;
          if (stage->mode.Contains(it->first) && !open) {
            it = openings.erase(it);
          } else {
            mode.Erase((it++)->first);
          }
        }
      }
    }
    next.time = elapsed;
    next.mode = mode;
    events.push_back(next);
  }
}

std::vector<ContactMode> EventMap::PerturbedModes(const VectorRef& direction) const {
  const double tie = kTie * (1 + direction.head(system_->dof()).cwiseAbs().maxCoeff());
  std::vector<ContactMode> modes;
  double last = 0;
  for (const PerturbedEvent& event : PerturbedEvents(direction)) {
    if (!modes.empty() && event.time - last <= tie) {
      modes.back() = event.mode;
    } else {
      modes.push_back(event.mode);
    }
    last = event.time;
  }
  return modes;
}

Matrix EventMap::Selection(const std::vector<int>& order) const {
  const int n = size();
  Matrix product = Matrix::Identity(n, n);
  ContactMode S;
  const Stage* stage = &StageAt(S);
  for (int i : order) {
    // Ξ_i = DR + (F⁺ − DR F⁻) Dh / (Dh F⁻), and the row of τ is −Dh / (Dh F⁻).
    const Eigen::RowVectorXd time = TimeRow(i, *stage);
    const Vector before = stage->field;
    const Matrix* reset = nullptr;
    stage = &Activate(S, i, &reset);
    const Matrix saltation = *reset + (*reset * before - stage->field) * time;
    product = S.Empty() ? saltation : saltation * product;
    S.Insert(i);
  }
  return product;
}

Matrix EventMap::Cone(const std::vector<int>& order) const {
  const int n = size(), m = static_cast<int>(order.size());
  std::vector<Eigen::RowVectorXd> rows;
  Matrix carried = Matrix::Identity(n, n);  // w at this stage, moved to the time of the last event
  ContactMode S;
  const Stage* stage = &StageAt(S);
  for (int k = 0; k + 1 < m; ++k) {
    const Eigen::RowVectorXd first = TimeRow(order[k], *stage);
    const int last = decoupled_ ? k + 1 : m - 1;
    for (int l = k + 1; l <= last; ++l) {
      const Eigen::RowVectorXd row = (TimeRow(order[l], *stage) - first) * carried;
      if (row.norm() > 0) rows.push_back(row / row.norm());
    }
    const Vector field = stage->field;
    const Matrix* reset = nullptr;
    stage = &Activate(S, order[k], &reset);
    carried = *reset * (carried + field * (first * carried));
    S.Insert(order[k]);
  }
  Matrix cone(rows.size(), n);
  for (std::size_t r = 0; r < rows.size(); ++r) cone.row(r) = rows[r];
  return cone;
}

Matrix EventMap::Times(const std::vector<int>& order) const {
  const int n = size(), m = static_cast<int>(order.size());
  Matrix times(m, n);
  Matrix carried = Matrix::Identity(n, n);  // as in Cone
  Eigen::RowVectorXd elapsed = Eigen::RowVectorXd::Zero(n);
  ContactMode S;
  const Stage* stage = &StageAt(S);
  for (int k = 0; k < m; ++k) {
    const Eigen::RowVectorXd step = TimeRow(order[k], *stage) * carried;
    elapsed += step;
    times.row(k) = elapsed;
    const Vector field = stage->field;
    const Matrix* reset = nullptr;
    stage = &Activate(S, order[k], &reset);
    carried = *reset * (carried + field * step);
    S.Insert(order[k]);
  }
  return times;
}

std::vector<ContactMode> EventMap::Modes(const std::vector<int>& order) const {
  std::vector<ContactMode> modes;
  ContactMode S;
  for (int i : order) {
    const Matrix* reset = nullptr;
    modes.push_back(Activate(S, i, &reset).mode);
    S.Insert(i);
  }
  if (modes.empty()) modes.push_back(transition_.mode_after);
  return modes;
}

PiecewiseLinearMap EventMap::Pieces(int max_activations) const {
  const int m = num_activations();
  if (m > max_activations) {
    std::ostringstream message;
    message << m << " simultaneous activations at t = " << transition_.t << " s have " << m
            << "! pieces: all pieces are given for at most " << max_activations
            << " (max_activations_for_pieces); directions are not limited";
    throw std::length_error(message.str());
  }
  const std::vector<std::string>& names = system_->description().constraints;
  std::vector<LinearPiece> pieces;
  std::vector<int> order = activated_;
  do {
    LinearPiece piece;
    piece.matrix = Selection(order);
    piece.cone = Cone(order);
    std::vector<std::string> word;
    for (int i : order) word.push_back(names[i]);
    if (m > 0) piece.omega.push_back(word);
    piece.eta.push_back(transition_.mode_before.ToString(names));
    for (ContactMode mode : Modes(order)) piece.eta.push_back(mode.ToString(names));
    pieces.push_back(std::move(piece));
  } while (std::next_permutation(order.begin(), order.end()));
  return PiecewiseLinearMap(std::move(pieces));
}

Modularity EventMap::AssessModularity() const {
  const int m = num_activations();
  Modularity modularity;
  if (!status_.ok() || m > kMaxModularActivations) {
    modularity.defect = std::numeric_limits<double>::quiet_NaN();
    return modularity;
  }
  if (m < 2) return modularity;
  // F̂_S over subsets S of {0, …, m−1}: F_S carried through the resets of the activations not in S.
  const std::uint64_t all = (std::uint64_t{1} << m) - 1;
  const auto set_of = [&](std::uint64_t subset) {
    ContactMode S;
    for (int k = 0; k < m; ++k) {
      if (subset >> k & 1) S.Insert(activated_[k]);
    }
    return S;
  };
  const Matrix* reset = nullptr;
  for (std::uint64_t subset = 1; subset <= all; ++subset) {  // make every stage
    const int top = 63 - __builtin_clzll(subset);
    Activate(set_of(subset & ~(std::uint64_t{1} << top)), activated_[top], &reset);
  }
  std::vector<Vector> carried(all + 1);
  for (std::uint64_t subset = 0; subset <= all; ++subset) {
    ContactMode S = set_of(subset);
    carried[subset] = StageAt(S).field;
    for (int i : events_ - S) {
      Activate(S, i, &reset);
      carried[subset] = *reset * carried[subset];
      S.Insert(i);
    }
    modularity.scale = std::max(modularity.scale, carried[subset].cwiseAbs().maxCoeff());
  }
  for (std::uint64_t subset = 0; subset <= all; ++subset) {
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < i; ++j) {
        const std::uint64_t bi = std::uint64_t{1} << i, bj = std::uint64_t{1} << j;
        if (subset & (bi | bj)) continue;
        const Vector defect = carried[subset | bi | bj] - carried[subset | bi] -
                              carried[subset | bj] + carried[subset];
        modularity.defect = std::max(modularity.defect, defect.cwiseAbs().maxCoeff());
      }
    }
  }
  return modularity;
}

}  // namespace contact_flow
