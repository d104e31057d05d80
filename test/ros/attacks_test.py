#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Ordinary and hostile calls that once crashed, froze or hung the node: each is answered or refused in
words, and the node goes on."""
import math
import signal
import tempfile
import threading
import time
import unittest

import rosbag
import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus
from actions_test import Action
from client import Client, wait_until
from contact_flow.msg import (
    FindPeriodicOrbitAction, FindPeriodicOrbitGoal, InitialState, InputCommand, OptimizeOutcomeAction,
    OptimizeOutcomeGoal, OptimizeTrajectoryAction, OptimizeTrajectoryGoal, PeriodicOrbitRequest,
    PoincareRequest, ReturnSection, RowMajorMatrix)
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from simulator_client import RecordingNode, Simulator

ON_BOTH_FEET = InitialState(names=["body_z", "left_foot_z", "right_foot_z"], positions=[0, 0, 0])
BUDGET_EXCEEDED = 3
SLACK = 3  # [s] of a busy machine


class Seconds:
    """with Seconds() as time: …; time.passed"""

    def __enter__(self):
        self.begin = time.time()
        return self

    def __exit__(self, *_):
        self.passed = time.time() - self.begin


class Requests(unittest.TestCase):
    def setUp(self):
        self.client = Client("attacked")

    def tearDown(self):
        self.assertTrue(self.client.simulate(duration=0.1).success, "the node lives")

    def test_a_state_in_which_no_forces_balance(self):
        for name in ("simulate", "b_derivative", "check_assumptions", "linearize", "compare",
                     "propagate_covariance", "assess_controllability"):
            answer = getattr(self.client, name)(state=ON_BOTH_FEET)
            self.assertIsInstance(answer.success, bool)
            self.assertTrue(answer.success or answer.message, name)
        simulator = Simulator("attacked")
        answer = simulator.set_state(state=ON_BOTH_FEET)
        self.assertTrue(answer.success or answer.message)
        simulator.reset_simulation()

    def test_a_mass_without_a_reciprocal(self):
        standing = Simulator("standing")
        for mass in (1e-310, 5e-324, 0.0, -1.0, math.nan, math.inf, 1e308):
            answer = standing.set_parameters(names=["body_mass"], values=[mass])
            self.assertFalse(answer.success, mass)
            self.assertRegex(answer.message, "body_mass|values", mass)
        self.assertTrue(standing.get_state().success)

    def test_the_shortest_horizon_there_is(self):
        section = ReturnSection(kind="apex", name="body_z")
        with Seconds() as time_:
            one = self.client.poincare_map(section=section, horizon=5e-324)
            two = self.client.assess_stability(
                return_map=PoincareRequest(section=section, horizon=5e-324))
            orbit = Action("attacked/find_periodic_orbit", FindPeriodicOrbitAction,
                           FindPeriodicOrbitGoal)
            orbit.send(PeriodicOrbitRequest(section=section, horizon=5e-324))
            three = orbit.wait()
        self.assertLess(time_.passed, 5 + SLACK)
        for answer in (one, two, three):
            self.assertFalse(answer.success)
            self.assertIn("horizon", answer.message)

    def test_a_cancel_of_the_last_century_of_time(self):
        """It ended the process, or all goals from then on."""
        section = ReturnSection(kind="apex", name="body_z")
        for name, kind, goal in (("find_periodic_orbit", FindPeriodicOrbitAction, FindPeriodicOrbitGoal),
                                 ("optimize", OptimizeOutcomeAction, OptimizeOutcomeGoal),
                                 ("optimize_trajectory", OptimizeTrajectoryAction, OptimizeTrajectoryGoal)):
            cancel = rospy.Publisher("attacked/%s/cancel" % name, GoalID, queue_size=10)
            self.assertTrue(wait_until(lambda: cancel.get_num_connections() > 0))
            for seconds in (4294967295, 4000000000, 1):
                cancel.publish(GoalID(id="nobody's %d" % seconds, stamp=rospy.Time(seconds, 999999999)))
            time.sleep(1)
            action = Action("attacked/" + name, kind, goal)
            request = goal().request
            if hasattr(request, "section"):
                request.section = section
            request.options.max_seconds = 1
            action.send(request)
            answer = action.wait()
            self.assertIsNotNone(answer, name)
            self.assertNotEqual(GoalStatus.RECALLED, action.client.get_state(), name)

    def test_a_matrix_without_rows_has_columns(self):
        answer = self.client.poincare_map(section=ReturnSection(kind="apex", name="body_z"),
                                          neutral=RowMajorMatrix(rows=0, cols=5))
        self.assertFalse(answer.success)
        self.assertIn("neutral", answer.message)

    def test_a_direction_beyond_all_numbers(self):
        direction = RowMajorMatrix(rows=1, cols=14, data=[1e308] + [0.0] * 13)
        for answer in (Simulator("attacked").predict(horizon=0.1, direction_matrix=direction),
                       self.client.b_derivative(direction_matrix=direction)):
            self.assertFalse(answer.success)
            self.assertIn("direction_matrix.data[0]", answer.message)


class TheSimulator(unittest.TestCase):
    def setUp(self):
        self.simulator = Simulator("attacked")
        self.simulator.reset_simulation()

    def tearDown(self):
        self.simulator.pause_physics()
        self.simulator.reset_simulation()
        self.assertTrue(self.simulator.step(seconds=0.01).success, "the simulator lives")

    def test_an_input_of_the_last_century_of_time(self):
        topic = rospy.Publisher("attacked/input", InputCommand, queue_size=10)
        self.assertTrue(wait_until(lambda: topic.get_num_connections() > 0))
        for seconds in (4000000000, 4294967295, 1):
            message = InputCommand(values=[])
            message.header.stamp = rospy.Time(seconds)
            topic.publish(message)
        topic.publish(InputCommand(values=[math.nan]))
        time.sleep(0.5)
        self.assertTrue(self.simulator.get_state().success)

    def test_settings_that_are_no_numbers(self):
        service = "attacked/simulator/set_parameters"
        rospy.wait_for_service(service, timeout=20)
        change = rospy.ServiceProxy(service, Reconfigure)
        for name in ("rate", "real_time_factor", "display_rate"):
            for value in (math.nan, math.inf, -math.inf):
                now = change(Config(doubles=[DoubleParameter(name=name, value=value)])).config
                for setting in now.doubles:
                    self.assertTrue(math.isfinite(setting.value), (name, value))
        change(Config(doubles=[DoubleParameter(name="rate", value=100),
                               DoubleParameter(name="real_time_factor", value=1),
                               DoubleParameter(name="display_rate", value=50)]))
        self.simulator.unpause_physics()
        self.assertTrue(wait_until(lambda: self.simulator.get_state().state.t > 0.02))

    def ends_within_its_budget(self):
        """Every call is answered soon while the motion is too quick, and then the epoch has ended."""
        slowest = 0
        for _ in range(200):
            with Seconds() as time_:
                condition = self.simulator.get_state().condition
            slowest = max(slowest, time_.passed)
            if condition.outcome != 0:
                break
            time.sleep(0.02)
        self.assertEqual(condition.outcome, BUDGET_EXCEEDED, condition.why)
        self.assertIn("step_seconds", condition.why)
        self.assertLess(slowest, 1 + SLACK)

    def test_a_motion_that_is_too_quick(self):
        quick = InitialState(names=["body_pitch"], velocities=[1e9])
        self.assertTrue(self.simulator.set_state(state=quick).success)
        with Seconds() as time_:
            self.simulator.unpause_physics()
            self.ends_within_its_budget()
        self.assertLess(time_.passed, 2 + SLACK)

    def test_a_step_of_a_motion_that_is_too_quick(self):
        quick = InitialState(names=["body_pitch"], velocities=[1e9])
        self.assertTrue(self.simulator.set_state(state=quick).success)
        with Seconds() as time_:
            answer = self.simulator.step(seconds=1)
        self.assertLess(time_.passed, 2 + SLACK)
        self.assertEqual(answer.condition.outcome, BUDGET_EXCEEDED)

    def test_a_blow_beside_a_mark(self):
        self.simulator.mark(project_directions=True)
        self.simulator.apply_impulse(names=["body_x"], impulse=[1e5])
        self.simulator.mark(project_directions=True)
        with Seconds() as time_:
            answer = self.simulator.step(seconds=0.01)
        self.assertTrue(answer.success or answer.message)
        self.assertLess(time_.passed, 4 + SLACK)
        self.assertTrue(self.simulator.get_state().success)


class Ends(unittest.TestCase):
    """Of a node of its own, whatever it is doing."""

    def run_and_end(self, how, busy=None, **settings):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "ending", **settings)
            try:
                simulator = Simulator("ending")
                self.assertTrue(wait_until(lambda: simulator.get_state().state.t > 0.05 or busy))
                threads = [threading.Thread(target=self.ignore, args=(busy, simulator), daemon=True)
                           for _ in range(3 if busy else 0)]
                for thread in threads:
                    thread.start()
                time.sleep(0.5)
                with Seconds() as time_:
                    node.stop(how)
                self.assertLess(time_.passed, 5 + SLACK)
            finally:
                node.process.kill()
            # Without an index this throws.
            with rosbag.Bag(node.bag) as bag:
                self.assertGreater(bag.get_message_count(), 0)

    @staticmethod
    def ignore(call, simulator):
        try:
            call(simulator)
        except (rospy.ServiceException, rospy.ROSException):
            pass

    def test_signals(self):
        for how in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            self.run_and_end(how)

    def test_steps_that_do_not_end(self):
        self.run_and_end(signal.SIGINT, lambda simulator: simulator.step(seconds=1e6), paused="true")

    def test_a_motion_that_is_too_quick(self):
        def call(simulator):
            simulator.set_state(state=InitialState(names=["body_pitch"], velocities=[1e9]))
            simulator.step(seconds=10)
        self.run_and_end(signal.SIGTERM, call, paused="true", step_seconds="100")


if __name__ == "__main__":
    rospy.init_node("attacks_test")
    rostest.rosrun("contact_flow", "attacks", "__main__")
