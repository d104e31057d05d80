#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Friction in messages: words beside modes, tangential forces and impulses, whole forces in wrenches and markers; a
robot with friction through simulate, b_derivative, compare and the simulator, whose recording is verified."""
import os
import tempfile
import time
import unittest

import numpy
import rosbag
import rostest
from client import Client, executable, matrix, package_path
from contact_flow.msg import InitialState
from simulator_client import RecordingNode, Simulator, verify

FRICTION = 0.8
FEET = ["left_foot", "right_foot"]
FORWARD = InitialState(names=["base_x"], velocities=[0.5])
# It lands on one foot, which slides, stops, slides again and lets go.
RUNNING = InitialState(names=["base_x", "left_hip"], positions=[0, -0.2], velocities=[3, 0])


def cone_holds(word, normal, tangential):
    """Coulomb's law for each foot, by its letter."""
    for letter, n, t in zip(word, normal, tangential):
        slack = 1e-9 * (1 + abs(n))
        if letter == "o" and (n or t):
            return False
        if letter == "s" and abs(t) > FRICTION * n + slack:
            return False
        if letter in "+-" and abs(t + (1 if letter == "+" else -1) * FRICTION * n) > slack:
            return False
    return True


class Friction(unittest.TestCase):
    def test_description_tells_of_friction(self):
        description = Client("biped").describe_model().description
        self.assertEqual(list(description.friction), [FRICTION, FRICTION, 0, 0])
        self.assertEqual(description.tangential, FEET)

    def test_words_and_forces_of_a_run(self):
        answer = Client("biped").simulate(state=FORWARD, duration=0.4)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        run = answer.trajectory
        self.assertEqual(run.tangential, FEET)
        self.assertEqual(answer.mode_words, run.mode_words)
        self.assertEqual(run.mode_words, [arc.mode_word for arc in run.arcs])
        self.assertEqual(run.mode_words[0], "oooo")
        self.assertTrue(any("+" in word[:2] for word in run.mode_words), run.mode_words)
        self.assertTrue(any("s" in word[:2] for word in run.mode_words), run.mode_words)
        for arc in run.arcs:
            active = [name for name, letter in zip(run.constraints, arc.mode_word) if letter != "o"]
            self.assertEqual(active, arc.mode)
        force, tangential = matrix(run.force), matrix(run.tangential_force)
        self.assertEqual(force.shape, (len(run.t), 4))
        self.assertEqual(tangential.shape, (len(run.t), 2))
        for arc in run.arcs:
            for k in range(arc.first_sample, arc.first_sample + arc.num_samples):
                self.assertTrue(cone_holds(arc.mode_word[:2], force[k][:2], tangential[k]),
                                (run.t[k], arc.mode_word, force[k], tangential[k]))
        words = []
        for transition in run.transitions:
            self.assertEqual(len(transition.mode_words), 2)
            words.append(transition.mode_words[0])
            self.assertEqual(len(transition.tangential_impulse), 2)
            for i, p in enumerate(transition.tangential_impulse):
                self.assertLessEqual(abs(p), FRICTION * transition.impulse[i] + 1e-9)
            self.assertLessEqual(transition.energy_change, 1e-12)
        self.assertEqual(words, run.mode_words[:-1])
        self.assertTrue(any(any(t.tangential_impulse) for t in run.transitions))

    def test_derivative_and_its_quotients(self):
        client = Client("biped")
        directions = ["+base_x", "+base_pitch", "-d/dt base_x", "+d/dt left_hip", "+parameter friction",
                      "-parameter torso_mass"]
        asked = dict(state=RUNNING, duration=0.43, directions=directions,
                     by_parameters=["friction", "torso_mass"])
        derivative = client.b_derivative(all_pieces=True, **asked)
        self.assertEqual((derivative.success, derivative.outcome), (True, 0), derivative.message)
        result = derivative.derivative
        self.assertEqual([len(w.names) for w in result.mode_words],
                         [len(m.names) for m in result.direction_modes])
        self.assertEqual([mode.mode_word for mode in result.modes], ["oooo", "+ooo", "sooo", "+ooo", "oooo"])
        for piece in result.pieces:
            self.assertEqual(len(piece.mode_words), len(piece.eta))
        answer = client.compare(alphas=[1e-3, 1e-4, 1e-5], **asked)
        self.assertEqual((answer.success, answer.outcome), (True, 0), answer.message)
        for comparison in answer.comparison.comparisons:
            small = max(comparison.errors) < 1e-6
            self.assertTrue(small or abs(comparison.slope - 1) < 0.1,
                            (comparison.name, comparison.slope, comparison.errors))
            self.assertEqual(len(comparison.mode_words), 3)
            self.assertEqual(len(comparison.mode_words[0].names), len(comparison.modes[0].names))

    def test_simulator_shows_whole_forces_and_is_repeated(self):
        robot = os.path.join(package_path(), "config", "robots", "planar_biped_friction.yaml")
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "rough", robot=robot, paused="true")
            biped = Simulator("rough")
            self.assertTrue(biped.set_state(state=FORWARD).success)
            biped.step(seconds=0.25)
            state = biped.get_state().state
            self.assertEqual(state.tangential, FEET)
            self.assertEqual(len(state.mode_word), 4)
            self.assertTrue(cone_holds(state.mode_word[:2], state.force[:2], state.tangential_force))
            self.assertTrue(any(state.tangential_force), state)
            self.assertTrue(biped.apply_impulse(names=["base_x"], impulse=[2]).success)
            biped.step(seconds=0.2)
            time.sleep(0.2)
            node.stop()
            result = verify(node.bag)
            self.assertEqual(result.returncode, 0, result.stdout[-2000:])
            self.assertIn(" 0 differ", result.stdout)
            self.check_bag(node.bag)

    def check_bag(self, path):
        """Wrenches and arrows are those of the forces beside them."""
        states, wrenches, arrows, words = {}, {}, {}, set()
        with rosbag.Bag(path) as bag:
            for topic, message, _ in bag.read_messages():
                if topic.endswith("/state"):
                    states[message.header.stamp.to_nsec()] = message
                    words.add(message.mode_word)
                elif "/wrench/" in topic:
                    key = (message.header.stamp.to_nsec(), topic.split("/")[-1])
                    wrenches[key] = message.wrench
                elif topic.endswith("/contacts"):
                    for marker in message.markers:
                        if marker.ns == "forces" and marker.action == marker.ADD:
                            arrows[marker.header.stamp.to_nsec(), marker.id] = marker.points
                elif topic.endswith("/events"):
                    self.assertEqual(message.tangential, FEET)
                elif topic.endswith("/status"):
                    self.assertEqual(len(message.mode_word), 4)
        self.assertTrue(any("s" in word for word in words), words)
        checked = 0
        for stamp, state in states.items():
            for i, foot in enumerate(FEET):
                wrench = wrenches.get((stamp, foot))
                if wrench is None:
                    continue
                force = [wrench.force.x, wrench.force.y, wrench.force.z]
                numpy.testing.assert_allclose(force, [state.tangential_force[i], 0, state.force[i]], atol=1e-9)
                checked += state.tangential_force[i] != 0
                points = arrows.get((stamp, i))
                if points is not None:
                    along = numpy.array([points[1].x - points[0].x, points[1].z - points[0].z])
                    across = along[0] * force[2] - along[1] * force[0]
                    self.assertAlmostEqual(across, 0, delta=1e-9 * (1 + abs(force[2])))
        self.assertGreater(checked, 0)


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "friction", Friction)
