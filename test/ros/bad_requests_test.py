#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every bad request is answered with success: false and a message that names field and value, and the
node still answers afterwards. A node with bad parameters says so and does not start."""
import os
import re
import subprocess
import tempfile
import unittest

import rospy
import rostest
from client import Client, executable, package_path
from contact_flow.msg import (
    DerivativeOptions, InitialState, RowMajorMatrix, SimulationOptions)
from contact_flow.srv import SimulateTrajectoryResponse

NAN, INF = float("nan"), float("inf")


def nominal(**changes):
    q = [0, -0.25, 0.25, 1, 0.5, 0.5, 0]
    v = [0] * 7
    for key, value in changes.items():
        (q if key[0] == "q" else v)[int(key[1])] = value
    return InitialState(q=q, v=v)


# What is wrong: the fields of a request for a run, and words that the message must have.
RUNS = {
    "nan in q": (dict(state=nominal(q3=NAN)), ["state.q[3]", "nan"]),
    "inf in v": (dict(state=nominal(v6=INF)), ["state.v[6]", "inf"]),
    "-inf in v": (dict(state=nominal(v6=-INF)), ["state.v[6]", "-inf"]),
    "nan by name": (dict(state=InitialState(names=["body_z"], positions=[NAN])),
                    ["state.positions[0]", "nan"]),
    "short q": (dict(state=InitialState(q=[1, 2, 3])), ["state.q", "3 entries", "7", "body_pitch"]),
    "long v": (dict(state=InitialState(v=[0] * 8)), ["state.v", "8 entries", "7"]),
    "q and v in one": (dict(state=InitialState(q=[0] * 14)), ["state.q", "14 entries"]),
    "unknown coordinate": (dict(state=InitialState(names=["body_pich"], positions=[0.1])),
                           ["state.names[0]", "body_pich", "'body_pitch'"]),
    "empty coordinate": (dict(state=InitialState(names=[""], positions=[0.1])),
                         ["state.names[0]", "''"]),
    "coordinate twice": (dict(state=InitialState(names=["body_x"] * 2, positions=[0.1, 0.2])),
                         ["state.names[0]", "body_x", "twice"]),
    "names without numbers": (dict(state=InitialState(names=["body_x"])),
                              ["state.names", "state.positions"]),
    "numbers without names": (dict(state=InitialState(positions=[1.0])),
                              ["state.positions", "1 entries", "0"]),
    "too few positions": (dict(state=InitialState(names=["body_x", "body_z"], positions=[1])),
                          ["state.positions", "1 entries", "2"]),
    "input of a model without": (dict(input=[1.0]), ["input", "1 entries", "0"]),
    "penetrating state": (dict(state=nominal(q4=-0.1)), ["left_foot", "-0.1", "penetrates"]),
    "velocity into an active contact": (dict(state=nominal(q5=0, v5=-0.5)),
                                        ["right_foot", "-0.5", "contact"]),
    "negative horizon": (dict(duration=-1), ["duration", "-1"]),
    "absurd horizon": (dict(duration=1e9), ["duration", "1e+09", "1e6"]),
    "nan horizon": (dict(duration=NAN), ["duration", "nan"]),
    "inf horizon": (dict(duration=INF), ["duration", "inf"]),
    "nan tolerance": (dict(options=SimulationOptions(relative_tolerance=NAN)),
                      ["options.relative_tolerance", "nan"]),
    "negative tolerance": (dict(options=SimulationOptions(absolute_tolerance=-1e-9)),
                           ["options.absolute_tolerance", "-1e-09"]),
    "loose tolerance": (dict(options=SimulationOptions(relative_tolerance=10)),
                        ["relative_tolerance", "10"]),
    "negative budget": (dict(options=SimulationOptions(max_steps=-5)), ["options.max_steps", "-5"]),
    "absurd budget": (dict(options=SimulationOptions(max_events=10**12)),
                      ["options.max_events", "1000000000000", "1000000"]),
    "absurd time": (dict(options=SimulationOptions(max_seconds=1e7)),
                    ["max_seconds", "1e+07", "3600"]),
    "unknown impact law": (dict(options=SimulationOptions(impact_law="projektion")),
                           ["options.impact_law", "projektion", "'projection'"]),
}

DIRECTIONS = {
    "unknown direction": (dict(directions=["+left_foot_y"]),
                          ["directions[0]", "+left_foot_y", "left_foot_"]),
    "no direction": (dict(directions=["body_x", ""]), ["directions[1]", "''"]),
    "unknown rate": (dict(directions=["-d/dt bodyx"]), ["directions[0]", "bodyx", "body_x"]),
    "nan in a direction": (dict(direction_matrix=RowMajorMatrix(data=[0.0] * 13 + [NAN])),
                           ["direction_matrix.data[13]", "nan"]),
    "ragged directions": (dict(direction_matrix=RowMajorMatrix(data=[0.0] * 15)),
                          ["direction_matrix.data", "15", "14"]),
    "wrong columns": (dict(direction_matrix=RowMajorMatrix(rows=1, cols=7, data=[0.0] * 7)),
                      ["direction_matrix.cols", "7", "14"]),
    "wrong rows": (dict(direction_matrix=RowMajorMatrix(rows=2, cols=14, data=[0.0] * 14)),
                   ["direction_matrix.data", "14", "2"]),
    "absurd rows": (dict(direction_matrix=RowMajorMatrix(rows=4294967295, cols=14)),
                    ["direction_matrix", "4294967295", "512"]),
    "a thousand directions": (dict(directions=["body_x"] * 1000), ["directions", "1000", "512"]),
    "a thousand rows": (dict(direction_matrix=RowMajorMatrix(data=[0.0] * 14000)),
                        ["direction_matrix", "1000", "512"]),
    "bad derivative tolerance": (dict(derivative_options=DerivativeOptions(tolerance=NAN)),
                                 ["derivative_options.tolerance", "nan"]),
}

ALPHAS = {
    "zero alpha": (dict(alphas=[0.1, 0]), ["alphas[1]", "0"]),
    "negative alpha": (dict(alphas=[-0.1]), ["alphas[0]", "-0.1"]),
    "nan alpha": (dict(alphas=[NAN]), ["alphas[0]", "nan"]),
    "many alphas": (dict(alphas=[0.1] * 1000), ["alphas", "1000", "32"]),
    "many runs": (dict(directions=["body_x"] * 500, alphas=[0.1] * 30), ["15000", "2048"]),
}


class BadRequests(unittest.TestCase):
    def refused(self, answer, words, what):
        self.assertFalse(answer.success, what)
        for word in words:
            self.assertIn(word, answer.message, what)

    def all_refused(self, service, table):
        for what, (fields, words) in table.items():
            answer = service(**fields)
            self.refused(answer, words, what)
            self.assertEqual(answer.outcome, SimulateTrajectoryResponse.REFUSED, what)

    def tearDown(self):
        self.assertTrue(Client("soft").simulate().success)

    def test_simulate(self):
        self.all_refused(Client("soft").simulate, RUNS)
        self.all_refused(Client("soft").simulate,
                         {"samples": (dict(samples=100001), ["samples", "100001", "100000"])})

    def test_b_derivative(self):
        self.all_refused(Client("soft").b_derivative, RUNS)
        self.all_refused(Client("soft").b_derivative, DIRECTIONS)
        self.all_refused(Client("wall").b_derivative,
                         {"inadmissible": (dict(directions=["-y"]), ["-y", "{floor}"])})

    def test_compare(self):
        self.all_refused(Client("soft").compare, RUNS)
        self.all_refused(Client("soft").compare, DIRECTIONS)
        self.all_refused(Client("soft").compare, ALPHAS)

    def test_unknown_model(self):
        answer = Client("soft").describe_model(model="sft_biped")
        self.refused(answer, ["sft_biped", "'soft_biped'"], "unknown model")

    def test_bag_names(self):
        client = Client("soft")
        for name in ("/tmp/x", "../x", "a/b", "..", ".hidden", "a b", "x\n", "x" * 300, "-rf", ".bag"):
            answer = client.start_recording(name=name)
            self.refused(answer, ["name", name[:60]], name)
        self.refused(client.stop_recording(), ["not recording"], "stop without start")


JOINT = ('<joint name="extra" type="continuous"><parent link="{}"/><child link="{}"/>'
         '<axis xyz="0 1 0"/></joint>')


class BadParameters(unittest.TestCase):
    def start(self, *arguments):
        """Exit code and output of a node with these arguments; it must end by itself."""
        done = subprocess.run([executable("contact_flow_node"), "__name:=doomed", *arguments],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=30)
        if rospy.has_param("/doomed"):
            rospy.delete_param("/doomed")
        return done.returncode, done.stdout.decode()

    def refused(self, words, *arguments):
        code, output = self.start(*arguments)
        self.assertEqual(code, 1, output)
        for word in words:
            self.assertIn(word, output)

    def test_each_is_named(self):
        self.refused(["sft_biped", "soft_biped"], "_model:=sft_biped")
        self.refused(["modle", "'model'"], "_modle:=soft_biped")
        self.refused(["stiffnes", "'stiffness'"], "_parameters/stiffnes:=27")
        self.refused(["stiffness", "'soft'"], "_parameters/stiffness:=soft")
        self.refused(["body_mass", "-1"], "_parameters/body_mass:=-1")
        self.refused(["relative_tolerance", "-1"], "_options/relative_tolerance:=-1")
        self.refused(["record", "'perhaps'"], "_record:=perhaps")
        self.refused(["threads", "0"], "_threads:=0")
        self.refused(["name", "a/b"], "_record:=true", "_bag_name:=a/b")
        self.refused(["bag_directory", "/proc"], "_record:=true", "_bag_directory:=/proc/none")

    def test_files(self):
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "model.yaml")
            for text, words in (("model: soft_biped\nparameters: {stiffness: 1\n", ["line"]),
                                ("model: soft_biped\nparameters:\n  stifness: 1\n",
                                 ["stifness", "'stiffness'"]),
                                ("model: soft_biped\noptions:\n  max_step: [1]\n",
                                 ["options/max_step", "line 3"]),
                                ("\t- x: [", ["line 1"]),
                                ("soft_biped", ["expected a map"])):
                with open(path, "w") as file:
                    file.write(text)
                self.refused(words, "_model_file:=" + path)
        self.refused(["/nowhere.yaml", "cannot be read"], "_model_file:=/nowhere.yaml")

    def test_robots(self):
        folder = os.path.join(package_path(), "config", "robots")
        biped = "_robot:=" + os.path.join(folder, "planar_biped.yaml")
        with open(os.path.join(folder, "planar_biped.urdf")) as file:
            urdf = file.read()
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "robot.urdf")
            for text, words in (
                    (urdf[:1000], ["URDF", "never closed", "line"]),
                    ("", ["no XML element"]),
                    (urdf.replace("</robot>", "<link name=\"loose\"/></robot>"), ["root"]),
                    (urdf.replace("</robot>", JOINT.format("torso", "left_thigh") + "</robot>"),
                     ["'left_thigh'", "child of two joints"]),
                    (urdf.replace('<parent link="torso"/>', '<parent link="left_foot"/>'), ["root"]),
                    (urdf.replace('<mass value="', '<mass value="-', 1), ["torso", "mass is -"]),
                    (re.sub('<mass value="[^"]*"', '<mass value="0"', urdf, 1), ["base_pitch", "moves no mass", "<inertial>"]),
                    (re.sub('ixx="[^"]*"', 'ixx="nan"', urdf, 1), ["torso"]),
                    (urdf.replace("<axis", "<mimic joint=\"left_hip\"/><axis"), ["mimics"]),
                    (urdf.replace("</robot>", "<link name=\"l\"/>" * 1000000 + "</robot>"),
                     ["bytes"])):
                with open(path, "w") as file:
                    file.write(text)
                self.refused(words, biped, "_robot_description:=" + path)
            yaml = os.path.join(directory, "robot.yaml")
            for text, words in (
                    ("base: planr", ["'planar'", "line 1"]),
                    ("base: planar\nconstraints:\n  foot: {kind: plane, link: left_fot}",
                     ["'left_foot'", "line 3"]),
                    ("base: planar\nefforts:\n  s: {kind: servo, joint: left_hip, input: u, stifness: 1}",
                     ["stiffness", "line 3"]),
                    ("base: planar\ngravity: .nan", ["gravity", "line 2"]),
                    ("[" * 100000, ["bad file"])):
                with open(yaml, "w") as file:
                    file.write(text)
                self.refused(words + [yaml], "_robot:=" + yaml, "_robot_description:=" + os.path.join(
                    folder, "planar_biped.urdf"))
            with open(yaml, "w") as file:
                file.write("base: planar")
            self.refused(["'urdf' is missing"], "_robot:=" + yaml)
        self.refused(["/nowhere.yaml", "cannot be read"], "_robot:=/nowhere.yaml")
        self.refused(["/nowhere.urdf", "cannot be read"], biped, "_robot_description:=/nowhere.urdf")
        self.refused(["/model", "one of them"], biped, "_model:=soft_biped")
        self.refused(["/robot", "is missing"], "_robot_description:=/nowhere.urdf")
        self.refused(["torso_mas", "'torso_mass'"], biped, "_parameters/torso_mas:=1")
        self.refused(["torso_mass", "-1"], biped, "_parameters/torso_mass:=-1")

    def test_player(self):
        """What plays a robot's run says what is wrong with it, and ends."""
        def refused(words, *arguments):
            done = subprocess.run([executable("robot_player"), "__name:=doomed", *arguments],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=30)
            rospy.delete_param("/doomed")
            self.assertEqual(done.returncode, 1, done.stdout.decode())
            for word in words:
                self.assertIn(word, done.stdout.decode())
        refused(["'soft_biped'", "no robot"], "_source:=soft")
        refused(["speed", "0"], "_speed:=0")
        refused(["sped", "'speed'"], "_sped:=1")


class UsualDescription(unittest.TestCase):
    """A YAML that names no URDF goes with the text of the parameter robot_description."""
    def test_it_is_found(self):
        with open(os.path.join(package_path(), "config", "robots", "planar_biped.urdf")) as file:
            rospy.set_param("/robot_description", file.read())
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as yaml:
            yaml.write("base: planar\nconstraints:\n  foot: {kind: plane, link: left_foot}")
            yaml.flush()
            node = subprocess.Popen([executable("contact_flow_node"), "__name:=usual",
                                     "_robot:=" + yaml.name])
            try:
                description = Client("usual").describe_model().description
            finally:
                node.terminate()
                node.wait(timeout=30)
                rospy.delete_param("/robot_description")
        self.assertEqual((description.name, description.constraints), ("planar_biped", ["foot"]))


if __name__ == "__main__":
    rospy.init_node("bad_requests_test")
    rostest.rosrun("contact_flow", "bad_requests", "__main__")
