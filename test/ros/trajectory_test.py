#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""optimize_trajectory: the ball of the hybrid-iLQR literature, watched, cancelled, refused, recorded; and from the command line."""
import math
import os
import subprocess
import time
import unittest

import actionlib
import rospy
import rostest
import yaml
from actionlib_msgs.msg import GoalStatus
from client import Client, executable
from contact_flow.msg import (
    InitialState, InputGrid, OptimizeTrajectoryAction, OptimizeTrajectoryGoal, OptimizeTrajectoryResult,
    RowMajorMatrix, RunCondition, TrajectoryRequest)

COUNT, STEP = 251, 0.004


def ball(start=-20.0, **fields):
    """From 4 m at rest to rest in 1 m, with one bounce: R Σ u² + 100 |error|², R = 5e-7/0.004."""
    request = TrajectoryRequest(
        duration=COUNT * STEP, input=[start], input_grid=InputGrid(times=[k * STEP for k in range(COUNT)]),
        effort=[5e-7 / STEP ** 2], outcomes=["z", "d/dt z"], targets=[1, 0], weights=[100, 100])
    for name, value in fields.items():
        setattr(request, name, value)
    return request


class Trajectory(unittest.TestCase):
    def setUp(self):
        self.feedback = []
        self.action = actionlib.SimpleActionClient("ball/optimize_trajectory", OptimizeTrajectoryAction)
        self.assertTrue(self.action.wait_for_server(rospy.Duration(20)))

    def send(self, request):
        self.action.send_goal(OptimizeTrajectoryGoal(request=request), feedback_cb=self.feedback.append)

    def wait(self):
        self.assertTrue(self.action.wait_for_result(rospy.Duration(120)))
        return self.action.get_result()

    def ask(self, request):
        self.send(request)
        return self.wait()

    def ask_what_is_refused(self, request):
        """actionlib's client does not know of a result that comes before its send_goal has returned ("a goal handle
        that we're not tracking"): asked again then."""
        for _ in range(5):
            self.send(request)
            if self.action.wait_for_result(rospy.Duration(5)):
                return self.action.get_result()
        return self.wait()

    def await_feedback(self, holds):
        """Feedback comes on a topic of its own, maybe behind the result."""
        deadline = time.monotonic() + 5
        while not holds(self.feedback[-1]) and time.monotonic() < deadline:
            time.sleep(0.02)

    def test_a_valley_with_its_certificate(self):
        result = self.ask(ball())
        self.assertTrue(result.success, result.message)
        self.assertEqual(result.outcome, OptimizeTrajectoryResult.VALLEY, result.message)
        found = result.result
        # The impact is on change 177, the cost that of the closed form.
        self.assertAlmostEqual(found.cost, 2.1560831956, places=8)
        self.assertEqual(sorted(piece.label for piece in found.pieces),
                         ["floor, input change", "input change, floor"])
        slopes = {piece.label: piece.slopes[0] for piece in found.pieces}
        self.assertAlmostEqual(slopes["floor, input change"], 2.7817, places=3)
        self.assertAlmostEqual(slopes["input change, floor"], 10.7122, places=3)
        self.assertLess(found.hull_distance, 1e-9)
        self.assertGreater(len(self.feedback), 1)
        self.assertEqual(len(self.feedback[-1].best), COUNT)
        self.await_feedback(lambda last: last.least <= found.cost + 1e-9)
        self.assertAlmostEqual(self.feedback[-1].least, found.cost, places=9)
        # The run of what was found has the outcome that is told.
        run = Client("ball").simulate(duration=COUNT * STEP, input_grid=found.inputs)
        self.assertAlmostEqual(run.trajectory.final_q[0], found.final_q[0], places=7)

    def test_neighbours_find_the_lowest_valley(self):
        result = self.ask(ball(neighbours=True))
        self.assertEqual(result.outcome, OptimizeTrajectoryResult.VALLEY, result.message)
        self.assertAlmostEqual(result.result.cost, 2.142216895, places=8)
        self.assertIn("neighbour", [iterate.kink for iterate in result.result.iterations])

    def test_conditions(self):
        """At rest in 1 m exactly, the floor met at 0.65 s; the costs are in test/trajectory_optimization/conditions_test.cc."""
        request = ball(duration=1, input_grid=InputGrid(times=[k / 50 for k in range(50)]), outcomes=[], targets=[], weights=[],
                       conditions=[RunCondition(name="z", lower=1, upper=1), RunCondition(name="d/dt z", lower=0, upper=0),
                                   RunCondition(name="floor", touchdown=True, lower=0.65, upper=0.65)])
        result = self.ask(request)
        self.assertTrue(result.success, result.message)
        self.assertIn(result.outcome, (OptimizeTrajectoryResult.SMOOTH_MINIMUM, OptimizeTrajectoryResult.VALLEY), result.message)
        found = result.result
        for value, goal in zip(found.condition_values, (1, 0, 0.65)):
            self.assertAlmostEqual(value, goal, places=7)
        self.assertEqual(len(found.multipliers), 3)
        self.assertLess(found.iterations[-1].violation, 1e-7)

    def test_parameters_and_durations(self):
        """The restitution by which a falling ball is at 0.5 m at 1.004 s, and at 0.6 m by a longer way."""
        request = TrajectoryRequest(
            duration=COUNT * STEP, keep_inputs=True, parameters=["restitution"], parameter_lower=[0], parameter_upper=[1],
            conditions=[RunCondition(name="z", lower=0.5, upper=0.5)])
        fall = (8 / 9.8) ** 0.5
        rest = COUNT * STEP - fall
        found = self.ask(request).result
        self.assertAlmostEqual(found.parameters[0], (0.5 + 4.9 * rest ** 2) / (9.8 * fall * rest), places=6)
        request.parameters, request.parameter_lower, request.parameter_upper = [], [], []
        request.durations = [0]
        request.conditions[0].lower = request.conditions[0].upper = 0.6
        found = self.ask(request).result
        rest = found.duration - fall
        self.assertAlmostEqual(0.7 * 9.8 * fall * rest - 4.9 * rest ** 2, 0.6, places=6)

    def test_elastic_collision(self):
        """A disc pushes another to the origin: the closed form of test/trajectory_optimization/elastic_test.cc."""
        discs = actionlib.SimpleActionClient("discs/optimize_trajectory", OptimizeTrajectoryAction)
        self.assertTrue(discs.wait_for_server(rospy.Duration(20)))
        request = TrajectoryRequest(
            input_grid=InputGrid(times=[k / 24 for k in range(24)]), effort=[0.01, 0.01], outcomes=["x2", "y2"],
            targets=[0, 0], neighbours=True)
        discs.send_goal(OptimizeTrajectoryGoal(request=request))
        self.assertTrue(discs.wait_for_result(rospy.Duration(120)))
        result = discs.get_result()
        self.assertTrue(result.success, result.message)
        self.assertAlmostEqual(result.result.cost, 0.311849942, places=7)

    def test_double_collision(self):
        """The other disc bounces off the wall and is stopped by a second collision: the least cost over the three instants,
        0.381143, 1.020583 and 1.658868 s, of the linear system of equations for its inputs
        (test/trajectory_optimization/double_collision_test.cc), found apart from it."""
        start = [4, 0.3, -0.3, 0, 0, 4]
        values = RowMajorMatrix(rows=6, cols=2, data=[force for y in start for force in (0, y)])
        found = self.ask_of("near_a_wall", TrajectoryRequest(
            duration=2, state=InitialState(q=[0, -0.8, 0, -0.1], v=[0, 0, 0, 0]),
            input_grid=InputGrid(times=[k / 3 for k in range(6)], values=values),
            lower=[0, -1000], upper=[0, 1000], effort=[0.01, 0.01], outcomes=["y1", "y2", "d/dt y1", "d/dt y2"],
            targets=[-0.8, -0.1, 0, 0], weights=[1, 10, 1, 1])).result
        self.assertAlmostEqual(found.cost, 0.118966818, places=8)

    def ask_of(self, node, request):
        action = actionlib.SimpleActionClient(node + "/optimize_trajectory", OptimizeTrajectoryAction)
        self.assertTrue(action.wait_for_server(rospy.Duration(20)))
        action.send_goal(OptimizeTrajectoryGoal(request=request))
        self.assertTrue(action.wait_for_result(rospy.Duration(120)))
        result = action.get_result()
        self.assertTrue(result.success, result.message)
        return result

    def test_costs_by_name(self):
        """What the first iterate costs, in closed form, and what is found costs less."""
        u, T = 3.0, 0.8
        a = u - 9.8
        hit = (-2 / a) ** 0.5
        v, rest = -0.7 * a * hit, T - hit
        squares = a * a * hit ** 3 / 3 + v * v * rest + a * v * rest ** 2 + a * a * rest ** 3 / 3
        falling = dict(duration=T, state=InitialState(q=[1], v=[0]), input=[u], input_grid=InputGrid(times=[0, 0.3]), effort=[0.1])
        effort = 0.1 * T * u * u
        found = self.ask_of("ball", TrajectoryRequest(power_inputs=["force"], power_velocities=["z"], power_weights=[0.25],
                                                      **falling)).result
        self.assertAlmostEqual(found.iterations[0].cost, effort + 0.25 * u * u * squares, places=8)
        self.assertLess(found.cost, 1e-8)
        found = self.ask_of("ball", TrajectoryRequest(impulses=["floor"], impulse_weights=[0.5], **falling)).result
        self.assertAlmostEqual(found.iterations[0].cost, effort + 0.5 * (1.7 * a * hit) ** 2, places=8)
        self.assertLess(found.cost, found.iterations[0].cost / 2)
        # A block that slides until it stops.
        b = 9.81 * (0.6 * math.cos(0.2) - math.sin(0.2)) - 0.7
        found = self.ask_of("block", TrajectoryRequest(
            duration=1.0, state=InitialState(q=[0, 0, 0], v=[1.3, 0, 1]), input=[0.7], input_grid=InputGrid(times=[0, 0.1]),
            effort=[0.01], slips=["floor"], slip_weights=[0.5])).result
        self.assertAlmostEqual(found.iterations[0].cost, 0.01 * 0.7 ** 2 + 0.5 * 1.3 ** 3 / (3 * b), places=8)
        self.assertLess(found.cost, found.iterations[0].cost)

    def test_linear_inputs(self):
        """From rest to rest in 1 s over 1 m by u = 6 − 12 t, which costs 12."""
        request = TrajectoryRequest(
            linear_inputs=True, duration=1, state=InitialState(q=[5], v=[0]), input_grid=InputGrid(times=[0, 0.3, 0.45]), effort=[1],
            conditions=[RunCondition(name="z", lower=6, upper=6), RunCondition(name="d/dt z", lower=0, upper=0)])
        found = self.ask_of("mass", request).result
        self.assertAlmostEqual(found.cost, 12, places=6)
        for t, u in zip(found.inputs.times, found.inputs.values.data):
            self.assertAlmostEqual(u, 6 - 12 * t, places=5)
        self.assertAlmostEqual(found.input_end[0], -6, places=5)
        self.assertAlmostEqual(found.final_q[0], 6, places=7)
        self.assertEqual((len(found.initial_q), len(found.final_v)), (1, 1))

    def test_multiple_shooting(self):
        request = ball(duration=1, input_grid=InputGrid(times=[k / 10 for k in range(10)]), linear_inputs=True)
        pieces = self.ask(request).result.cost
        request.method, request.segments = "multiple_shooting", [2, 8]
        result = self.ask_what_is_refused(request)
        if not result.success:
            self.assertIn("coinor-libipopt-dev", result.message)
            return
        self.assertEqual(result.outcome, OptimizeTrajectoryResult.SMOOTH_MINIMUM, result.message)
        self.assertIn("3 segments", result.message)
        self.assertAlmostEqual(result.result.cost, pieces, places=7)

    def test_cancelled(self):
        request = ball(start=-100.0, neighbours=True)
        request.options.max_step = 1e-5
        request.options.max_steps = 100000000
        self.send(request)
        time.sleep(1)
        start = time.time()
        self.action.cancel_goal()
        result = self.wait()
        self.assertLess(time.time() - start, 20)
        self.assertEqual(self.action.get_state(), GoalStatus.PREEMPTED)
        self.assertEqual((result.outcome, result.recorded), (OptimizeTrajectoryResult.CANCELLED, ""))

    def test_wrong_goals_are_refused(self):
        for fields, part in (({"outcomes": ["zz", "d/dt z"]}, "outcomes[0]"),
                             ({"targets": [1.0]}, "targets has 1 entries, expected 2"),
                             ({"weights": [-1.0, 1.0]}, "weights[0] is -1"),
                             ({"effort": [1.0, 2.0]}, "effort has 2 entries, expected 1"),
                             ({"initial": ["y"]}, "initial[0]"),
                             ({"path": ["d/dt z"], "path_targets": [0.0]}, "a position is needed"),
                             ({"keep_inputs": True}, "nothing may be chosen"),
                             ({"lower": [1.0], "upper": [0.0]}, "lower bound"),
                             ({"kink_interval": -1.0}, "kink_interval"),
                             ({"parameters": ["restitutio"]}, "restitution"),
                             ({"durations": [251]}, "durations has 251"),
                             ({"durations": [3], "duration_lower": [1.0, 2.0]}, "duration_lower has 2 entries"),
                             ({"durations": [250], "keep_horizon": True}, "the last interval"),
                             ({"duration_weight": -1.0}, "duration_weight"),
                             ({"path": ["z"], "path_reference": RowMajorMatrix(rows=2, cols=1, data=[0, 1])}, "path_reference"),
                             ({"conditions": [RunCondition(name="y")]}, "conditions[0].name"),
                             ({"conditions": [RunCondition(name="z", lower=1)]}, "conditions[0]: the lower"),
                             ({"conditions": [RunCondition(name="z", number=252)]}, "conditions[0].number"),
                             ({"conditions": [RunCondition(name="z", touchdown=True)]}, "constraint"),
                             ({"power_inputs": ["force"]}, "power_velocities has 0 entries, expected 1"),
                             ({"power_inputs": ["forse"], "power_velocities": ["z"]}, "power_inputs[0]"),
                             ({"power_inputs": ["force"], "power_velocities": ["zz"]}, "power_velocities[0]"),
                             ({"power_inputs": ["force"], "power_velocities": ["z"], "power_weights": [-1.0]}, "power_weights[0] is -1"),
                             ({"impulses": ["flor"]}, "impulses[0]"),
                             ({"impulses": ["floor"], "impulse_weights": [1.0, 2.0]}, "impulse_weights has 2 entries"),
                             ({"impulses": ["floor", "floor"]}, "second time"),
                             ({"slips": ["floor"]}, "'floor' has no friction"),
                             ({"input_end": [1.0]}, "linear_inputs"),
                             ({"linear_inputs": True, "input_end": [1.0, 2.0]}, "input_end has 2 entries, expected 1"),
                             ({"method": "shooting"}, "multiple_shooting"),
                             ({"segments": [3]}, "segments"),
                             ({"duration": 0.5}, "horizon")):
            result = self.ask_what_is_refused(ball(**fields))
            self.assertFalse(result.success, fields)
            self.assertEqual(result.outcome, OptimizeTrajectoryResult.REFUSED)
            self.assertIn(part, result.message)
        self.assertEqual(self.action.get_state(), GoalStatus.ABORTED)

    def test_recorded_and_verified(self):
        client = Client("ball")
        client.start_recording(name="trajectory_%d" % os.getpid())
        recorded = self.ask(ball()).recorded
        path, = client.stop_recording().paths
        self.addCleanup(os.remove, path)
        self.assertEqual(recorded, path)
        done = subprocess.run([executable("verify_bag"), path], stdout=subprocess.PIPE, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("1 verified, 0 differ, 0 skipped", done.stdout.decode())

    def test_from_the_command_line(self):
        done = subprocess.run(
            [executable("run_action.py"), "/ball/optimize_trajectory",
             "{input_grid: {times: [0, 0.25, 0.5, 0.75]}, effort: [0.01], outcomes: [z, d/dt z],"
             " targets: [1, 0], weights: [100, 100]}"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr.decode() + done.stdout.decode())
        self.assertRegex(done.stderr.decode(), r"\[[#.]{30}\] +\d+ %  iteration \d+")
        result = yaml.safe_load(done.stdout.decode())
        self.assertTrue(result["success"])
        self.assertEqual(len(result["result"]["inputs"]["times"]), 4)


if __name__ == "__main__":
    rospy.init_node("trajectory_test")
    rostest.rosrun("contact_flow", "trajectory", "__main__")
