#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""contact_flow.ros.Client: services by name, numpy in and out; the node's numbers are those of the module."""
import os
import tempfile
import unittest

import numpy as np
import rospy
import rostest

import contact_flow
from contact_flow.msg import InitialState

try:
    import contact_flow.bags
    import contact_flow.cli
    import contact_flow.ros
except ImportError:   # CONTACT_FLOW_PYTHON is OFF
    Client = None
else:
    Client = contact_flow.ros.Client


@unittest.skipIf(Client is None, "built without the Python module")
class PythonClient(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("python_client_test")
        cls.client = Client("/pythonic")

    def local(self):
        return contact_flow.Model("soft_biped")

    def test_simulate_as_the_module_does(self):
        answer = self.client.simulate(state={"names": ["body_pitch"], "positions": np.array([0.1])})
        run = self.local().simulate({"body_pitch": 0.1})
        self.assertEqual([event.t for event in run.events], answer.event_times.tolist())
        self.assertIsInstance(answer.event_times, np.ndarray)
        whole = InitialState(q=run.x0[:7].tolist(), v=run.x0[7:].tolist())
        again = self.client.simulate(state=whole)
        np.testing.assert_array_equal(answer.event_times, again.event_times)

    def test_matrices_are_arrays(self):
        answer = self.client.linearize(input_grid={"times": [0, 0.5], "values": np.zeros((2, 0))})
        A = answer.linearization.intervals[0].A
        np.testing.assert_array_equal(self.local().simulate(
            inputs=contact_flow.Grid([0, 0.5], np.zeros((2, 0)))).linearize()[0].A, A)

    def test_sweeps_as_the_module_does(self):
        told = []
        draws = {"+body_pitch": contact_flow.Normal(0, 0.01), "stiffness": [25, 27]}
        answer = self.client.sweep(draws=draws, runs=700, seed=5, keep=["final_state"], progress=told.append)
        swept = self.local().sweep(draws, 700, seed=5)
        np.testing.assert_array_equal(swept.mean, answer.result.mean)
        np.testing.assert_array_equal(swept.covariance, answer.result.covariance)
        np.testing.assert_array_equal(swept["final_state"].ravel(), answer.result.columns[0].values)
        self.assertEqual(swept.words, {word.name: word.count for word in answer.result.words})
        done = [feedback.done for feedback in told]   # what comes behind the result is not told
        self.assertEqual(sorted(done), done)  # a slow machine tells the same count again
        self.assertTrue(all(0 <= number <= 700 for number in done), done)
        with self.assertRaisesRegex(contact_flow.ros.Refused, "body_pitch"):
            self.client.sweep(draws={"body_ptch": [0.1]})
        with self.assertRaisesRegex(ValueError, "no field 'run'"):
            self.client.sweep(run=3)
        self.assertIn("sweep", dir(self.client))

        class Enough(Exception):
            pass

        def stop(_):
            raise Enough
        with self.assertRaises(Enough):   # and the goal is cancelled: the next one is not in its way
            self.client.sweep(draws=draws, runs=10 ** 9, progress=stop)
        answer = self.client.find_periodic_orbit(section={"kind": "apex", "name": "body_z"}, max_iterations=1)
        self.assertNotEqual(255, answer.outcome)

    def test_a_bag_of_the_node_as_a_report(self):
        """What the node records, computed again by the module to the bit, as a page."""
        self.client.start_recording(name="reported")
        self.client.simulate(state={"names": ["body_pitch"], "positions": [0.1]}, duration=1.2)
        self.client.b_derivative(directions=["+body_pitch"], by_parameters=["stiffness"],
                                 options={"relative_tolerance": 1e-7})
        path, = self.client.stop_recording().paths
        self.addCleanup(os.remove, path)
        found = contact_flow.bags.runs(path)
        self.assertEqual([True, True], [one.same for one in found])
        self.assertEqual([("state",), ("state", "stiffness")], [one.by for one in found])
        self.assertEqual([1.2, 1.4], [one.run.duration for one in found])
        self.assertEqual(1e-7, found[1].run.options["relative_tolerance"])
        with tempfile.TemporaryDirectory() as folder:
            page = os.path.join(folder, "page.html")
            self.assertEqual(0, contact_flow.cli.main(["report", path, page, "--number", "0"]))
            with open(page, encoding="utf-8") as file:
                self.assertIn("Run 0 of 2 of reported.bag", file.read())

    def test_refusals(self):
        with self.assertRaisesRegex(contact_flow.ros.Refused, "body_pitch"):
            self.client.simulate(state={"names": ["body_ptch"], "positions": [0.1]})
        with self.assertRaisesRegex(ValueError, "no field 'durations'"):
            self.client.simulate(durations=1)
        with self.assertRaisesRegex(ValueError, "state has no field 'name'"):
            self.client.simulate(state={"name": []})
        with self.assertRaisesRegex(AttributeError, "no service 'simulat'"):
            self.client.simulat()
        self.assertIn("simulate", dir(self.client))
        self.assertIn("b_derivative", repr(self.client))


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "python_client", PythonClient)
