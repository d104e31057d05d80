// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

/// Random runs in which the input changes at touchdowns.
namespace contact_flow {
namespace test {

/// Two bodies above floors of their own, pushed by two inputs each of which moves both, with a
/// force that depends on all velocities and, when `bend` is not 0, on their squares; a third body
/// that rests on the ground or flies.
struct PushedBodies : UnitMasses<3, 3> {
  static constexpr const char* kName = "pushed_bodies";
  static constexpr int kInputs = 2;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "y", "z"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"first", "second", "third"};
  static constexpr std::array<const char*, 2> kInputNames = {"f", "g"};
  template <class P>
  struct Parameters {
    P first = 0, second = 0, bend = 0.3, coupling = 0.5, sink = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(first, "first", "", "restitution", Range::kUnitInterval);
      visit(second, "second", "", "restitution", Range::kUnitInterval);
      visit(bend, "bend", "", "quadratic force", Range::kAny);
      visit(coupling, "coupling", "", "of the velocities", Range::kAny);
      visit(sink, "sink", "m", "by which the second floor is lower", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 2, 1>& u,
                    Eigen::Matrix<S, 3, 1>* f) {
    const S difference = v(0) - v(1);
    (*f)(0) = -9.8 + u(0) + 0.3 * u(1) - p.coupling * difference + p.bend * v(2) * v(2);
    (*f)(1) = -9.8 + u(1) - 0.2 * u(0) + p.coupling * difference - 0.5 * q(0);
    (*f)(2) = -1.0 + 0.4 * u(0) + p.bend * difference * difference;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 3, 1>* a) {
    *a = q;
    (*a)(1) += p.sink;
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.first : i == 1 ? p.second : P(0.0);
  }
};

using Bodies = ModelSystem<PushedBodies>;

inline ParameterValues Named(const PushedBodies::Parameters<double>& p) {
  return {{"first", p.first},
          {"second", p.second},
          {"bend", p.bend},
          {"coupling", p.coupling},
          {"sink", p.sink}};
}

inline SimulateOptions WithSimultaneity(double simultaneity) {
  SimulateOptions options = AtTolerance(1e-13);
  options.simultaneity_tolerance = simultaneity;
  return options;
}

/// One random coincidence.
struct Case {
  enum Kind { kOneContact, kTwoContacts, kTwoChanges };
  Kind kind = kOneContact;
  std::unique_ptr<MechanicalSystem> system;
  Vector x;
  InputSchedule schedule;
  double duration = 0;
};

/// The first touchdown of `i` under the first input.
inline const Transition* Touchdown(const Trajectory& run, int i) {
  for (const Transition& transition : run.transitions) {
    if (transition.activated.Contains(i)) return &transition;
  }
  return nullptr;
}

class RandomCase {
 public:
  explicit RandomCase(int seed) : random_(static_cast<unsigned>(seed)), kind_(seed % 3) {}

  Case Make() {
    for (;;) {
      Case made;
      if (Try(&made)) return made;
    }
  }

 private:
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  bool Try(Case* made) {
    made->kind = static_cast<Case::Kind>(kind_);
    PushedBodies::Parameters<double> p;
    p.first = Uniform(0, 1) < 0.5 ? 0 : Uniform(0.2, 0.9);
    p.second = Uniform(0, 1) < 0.5 ? 0 : Uniform(0.2, 0.9);
    p.bend = Uniform(-0.3, 0.3);
    p.coupling = Uniform(-1, 1);
    Vector x(6);
    x << Uniform(0.3, 1), 5, Uniform(0, 1) < 0.5 ? 0 : Uniform(1, 2), Uniform(-1, 1),
        Uniform(-1, 1), 0;
    std::vector<Vector> u;
    for (int k = 0; k < 4; ++k) u.push_back(Vector::NullaryExpr(2, [&] { return Uniform(-2, 2); }));
    const double early = 0.1;
    if (made->kind == Case::kTwoContacts) {
      // The second body falls onto its floor when the first does: by the secant method.
      p.sink = 100;
      double last = 0, last_gap = 0, height = 0.6;
      for (int i = 0; i < 60; ++i) {
        x(1) = height;
        const Bodies free(Named(p));
        const Trajectory run =
            Simulate(free, x, {{0, early}, {u[0], u[1]}}, 2, WithSimultaneity(0));
        const Transition* hit = Touchdown(run, 0);
        if (hit == nullptr || hit->t < early + 0.02) return false;
        const double gap = hit->x_minus(1);
        if (hit->x_minus(4) > -0.3) return false;
        if (std::abs(gap) < 1e-15) break;
        const double slope = i == 0 ? 1 : (gap - last_gap) / (height - last);
        last = height;
        last_gap = gap;
        if (!(std::abs(slope) > 1e-3)) break;
        height -= gap / slope;
      }
      if (std::abs(last_gap) > 1e-13) return false;
      p.sink = 0;
    }
    made->system = std::make_unique<Bodies>(Named(p));
    made->x = x;
    const Trajectory run =
        Simulate(*made->system, x, {{0, early}, {u[0], u[1]}}, 1.5, WithSimultaneity(1e-12));
    const Transition* hit = Touchdown(run, 0);
    if (hit == nullptr || hit->t < early + 0.02 || hit->x_minus(3) > -0.3) return false;
    made->schedule = {{0, early, hit->t}, {u[0], u[1], u[2]}};
    if (made->kind == Case::kTwoChanges) {
      made->schedule.grid.push_back(hit->t + 1e-11);
      made->schedule.values.push_back(u[3]);
    }
    made->duration = hit->t + 0.1;
    return true;
  }

  std::mt19937 random_;
  int kind_;
};

inline Vector Outcome(const Case& c, const Vector& dx, const Matrix& du, const Vector& dt,
                      double alpha) {
  InputSchedule schedule = c.schedule;
  for (std::size_t k = 0; k < schedule.values.size(); ++k) {
    schedule.values[k] += alpha * du.col(static_cast<Eigen::Index>(k));
    if (k > 0 && dt.size() > 0) schedule.grid[k] += alpha * dt(static_cast<Eigen::Index>(k) - 1);
  }
  const Trajectory run =
      Simulate(*c.system, c.x + alpha * dx, schedule, c.duration, WithSimultaneity(1e-13));
  EXPECT_TRUE(run.status.ok()) << run.status.message;
  return run.FinalState();
}

}  // namespace test
}  // namespace contact_flow
