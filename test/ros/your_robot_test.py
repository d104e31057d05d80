#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The README's "Your robot in ten minutes", done: its files written, its commands run, its answers compared."""
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import rospy
import rostest
from client import Client, executable, package_path


def section():
    with open(os.path.join(package_path(), "README.md")) as readme:
        text = readme.read()
    return re.search(r"\n## Your robot in ten minutes\n(.*?)\n## ", text, re.S).group(1)


def blocks(text):
    """The fenced blocks of a text."""
    return re.findall(r"```[a-z]*\n(.*?)```", text, re.S)


def matches(expected, line):
    """The same words, and numbers to 1e-6: other compilers and libraries round differently."""
    a, b = expected.split(), line.split()
    def same(x, y):
        try:
            return abs(float(x) - float(y)) <= 1e-6 * max(1, abs(float(x)))
        except ValueError:
            return x == y
    return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))


class YourRobot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.text = section()
        for name in ("hopper.urdf", "hopper.yaml"):
            block = blocks(cls.text.split("`" + name + "`\n", 1)[1])[0]
            with open(os.path.join(cls.folder.name, name), "w") as file:
                file.write(block)
        command = re.search(r"\$ (roslaunch .*?) rviz:=true\n", cls.text).group(1)
        cls.launch = subprocess.Popen("exec " + command + " output:=log", shell=True,
                                      cwd=cls.folder.name, stdout=subprocess.DEVNULL)
        Client("contact_flow")  # waits for all services

    @classmethod
    def tearDownClass(cls):
        cls.launch.terminate()
        cls.launch.wait(timeout=30)
        cls.folder.cleanup()

    def test_every_call_answers_as_the_readme_says(self):
        asked = 0
        for block in blocks(self.text):
            for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
                command, *expected = part.rstrip("\n").split("\n")
                if not command.startswith("rosservice"):
                    continue
                asked += 1
                answer = subprocess.run(command, shell=True, stdout=subprocess.PIPE, timeout=60)
                lines = answer.stdout.decode().split("\n")
                for line in expected:
                    found = line == "…" or any(matches(line, other) for other in lines)
                    self.assertTrue(found, (command, line, lines))
        self.assertEqual(asked, 2)

    def test_mistake_is_answered_as_the_readme_says(self):
        with open(os.path.join(self.folder.name, "hopper.yaml")) as file:
            text = file.read()
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(os.path.join(self.folder.name, "hopper.urdf"), folder)
            with open(os.path.join(folder, "hopper.yaml"), "w") as file:
                file.write(text.replace("joint: hip", "joint: hop"))
            done = subprocess.run([executable("contact_flow_node"), "__name:=mistaken",
                                   "_robot:=hopper.yaml"], cwd=folder, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, timeout=30)
        self.assertEqual(done.returncode, 1)
        expected, = [b.strip() for b in blocks(self.text) if b.startswith("contact_flow: hopper.yaml")]
        self.assertIn(expected, done.stdout.decode())

    def test_every_kind_is_in_the_tables(self):
        for folder in ("constraint", "effort"):
            path = os.path.join(package_path(), "include/contact_flow/model/rigid_body", folder)
            for name in sorted(os.listdir(path)):
                with open(os.path.join(path, name)) as file:
                    for kind in re.findall(r'kName = "(.*?)"', file.read()):
                        self.assertIn("`" + kind + "`", self.text)


if __name__ == "__main__":
    rospy.init_node("your_robot_test")
    rostest.rosrun("contact_flow", "your_robot", "__main__")
