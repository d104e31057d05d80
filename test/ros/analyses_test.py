#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""poincare_map, assess_stability, assess_controllability, propagate_covariance, gradient; recorded, and verified."""
import math
import os
import subprocess
import tempfile
import unittest

import numpy as np
import rosbag
import rospy
import rostest
from client import Client, executable, matrix
from contact_flow.msg import (
    DerivativePiece, InitialState, InputGrid, PoincareRequest, ResultWarning, ReturnSection,
    RowMajorMatrix, StabilityProof)

FEET = ["body_x", "left_foot_x", "right_foot_x"]
APEX = ReturnSection(kind="apex", name="body_z")


def message(array):
    array = np.atleast_2d(np.array(array, dtype=float))
    return RowMajorMatrix(rows=array.shape[0], cols=array.shape[1], data=list(array.ravel()))


def piece(matrix_, cone):
    return DerivativePiece(matrix=message(matrix_), cone=message(cone))


def trap(t_left, d_left, t_right, d_right):
    """Pieces on y1 <= 0 and y1 >= 0 that agree on y1 = 0."""
    return [piece([[t_left, 1], [-d_left, 0]], [-1, 0]), piece([[t_right, 1], [-d_right, 0]], [1, 0])]


def value(pieces, w):
    """f(w) by the piece whose cone holds w best."""
    def margin(p):
        return min(matrix(p.cone) @ w) if p.cone.rows else math.inf
    return matrix(max(pieces, key=margin).matrix) @ w


class ReturnMaps(unittest.TestCase):
    def test_the_trot_returns_to_its_apex(self):
        answer = Client("wide").poincare_map(section=APEX, translation=FEET)
        self.assertTrue(answer.success, answer.message)
        result = answer.result
        self.assertEqual((answer.outcome, answer.message), (0, ""))
        self.assertAlmostEqual(result.time, 0.8, places=10)
        self.assertLess(result.distance, 1e-9)
        self.assertEqual(len(result.map), 2)
        self.assertEqual(matrix(result.basis).shape, (14, 11))
        self.assertLess(result.neutral_residual, 1e-8)
        self.assertLess(result.crossing_speed, -1)

    def test_the_derivative_predicts_returns_from_beside(self):
        client = Client("wide")
        result = client.poincare_map(section=APEX, translation=FEET).result
        x, alpha = np.array(result.q + result.v), 1e-5
        times = matrix(result.return_time)
        for w in (np.eye(14)[6], -np.eye(14)[6], np.eye(14)[4] - np.eye(14)[12]):
            start = x + alpha * w
            moved = client.poincare_map(
                section=APEX, state=InitialState(q=start[:7], v=start[7:])).result
            quotient = (np.array(moved.q + moved.v) - x) / alpha
            self.assertLess(np.max(np.abs(quotient - value(result.map, w))), 1e-2)
            slopes = (moved.time - result.time) / alpha - times @ w
            self.assertLess(np.min(np.abs(slopes)), 1e-2)

    def test_sections_of_every_kind(self):
        client = Client("wide")
        for section, i, height in (
                (ReturnSection(kind="coordinate", name="body_z", value=0.7, direction=1), 3, 0.7),
                (ReturnSection(kind="velocity", name="body_z", value=-0.5), 10, -0.5),
                (ReturnSection(kind="clock", value=0.8), 3, 0.8)):
            answer = client.poincare_map(section=section)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.outcome, 0, answer.message)
            self.assertAlmostEqual((answer.result.q + answer.result.v)[i], height, places=9)
        client = Client("pendulum")
        answer = client.poincare_map(section=ReturnSection(kind="touchdown", name="elbow_stop"))
        self.assertTrue(answer.success)
        self.assertEqual(answer.outcome, 4)  # both stops at once
        self.assertIn("other constraints", answer.message)
        never = ReturnSection(kind="coordinate", name="shoulder", value=50)
        answer = client.poincare_map(section=never, horizon=1.0)
        self.assertTrue(answer.success)
        self.assertEqual(answer.outcome, 1)
        self.assertIn("within 1 s", answer.message)

    def test_wrong_requests_are_refused(self):
        client = Client("wide")
        for fields, part in (
                ({}, "section.name"),
                ({"section": ReturnSection(kind="apex", name="body_zz")}, "body_z"),
                ({"section": ReturnSection(kind="apexx", name="body_z")}, "'apex'"),
                ({"section": ReturnSection(kind="clock", value=-1)}, "section.value is -1"),
                ({"section": ReturnSection(name="body_z", direction=3)}, "section.direction is 3"),
                ({"section": APEX, "translation": ["body_y"]}, "translation[0]"),
                ({"section": APEX, "neutral": message([1, 2, 3])}, "neutral has 3 columns"),
                ({"section": APEX, "neutral": message(np.eye(14)[10])}, "no tangent of the section"),
                ({"section": APEX, "horizon": -1.0}, "horizon"),
                ({"section": APEX, "horizon": math.nan}, "horizon"),
                ({"section": APEX, "input": [1.0]}, "input"),
                ({"section": APEX, "state": InitialState(names=["left_foot_z"], positions=[-1])},
                 "left_foot")):
            answer = client.poincare_map(**fields)
            self.assertFalse(answer.success, fields)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)


class Stability(unittest.TestCase):
    def test_wide_is_stable_and_narrow_is_not(self):
        request = PoincareRequest(section=APEX, translation=FEET)
        for name, outcome in (("wide", 0), ("narrow", 1)):
            answer = Client(name).assess_stability(return_map=request)
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.outcome, outcome, answer.message)
            self.assertTrue(answer.result.verified)
            self.assertLess(answer.result.distance, 1e-9)
            # The certificate alone decides as well, and not for the other gait.
            again = Client(name).assess_stability(map=answer.result.map,
                                                  certificate=answer.result.certificate)
            self.assertEqual((again.outcome, again.result.verified), (outcome, True))
            other = {"wide": "narrow", "narrow": "wide"}[name]
            wrong = Client(other).assess_stability(return_map=request,
                                                   certificate=answer.result.certificate)
            self.assertEqual((wrong.outcome, wrong.result.verified), (2, False), name)

    def test_without_setting_symmetry_aside_nothing_is_proven(self):
        answer = Client("wide").assess_stability(return_map=PoincareRequest(section=APEX),
                                                 max_words=50)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 2)
        self.assertGreater(answer.result.growth_above, 0.999)

    def test_what_is_not_neutral_is_noticed(self):
        request = PoincareRequest(section=APEX, translation=["body_x"])  # the feet stay behind
        answer = Client("wide").assess_stability(return_map=request)
        self.assertTrue(answer.success)
        self.assertEqual(answer.outcome, 3)
        self.assertIn("neutral directions are none", answer.message)

    def test_off_the_orbit_the_message_says_so(self):
        state = InitialState(names=["body_z"], positions=[0.82])
        answer = Client("wide").assess_stability(
            return_map=PoincareRequest(section=APEX, translation=FEET, state=state))
        self.assertTrue(answer.success)
        self.assertIn("no fixed point", answer.message)
        self.assertEqual([w.code for w in answer.warnings], [ResultWarning.NO_FIXED_POINT])
        self.assertEqual(answer.result.warnings, answer.warnings)

    def test_pieces_that_are_no_map_are_refused_whatever_their_norms(self):
        client = Client("pendulum")
        half, third = 0.5 * np.eye(2), np.eye(2) / 3
        quadrants = [piece(half, np.diag([a, b])) for a in (1, -1) for b in (1, -1)]
        norm = StabilityProof(test=StabilityProof.NORM_TWO, bound=0.6)
        self.assertEqual(client.assess_stability(map=quadrants).outcome, 0)
        self.assertTrue(client.assess_stability(map=quadrants, certificate=norm).result.verified)
        for pieces, part in (
                ([piece(half, [1, 0]), piece(third, [-1, 0])], "pieces 0 and 1 disagree"),
                (quadrants[:1], "no piece's cone holds the direction"),
                (quadrants[:3], "behind a face of piece"),
                (quadrants + [piece(third, [1, 0])], "overlap, and differ: at w = (")):
            for fields in ({}, {"certificate": norm}):
                answer = client.assess_stability(map=pieces, **fields)
                self.assertEqual((answer.success, answer.outcome), (False, 255), answer.message)
                self.assertIn("map: the pieces are not one continuous map", answer.message)
                self.assertIn(part, answer.message)
            answer = client.assess_controllability(map=pieces)
            self.assertEqual((answer.success, answer.outcome), (False, 255), answer.message)
            self.assertIn(part, answer.message)

    def test_the_tolerance_of_the_check_may_be_stated(self):
        client = Client("pendulum")
        bent = [piece(np.diag([0.5, 0.5]), [1, 0]), piece(np.diag([0.5, 0.50001]), [-1, 0])]
        self.assertFalse(client.assess_stability(map=bent).success)
        self.assertEqual(client.assess_stability(map=bent, map_tolerance=1e-4).outcome, 0)
        self.assertIn("map_tolerance", client.assess_stability(map=bent, map_tolerance=0.5).message)

    def test_a_map_that_could_not_be_checked_is_not_believed(self):
        client = Client("pendulum")
        quadrants = [piece(0.5 * np.eye(2), np.diag([a, b])) for a in (1, -1) for b in (1, -1)]
        norm = StabilityProof(test=StabilityProof.NORM_TWO, bound=0.6)
        for answer in (client.assess_stability(map=quadrants, max_linear_programs=1),
                       client.assess_stability(map=quadrants, max_linear_programs=1, certificate=norm),
                       client.assess_controllability(map=quadrants, max_linear_programs=1)):
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.outcome, 2, answer.message)
            self.assertIn("undetermined: unchecked: 4 pieces", answer.message)
            self.assertEqual([w.code for w in answer.warnings], [ResultWarning.MAP_UNCHECKED])
            self.assertFalse(getattr(answer.result, "verified", False))

    def test_traps(self):
        client = Client("pendulum")
        answer = client.assess_stability(map=trap(-1.8, 0.9, -0.5, 0.9))
        self.assertEqual((answer.outcome, answer.result.test), (1, "growing ray"))
        self.assertAlmostEqual(answer.result.certificate.bound, 1.62, places=2)
        answer = client.assess_stability(map=trap(-0.7, 1.1, -1.7, 0.3))
        self.assertEqual((answer.outcome, answer.result.test), (0, "words"))
        self.assertTrue(answer.result.verified)

    def test_wrong_requests_are_refused(self):
        client = Client("pendulum")
        nan = [piece([[math.nan]], [1])]
        for fields, part in (
                ({"map": nan}, "map[0].matrix"),
                ({"map": [piece([[1, 2]], [1, 0])]}, "expected a square one"),
                ({"map": [piece([[1.0]], [0.0])]}, "half-space"),
                ({"map": [piece([[1.0]], [1.0, 2.0])]}, "map[0].cone"),
                ({"map": [DerivativePiece()]}, "must not be empty"),
                ({"map": trap(1, 1, 1, 1), "margin": 0.7}, "margin is 0.7"),
                ({"map": trap(1, 1, 1, 1), "certificate": StabilityProof(test=9)}, "certificate.test"),
                ({}, "section.name")):
            answer = client.assess_stability(**fields)
            self.assertFalse(answer.success, fields)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)


class Controllability(unittest.TestCase):
    def test_torques_reach_every_state_of_the_pendulum(self):
        answer = Client("pendulum").assess_controllability(input_grid=InputGrid(times=[0, 0.2, 0.5]))
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        result = answer.result
        self.assertEqual((len(result.inputs), len(result.reached)), (6, 4))
        self.assertEqual(result.inputs[3], "input elbow_torque at 0.2 s")
        self.assertEqual(matrix(result.reachable).shape, (4, 4))
        self.assertTrue(result.coherently_oriented)

    def test_degree_two_is_onto_but_no_homeomorphism(self):
        pieces = []
        for k in range(8):  # ray 45k° → ray 90k°
            a, b = np.radians([45 * k, 45 * k + 45])
            rays = np.array([[np.cos(a), np.cos(b)], [np.sin(a), np.sin(b)]])
            images = np.array([[np.cos(2 * a), np.cos(2 * b)], [np.sin(2 * a), np.sin(2 * b)]])
            pieces.append(piece(images @ np.linalg.inv(rays), np.linalg.inv(rays)))
        answer = Client("pendulum").assess_controllability(map=pieces)
        self.assertEqual(answer.outcome, 0, answer.message)
        result = answer.result
        self.assertEqual((result.coherently_oriented, result.degree, result.preimages,
                          result.homeomorphism), (True, 2, 2, False))
        first, second = matrix(result.twins)
        self.assertGreater(np.linalg.norm(first - second), 1e-3)
        self.assertLess(np.linalg.norm(value(pieces, first) - value(pieces, second)), 1e-9)

    def test_what_folds_back_is_not_reached(self):
        fold = [piece([[1, 0], [0, 1]], [0, 1]), piece([[1, 0], [0, -1]], [0, -1])]  # (u1, |u2|)
        answer = Client("pendulum").assess_controllability(map=fold)
        self.assertEqual(answer.outcome, 1, answer.message)
        self.assertLess(answer.result.unattained[1], 0)

    def test_wrong_requests_are_refused(self):
        answer = Client("wide").assess_controllability()
        self.assertFalse(answer.success)
        self.assertIn("has no inputs", answer.message)
        for fields, part in (({"reached": ["elbo"]}, "elbow"),
                             ({"rank_tolerance": -1.0}, "rank_tolerance"),
                             ({"input_grid": InputGrid(times=[0, 0.2, 0.1])}, "0.1"),
                             ({"input_grid": InputGrid(times=[0, 0.2, 0.3], values=RowMajorMatrix(2, 3, [0.0] * 6))},
                              "2 × 3, expected 3 instants × 2 inputs")):
            answer = Client("pendulum").assess_controllability(**fields)
            self.assertFalse(answer.success, fields)
            self.assertIn(part, answer.message)


class Covariance(unittest.TestCase):
    def test_through_a_simultaneous_impact_against_samples(self):
        client = Client("pendulum")
        sigma = 1e-4
        answer = client.propagate_covariance(deviations=[sigma] * 4)
        self.assertTrue(answer.success, answer.message)
        result = answer.result
        self.assertEqual((answer.outcome, result.method, result.pieces), (0, "truncation", 2))
        pieces = client.b_derivative(all_pieces=True).derivative.pieces
        random = np.random.default_rng(1)
        samples = np.array([value(pieces, w) for w in sigma * random.standard_normal((20000, 4))])
        covariance = matrix(result.covariance)
        scale = np.sqrt(np.diag(covariance))
        # Five standard errors of 20000 samples.
        self.assertLess(np.max(np.abs(samples.mean(0) - result.mean) / scale), 5 / math.sqrt(20000))
        relative = (np.cov(samples.T) - covariance) / np.outer(scale, scale)
        self.assertLess(np.max(np.abs(relative)), 5 * math.sqrt(2 / 20000))
        self.assertGreater(np.max(np.abs(np.array(result.mean) / scale)), 0.05)  # kinked: biased

    def test_where_order_decides_there_is_none(self):
        answer = Client("rigid").propagate_covariance(deviations=[0.01] * 6)
        self.assertTrue(answer.success)
        self.assertEqual(answer.outcome, 6)
        self.assertIn("discontinuous", answer.message)

    def test_wrong_requests_are_refused(self):
        client = Client("pendulum")
        for fields, part in (
                ({}, "either covariance or deviations"),
                ({"deviations": [1, 2]}, "deviations has 2 entries, expected 4"),
                ({"deviations": [1, 1, 1, -1]}, "deviations[3] is -1"),
                ({"covariance": message(np.eye(3))}, "expected 4"),
                ({"covariance": message(-np.eye(4))}, "negative eigenvalue"),
                ({"deviations": [1] * 4, "by_parameters": ["m2"]}, "m")):
            answer = client.propagate_covariance(**fields)
            self.assertFalse(answer.success, fields)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)
        standing = InitialState(names=["body_z"], positions=[0.5])
        answer = Client("rigid").propagate_covariance(state=standing, deviations=[0.01] * 6)
        self.assertFalse(answer.success)
        self.assertIn("leaves the contact mode", answer.message)


class Records(unittest.TestCase):
    def test_every_result_is_recorded_and_verified(self):
        client = Client("pendulum")
        section = ReturnSection(kind="coordinate", name="elbow", value=1.6)
        client.start_recording(name="analyses")
        recorded = [client.poincare_map(section=section).recorded,
                    client.assess_stability(map=trap(-0.7, 1.1, -1.7, 0.3)).recorded,
                    client.assess_controllability(input_grid=InputGrid(times=[0, 0.3])).recorded,
                    client.propagate_covariance(deviations=[0.1] * 4).recorded,
                    client.gradient(outcomes=["elbow"], direction=[1, 0, 0, 0]).recorded]
        path, = client.stop_recording().paths
        self.addCleanup(os.remove, path)
        self.assertEqual(recorded, [path] * 5)
        done = subprocess.run([executable("verify_bag"), path], stdout=subprocess.PIPE, timeout=60)
        output = done.stdout.decode()
        self.assertEqual(done.returncode, 0, output)
        self.assertIn("5 verified, 0 differ, 0 skipped", output)
        # One number that was changed is noticed.
        with tempfile.TemporaryDirectory() as directory:
            forged = os.path.join(directory, "forged.bag")
            with rosbag.Bag(path) as old, rosbag.Bag(forged, "w") as new:
                for topic, m, stamp in old.read_messages():
                    if topic.endswith("record/stability"):
                        m.result.growth_above *= 1 + 1e-15
                    new.write(topic, m, stamp)
            done = subprocess.run([executable("verify_bag"), forged], stdout=subprocess.PIPE,
                                  timeout=60)
            self.assertEqual(done.returncode, 1)
            self.assertIn("4 verified, 1 differ", done.stdout.decode())


if __name__ == "__main__":
    rospy.init_node("analyses_test")
    rostest.rosrun("contact_flow", "analyses", "__main__")
