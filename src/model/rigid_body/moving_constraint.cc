// SPDX-License-Identifier: BSD-3-Clause
#include "moving_constraint.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace contact_flow {
namespace {

constexpr int kMost = 18;         // numbers of z
constexpr double kAcross = 1e-9;  // sine of an angle that rounding leaves

/// g · s over points: s is what each of them is displaced by.
double Along(const double* g, const Vec3<double>& s, int numbers) {
  double sum = 0;
  for (int k = 0; k < numbers; ++k) sum += g[k] * s(k % 3);
  return sum;
}

}  // namespace

/// y, ẏ and ÿ with the turns behind, and what they come from.
struct MovingConstraint::Relative {
  Relative(const MovingConstraint& of, const double* z, const double* rate,
           const double* acceleration)
      : s(of.motion_.At(z[of.clock()])) {
    const int c = of.clock(), size = of.slip_size();
    if (rate != nullptr) pace = rate[c];
    if (acceleration != nullptr) bend = acceleration[c];
    const Vec3<double> speed = pace * s[1], push = (pace * pace) * s[2] + bend * s[1];
    for (int k = 0; k < size - 1; ++k) {
      const bool point = k < c;
      const int from = point ? k : k + 1;
      y[k] = point ? z[from] - s[0](k % 3) : 0;
      y_rate[k] = rate == nullptr ? 0 : point ? rate[from] - speed(k % 3) : rate[from];
      y_bend[k] = acceleration == nullptr ? 0
                  : point                 ? acceleration[from] - push(k % 3)
                                          : acceleration[from];
    }
  }

  const std::array<Vec3<double>, 4> s;  // with its derivatives
  double pace = 0, bend = 0;            // ṫ, ẗ
  double y[kMost] = {}, y_rate[kMost] = {}, y_bend[kMost] = {};
};

/// Rows over y as rows over z, with what they have at the clock.
template <class AtClock>
void MovingConstraint::Widen(const double* rows, AtClock at_clock, double* wide) const {
  const int c = clock(), m = slip_size();
  for (int r = 0; r < slip.rows; ++r) {
    const double* row = rows + r * (m - 1);
    double* to = wide + r * m;
    std::copy_n(row, c, to);
    to[c] = at_clock(row, r);
    std::copy_n(row + c, m - 1 - c, to + c + 1);
  }
}

MovingConstraint::MovingConstraint(std::unique_ptr<ConstraintElement> still, SurfaceMotion motion,
                                   const RobotModel::Coordinate& clock)
    : still_(std::move(still)), motion_(std::move(motion)) {
  parts = still_->parts;
  if (!parts.joints.empty() || !parts.turns.empty()) {
    throw std::logic_error("a surface that moves is met by points");
  }
  parts.joints = {clock};
  for (const Parameter& number : SurfaceMotion::Numbers()) {
    parts.numbers.push_back(number);
    parts.ranges.push_back(Range::kAny);
  }
}

void MovingConstraint::TakeNumbers() {
  std::vector<Parameter>& own = still_->parts.numbers;
  for (std::size_t k = 0; k < own.size(); ++k) own[k].value = parts.numbers[k].value;
  for (int k = 0; k < SurfaceMotion::kNumbers; ++k) {
    motion_.SetNumber(k, parts.numbers[own.size() + static_cast<std::size_t>(k)].value);
  }
}

void MovingConstraint::AddFriction(const SlipFrame& frame) {
  if (frame.rows == 1 && std::abs(frame.plane.dot(motion_.Direction())) > kAcross) {
    throw std::invalid_argument(
        "the surface moves out of the plane in which the robot stays, and "
        "drags it there: give `motion` a direction in that plane, or the "
        "robot freedom across it");
  }
  still_->AddFriction(frame);
  slip = frame;
  parts.turns = still_->parts.turns;
}

double MovingConstraint::Gap(const double* z, double* gradient) const {
  const Relative at(*this, z, nullptr, nullptr);
  const double gap = still_->Gap(at.y, gradient);
  gradient[clock()] = -Along(gradient, at.s[1], clock());
  return gap;
}

double MovingConstraint::Curvature(const double* z, const double* rate) const {
  const Relative at(*this, z, rate, nullptr);
  double gradient[kMost];
  still_->Gap(at.y, gradient);
  return still_->Curvature(at.y, at.y_rate) - at.pace * at.pace * Along(gradient, at.s[2], clock());
}

void MovingConstraint::Differentiate(const double* z, const double* rate,
                                     const double* acceleration, double lambda, double* hessian,
                                     double* by_z, double* by_rate) const {
  const Relative at(*this, z, rate, acceleration);
  const int c = clock(), n = c + 1;
  const auto& s = at.s;
  double gradient[kMost], H[kMost * kMost], by_y[kMost], by_y_rate[kMost];
  still_->Gap(at.y, gradient);
  still_->Differentiate(at.y, at.y_rate, at.y_bend, lambda, H, by_y, by_y_rate);
  double corner = -lambda * Along(gradient, s[2], c);
  for (int k = 0; k < c; ++k) {
    std::copy_n(H + k * c, c, hessian + k * n);
    const double across = Along(H + k * c, s[1], c);  // H is symmetric
    hessian[c + k * n] = hessian[k + c * n] = -across;
    corner += s[1](k % 3) * across;
  }
  hessian[c + c * n] = corner;
  std::copy_n(by_y, c, by_z);
  std::copy_n(by_y_rate, c, by_rate);
  const Vec3<double> speed = at.pace * s[2], push = (at.pace * at.pace) * s[3] + at.bend * s[2];
  by_z[c] = -Along(by_y, s[1], c) - Along(by_y_rate, speed, c) - Along(gradient, push, c);
  by_rate[c] = -Along(by_y_rate, s[1], c) - 2 * Along(gradient, speed, c);
}

ConstraintElement::ByNumber MovingConstraint::DifferentiateByNumber(const double* z,
                                                                    const double* rate,
                                                                    const double* acceleration,
                                                                    int k, double* gradient) const {
  const Relative at(*this, z, rate, acceleration);
  const int c = clock(), own = static_cast<int>(still_->parts.numbers.size());
  if (k < own) {
    const ByNumber by = still_->DifferentiateByNumber(at.y, at.y_rate, at.y_bend, k, gradient);
    gradient[c] = -Along(gradient, at.s[1], c);
    return by;
  }
  const std::array<Vec3<double>, 3> e = motion_.ByNumber(z[c], k - own);
  double g[kMost], H[kMost * kMost], by_y[kMost], by_y_rate[kMost];
  still_->Gap(at.y, g);
  still_->Differentiate(at.y, at.y_rate, at.y_bend, 1, H, by_y, by_y_rate);
  gradient[c] = -Along(g, e[1], c);
  for (int i = 0; i < c; ++i) {
    gradient[i] = -Along(H + i * c, e[0], c);
    gradient[c] -= gradient[i] * at.s[1](i % 3);
  }
  const Vec3<double> speed = at.pace * e[1], push = (at.pace * at.pace) * e[2] + at.bend * e[1];
  return {-Along(g, e[0], c),
          -Along(by_y, e[0], c) - Along(by_y_rate, speed, c) - Along(g, push, c)};
}

void MovingConstraint::SlipMap(const double* z, double* map) const {
  const Relative at(*this, z, nullptr, nullptr);
  double W[2 * kMost];
  still_->SlipMap(at.y, W);
  Widen(
      W, [&](const double* row, int) { return -Along(row, at.s[1], clock()); }, map);
}

void MovingConstraint::SlipRate(const double* z, const double* rate, const double* acceleration,
                                double* slip_rate) const {
  const Relative at(*this, z, rate, acceleration);
  still_->SlipRate(at.y, at.y_rate, at.y_bend, slip_rate);
}

void MovingConstraint::SlipHessian(const double* z, const double* lambda, double* hessian) const {
  const Relative at(*this, z, nullptr, nullptr);
  const int c = clock(), m = slip_size(), inner = m - 1;
  double H[kMost * kMost], W[2 * kMost];
  still_->SlipMap(at.y, W);
  still_->SlipHessian(at.y, lambda, H);
  // Of (Wᵀλ, −ṡ·Wᵀλ), by y and by t.
  double corner = 0;
  for (int r = 0; r < slip.rows; ++r) corner -= lambda[r] * Along(W + r * inner, at.s[2], c);
  for (int k = 0; k < inner; ++k) {
    const int column = k < c ? k : k + 1;
    double by_clock = 0;
    for (int j = 0; j < inner; ++j) {
      hessian[(j < c ? j : j + 1) + column * m] = H[j + k * inner];
      if (j < c) by_clock += H[k + j * inner] * at.s[1](j % 3);
    }
    const double across = Along(H + k * inner, at.s[1], c);
    hessian[c + column * m] = -across;
    hessian[column + c * m] = -by_clock;
    if (k < c) corner += across * at.s[1](k % 3);
  }
  hessian[c + c * m] = corner;
}

void MovingConstraint::DifferentiateSlip(const double* z, const double* rate,
                                         const double* acceleration, double* rate_z,
                                         double* rate_rate, double* slip_z) const {
  const Relative at(*this, z, rate, acceleration);
  const int c = clock(), inner = slip_size() - 1;
  double W[2 * kMost], by_y[2 * kMost], by_y_rate[2 * kMost], slip_y[2 * kMost];
  still_->SlipMap(at.y, W);
  still_->DifferentiateSlip(at.y, at.y_rate, at.y_bend, by_y, by_y_rate, slip_y);
  const Vec3<double> speed = at.pace * at.s[2],
                     push = (at.pace * at.pace) * at.s[3] + at.bend * at.s[2];
  const auto of = [&](const double* rows, int r) { return rows + r * inner; };
  Widen(
      by_y,
      [&](const double* row, int r) {
        return -Along(row, at.s[1], c) - Along(of(by_y_rate, r), speed, c) -
               Along(of(W, r), push, c);
      },
      rate_z);
  Widen(
      by_y_rate,
      [&](const double* row, int r) {
        return -Along(row, at.s[1], c) - 2 * Along(of(W, r), speed, c);
      },
      rate_rate);
  Widen(
      slip_y,
      [&](const double* row, int r) { return -Along(row, at.s[1], c) - Along(of(W, r), speed, c); },
      slip_z);
}

void MovingConstraint::DifferentiateSlipByNumber(const double* z, const double* rate,
                                                 const double* acceleration, int k, double* map,
                                                 double* slip_rate) const {
  const Relative at(*this, z, rate, acceleration);
  const int c = clock(), inner = slip_size() - 1;
  const int own = static_cast<int>(still_->parts.numbers.size());
  double W[2 * kMost];
  if (k < own) {
    still_->DifferentiateSlipByNumber(at.y, at.y_rate, at.y_bend, k, W, slip_rate);
    Widen(
        W, [&](const double* row, int) { return -Along(row, at.s[1], c); }, map);
    return;
  }
  const std::array<Vec3<double>, 3> e = motion_.ByNumber(z[c], k - own);
  const Vec3<double> speed = at.pace * e[1], push = (at.pace * at.pace) * e[2] + at.bend * e[1];
  double by_y[2 * kMost], by_y_rate[2 * kMost], slip_y[2 * kMost], change[2 * kMost] = {};
  still_->SlipMap(at.y, W);
  still_->DifferentiateSlip(at.y, at.y_rate, at.y_bend, by_y, by_y_rate, slip_y);
  for (int r = 0; r < slip.rows; ++r) {
    const double* row = W + r * inner;
    slip_rate[r] = -Along(by_y + r * inner, e[0], c) - Along(by_y_rate + r * inner, speed, c) -
                   Along(row, push, c);
    const double lambda[] = {r == 0 ? 1. : 0., r == 1 ? 1. : 0.};
    double H[kMost * kMost];
    still_->SlipHessian(at.y, lambda, H);  // ∂(row)/∂y
    for (int j = 0; j < inner; ++j) {
      for (int i = 0; i < c; ++i) change[r * inner + j] -= H[j + i * inner] * e[0](i % 3);
    }
  }
  Widen(
      change,
      [&](const double* row, int r) {
        return -Along(row, at.s[1], c) - Along(W + r * inner, e[1], c);
      },
      map);
}

void MovingConstraint::Place(const double* z, Vec3<double>* arm, Vec3<double>* push) const {
  const Relative at(*this, z, nullptr, nullptr);
  still_->Place(at.y, arm, push);
}

void MovingConstraint::Across(const double* z, double* coordinates) const {
  const Relative at(*this, z, nullptr, nullptr);
  still_->Across(at.y, coordinates);
}

SurfacePassage MovingConstraint::Passage(const double* z, const double* rate) const {
  const Relative at(*this, z, rate, nullptr);
  return still_->Passage(at.y, at.y_rate);
}

}  // namespace contact_flow
