// SPDX-License-Identifier: BSD-3-Clause
// Two hours of hopping, at full speed: nothing grows, and the energy budget is closed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <map>

#include "contact_flow/flow/online_flow.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// Resident memory of this process [bytes].
long ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  file >> total >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

/// The trot's energy and the power of what is not conservative, written out by leg in
/// polar coordinates.
class TrotEnergy {
 public:
  explicit TrotEnergy(const MechanicalSystem& system) : system_(system) {
    for (const Parameter& p : system.description().parameters) p_[p.name] = p.value;
  }

  double Kinetic(const Vector& v) const {
    const double feet = v(1) * v(1) + v(2) * v(2) + v(4) * v(4) + v(5) * v(5);
    return 0.5 * (p_.at("body_mass") * (v(0) * v(0) + v(3) * v(3)) + p_.at("foot_mass") * feet +
                  p_.at("body_inertia") * v(6) * v(6));
  }

  double Total(const Vector& x) const {
    double energy = Kinetic(x.tail(7)) + p_.at("gravity") * (p_.at("body_mass") * x(3) +
                                                             p_.at("foot_mass") * (x(4) + x(5)));
    for (int leg = 0; leg < 2; ++leg) {
      const Leg l = At(x, leg);
      energy += 0.5 * p_.at("axial_stiffness") * l.stretch * l.stretch +
                0.5 * p_.at("lateral_stiffness") * l.sway * l.sway;
    }
    return energy;
  }

  /// Pushes, dampers and the flywheel [W].
  double Power(const Vector& x) const {
    const Vector v = x.tail(7);
    double power = p_.at("flywheel") * (v(4) - v(5)) * (v(4) - v(5)) * v(6);
    for (int leg = 0; leg < 2; ++leg) {
      const Leg l = At(x, leg);
      const double strain = l.stretch / p_.at("leg_length");
      const double scale = p_.at("push_strain");
      const double push = p_.at("push") * std::tanh(l.stretch_rate / p_.at("push_rate")) * strain *
                          strain / (strain * strain + scale * scale);
      power += push * l.stretch_rate - p_.at("axial_damping") * l.stretch_rate * l.stretch_rate -
               p_.at("lateral_damping") * l.sway_rate * l.sway_rate;
    }
    return power;
  }

 private:
  struct Leg {
    double stretch, stretch_rate, sway, sway_rate;
  };

  /// The foot as a complex number in the body frame: (foot − body) e^{−iθ}.
  Leg At(const Vector& x, int leg) const {
    const double cosine = std::cos(x(6)), sine = std::sin(x(6));
    const double dx = x(1 + leg) - x(0), dz = x(4 + leg) - x(3);
    const double ux = x(8 + leg) - x(7), uz = x(11 + leg) - x(10), spin = x(13);
    const double along = cosine * dx + sine * dz, up = -sine * dx + cosine * dz;
    const double along_rate = cosine * ux + sine * uz + spin * up;
    const double up_rate = -sine * ux + cosine * uz - spin * along;
    const double hip = (leg == 0 ? -1 : 1) * p_.at("hip_offset");
    return {-up - p_.at("leg_length"), -up_rate, along - hip, along_rate};
  }

  const MechanicalSystem& system_;
  std::map<std::string, double> p_;
};

TEST(LongRun, TwoHoursOfHopping) {
  const std::shared_ptr<const MechanicalSystem> system = MakeModel("hopping_trot");
  const TrotEnergy energy(*system);
  constexpr double kHours = 2 * 3600, kStride = 0.01;
  // Gauss–Legendre with three nodes: order 6.
  const double nodes[3] = {0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)};
  const double weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

  OnlineFlow run(system, 0, system->nominal().x, system->nominal().u, {});
  run.KeepMotion(true);
  const double begin = energy.Total(run.State());
  double work = 0, throughput = 0, lost = 0;
  long events = 0, memory = 0, resident_after_minute = 0;
  double last = 0;
  while (run.now() < kHours) {
    // To the end of the stride or to the next event: in between the power is smooth.
    const bool passed = run.AdvanceTo(std::min(kHours, last + kStride));
    ASSERT_TRUE(run.status().ok()) << run.status().message;
    const Arc motion = run.Motion();
    const double length = run.now() - last;
    Vector x(14);
    for (int i = 0; i < 3 && length > 0; ++i) {
      motion.dense.Evaluate(last + nodes[i] * length, x.data());
      const double power = energy.Power(x);
      work += weights[i] * length * power;
      throughput += weights[i] * length * std::abs(power);
    }
    if (passed) {
      const Transition& event = run.transition();
      const double loss =
          energy.Kinetic(event.x_minus.tail(7)) - energy.Kinetic(event.x_plus.tail(7));
      ASSERT_GE(loss, -1e-12) << "an impact creates energy at " << event.t;
      lost += loss;
      throughput += loss;
      ++events;
    }
    last = run.now();
    run.Forget();
    if (resident_after_minute == 0 && run.now() > 60) resident_after_minute = ResidentBytes();
  }
  memory = ResidentBytes() - resident_after_minute;
  const double end = energy.Total(run.State());
  const double gap = end - begin - work + lost;
  std::printf(
      "%ld events, %ld steps, energy %.6f J -> %.6f J, work %.6f J, impacts %.6f J, "
      "unaccounted %.1e J (%.1e of what passed through), memory %+ld kB\n",
      events, run.statistics().steps, begin, end, work, -lost, gap, gap / throughput,
      memory / 1024);
  EXPECT_GE(events, 10000);
  EXPECT_TRUE(run.State().allFinite());
  // Each step may be wrong by 1e-9 in the state, and by about 10 N times that in energy.
  EXPECT_LT(std::abs(gap), 1e-8 * static_cast<double>(run.statistics().steps));
  EXPECT_LT(std::abs(gap) / throughput, 1e-7);
#ifndef CONTACT_FLOW_SANITIZED  // which keeps for a while what is freed
  EXPECT_LT(memory, 1 << 20);
#endif
}

}  // namespace
}  // namespace contact_flow
