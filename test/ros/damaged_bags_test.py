#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Bytes of recordings that are damaged: verify_bag says so, whatever they are."""
import os
import random
import struct
import unittest

import rospy
import rostest
from forged_bags_test import ForgedBags
from forging import DIFFERS, INCOMPLETE, verify


class DamagedBags(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        ForgedBags.setUpClass()

    @classmethod
    def tearDownClass(cls):
        ForgedBags.tearDownClass()

    def test_many_damaged_ones(self):
        """As many as the parameter `damaged` says, bytes of real recordings: each is told, none ends the reader."""
        draw = random.Random(21)
        sound = {}
        for path in (ForgedBags.online, ForgedBags.results):
            with open(path, "rb") as file:
                sound[path] = file.read()
        damaged = os.path.join(ForgedBags.directory, "damaged.bag")
        for k in range(rospy.get_param("damaged", 20)):
            data = bytearray(sound[draw.choice((ForgedBags.online, ForgedBags.results))])
            at, size = draw.randrange(len(data)), draw.choice((1, 4, 100, 5000))
            kind = draw.randrange(5)
            if kind == 0:
                data[at] ^= 1 << draw.randrange(8)
            elif kind == 1:
                del data[at:at + size]
            elif kind == 2:
                data[at:at + size] = bytes(draw.randrange(256) for _ in data[at:at + size])
            elif kind == 3:
                data[at:at] = data[draw.randrange(len(data)):][:size]
            else:
                data[at:at + 4] = struct.pack("<I", draw.choice((0, 2**31 - 1, 2**32 - 1)))
            if bytes(data) in sound.values():
                continue
            with open(damaged, "wb") as file:
                file.write(data)
            code, output = verify(damaged)
            self.assertIn(code, (DIFFERS, INCOMPLETE), "damaged bag %d\n%s" % (k, output[-800:]))
            self.assertNotIn("ended by signal", output)


if __name__ == "__main__":
    rospy.init_node("damaged_bags_test")
    rostest.rosrun("contact_flow", "damaged_bags", DamagedBags)
