#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The layouts of config/layouts: what they name is published, by a field that the message has and the panel can show."""
import argparse
import glob
import json
import os
import pathlib
import re
import sys
import unittest
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "layout"))
from include_direction_test import write_junit  # noqa: E402

LAYOUTS = ROOT / "config" / "layouts"
NODE = "/simulator"   # its name in launch/simulator.launch
NUMBERS = {"bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64",
           "byte", "char", "time", "duration"}
STATES = NUMBERS | {"string"}
#: as in std_msgs: the one standard message within ours
HEADER = "uint32 seq\ntime stamp\nstring frame_id\n"


def topics():
    """{"/simulator/state": "contact_flow/HybridState", …}, from the sources that advertise them."""
    found = {}
    for name in ("simulator/simulator_topics", "recording/outlet"):
        source = (ROOT / "src" / "ros" / (name + ".cc")).read_text(encoding="utf-8")
        for whose, kind, topic, more in re.findall(
                r'(node_?|outside)(?:\.|->)advertise<([\w:]+)>\(\s*"([\w/]+)"( \+)?', source):
            if more:
                continue   # one a constraint, or a link
            name = topic if topic[0] == "/" else (NODE if whose != "outside" else "") + "/" + topic
            found[name] = kind.replace("::", "/") if "::" in kind else "contact_flow/" + kind
    for name, kind in result_topics().items():
        found[NODE + "/" + name] = "contact_flow/" + kind
    return found


def result_topics():
    """{"trajectory": "ContactTrajectory", …}: what is made of the results of records, by their list."""
    found = {}
    source = (ROOT / "src/ros/recording/record_types.h").read_text(encoding="utf-8")
    for kinds, names in re.findall(r'RecordType<\w+Record((?:, \w+)+)>\{\s*"\w+",\s*\{(.*?)\}\}', source, re.S):
        found.update(zip(re.findall(r'\{"(\w+)"', names), re.findall(r"\w+", kinds)))
    return found


def definition(kind):
    """The text of a message; None for a standard one that is not installed here."""
    package, name = kind.split("/")
    if package == "contact_flow":
        return (ROOT / "msg" / (name + ".msg")).read_text(encoding="utf-8")
    if kind == "std_msgs/Header":
        return HEADER
    for place in ["/usr/share", *glob.glob("/opt/ros/*/share"),
                  *(p + "/share" for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(":"))]:
        path = pathlib.Path(place) / package / "msg" / (name + ".msg")
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return None


def fields(kind):
    """{name: (type, size)}: size "" of one, "[]" or "[3]" of an array. None where it is not known here."""
    text = definition(kind)
    if text is None:
        return None
    found = {}
    for line in text.split("\n"):
        match = re.match(r"\s*([\w/]+)(\[\d*\])?\s+(\w+)\s*(?:#.*)?$", line)
        if match:
            one, size, name = match.groups()
            if one not in STATES and "/" not in one:
                one = "std_msgs/Header" if one == "Header" else kind.split("/")[0] + "/" + one
            found[name] = (one, size or "")
    return found


def leaf(path, separator, known):
    """(type, is a list) of what a path names. ValueError where there is no such thing; None where the definition of a
    message is not installed. "/" separates fields for PlotJuggler, "." for Foxglove; "[2]" is an entry, "[:]" all of them."""
    topic = max((t for t in known if path == t or path.startswith(t + separator)), key=len, default=None)
    if topic is None:
        raise ValueError("no topic of %s" % path)
    kind, is_list = known[topic], False
    for part in filter(None, path[len(topic):].split(separator)):
        name, index = re.fullmatch(r"(\w+)(\[(?:\d+|:)\])?", part).groups()
        have = fields(kind)
        if have is None:
            return None
        if name not in have:
            raise ValueError("%s: %s has no field %s" % (path, kind, name))
        kind, size = have[name]
        if bool(index) != bool(size):
            raise ValueError("%s: %s is %s" % (path, name, "an array" if size else "no array"))
        if size not in ("", "[]") and index != "[:]" and int(index[1:-1]) >= int(size[1:-1]):
            raise ValueError("%s: %s has %s entries" % (path, name, size[1:-1]))
        is_list = is_list or index == "[:]"
    return kind, is_list


def panels_of(layout):
    """Names of the panels in a tree of splits, which are halves, or a tab's layout."""
    if isinstance(layout, str):
        return [layout]
    if layout["direction"] not in ("row", "column") or not 0 < layout["splitPercentage"] < 100:
        raise ValueError("a split: %s" % layout)
    return panels_of(layout["first"]) + panels_of(layout["second"])


class Layouts(unittest.TestCase):
    def setUp(self):
        self.known = topics()

    def show(self, path, separator, types, lists=False):
        found = leaf(path, separator, self.known)
        if found is None:
            print("not checked, its message is not installed: " + path)
            return
        self.assertIn(found[0], types, path)
        self.assertEqual(lists, found[1], path)

    def test_topics_of_results_are_found(self):
        self.assertEqual({"trajectory": "ContactTrajectory", "mode_sequence": "ModeSequence",
                          "b_derivative": "OutcomeDerivative"}, result_topics())

    def test_plotjuggler(self):
        root = xml.etree.ElementTree.parse(LAYOUTS / "plotjuggler.xml").getroot()
        curves = [curve.get("name") for curve in root.iter("curve")]
        self.assertGreater(len(curves), 30)
        for name in curves:
            self.show(name, "/", NUMBERS)
        for split in root.iter("DockSplitter"):
            sizes = [float(s) for s in split.get("sizes").split(";")]
            self.assertEqual([int(split.get("count"))] * 2, [len(sizes), len(split)])
            self.assertAlmostEqual(1, sum(sizes), places=4)
        for plot in root.iter("plot"):
            self.assertEqual(["range", "limitY"], [child.tag for child in plot][:2])
            self.assertIsNotNone(plot.find("curve"))

    def test_foxglove(self):
        layout = json.loads((LAYOUTS / "foxglove.json").read_text(encoding="utf-8"))
        configs = layout["configById"]
        shown = panels_of(layout["layout"])
        for name in list(shown):
            if name.startswith("Tab!"):
                shown += [p for tab in configs[name]["tabs"] for p in panels_of(tab["layout"])]
        self.assertEqual(sorted(configs), sorted(shown))
        checked = 0
        for name, config in configs.items():
            kind = name.split("!")[0]
            if kind in ("Plot", "StateTransitions"):
                for path in config["paths"]:
                    self.assertIn(path["timestampMethod"], ("receiveTime", "headerStamp"))
                    topic = path["value"].split(".")[0]
                    if path["timestampMethod"] == "headerStamp":
                        self.show(topic + ".header.stamp", ".", {"time"})
                    self.show(path["value"], ".", NUMBERS if kind == "Plot" else STATES,
                              config.get("xAxisVal") == "index")
                    checked += 1
            elif kind == "RawMessages":
                leaf(config["topicPath"], ".", self.known)
            elif kind == "DiagnosticSummary":
                self.assertEqual("diagnostic_msgs/DiagnosticArray", self.known[config["topicToRender"]])
            elif kind == "3D":
                for topic in config["topics"]:
                    self.assertIn(self.known[topic], ("visualization_msgs/MarkerArray", "tf2_msgs/TFMessage"))
                parameters = [l["parameter"] for l in config["layers"].values() if "parameter" in l]
                self.assertEqual(["/robot_description"], parameters)
            else:
                self.assertEqual("Tab", kind)
        self.assertGreater(checked, 25)

    def test_the_launch_file_has_these_names(self):
        launch = (ROOT / "launch" / "simulator.launch").read_text(encoding="utf-8")
        self.assertIn('name="name" default="%s"' % NODE[1:], launch)
        self.assertIn('name="namespace" default="/"', launch)
        self.assertIn('name="robot_description"', launch)

    def test_what_is_wrong_is_found(self):
        for path in ("/simulator/stat.force[0]", "/simulator/state.forces[0]", "/simulator/state.force",
                     "/simulator/state.t[0]", "/simulator/status.margins.gaps", "/odometry.twist",
                     "/simulator/record.previous[0]"):
            with self.assertRaises(ValueError, msg=path):
                leaf(path, ".", self.known)
        with self.assertRaisesRegex(ValueError, "has 32 entries"):
            leaf("/link.digest[32]", ".", {"/link": "contact_flow/RecordingLink"})
        self.assertEqual(("float64", False), leaf("/simulator/state/force[3]", "/", self.known))
        self.assertEqual(("float64", True), leaf("/simulator/rolling_derivative.tangents.data[:]", ".", self.known))
        self.assertEqual(("time", False), leaf("/simulator/state.header.stamp", ".", self.known))
        with self.assertRaises(ValueError):
            panels_of({"direction": "row", "first": "a", "second": "b", "splitPercentage": 100})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--junit", help="write the results to this file")
    arguments = parser.parse_args()
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(Layouts)
    cases = [case.id() for case in suite]
    result = unittest.TextTestRunner(stream=sys.stdout).run(suite)
    if arguments.junit:
        write_junit(arguments.junit, cases, result)
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
