#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The pages of docs/, done: files that they give are written, commands are run as printed, outputs compared.

A page is a session of its own, from top to bottom. What starts a node goes on beside it until the page ends. Commands that
say "# by hand:", with a reason, are left out, and listed.
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import rostest
from client import executable

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "test", "docs"))
import page  # noqa: E402

STARTS = ("roslaunch ", "rosrun contact_flow contact_flow_node ")
SECONDS = 60  # of one command


class Session:
    """A shell's folder and environment, and the nodes that were started in it."""

    def __init__(self):
        self.folder = tempfile.mkdtemp()
        self.nodes = []
        programs = os.path.dirname(executable("contact_flow_node"))   # as setup.bash puts on the PATH
        self.environment = dict(os.environ, PATH=programs + ":" + os.environ["PATH"], HOME=self.folder, ROS_HOME=self.folder + "/.ros",
                                ROS_LOG_DIR=self.folder + "/log")

    def shell(self, command):
        """As a user who sourced setup.bash: rosrun does not find what is in a folder named build."""
        rosrun = 'rosrun() { if [ "$1" = contact_flow ]; then shift; "$@"; else command rosrun "$@"; fi; }\n'
        return ["bash", "-c", rosrun + command]

    def start(self, command):
        before = self.services()
        with open(os.path.join(self.folder, "node%d.txt" % len(self.nodes)), "w+") as log:
            node = subprocess.Popen(self.shell(command), cwd=self.folder, env=self.environment, stdout=log,
                                    stderr=subprocess.STDOUT, start_new_session=True)
            self.nodes.append(node)
            end = time.time() + SECONDS
            while time.time() < end and node.poll() is None:
                new = self.services() - before
                if any(service.endswith("/stop_recording") for service in new):
                    return
                time.sleep(0.2)
            log.seek(0)
            raise AssertionError("%s: no node: %s" % (command, log.read()[-2000:]))

    def services(self):
        done = subprocess.run(["rosservice", "list"], stdout=subprocess.PIPE, timeout=SECONDS)
        return set(done.stdout.decode().split())

    def run(self, command):
        done = subprocess.run(self.shell(command), cwd=self.folder, env=self.environment, timeout=SECONDS,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return done.returncode, done.stdout.decode(errors="replace")

    def close(self):
        for node in self.nodes:
            if node.poll() is None:
                os.killpg(node.pid, signal.SIGINT)
        for node in self.nodes:
            node.wait(timeout=30)
        # What they left in the master is not for the next page.
        _, names = self.run("rosparam list")
        for name in {n.split("/")[1] for n in names.split() if n.startswith("/")}:
            if name not in ("rosdistro", "rosversion", "roslaunch", "run_id", "pages", "rosout"):
                self.run("rosparam delete /" + name)
        shutil.rmtree(self.folder, ignore_errors=True)


class PagesAsPrinted(unittest.TestCase):
    def follow(self, name):
        with open(os.path.join(ROOT, "docs", name + ".md"), encoding="utf-8") as file:
            text = file.read()
        session = Session()
        self.addCleanup(session.close)
        for _, body, before in page.blocks(text):
            file_name = re.fullmatch(r"`([\w.]+)`", before)
            if file_name:
                with open(os.path.join(session.folder, file_name.group(1)), "w", encoding="utf-8") as file:
                    file.write(body)
        ran, wrong = 0, []
        for command, expected in page.commands(text):
            if page.BY_HAND in command:
                print("by hand: %s: %s" % (name, command))
                continue
            ran += 1
            begun = time.time()
            if command.startswith(STARTS) and "output_directory" not in command:
                session.start(command)
            else:
                code, output = session.run(command)
                line = page.missing(expected, output)
                if code != 0 or line is not None:
                    wrong.append("%s\nends with %d and prints, without '%s':\n%s"
                                 % (command, code, line, output[:6000]))
            print("%s: %.1f s: %s" % (name, time.time() - begun, command.split("\n")[0][:100]))
        if wrong:
            self.fail("\n".join(wrong))
        return ran, session

    def test_robot(self):
        ran, session = self.follow("robot")
        self.assertGreaterEqual(ran, 3)
        with open(os.path.join(ROOT, "docs", "robot.md"), encoding="utf-8") as file:
            expected, = [b.strip() for _, b, _ in page.blocks(file.read()) if b.startswith("contact_flow: hopper")]
        with open(os.path.join(session.folder, "hopper.yaml"), encoding="utf-8") as file:
            text = file.read()
        with open(os.path.join(session.folder, "hopper.yaml"), "w", encoding="utf-8") as file:
            file.write(text.replace("joint: hip", "joint: hop"))
        code, output = session.run("rosrun contact_flow contact_flow_node __name:=mistaken _robot:=hopper.yaml")
        self.assertEqual(code, 1)
        self.assertIn(expected, output)

    def test_derivative(self):
        self.assertGreaterEqual(self.follow("derivative")[0], 9)

    def test_control(self):
        self.assertGreaterEqual(self.follow("control")[0], 8)

    def test_recording(self):
        self.assertGreaterEqual(self.follow("recording")[0], 7)

    def test_simulator(self):
        self.assertGreaterEqual(self.follow("simulator")[0], 9)

    def test_layouts(self):
        self.assertGreaterEqual(self.follow("layouts")[0], 4)

    def test_cpp(self):
        self.assertGreaterEqual(self.follow("cpp")[0], 1)

    def test_python(self):
        try:
            import contact_flow.cli  # noqa: F401
        except ImportError:
            self.skipTest("built without the Python module")
        self.assertGreaterEqual(self.follow("python")[0], 9)

    def test_ensembles(self):
        try:
            import contact_flow.cli  # noqa: F401
            import zarr  # noqa: F401
        except ImportError:
            self.skipTest("built without the Python module, or python3-zarr is not installed")
        self.assertGreaterEqual(self.follow("ensembles")[0], 4)

    def test_trajectories(self):
        self.assertGreaterEqual(self.follow("trajectories")[0], 2)

    def test_examples(self):
        self.assertGreaterEqual(self.follow("examples")[0], 6)

    def test_every_page_with_commands_is_here(self):
        here = {name[5:] for name in dir(self) if name.startswith("test_")}
        for path in page.pages()[1:]:
            run = [c for c, _ in page.commands(path.read_text(encoding="utf-8")) if page.BY_HAND not in c]
            if run and path.stem != "install":  # which sets up what this test runs in
                self.assertIn(path.stem, here)


if __name__ == "__main__":
    rostest.rosrun("contact_flow", "pages", "__main__")
