#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""contact_flow.launch brings up every model, each answers its nominal run; and it records."""
import os
import subprocess
import tempfile
import unittest

import numpy
import rospy
import rostest
from client import Client, case, executable, labels

CASES = {
    "soft_biped": "soft_biped_simultaneous",
    "hopping_trot": "hopping_trot_stable",
    "rigid_biped": "rigid_biped_simultaneous",
    "double_pendulum": "double_pendulum_simultaneous",
    "wall_and_floor": "wall_and_floor",
    "ball_in_corner": "ball_in_corner",
}
# Models without a reference case: the contact modes of their nominal runs.
NOMINAL_MODES = {
    "corner": ["{}", "{floor}"],
    "bouncing_ball": ["{}", "{}", "{}"],
    "ceiling": ["{}", "{}"],
    "rocking_block": ["{left_corner}", "{right_corner}", "{left_corner}", "{right_corner}"],
    "legged_table": ["{}", "{outer_left_foot, inner_left_foot, inner_right_foot, outer_right_foot}"],
    "chair": ["{}", "{left_foot, right_foot}"],
    "falling_box": ["{}", "{}", "{}", "{}"],
    "jointed_biped": ["{}", "{left_foot, right_foot}"],
    "damped_plate": ["{table}", "{table}"],
    "rigid_quadruped": ["{}", "{hind_foot, front_foot}"],
    "block_on_incline": ["{floor}", "{floor}"],
    "sliding_rod": ["{foot}", "{foot}"],
    "puck": ["{floor}", "{floor}"],
    "spinning_ball": ["{}", "{}", "{}", "{}"],
    "rimless_wheel": ["{spoke_1}", "{spoke_2}"],
    "compass_walker": ["{left_foot}", "{right_foot}"],
    "simplest_walker": ["{left_foot}", "{right_foot}"],
    "driven_ball": ["{}", "{}"],
    "two_discs": ["{}", "{}"],
    "steered_trot": ["{}", "{left_foot, right_foot}", "{}"],
}


class LaunchFiles(unittest.TestCase):
    def test_nothing_said_is_the_soft_biped(self):
        self.assertEqual(Client("contact_flow").describe_model().description.name, "soft_biped")

    def test_nominal_run_of_every_model_is_its_reference_case(self):
        for model, name in CASES.items():
            reference = case(name)
            client = Client(model)
            description = client.describe_model().description
            self.assertEqual(description.name, model)
            self.assertEqual(description.constraints, reference["constraints"])
            answer = client.simulate()
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.mode_sequence, labels(reference["mode_sequence"]), model)
            x = numpy.array(answer.trajectory.final_q + answer.trajectory.final_v)
            self.assertLess(numpy.max(numpy.abs(x - reference["final_state"]["x"])), 1e-7, model)

    def test_nominal_run_of_every_other_model_passes_through_its_modes(self):
        for model, modes in NOMINAL_MODES.items():
            answer = Client(model).simulate()
            self.assertTrue(answer.success, answer.message)
            self.assertEqual((answer.outcome, answer.mode_sequence), (0, modes), model)

    def test_no_model_is_left_out(self):
        self.assertEqual(sorted([*CASES, *NOMINAL_MODES]),
                         Client("contact_flow").describe_model().models)

    def test_recording_from_the_start(self):
        with tempfile.TemporaryDirectory() as directory:
            launch = subprocess.Popen(
                ["roslaunch", "contact_flow", "contact_flow.launch", "name:=launched",
                 "record:=true", "bag_name:=run", "bag_directory:=" + directory, "output:=log"],
                stdout=subprocess.DEVNULL)
            try:
                path = Client("launched").simulate().recorded
            finally:
                launch.terminate()
                launch.wait(timeout=30)
            self.assertEqual(path, os.path.join(directory, "run.bag"))
            subprocess.check_call([executable("verify_bag"), path], stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    rospy.init_node("launch_files_test")
    rostest.rosrun("contact_flow", "launch_files", "__main__")
