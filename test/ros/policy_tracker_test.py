#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""make_policy, saved, read, refused, recorded; policy_tracker in lockstep against a ball in closed form, and by topics."""
import math
import os
import signal
import subprocess
import tempfile
import unittest

import rospy
import rostest
from client import Client, executable, matrix, wait_until
from contact_flow.msg import InitialState, InputGrid, Policy, PolicyEvent, PolicySolve, PolicyStep, SimulatorInput
from contact_flow.srv import MakePolicy
from simulator_client import Listener, Simulator
from std_srvs.srv import Trigger

GRAVITY, RESTITUTION, OTHER = 9.8, 0.7, 0.65   # of the policy's ball, and of the one that is steered
HEIGHT, HIGHER = 1.0, 1.1                      # where they begin [m]
DURATION, COUNT = 0.8, 40
HIT = math.sqrt(2 * HEIGHT / GRAVITY)


def request(**fields):
    """A ball falls from 1 m and bounces once; nothing is fed forward, and feedback is weak."""
    asked = dict(duration=DURATION, state=InitialState(q=[HEIGHT], v=[0]), input=[0],
                 input_grid=InputGrid(times=[k * DURATION / COUNT for k in range(COUNT)]),
                 state_weights=[10, 1], terminal_weights=[1, 1], input_weights=[1])
    asked.update(fields)
    return asked


def reference(phase, t):
    """(z, ż) of the falling ball, and of the one that has bounced, as if there were no floor."""
    if phase == 0:
        return HEIGHT - GRAVITY * t ** 2 / 2, -GRAVITY * t
    s, v = t - HIT, RESTITUTION * GRAVITY * HIT
    return v * s - GRAVITY * s ** 2 / 2, v - GRAVITY * s


def gain(policy, phase, t):
    """Of the interval at t if it begins in this phase, else of the nearest one that does."""
    at = max(k for k in range(COUNT) if policy.feed_forward.times[k] <= t)
    k = min((k for k in range(COUNT) if policy.gains[k].phase == phase), key=lambda k: abs(k - at))
    return matrix(policy.gains[k].K)[0]


class Ball:
    """A ball over a floor under inputs that are held, in closed form."""

    def __init__(self, z):
        self.z, self.v, self.bounces, self.t = z, 0.0, [], 0.0

    def go(self, t, u):
        h, a = t - self.t, u - GRAVITY
        fall = (-self.v - math.sqrt(self.v ** 2 - 2 * a * self.z)) / a   # the later zero of z, as a < 0
        if fall <= h:
            self.bounces.append(self.t + fall)
            self.v = -OTHER * (self.v + a * fall)
            self.z, h = 0.0, h - fall
        self.z += self.v * h + a * h ** 2 / 2
        self.v += a * h
        self.t = t


class Tracker:
    """A policy_tracker of its own."""

    def __init__(self, name, **parameters):
        self.steps, self.events = Listener("/%s/steps" % name, PolicyStep), Listener("/%s/tracked_events" % name, PolicyEvent)
        self.solves = Listener("/%s/solves" % name, PolicySolve)
        for item in parameters.pop("horizon", {}).items():
            rospy.set_param("/%s/horizon/%s" % (name, item[0]), item[1])
        self.process = subprocess.Popen(
            [executable("policy_tracker"), "__name:=" + name] + ["_%s:=%s" % item for item in parameters.items()],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=30), self.process.stderr.read().decode()


class PolicyTracker(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.published = Listener("/maker/policy", Policy)
        cls.maker = Client("maker")
        rospy.wait_for_service("/maker/make_policy", timeout=20)
        cls.make = rospy.ServiceProxy("/maker/make_policy", MakePolicy)
        cls.folder = tempfile.TemporaryDirectory()
        cls.file = os.path.join(cls.folder.name, "ball.yaml")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def made(self):
        answer = self.make(**request())
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        return answer.result.policy

    def test_1_a_policy_has_both_sides_of_its_event(self):
        policy = self.made()
        self.assertTrue(wait_until(self.published.all))
        self.assertEqual(policy.gains, self.published.all()[-1].gains)
        first, second = policy.phases
        self.assertEqual((["floor"], []), (first.activated, first.released))
        self.assertAlmostEqual(HIT, first.t_end, places=9)
        self.assertEqual(first.t_end, second.t_begin)
        self.assertAlmostEqual(-GRAVITY * HIT, first.v_end[0], places=8)
        self.assertAlmostEqual(RESTITUTION * GRAVITY * HIT, second.v_begin[0], places=8)
        for number, phase in enumerate(policy.phases):   # all of them, beyond both ends
            for t, z, v in zip(phase.t, phase.q.data, phase.v.data):
                self.assertAlmostEqual(reference(number, t)[0], z, places=8)
                self.assertAlmostEqual(reference(number, t)[1], v, places=8)
        self.assertLess(second.t[0], HIT - 0.09)
        self.assertGreater(first.t[-1], HIT + 0.09)

    def test_2_wrong_requests_are_refused(self):
        for fields, part in (
                ({"state_weights": [1]}, "state_weights has 1 entries, expected 2"),
                ({"state_weights": [1, -1]}, "state_weights[1] is -1"),
                ({"input_weights": [0]}, "input_weights[0] is 0"),
                ({"terminal_weights": [float("nan"), 1]}, "terminal_weights[0] is nan"),
                ({"reach": -1}, "reach is -1"),
                ({"reach": 1e9}, "reach is 1"),
                ({"lower": [1], "upper": [0]}, "lower[0] is 1"),
                ({"upper": [1, 2]}, "upper has 2 entries"),
                ({"duration": -1}, "duration is -1")):
            answer = self.make(**request(**fields))
            self.assertFalse(answer.success, fields)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)

    def test_3_recorded_and_verified(self):
        self.maker.start_recording(name="policies")
        path = self.make(**request()).recorded
        self.addCleanup(os.remove, path)
        self.maker.stop_recording()
        done = subprocess.run([executable("verify_bag"), path], stdout=subprocess.PIPE, timeout=60)
        self.assertIn("1 verified, 0 differ, 0 skipped", done.stdout.decode())

    def save(self):
        policy = self.made()
        done = subprocess.run([executable("save_policy"), "/maker", self.file], stdout=subprocess.PIPE, timeout=60)
        self.assertEqual((0, self.file), (done.returncode, done.stdout.decode().strip()))
        return policy

    def test_4_in_lockstep_as_in_closed_form(self):
        """From higher, with another restitution: each input is that of the feedback on a ball of our own."""
        policy, ball = self.save(), Simulator("/stepped")
        taken = Listener("/stepped/input_taken", SimulatorInput)
        self.assertTrue(wait_until(lambda: taken.subscriber.get_num_connections() == 1))
        self.assertTrue(ball.set_state(state=InitialState(q=[HIGHER], v=[0])).success)
        taken.messages = []
        tracker = Tracker("lockstep", file=self.file, simulator="/stepped", lockstep="true")
        self.addCleanup(tracker.end)
        self.assertTrue(wait_until(lambda: ball.get_state().state.t > DURATION, seconds=60), tracker.process.poll())
        self.assertTrue(wait_until(lambda: taken.all() and taken.all()[-1].t > DURATION - 0.0015))
        mine, u, differences = Ball(HIGHER), 0.0, []
        inputs = taken.all()
        for message in inputs:
            mine.go(message.t, u)
            phase = len(mine.bounces)
            error = [a - b for a, b in zip((mine.z, mine.v), reference(phase, message.t))]
            u = message.input[0]
            differences.append(abs(u + gain(policy, phase, message.t).dot(error)))
        self.assertGreaterEqual(len(inputs), 800)
        self.assertGreater(max(abs(m.input[0]) for m in inputs), 0.05)
        self.assertLess(max(differences), 1e-6)
        self.assertTrue(wait_until(tracker.events.all))
        event, = tracker.events.all()
        self.assertEqual(("late", ["floor"], 1), (event.kind, event.constraints, event.phase))
        self.assertAlmostEqual(mine.bounces[0], event.t, places=7)
        self.assertAlmostEqual(HIT, event.expected, places=8)

    def test_5_by_topics(self):
        """Whenever states come, they are answered by the feedback on them; the ball takes what is answered."""
        policy, ball = self.save(), Simulator("/slow")
        taken = Listener("/slow/input_taken", SimulatorInput)
        self.assertTrue(ball.set_state(state=InitialState(q=[HIGHER], v=[0])).success)
        tracker = Tracker("by_topics", file=self.file, simulator="/slow", commands="commands", begin=0)
        self.addCleanup(tracker.end)
        self.assertTrue(wait_until(lambda: tracker.steps.subscriber.get_num_connections() == 1
                                   and taken.subscriber.get_num_connections() == 1))
        ball.unpause_physics()
        self.assertTrue(wait_until(lambda: ball.get_state().state.t > DURATION, seconds=60))
        ball.pause_physics()
        steps = tracker.steps.all()
        self.assertGreater(len(steps), 100)
        for step in steps:
            self.assertAlmostEqual(-gain(policy, step.phase, step.t).dot(step.error), step.input[0], places=12)
        inputs = {m.input[0] for m in taken.all() if m.t > steps[0].t + 0.01}
        self.assertGreater(len(inputs), 100)
        self.assertTrue(wait_until(lambda: inputs <= {step.input[0] for step in tracker.steps.all()}))
        event, = tracker.events.all()
        self.assertEqual(("late", ["floor"]), (event.kind, event.constraints))
        # Time goes back: the policy begins anew.
        ball.reset_simulation()
        self.assertTrue(ball.step(seconds=0.01).success)
        self.assertTrue(wait_until(lambda: tracker.steps.all()[-1].t < 0.1))
        self.assertEqual(0, tracker.steps.all()[-1].phase)

    def test_6_commands_to_joints(self):
        """A robot's servos get their setpoints as JointState; the tracker has waited for its policy."""
        biped = Simulator("/biped")
        taken = Listener("/biped/input_taken", SimulatorInput)
        steps = Listener("/policy_tracker/steps", PolicyStep)
        make = rospy.ServiceProxy("/biped/make_policy", MakePolicy)
        answer = make(duration=0.2, input_grid=InputGrid(times=[0, 0.05, 0.1, 0.15]), input_weights=[100] * 4)
        self.assertTrue(answer.success and answer.outcome == 0, answer.message)
        self.assertTrue(wait_until(lambda: steps.subscriber.get_num_connections() == 1
                                   and taken.subscriber.get_num_connections() == 1))
        self.assertTrue(biped.set_state(state=InitialState(names=["base_z"], positions=[0.86])).success)
        biped.unpause_physics()
        self.assertTrue(wait_until(lambda: biped.get_state().state.t > 0.2, seconds=60))
        biped.pause_physics()
        answered = {tuple(step.input) for step in steps.all()}
        self.assertGreater(len(answered), 20)
        self.assertGreater(len(answered & {tuple(m.input) for m in taken.all()}), 20)

    def test_7_a_robot_by_its_standard_topics(self):
        """Joints, odometry and forces of the same robot: its touchdowns are recognized, its servos are commanded."""
        biped = Simulator("/biped")
        biped.reset_simulation()
        make = rospy.ServiceProxy("/biped/make_policy", MakePolicy)
        self.assertEqual(0, make(duration=0.3, input_grid=InputGrid(times=[0, 0.1, 0.2]), input_weights=[100] * 4).outcome)
        rospy.set_param("/as_robot/joints", ["left_hip", "left_knee", "right_hip", "right_knee"])
        tracker = Tracker("as_robot", source="/biped", simulator="/biped", states="robot", commands="joint_commands",
                          joint_quantity="position")
        self.addCleanup(tracker.end)
        taken = Listener("/biped/input_taken", SimulatorInput)
        rospy.wait_for_service("/as_robot/start", timeout=30)
        self.assertTrue(wait_until(lambda: all(listener.subscriber.get_num_connections() == 1
                                               for listener in (tracker.steps, tracker.events, taken))))
        biped.unpause_physics()
        self.assertTrue(rospy.ServiceProxy("/as_robot/start", Trigger)().success)
        self.assertTrue(wait_until(lambda: biped.get_state().state.t > 0.3, seconds=60))
        biped.pause_physics()
        self.assertTrue(wait_until(lambda: {tuple(step.input) for step in tracker.steps.all()}
                                   & {tuple(m.input) for m in taken.all()}))
        for step in tracker.steps.all():
            self.assertEqual(14, len(step.error))
        self.assertTrue(wait_until(lambda: any(set(event.constraints) & {"left_foot", "right_foot"}
                                               and event.kind != "missed" for event in tracker.events.all())),
                        tracker.events.all())

    HORIZON = {"model": "driven_ball", "parameters": {"restitution": OTHER}, "intervals": COUNT, "effort": [0.01],
               "weights": [100, 10], "lead": 0.04, "max_iterations": 50}

    def end_of(self, ball):
        """Height and velocity of a simulator's ball beside those of the reference, at the end."""
        state = ball.get_state().state
        self.assertAlmostEqual(DURATION, state.t, delta=0.0015)
        z, v = reference(1, state.t)
        return abs(state.q[0] - z), abs(state.v[0] - v)

    def test_8_solves_again_in_lockstep(self):
        """From higher, with another restitution, the feedback alone ends elsewhere; the solves tell what they did."""
        self.save()
        ball, ends = Simulator("/stepped"), []
        for name, horizon in (("fixed", {}), ("receding", self.HORIZON), ("again", self.HORIZON)):
            ball.reset_simulation()
            self.assertTrue(ball.set_state(state=InitialState(q=[HIGHER], v=[0])).success)
            tracker = Tracker(name, file=self.file, simulator="/stepped", lockstep="true", horizon=horizon)
            self.addCleanup(tracker.end)
            self.assertTrue(wait_until(lambda: ball.get_state().state.t > DURATION, seconds=60), tracker.process.poll())
            ends.append(self.end_of(ball))
            self.assertEqual(bool(horizon), bool(wait_until(tracker.solves.all, seconds=2)))
        self.assertEqual(ends[1], ends[2])   # whatever the clock
        self.assertLess(max(ends[1]), 0.02)
        self.assertGreater(max(ends[0]), 10 * max(ends[1]))
        for solve in tracker.solves.all():
            self.assertEqual(("solved", True), (solve.verdict, solve.followed), solve.message)
            self.assertAlmostEqual(0.04, solve.begin - solve.t, places=9)
            self.assertGreater(solve.seconds, 0)
            self.assertLessEqual(solve.cost, solve.first_cost)

    def test_9_late_solves_change_nothing(self):
        """A budget that nothing can meet: each solve says so, and the policy's own feedback goes on, a state a millisecond."""
        policy, ball = self.save(), Simulator("/slow")
        ball.reset_simulation()
        self.assertTrue(ball.set_state(state=InitialState(q=[HIGHER], v=[0])).success)
        tracker = Tracker("hasty", file=self.file, simulator="/slow", commands="commands", begin=0,
                          horizon=dict(self.HORIZON, budget=1e-6))
        self.addCleanup(tracker.end)
        self.assertTrue(wait_until(lambda: tracker.steps.subscriber.get_num_connections() == 1
                                   and tracker.solves.subscriber.get_num_connections() == 1))
        ball.unpause_physics()
        self.assertTrue(wait_until(lambda: ball.get_state().state.t > DURATION, seconds=60))
        ball.pause_physics()
        self.assertGreater(len(tracker.steps.all()), 100)
        for step in tracker.steps.all():
            self.assertAlmostEqual(-gain(policy, step.phase, step.t).dot(step.error), step.input[0], places=12)
        self.assertGreater(len(tracker.solves.all()), 10)
        for solve in tracker.solves.all():
            self.assertEqual(("late", False), (solve.verdict, solve.followed))
            self.assertIn("the last policy is kept", solve.message)

    def test_a_what_does_not_fit_is_refused(self):
        self.save()
        with open(self.file) as file:
            text = file.read()
        broken = os.path.join(self.folder.name, "broken.yaml")
        with open(broken, "w") as file:
            file.write(text.replace("t_begin: 0", "t_begin: 0.1", 1))
        for name, parameters, part in (
                ("neither", {}, "/neither/file is ''"),
                ("nowhere", {"file": "/nowhere.yaml"}, "/nowhere.yaml"),
                ("broken", {"file": broken}, "phases[0].x_begin"),
                ("patient", {"file": self.file, "patience": -1}, "/patient/patience is -1"),
                ("misspelt", {"file": self.file, "extent": "true"}, "did you mean 'extend'"),
                ("jointless", {"file": self.file, "commands": "joint_commands"}, "joints has 0 entries, expected 1"),
                ("strange", {"file": self.file, "horizon": {"model": "soft_biped"}}, "it is of another model"),
                ("unweighted", {"file": self.file, "horizon": {"model": "driven_ball", "weights": [1]}},
                 "horizon/weights has 1 entries, expected 2"),
                ("hurried", {"file": self.file, "horizon": {"model": "driven_ball", "budget": 0}}, "horizon/budget is 0"),
                ("foreign", {"file": self.file, "simulator": "/biped", "lockstep": "true"}, "of another model")):
            tracker = Tracker(name, **parameters)
            tracker.process.wait(timeout=60)
            code, printed = tracker.end()
            self.assertEqual(code, 1, name)
            self.assertIn(part, printed)


if __name__ == "__main__":
    rospy.init_node("policy_tracker_test")
    rostest.rosrun("contact_flow", "policies", "__main__")
