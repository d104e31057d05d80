# SPDX-License-Identifier: BSD-3-Clause
"""What a forger of bags needs."""
import os
import struct
import subprocess

import rosbag
from client import executable

VERIFIED, DIFFERS, INCOMPLETE = 0, 1, 3


def verify(*bags):
    # One that says of an endless run that it came to its end is repeated to no end.
    done = subprocess.run([executable("verify_bag"), "--max-seconds", "30", *bags], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=120)
    return done.returncode, done.stdout


def forge_bag(source, target):
    build = os.path.dirname(executable("verify_bag"))
    subprocess.run([os.path.join(build, "forge_bag"), source, target], check=True, timeout=60)


class Entry:
    """A message of a bag, with all that a forger needs."""

    def __init__(self, topic, message, stamp, header):
        self.topic, self.message, self.stamp, self.header = topic, message, stamp, header


def read(path):
    with rosbag.Bag(path) as bag:
        return [Entry(*entry) for entry in bag.read_messages(return_connection_header=True)]


def write(path, entries):
    with rosbag.Bag(path, "w") as bag:
        for e in entries:
            bag.write(e.topic, e.message, e.stamp, connection_header=e.header)


def next_up(number):
    pattern = struct.unpack("<q", struct.pack("<d", number))[0]
    return struct.unpack("<d", struct.pack("<q", pattern + 1))[0]


def change_one(numbers, draw):
    numbers = list(numbers)
    k = draw.randrange(len(numbers))
    numbers[k] = next_up(numbers[k])
    return numbers


def verify_after(told, entries):
    """The exit code under a new chain."""
    return told(entries)[1][0]
