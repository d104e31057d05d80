#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""fig3.launch ends by itself, and leaves a verified bag and a picture whose regions are those of simulated runs."""
import os
import re
import subprocess
import tempfile
import unittest

import rostest


class Fig3(unittest.TestCase):
    def test_launch_file_draws_and_ends(self):
        with tempfile.TemporaryDirectory() as directory:
            done = subprocess.run(
                ["roslaunch", "contact_flow", "fig3.launch", "output_directory:=" + directory,
                 "points:=6"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100)
            output = done.stdout.decode()
            self.assertEqual(done.returncode, 0, output)
            self.assertIn("verify_bag: 38 verified, 0 differ, 0 skipped", output)
            trot = re.search(r"trot: period (\S+) s, \|P\(x\) - x\| = (\S+), 2 selections", output)
            self.assertAlmostEqual(float(trot.group(1)), 0.8, places=9)
            self.assertLess(float(trot.group(2)), 1e-9)
            # An even number of points leaves out the orbit itself: every run lands one foot first.
            self.assertIn("first feet of 36 of 36 perturbed runs", output)
            with open(os.path.join(directory, "fig3.png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "fig3_launch", "__main__")
