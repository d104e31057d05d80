#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""fig5.launch ends by itself, and leaves verified bags, a walker's eigenvalues, and a picture."""
import os
import re
import subprocess
import tempfile
import unittest

import rostest


class Fig5(unittest.TestCase):
    def test_launch_file_draws_and_ends(self):
        with tempfile.TemporaryDirectory() as directory:
            done = subprocess.run(
                ["roslaunch", "contact_flow", "fig5.launch", "output_directory:=" + directory,
                 "steps:=4", "duration:=3"],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100)
            output = done.stdout.decode()
            self.assertEqual(done.returncode, 0, output)
            self.assertIn("verify_bag: 4 verified, 0 differ, 0 skipped", output)
            self.assertRegex(output, r"block: s\+s?-", output)
            out = float(re.search(r"leaves its cone by (\S+) N", output).group(1))
            self.assertLess(out, 1e-6)
            self.assertIn("walker: period 0.734346391 s", output)
            self.assertIn("eigenvalues -0.199726+0.544476i, -0.199726-0.544476i, 0.131573", output)
            self.assertRegex(output, r"walker: stable: .*, verified\)")
            with open(os.path.join(directory, "fig5.png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "fig5_launch", "__main__")
