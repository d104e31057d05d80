#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""fig2.launch ends by itself, and leaves a verified bag and a picture of two orders, one derivative."""
import glob
import os
import re
import subprocess
import tempfile
import unittest

import rostest
from client import executable


class Fig2(unittest.TestCase):
    def test_launch_file_draws_and_ends(self):
        with tempfile.TemporaryDirectory() as directory:
            done = subprocess.run(
                ["roslaunch", "contact_flow", "fig2.launch", "output_directory:=" + directory,
                 "points:=9"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100)
            output = done.stdout.decode()
            self.assertEqual(done.returncode, 0, output)
            self.assertRegex(output, r"verify_bag: 2\d verified, 0 differ, 0 skipped")
            # Events apart in either order, and at once.
            table = output[output.index("contact modes"):output.index("derivative at 0")]
            for modes in ("{floor} {floor, wall} {wall}", "{floor} {} {wall}", "{floor} {wall}"):
                self.assertIn(modes + "\n", table)
            one = re.search(r"derivative at 0: 1 piece, right and left differ by (\S+)", output)
            self.assertLess(float(one.group(1)), 1e-12, output)
            # Beside 0, events are isolated: the derivative is a product of saltation matrices in that order,
            # O(1e-5 s) away from the one at 0.
            beside = re.findall(r"derivative at ([+-])1e-05 s, (.*): differs by (\S+) from", output)
            self.assertEqual([(sign, modes) for sign, modes, _ in beside],
                             [("-", "{floor} {floor, wall} {wall}"), ("+", "{floor} {} {wall}")])
            for _, _, difference in beside:
                self.assertLess(float(difference), 1e-3, output)
            powers = re.findall(r"falling with power ([\d.]+)", output)
            self.assertEqual(len(powers), 2, output)
            for power in powers:
                self.assertAlmostEqual(float(power), 1, delta=0.05)
            with open(os.path.join(directory, "fig2.png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")
            bag, = glob.glob(os.path.join(directory, "*.bag"))
            subprocess.run([executable("verify_bag"), bag], check=True, timeout=60,
                           stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "fig2_launch", "__main__")
