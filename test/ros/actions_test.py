#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""find_periodic_orbit and optimize: found, watched, cancelled, refused, recorded; and from the command line."""
import os
import signal
import subprocess
import threading
import time
import unittest

import actionlib
import rospy
import rostest
import yaml
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from client import Client, executable
from contact_flow.msg import (
    FindPeriodicOrbitAction, FindPeriodicOrbitGoal, OptimizationRequest, OptimizeOutcomeAction,
    OptimizeOutcomeGoal, OrbitRequirement, PeriodicOrbitRequest, ReturnSection, SimulationOptions)

FEET = ["body_x", "left_foot_x", "right_foot_x"]
UNKNOWN = ["axial_stiffness", "axial_damping", "push", "leg_length"]


def trot_request():
    """Apex 0.8 m, period 0.8 s, both feet down at 0.1 s and up at 0.7 s."""
    return PeriodicOrbitRequest(
        section=ReturnSection(kind="apex", name="body_z"), unknown_parameters=UNKNOWN,
        translation=FEET, shortest=0.1, requirements=[
            OrbitRequirement(kind="period", value=0.8),
            OrbitRequirement(kind="coordinate", name="body_z", value=0.8),
            OrbitRequirement(kind="touchdown", name="left_foot", value=0.1),
            OrbitRequirement(kind="touchdown", name="left_foot", other="right_foot"),
            OrbitRequirement(kind="liftoff", name="left_foot", value=0.7),
            OrbitRequirement(kind="liftoff", name="left_foot", other="right_foot")])


def law_request():
    """The shoulder torque that brings the elbow to 2.03 rad."""
    return OptimizationRequest(unknowns=["input shoulder_torque"], outcomes=["elbow"], targets=[2.03],
                               tolerance=1e-10)


class Action:
    """action(request) sends a goal and waits; feedback is kept, also what comes behind the result."""

    def __init__(self, name, kind, goal):
        self.goal = goal
        self.client = actionlib.SimpleActionClient(name, kind)
        self.feedback = []
        self.told = rospy.Subscriber(name + "/feedback", type(kind().action_feedback),
                                     lambda message: self.feedback.append(message.feedback))
        if not self.client.wait_for_server(rospy.Duration(20)):
            raise RuntimeError("no server " + name)

    def send(self, request):
        self.feedback = []
        self.client.send_goal(self.goal(request=request))

    def wait(self):
        if not self.client.wait_for_result(rospy.Duration(60)):
            raise RuntimeError("no result within 60 s")
        return self.client.get_result()

    def __call__(self, request):
        self.send(request)
        return self.wait()


class Actions(unittest.TestCase):
    def setUp(self):
        self.orbit = Action("trot/find_periodic_orbit", FindPeriodicOrbitAction,
                            FindPeriodicOrbitGoal)
        self.optimize = Action("pendulum/optimize", OptimizeOutcomeAction, OptimizeOutcomeGoal)

    def test_the_trot_is_found_from_other_parameters(self):
        result = self.orbit(trot_request())
        self.assertEqual(self.orbit.client.get_state(), GoalStatus.SUCCEEDED)
        self.assertTrue(result.success, result.message)
        self.assertEqual(result.outcome, 0, result.message)
        found = result.result
        self.assertLess(max(map(abs, found.residual)), 1e-11)
        for name, value in (("axial_stiffness", 32.488288908534154),
                            ("axial_damping", 1.2834934738545232),
                            ("push", 2.5496355456825017), ("leg_length", 0.75442713321021629)):
            self.assertAlmostEqual(found.parameters[UNKNOWN.index(name)], value, places=6)
        self.assertEqual([mode.active for mode in found.orbit.modes],
                         [[], ["left_foot", "right_foot"], []])
        self.assertEqual((len(found.orbit.map), len(found.orbit.reduced)), (2, 2))
        # Feedback ends with all digits gained; it comes by another topic than the result.
        deadline = time.time() + 20
        while not (self.orbit.feedback and self.orbit.feedback[-1].fraction == 1) and time.time() < deadline:
            time.sleep(0.02)
        self.assertGreater(len(self.orbit.feedback), 3)
        self.assertEqual(self.orbit.feedback[-1].fraction, 1)
        self.assertEqual(len(self.orbit.feedback[-1].best), 18)
        values = [iteration.value for iteration in found.iterations]
        self.assertEqual(values[-1], self.orbit.feedback[-1].value)

    def test_an_orbit_of_a_robot(self):
        action = Action("robot/find_periodic_orbit", FindPeriodicOrbitAction, FindPeriodicOrbitGoal)
        result = action(PeriodicOrbitRequest(section=ReturnSection(kind="apex", name="base_z"),
                                             translation=["base_x"]))
        self.assertTrue(result.success, result.message)
        self.assertEqual(result.outcome, 0, result.message)
        modes = [mode.active for mode in result.result.orbit.modes]
        self.assertEqual(len(modes), 5, modes)  # one foot after the other, down and up
        self.assertLess(result.result.orbit.distance, 1e-9)
        self.assertLess(result.result.orbit.neutral_residual, 1e-6)

    def test_the_torque_is_found(self):
        result = self.optimize(law_request())
        self.assertTrue(result.success, result.message)
        self.assertLess(result.result.cost, 1e-14)
        self.assertAlmostEqual(result.result.final_q[1], 2.03, places=6)
        torque = result.result.values[0]
        run = Client("pendulum").simulate(input=[torque, 0])
        self.assertAlmostEqual(run.trajectory.final_q[1], 2.03, places=6)
        costs = [iteration.value for iteration in result.result.iterations]
        self.assertGreater(len(costs), 2)
        self.assertEqual(costs, sorted(costs, reverse=True))

    def test_a_kink_is_told(self):
        # The shoulder's final speed is least where both stops are met at once.
        request = OptimizationRequest(unknowns=["shoulder"], outcomes=["d/dt shoulder"],
                                      targets=[-0.7], radius=0.01, tolerance=1e-7)
        request.state.names, request.state.positions = ["shoulder"], [0.678]
        result = self.optimize(request)
        self.assertEqual(result.outcome, 0, result.message)
        kink, = result.result.kinks
        self.assertTrue(kink.valley)
        self.assertAlmostEqual(result.result.values[0], 0.68154256, places=5)

    def test_cancelled(self):
        request = law_request()
        request.targets = [-3.0]  # beyond what is reached: the search takes its time …
        request.duration = 1.3
        request.options = SimulationOptions(max_step=1e-5)  # … with 130000 steps a run
        request.options.max_steps = 10000000
        self.optimize.send(request)
        time.sleep(0.5)
        start = time.time()
        self.optimize.client.cancel_goal()
        result = self.optimize.wait()
        self.assertLess(time.time() - start, 20)
        self.assertEqual(self.optimize.client.get_state(), GoalStatus.PREEMPTED)
        self.assertEqual((result.outcome, result.recorded), (5, ""))

    def test_wrong_goals_are_refused(self):
        def orbit(**fields):
            request = trot_request()
            for name, value in fields.items():
                setattr(request, name, value)
            return self.orbit(request)

        for result, part in (
                (orbit(unknown_parameters=["axial_stifness"]), "axial_stiffness"),
                (orbit(section=ReturnSection(name="body_q")), "section.name"),
                (orbit(requirements=[OrbitRequirement(kind="perod")]), "period"),
                (orbit(requirements=[OrbitRequirement(kind="liftoff", name="foot")]),
                 "requirements[0].name"),
                (orbit(parameters=[1.0]), "parameters has 1 entries, expected 4"),
                (orbit(parameters=[-1.0, 1, 1, 1]), "axial_stiffness"),
                (orbit(tolerance=-1.0), "tolerance")):
            self.assertFalse(result.success)
            self.assertEqual(result.outcome, 255)
            self.assertIn(part, result.message)
        self.assertEqual(self.orbit.client.get_state(), GoalStatus.ABORTED)
        for fields, part in (({"unknowns": []}, "unknowns is empty"),
                             ({"unknowns": ["input shoulde_torque"]}, "shoulder_torque"),
                             ({"outcomes": ["elbo"]}, "elbow"),
                             ({"targets": []}, "targets has 0 entries, expected 1"),
                             ({"weights": [-1.0]}, "weights[0] is -1"),
                             ({"effort": [1.0]}, "effort has 1 entries, expected 2")):
            request = law_request()
            for name, value in fields.items():
                setattr(request, name, value)
            result = self.optimize(request)
            self.assertFalse(result.success)
            self.assertIn(part, result.message)

    def test_a_search_that_ends_elsewhere_says_why(self):
        request = trot_request()
        request.requirements = [OrbitRequirement(kind="touchdown", name="left_foot", value=0.1,
                                                 occurrence=7)]
        result = self.orbit(request)
        self.assertTrue(result.success)
        self.assertEqual(result.outcome, 3)
        self.assertIn("touchdown number 7 of 'left_foot' does not happen", result.message)

    def test_a_search_that_time_has_ended_is_verified_up_to_there(self):
        client = Client("trot")
        path = client.start_recording(name="trot_in_haste_%d" % os.getpid()).path
        iterations = set()
        for seconds in (0.001, 0.1, 0.2, 0.4, 0.8):
            request = trot_request()
            request.options = SimulationOptions(max_seconds=seconds)
            result = self.orbit(request)
            if result.outcome == 6:
                self.assertIn("max_seconds = %g " % seconds, result.message)
                self.assertEqual(result.result.orbit.model, "", "nothing of what depends on when")
                iterations.add(len(result.result.iterations))
        print("ended by time after", sorted(iterations), "iterations")
        self.assertTrue(iterations)
        client.stop_recording()
        done = subprocess.run([executable("verify_bag"), path], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, universal_newlines=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("ended by its budget of time", done.stdout)
        os.remove(path)

    def test_recorded_and_verified(self):
        for name, action, request in (("trot", self.orbit, trot_request()),
                                      ("pendulum", self.optimize, law_request())):
            client = Client(name)
            client.start_recording(name="actions_" + name)
            recorded = action(request).recorded
            path, = client.stop_recording().paths
            self.addCleanup(os.remove, path)
            self.assertEqual(recorded, path)
            done = subprocess.run([executable("verify_bag"), path], stdout=subprocess.PIPE,
                                  timeout=60)
            self.assertEqual(done.returncode, 0, done.stdout)
            self.assertIn("1 verified, 0 differ, 0 skipped", done.stdout.decode())


class CommandLine(unittest.TestCase):
    def run_action(self, *arguments):
        return subprocess.run([executable("run_action.py"), *arguments], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, timeout=60)

    def test_a_bar_and_the_result(self):
        done = self.run_action("/pendulum/optimize",
                               "{unknowns: [input shoulder_torque], outcomes: [elbow], targets: [2.03]}")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr.decode(), r"\[[#.]{30}\] +\d+ %  iteration \d+")
        result = yaml.safe_load(done.stdout.decode())
        self.assertTrue(result["success"])
        self.assertEqual(result["result"]["unknowns"], ["input shoulder_torque"])

    def test_wrong_use(self):
        self.assertEqual(self.run_action().returncode, 2)
        self.assertEqual(self.run_action("/pendulum/simulate").returncode, 2)
        done = self.run_action("/pendulum/optimize", "{unknown: [input shoulder_torque]}")
        self.assertEqual(done.returncode, 2)
        self.assertIn("unknown", done.stderr.decode())
        done = self.run_action("/pendulum/optimize", "{unknowns: [elbo]}")
        self.assertEqual(done.returncode, 1)
        self.assertIn("elbow", done.stdout.decode())

    def test_interrupt_cancels(self):
        client = subprocess.Popen(
            [executable("run_action.py"), "/pendulum/optimize",
             "{unknowns: [input shoulder_torque], outcomes: [elbow], targets: [-3.0],"
             " options: {max_step: 0.00001, max_steps: 10000000}}"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        running = threading.Event()
        status = rospy.Subscriber(
            "/pendulum/optimize/status", GoalStatusArray,
            lambda m: any(s.status == GoalStatus.ACTIVE for s in m.status_list) and running.set())
        self.assertTrue(running.wait(60))
        status.unregister()
        client.send_signal(signal.SIGINT)
        output, errors = client.communicate(timeout=60)
        self.assertEqual(client.returncode, 1, errors)
        self.assertIn("outcome: 5", output.decode())


if __name__ == "__main__":
    rospy.init_node("actions_test")
    rostest.rosrun("contact_flow", "actions", "__main__")
