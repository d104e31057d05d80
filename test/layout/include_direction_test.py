#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The layout of docs/architecture.md, checked: include direction, ROS only in ros/, licence, length.

Each check takes the root of a tree and yields one line per violation. The checks are themselves
tested on small trees, each with one planted violation.
"""
import argparse
import pathlib
import re
import sys
import tempfile
import unittest
from xml.sax.saxutils import quoteattr

ROOT = pathlib.Path(__file__).resolve().parents[2]
PIPELINE = ["", "piecewise_linear", "model", "dynamics", "flow", "derivative", "analysis", "trajectory_optimization",
            "ensemble", "io", "session", "ros/message", "ros/request", "ros/answer", "ros/recording", "ros/display",
            "ros/service", "ros/simulator", "ros/verification", "ros/policy", "ros/node", "nodes"]
RANK = {folder: rank for rank, folder in enumerate(PIPELINE)}
RANK["tools"] = RANK["nodes"]
FIRST_OF_ROS = RANK["ros"] = RANK["ros/message"]
FACADE = ("contact_flow.h",)   # all that users include of the core
MAX_LINES = 350

INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')
ROS_HEADER = re.compile(
    r"(ros|rosbag|rosbag_storage|rosconsole|actionlib|diagnostic_updater|dynamic_reconfigure|nodelet"
    r"|pluginlib|message_filters|topic_tools|tf|tf2\w*|urdf|\w+_msgs|\w+_srvs)/|XmlRpc")


def rank(path):
    """The place in the pipeline of a file, given from the root of the tree."""
    parts = path.parts[2:] if path.parts[0] == "include" else path.parts[1:]
    folder = parts[0] if len(parts) > 1 else ""
    if folder == "ros" and len(parts) > 2:
        folder = "/".join(parts[:2])
    if parts == FACADE:
        folder = "io"
    if folder not in RANK:
        raise LookupError("%s: folder '%s' has no place in the pipeline" % (path, folder))
    return RANK[folder]


def generated_headers(root):
    """Headers that catkin makes of msg/, srv/, action/ and cfg/, as they are included."""
    kinds = {
        "msg": [""],
        "srv": ["", "Request", "Response"],
        "action": ["Action", "ActionGoal", "ActionResult", "ActionFeedback", "Goal", "Result",
                   "Feedback"],
        "cfg": ["Config"],
    }
    return {"contact_flow/%s%s.h" % (path.stem, suffix)
            for kind, suffixes in kinds.items()
            for path in (root / kind).glob("*." + kind) for suffix in suffixes}


def files(root, folders, suffixes):
    return sorted(p for folder in folders for p in (root / folder).rglob("*")
                  if p.suffix in suffixes and p.is_file())


def includes(root):
    """(place 'path:line', includer, delimiter, name) of every #include in include/ and src/."""
    for path in files(root, ["include", "src"], [".h", ".cc"]):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            match = INCLUDE.match(line)
            if match:
                place = "%s:%d" % (path.relative_to(root), number)
                yield place, path, match.group(1), match.group(2)


def resolve(root, includer, name):
    """The header of this tree that `name` means, from the root; None if there is none."""
    for path in (includer.parent / name, root / "include" / name, root / name):
        if path.is_file():
            return path.resolve().relative_to(root)
    return None


def backward_includes(root):
    """A folder includes from a later one of the pipeline."""
    for place, includer, _, name in includes(root):
        header = resolve(root, includer, name)
        if header and rank(header) > rank(includer.relative_to(root)):
            yield "%s includes %s, which comes later" % (place, name)


def ros_in_core(root):
    """A file before ros/ includes a header of ROS or of this package's messages."""
    generated = generated_headers(root)
    for place, includer, _, name in includes(root):
        if rank(includer.relative_to(root)) < FIRST_OF_ROS:
            if ROS_HEADER.match(name) or name in generated:
                yield "%s includes %s, which needs ROS" % (place, name)


def missing_headers(root):
    """A header of this package that does not exist. Those of others are included with < >."""
    generated = generated_headers(root)
    for place, includer, delimiter, name in includes(root):
        own = delimiter == '"' or name.startswith("contact_flow/")
        if own and name not in generated and not resolve(root, includer, name):
            yield "%s includes %s, which does not exist" % (place, name)


SOURCES = ["include", "src", "test", "benchmark", "examples", "scripts", "cmake", "docs/site", "python", ".ci"]


def private_in_public(root):
    """A header of include/, which users have, includes one of src/, which they do not."""
    for place, includer, _, name in includes(root):
        header = resolve(root, includer, name)
        if header and includer.relative_to(root).parts[0] == "include" and header.parts[0] == "src":
            yield "%s includes %s, which is not installed" % (place, name)


def facade_gaps(root):
    """What docs/site/public_headers.txt names and the facade does not include, or the other way round."""
    facade = root / "include" / "contact_flow" / FACADE[0]
    included = {name for _, path, _, name in includes(root) if path == facade}
    listed = {"contact_flow/" + name for name in (root / "docs/site/public_headers.txt").read_text().split()
              if not name.startswith("ros/")}
    for name in sorted(included ^ listed):
        yield "%s is %s" % (name, "not in the facade" if name in listed else "not among the public headers")


def missing_licences(root):
    """A source, script or CMakeLists.txt without the SPDX line among its first three."""
    for path in files(root, SOURCES, [".h", ".cc", ".py", ".sh", ".txt", ".cmake", ".in", ""]):
        head = path.read_text(encoding="utf-8", errors="replace").splitlines()[:3]
        is_source = (path.suffix in (".h", ".cc", ".py", ".sh", ".cmake", ".in") or path.name == "CMakeLists.txt"
                     or (head and head[0].startswith("#!")))
        if is_source and not any("SPDX-License-Identifier: BSD-3-Clause" in line for line in head):
            yield "%s has no SPDX line" % path.relative_to(root)


def long_files(root):
    """A source longer than MAX_LINES: it is two concepts."""
    for path in files(root, SOURCES, [".h", ".cc", ".py"]):
        length = len(path.read_text(encoding="utf-8").splitlines())
        if length > MAX_LINES:
            yield "%s has %d lines, more than %d" % (path.relative_to(root), length, MAX_LINES)


class ThisTree(unittest.TestCase):
    """The checks, on the tree that holds this file."""

    def check(self, violations):
        violations = list(violations)
        self.assertFalse(violations, "\n" + "\n".join(violations))

    def test_is_found(self):
        self.assertGreater(len(list(includes(ROOT))), 20)

    def test_no_backward_include(self):
        self.check(backward_includes(ROOT))

    def test_no_ros_in_core(self):
        self.check(ros_in_core(ROOT))

    def test_included_headers_exist(self):
        self.check(missing_headers(ROOT))

    def test_public_headers_stand_alone(self):
        self.check(private_in_public(ROOT))

    def test_facade_is_complete(self):
        self.check(facade_gaps(ROOT))

    def test_licence(self):
        self.check(missing_licences(ROOT))

    def test_length(self):
        self.check(long_files(ROOT))


class PlantedViolations(unittest.TestCase):
    """The checks, on a clean tree and on the same tree with one violation."""

    SPDX = "// SPDX-License-Identifier: BSD-3-Clause\n"
    CLEAN = {
        "include/contact_flow/types.h": SPDX + "#include <vector>\n",
        "include/contact_flow/flow/a.h": SPDX + '#include "contact_flow/types.h"\n',
        "src/ros/message/c.h": SPDX + '#include <ros/ros.h>\n#include "contact_flow/A.h"\n',
        "src/ros/node/d.cc": SPDX + '#include "src/ros/message/c.h"\n',
        "src/flow/a.cc": SPDX + '#include "contact_flow/flow/a.h"\n#include "private.h"\n',
        "src/flow/private.h": SPDX,
        "src/io/b.cc": SPDX + '#include <contact_flow/flow/a.h>\n#include <yaml-cpp/yaml.h>\n',
        "src/nodes/n.cc": SPDX + '#include "src/ros/message/c.h"\n#include <std_msgs/Header.h>\n',
        "msg/A.msg": "float64 t\n",
    }

    def violations(self, path=None, text="", beside=None):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            planted = {**({path: text} if path else {}), **({beside: self.SPDX} if beside else {})}
            for p, t in {**self.CLEAN, **planted}.items():
                (root / p).parent.mkdir(parents=True, exist_ok=True)
                (root / p).write_text(t, encoding="utf-8")
            checks = [backward_includes, ros_in_core, missing_headers, private_in_public, missing_licences, long_files]
            return [v for check in checks for v in check(root)]

    def expect(self, violation, path, text, beside=None):
        self.assertEqual(self.violations(path, text, beside), [violation])

    def test_clean(self):
        self.assertEqual(self.violations(), [])

    def test_backward_include(self):
        self.expect("src/model/x.cc:2 includes contact_flow/flow/a.h, which comes later",
                    "src/model/x.cc", self.SPDX + '  # include "contact_flow/flow/a.h"\n')

    def test_backward_include_from_the_root(self):
        self.expect("include/contact_flow/y.h:2 includes flow/a.h, which comes later",
                    "include/contact_flow/y.h", self.SPDX + '#include "flow/a.h"\n')

    def test_a_session_that_knows_of_ros(self):
        self.expect("src/session/x.cc:2 includes src/ros/message/c.h, which comes later",
                    "src/session/x.cc", self.SPDX + '#include "src/ros/message/c.h"\n')

    def test_ros_header(self):
        self.expect("src/io/x.cc:2 includes std_msgs/Header.h, which needs ROS",
                    "src/io/x.cc", self.SPDX + "#include <std_msgs/Header.h>\n")

    def test_message_header(self):
        self.expect("src/io/x.cc:2 includes contact_flow/A.h, which needs ROS",
                    "src/io/x.cc", self.SPDX + '#include "contact_flow/A.h"\n')

    def test_missing_header(self):
        self.expect("src/ros/node/x.cc:2 includes contact_flow/flow/z.h, which does not exist",
                    "src/ros/node/x.cc", self.SPDX + '#include "contact_flow/flow/z.h"\n')

    def test_backward_include_among_the_rooms_of_ros(self):
        self.expect("src/ros/message/x.cc:2 includes src/ros/node/x.h, which comes later", "src/ros/message/x.cc",
                    self.SPDX + '#include "src/ros/node/x.h"\n', "src/ros/node/x.h")

    def test_private_header_in_a_public_one(self):
        self.expect("include/contact_flow/flow/x.h:2 includes src/flow/private.h, which is not installed",
                    "include/contact_flow/flow/x.h", self.SPDX + '#include "src/flow/private.h"\n')

    def test_facade(self):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            (root / "include/contact_flow").mkdir(parents=True)
            (root / "docs/site").mkdir(parents=True)
            (root / "include/contact_flow/contact_flow.h").write_text('#include "contact_flow/types.h"\n')
            (root / "docs/site/public_headers.txt").write_text("budget.h\nros/run_node.h\n")
            self.assertEqual(["contact_flow/budget.h is not in the facade",
                              "contact_flow/types.h is not among the public headers"], list(facade_gaps(root)))

    def test_unknown_folder(self):
        with self.assertRaises(LookupError):
            self.violations("src/util/x.cc", self.SPDX + '#include "contact_flow/types.h"\n')

    def test_licence(self):
        self.expect("test/flow/x_test.cc has no SPDX line", "test/flow/x_test.cc", "int x;\n")
        self.expect("scripts/x has no SPDX line", "scripts/x", "#!/bin/sh\n")

    def test_length(self):
        self.expect("src/flow/x.cc has 351 lines, more than 350",
                    "src/flow/x.cc", self.SPDX + "\n" * 350)


def write_junit(path, cases, result):
    """What catkin and scripts/count_tests.py read."""
    failures = {case.id(): text for case, text in result.failures + result.errors}
    pathlib.Path(path).parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", encoding="utf-8") as out:
        out.write("<testsuite name='layout' tests='%d' failures='%d' errors='0'>\n"
                  % (len(cases), len(failures)))
        for name in cases:
            class_name, test = name.split(".")[-2:]
            failure = "<failure message=%s/>" % quoteattr(failures[name]) if name in failures else ""
            out.write("<testcase classname='%s' name='%s'>%s</testcase>\n"
                      % (class_name, test, failure))
        out.write("</testsuite>\n")


def main(classes, description):
    """Runs the cases of `classes`; --junit FILE writes the results."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--junit", help="write the results to this file")
    arguments = parser.parse_args()
    load = unittest.defaultTestLoader.loadTestsFromTestCase
    suites = [load(one) for one in classes]
    cases = [case.id() for suite in suites for case in suite]
    result = unittest.TextTestRunner(stream=sys.stdout).run(unittest.TestSuite(suites))
    if arguments.junit:
        write_junit(arguments.junit, cases, result)
    sys.exit(0 if result.wasSuccessful() else 1)


if __name__ == "__main__":
    main([ThisTree, PlantedViolations], __doc__)
