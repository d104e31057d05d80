#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""fig4.launch ends by itself, and leaves verified bags, the verdicts, and a picture of a ball and its images."""
import os
import re
import subprocess
import tempfile
import unittest

import rostest


class Fig4(unittest.TestCase):
    def test_launch_file_draws_and_ends(self):
        with tempfile.TemporaryDirectory() as directory:
            done = subprocess.run(
                ["roslaunch", "contact_flow", "fig4.launch", "output_directory:=" + directory,
                 "points:=8", "range:=0.0001"],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100)
            output = done.stdout.decode()
            self.assertEqual(done.returncode, 0, output)
            self.assertIn("verify_bag: 20 verified, 0 differ, 0 skipped", output)
            self.assertRegex(output, r"wide: stable: .*, verified\)")
            self.assertRegex(output, r"narrow: unstable: .*, verified\)")
            # The verdict's growth is an active eigenvalue of one of the two selections.
            growth = float(re.search(r"narrow: unstable: a direction grows by (\S+)", output).group(1))
            active = [float(value) for value in
                      re.findall(r"narrow eigenvalue (\S+) of the selection", output)]
            self.assertTrue(any(abs(value - growth) < 1e-3 for value in active), output)
            # Errors are of the order of the perturbation, times the square of what grows by 35.
            for name, most in (("wide", 1e-3), ("narrow", 1e-1)):
                error = re.search(name + r" simulated returns differ from the derivative by (\S+) of",
                                  output)
                self.assertLess(float(error.group(1)), most)
            with open(os.path.join(directory, "fig4.png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "fig4_launch", "__main__")
