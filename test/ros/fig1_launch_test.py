#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""fig1.launch ends by itself, and leaves verified bags and a picture with the right slopes."""
import glob
import os
import re
import subprocess
import tempfile
import unittest

import numpy
import rostest
from client import case, executable


def predicted_slopes():
    """dθ(T)/dθ(0) left and right of 0, from test/data: B is linear on the cone of either order, so
    that its value at ±w follows from the directions that lie in that cone."""
    reference = case("soft_biped_simultaneous")
    pitch = reference["coordinates"].index("body_pitch")
    size = 2 * len(reference["coordinates"])
    landed = {-1: ["right_foot"], 1: ["left_foot"]}
    slopes = []
    for sign in (-1, 1):
        cone = [d for d in reference["directional_derivatives"]
                if d["mode_sequence"][1] in (landed[sign], ["left_foot", "right_foot"])]
        matrix = numpy.linalg.lstsq(numpy.array([d["direction"] for d in cone]),
                                    numpy.array([d["derivative"] for d in cone]), rcond=None)[0]
        w = numpy.zeros(size)
        w[pitch] = 1
        for foot, offset in (("left_foot", -0.25), ("right_foot", 0.25)):
            w[reference["coordinates"].index(foot + "_x")] = 0.5
            w[reference["coordinates"].index(foot + "_z")] = offset
        slopes.append(w.dot(matrix)[pitch])
    return slopes


class Fig1(unittest.TestCase):
    def test_launch_file_draws_and_ends(self):
        with tempfile.TemporaryDirectory() as directory:
            done = subprocess.run(
                ["roslaunch", "contact_flow", "fig1.launch", "output_directory:=" + directory,
                 "points:=9"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100)
            output = done.stdout.decode()
            self.assertEqual(done.returncode, 0, output)
            self.assertRegex(output, r"verify_bag: 2\d+ verified, 0 differ, 0 skipped")
            self.assertIn("θ(T)", output)
            slopes = re.findall(r"slope dθ\(T\)/dθ\(0\) at 0 from the \w+: ([\d.]+)", output)
            numpy.testing.assert_allclose([float(s) for s in slopes], predicted_slopes(),
                                          atol=1e-6, err_msg=output)
            with open(os.path.join(directory, "fig1.png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")
            bags = glob.glob(os.path.join(directory, "*.bag"))
            self.assertEqual(len(bags), 2)
            subprocess.run([executable("verify_bag")] + bags, check=True, timeout=60,
                           stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "fig1_launch", "__main__")
