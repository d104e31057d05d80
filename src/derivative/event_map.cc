// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/event_map.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"
#include "frictional_event.h"
#include "germ.h"
#include "input_cluster.h"

namespace contact_flow {
namespace {

/// First-order times that differ by less than this, relative, coincide.
constexpr double kTie = 1e-8;

}  // namespace

double EventMap::TimeTo(int i, const Stage& stage, const Vector& w) const {
  return -sparse_guards_.Dot(i, w) / sparse_guards_.Dot(i, stage.field);
}

Eigen::RowVectorXd EventMap::TimesTo(int i, const Stage& stage, const Matrix& W) const {
  Eigen::RowVectorXd times(W.cols());
  for (Eigen::Index c = 0; c < W.cols(); ++c) times(c) = -sparse_guards_.Dot(i, W.col(c));
  return times / sparse_guards_.Dot(i, stage.field);
}

Vector EventMap::operator()(const VectorRef& w) const {
  if (absorbed_) return w;
  if (friction_) return Vector(friction_->Follow(w).matrix * w);
  const Vector none = Vector::Zero(num_input_changes());
  return Germ(*this, Widen(w, none)).Run(nullptr).head(width());
}

Vector EventMap::operator()(const VectorRef& w, const VectorRef& dt) const {
  const auto c = static_cast<Eigen::Index>(absorbed_ ? 0 : num_input_changes());
  bool in_order = dt.size() == c && dt.allFinite();
  for (Eigen::Index k = 1; in_order && k < c; ++k) in_order = dt(k - 1) <= dt(k);
  if (!in_order) {
    std::ostringstream message;
    message << "at t = " << transition_.t << " s the input changes " << c
            << " times: as many changes of its instants are needed, none before the other";
    throw std::invalid_argument(message.str());
  }
  if (c == 0) return (*this)(w);
  if (friction_) {
    const FrictionalPath path = friction_->Follow(w, dt);
    return path.matrix * w + path.by_instants * dt;
  }
  return Germ(*this, Widen(w, dt)).Run(nullptr).head(width());
}

FrictionalPath EventMap::AnyPath() const { return friction_->Follow(Vector::Zero(width())); }

std::vector<PerturbedEvent> EventMap::PerturbedEvents(const VectorRef& w) const {
  std::vector<PerturbedEvent> events;
  if (absorbed_) return events;
  if (friction_) return friction_->Events(w);
  Germ(*this, Widen(w, Vector::Zero(num_input_changes()))).Run(&events);
  return events;
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
  const Status linear = PiecewiseLinear(order);
  if (!linear.ok()) throw NotPiecewiseLinear(linear.message);
  if (absorbed_) return Matrix::Identity(width(), width());
  if (friction_) return AnyPath().matrix;
  return WideSelection(order).topLeftCorner(width(), width());
}

Matrix EventMap::WideSelection(const std::vector<int>& order) const {
  const int n = size();
  Matrix product = Matrix::Identity(n, n);
  ConstraintSet S;
  const Stage* stage = &StageAt(S);
  for (int i : order) {
    // Ξ_i = DR + (F⁺ − DR F⁻) Dh / (Dh F⁻), and the row of τ is −Dh / (Dh F⁻).
    const Eigen::RowVectorXd time = TimesTo(i, *stage, product);
    const Stage& before = *stage;
    const ImpactReset* reset = nullptr;
    stage = &Activate(S, i, &reset);
    const Vector jump = *reset * before.field - stage->field;
    product = S.Empty() ? reset->matrix() : *reset * product;
    product += jump * time;
    S.Insert(i);
  }
  return product;
}

Matrix EventMap::Cone(const std::vector<int>& order) const {
  if (absorbed_) return Matrix(0, width());
  if (friction_) return AnyPath().cone;
  const int n = size(), m = static_cast<int>(order.size());
  std::vector<Eigen::RowVectorXd> rows;
  Matrix carried = Matrix::Identity(n, n);  // w at this stage, moved to the time of the last event
  ConstraintSet S;
  const Stage* stage = &StageAt(S);
  for (int k = 0; k + 1 < m; ++k) {
    const Eigen::RowVectorXd first = TimesTo(order[k], *stage, carried);
    const int last = decoupled_ ? k + 1 : m - 1;
    for (int l = k + 1; l <= last; ++l) {
      const Eigen::RowVectorXd row = (TimesTo(order[l], *stage, carried) - first).head(width());
      if (row.norm() > 0) rows.push_back(row / row.norm());
    }
    carried += stage->field * first;
    const ImpactReset* reset = nullptr;
    stage = &Activate(S, order[k], &reset);
    carried = *reset * carried;
    S.Insert(order[k]);
  }
  Matrix cone(rows.size(), width());
  for (std::size_t r = 0; r < rows.size(); ++r) cone.row(r) = rows[r];
  return cone;
}

Matrix EventMap::Times(const std::vector<int>& order) const {
  if (absorbed_) return Matrix(0, width());
  if (friction_) return AnyPath().times;
  return WideTimes(order).leftCols(width());
}

Matrix EventMap::WideTimes(const std::vector<int>& order) const {
  const int n = size(), m = static_cast<int>(order.size());
  Matrix times(m, n);
  Matrix carried = Matrix::Identity(n, n);  // as in Cone
  Eigen::RowVectorXd elapsed = Eigen::RowVectorXd::Zero(n);
  ConstraintSet S;
  const Stage* stage = &StageAt(S);
  for (int k = 0; k < m; ++k) {
    const Eigen::RowVectorXd step = TimesTo(order[k], *stage, carried);
    elapsed += step;
    times.row(k) = elapsed;
    if (k + 1 == m) break;
    carried += stage->field * step;
    const ImpactReset* reset = nullptr;
    stage = &Activate(S, order[k], &reset);
    carried = *reset * carried;
    S.Insert(order[k]);
  }
  return times;
}

std::vector<PieceTimes> EventMap::TimesOfPieces(int max_activations) const {
  if (friction_) return friction_->Times();
  if (num_activations() > max_activations) return {};
  std::vector<PieceTimes> times;
  std::vector<int> order = activated_;
  do {
    if (IsOrder(order)) times.push_back({order, Times(order)});
  } while (std::next_permutation(order.begin(), order.end()));
  return times;
}

std::vector<ContactMode> EventMap::Modes(const std::vector<int>& order) const {
  if (friction_) return AnyPath().modes;
  std::vector<ContactMode> modes;
  ConstraintSet S;
  for (int i : order) {
    const ImpactReset* reset = nullptr;
    modes.push_back(Activate(S, i, &reset).mode);
    S.Insert(i);
  }
  if (modes.empty()) modes.push_back(transition_.mode_after);
  return modes;
}

PiecewiseLinearMap EventMap::Pieces(int max_activations) const {
  if (absorbed_) return PiecewiseLinearMap::Linear(Matrix::Identity(width(), width()));
  if (friction_) return friction_->Map();
  const int m = num_activations();
  if (m > max_activations) {
    std::ostringstream message;
    message << m << " simultaneous activations at t = " << transition_.t << " s have " << m
            << "! pieces: all pieces are given for at most " << max_activations
            << " (max_activations_for_pieces); directions are not limited";
    throw std::length_error(message.str());
  }
  const std::vector<std::string>& names = system_->description().constraints;
  double count = 1;
  for (int i = num_input_changes() + 1; i <= m; ++i) count *= i;
  const double n = size();
  AskMemory(count * 8 * n * (n + (decoupled_ ? m : m * m / 2)),
            std::to_string(static_cast<long>(count)) + " pieces of a cluster of " +
                std::to_string(m) + " contacts");
  BudgetStage stage("the pieces of a cluster", static_cast<std::size_t>(count));
  std::vector<LinearPiece> pieces;
  std::vector<int> order = activated_;
  do {
    AskBudget();
    if (!IsOrder(order)) continue;
    stage.Next();
    LinearPiece piece;
    piece.matrix = Selection(order);
    piece.cone = Cone(order);
    std::vector<std::string> word;
    for (int i : order) word.push_back(IsInputChange(i) ? kInputChange : names[i]);
    if (m > 0) piece.omega.push_back(word);
    piece.eta.push_back(transition_.mode_before.ToString(names));
    piece.words.push_back(transition_.mode_before.Word(static_cast<int>(names.size())));
    for (ContactMode mode : Modes(order)) {
      piece.eta.push_back(mode.ToString(names));
      piece.words.push_back(mode.Word(static_cast<int>(names.size())));
    }
    pieces.push_back(std::move(piece));
  } while (std::next_permutation(order.begin(), order.end()));
  return PiecewiseLinearMap(std::move(pieces));
}

}  // namespace contact_flow
