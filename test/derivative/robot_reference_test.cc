// SPDX-License-Identifier: BSD-3-Clause
// The trots as URDF and YAML against the reference cases of the analytic models: the same events,
// states, modes and directional derivatives, seen through the change of coordinates.
#include <gtest/gtest.h>

#include "contact_flow/autodiff.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

using test::Names;
using test::ReferenceCase;
template <class S>
using State = Eigen::Matrix<S, Eigen::Dynamic, 1>;

/// The accuracies that the analytic models are held to at tolerance 1e-12 (reference_test.cc). The
/// change of coordinates of the hopping trot has derivatives of order 1, and adds nothing to them.
constexpr double kEventTime = 1e-11, kState = 1e-10, kDerivative = 1e-8;

/// State of the robot from that of the model, (q, v) by the names of the coordinates.
template <class S>
State<S> SoftBiped(const SystemDescription& model, const SystemDescription& robot,
                   const State<S>& x) {
  State<S> y(x.size());
  const auto d = static_cast<Eigen::Index>(model.coordinates.size());
  for (Eigen::Index i = 0; i < d; ++i) {
    for (Eigen::Index k = 0; k < d; ++k) {
      if (robot.coordinates[i] != model.coordinates[k]) continue;
      y(i) = x(k);
      y(d + i) = x(d + k);
    }
  }
  return y;
}

/// As HoppingTrot sees its legs: in the axes of the body, which the robot's pitch
/// turns the other way.
template <class S>
State<S> HoppingTrot(const SystemDescription&, const SystemDescription& robot, const State<S>& x) {
  using std::cos;
  using std::sin;
  const auto put = [&](const std::string& name, const S& q, const S& v, State<S>* y) {
    const auto it = std::find(robot.coordinates.begin(), robot.coordinates.end(), name);
    const auto i = it - robot.coordinates.begin();
    (*y)(i) = q;
    (*y)(7 + i) = v;
  };
  State<S> y(14);
  const S c = cos(x(6)), s = sin(x(6)), turn = x(13);
  put("base_x", x(0), x(7), &y);
  put("base_z", x(3), x(10), &y);
  put("base_pitch", -x(6), -turn, &y);
  for (int leg = 0; leg < 2; ++leg) {
    const S dx = x(1 + leg) - x(0), dz = x(4 + leg) - x(3);
    const S ux = x(8 + leg) - x(7), uz = x(11 + leg) - x(10);
    const S along = c * dx + s * dz, up = c * dz - s * dx;
    const std::string side = leg == 0 ? "left" : "right";
    put(side + "_lateral", along, c * ux + s * uz + turn * up, &y);
    put(side + "_leg", -up, s * ux - c * uz + turn * along, &y);
  }
  return y;
}

class RobotReference : public testing::TestWithParam<const char*> {
 protected:
  RobotReference()
      : reference(GetParam()), hops(std::string(GetParam()).compare(0, 7, "hopping") == 0) {
    ParameterValues values;
    for (const Parameter& parameter : reference.system->description().parameters) {
      values[parameter.name] = parameter.value;
    }
    if (hops) {
      values["left_offset"] = -values["hip_offset"];
      values["right_offset"] = values["hip_offset"];
      values["flywheel"] *= -1;
    } else {
      EXPECT_EQ(0.25, values["hip_offset"]) << "a place in the URDF, not a parameter";
    }
    values.erase("hip_offset");
    robot = LoadRobot(RobotFile(hops ? "hopping_trot" : "soft_biped"), values);
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    derivative_options.tolerance = 1e-12;
  }
  template <class S>
  State<S> ToRobot(const State<S>& x) const {
    const SystemDescription &model = reference.system->description(), &names = robot->description();
    return hops ? HoppingTrot(model, names, x) : SoftBiped(model, names, x);
  }
  /// The same tangent at x in the robot's coordinates.
  Vector ToRobot(const Vector& x, const Vector& w) const {
    using S = Dual<double, 1>;
    State<S> X(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      X(i) = S(x(i));
      X(i).d[0] = w(i);
    }
    const State<S> Y = ToRobot(X);
    Vector tangent(Y.size());
    for (Eigen::Index i = 0; i < Y.size(); ++i) tangent(i) = Y(i).d[0];
    return tangent;
  }
  Trajectory Run() const {
    return Simulate(*robot, ToRobot(State<double>(reference.x)), reference.u, reference.duration,
                    options);
  }

  ReferenceCase reference;
  const bool hops;
  std::unique_ptr<RobotSystem> robot;
  SimulateOptions options;
  BDerivativeOptions derivative_options;
};

TEST_P(RobotReference, EventsModesAndFinalState) {
  const Trajectory run = Run();
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(static_cast<std::size_t>(reference.event_times.size()), run.transitions.size());
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    EXPECT_NEAR(reference.event_times(k), run.transitions[k].t, kEventTime);
  }
  EXPECT_EQ(reference.modes, reference.NamesOf(run.ModeSequence()));
  const Vector expected = ToRobot(State<double>(reference.final_state));
  EXPECT_LE((run.FinalState() - expected).cwiseAbs().maxCoeff(), kState);
}

TEST_P(RobotReference, DirectionalDerivatives) {
  ASSERT_FALSE(reference.derivatives.empty());
  const BDerivative B = DifferentiateOutcome(*robot, Run(), derivative_options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const double scale = reference.DerivativeScale();
  for (const ReferenceCase::Derivative& d : reference.derivatives) {
    const Vector outcome = B(ToRobot(reference.x, d.direction));
    const Vector expected = ToRobot(reference.final_state, d.derivative);
    EXPECT_LE((outcome - expected).cwiseAbs().maxCoeff(), kDerivative * scale)
        << "direction " << d.direction.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Trots, RobotReference,
                         testing::Values("soft_biped_tilted", "soft_biped_simultaneous",
                                         "soft_biped_decoupled", "hopping_trot_stable",
                                         "hopping_trot_unstable"),
                         [](const testing::TestParamInfo<const char*>& info) {
                           return std::string(info.param);
                         });

/// Where the robot's coordinates are the model's, so are all numbers: M, f and both Jacobians, to
/// the rounding of some 100 operations.
TEST(RobotReference, SoftBipedIsTheModelNumberByNumber) {
  const auto model = MakeModel("soft_biped");
  const auto robot = LoadRobot(RobotFile("soft_biped"));
  EXPECT_TRUE(robot->HasConstantMass());
  EXPECT_TRUE(robot->HasAffineConstraints());
  std::srand(1);
  const SystemDescription &m = model->description(), &r = robot->description();
  Matrix P = Matrix::Zero(7, 7);  // y = P x
  for (int k = 0; k < 7; ++k) P.col(k) = SoftBiped<double>(m, r, Vector::Unit(14, k)).head(7);
  for (int trial = 0; trial < 100; ++trial) {
    const Vector x = model->nominal().x + 0.3 * Vector::Random(14);
    const Vector q = x.head(7), v = x.tail(7), a = Vector::Random(7), lambda = Vector::Random(2);
    Matrix M, N;
    Vector f, g;
    model->Dynamics(q, v, Vector(0), ContactMode(), &M, &f);
    robot->Dynamics(P * q, P * v, Vector(0), ContactMode(), &N, &g);
    EXPECT_LE((P * M * P.transpose() - N).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LE((P * f - g).cwiseAbs().maxCoeff(), 1e-13 * (1 + f.cwiseAbs().maxCoeff()));
    ResidualJacobian J, K;
    model->DifferentiateDynamics(q, v, Vector(0), ContactMode(), a, lambda, &J);
    robot->DifferentiateDynamics(P * q, P * v, Vector(0), ContactMode(), a, lambda, &K);
    const double scale = 1 + J.momentum_q.cwiseAbs().maxCoeff();
    EXPECT_LE((P * J.momentum_q * P.transpose() - K.momentum_q).cwiseAbs().maxCoeff(),
              1e-13 * scale);
    EXPECT_LE((P * J.momentum_v * P.transpose() - K.momentum_v).cwiseAbs().maxCoeff(),
              1e-13 * scale);
  }
}

}  // namespace
}  // namespace contact_flow
