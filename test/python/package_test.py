#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The package: ROS's messages beside it, docstrings, types, doctests, examples, the command."""
import ast
import doctest
import importlib
import importlib.util
import inspect
import json
import os
import pathlib
import re
import site
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import contact_flow as cf
import case
from contact_flow import _core

FOLDER = pathlib.Path(cf.__file__).parent
EXAMPLES = sorted((case.ROOT / "examples" / "python").glob("*.py"))
MODULES = ["contact_flow", "contact_flow.jet", "contact_flow.python_model", "contact_flow.sections",
           "contact_flow.cli", "contact_flow.cli_commands", "contact_flow.report", "contact_flow.report_scene",
           "contact_flow.report_shapes", "contact_flow.report_words", "contact_flow.bags", "contact_flow.ros",
           "contact_flow.bag_writer", "contact_flow.differences", "contact_flow.model_checks", "contact_flow.progress",
           "contact_flow.trajectories", "contact_flow.draws", "contact_flow.ensemble", "contact_flow.ensemble_store",
           "contact_flow.ensemble_chunks", "contact_flow.ensemble_plots", "contact_flow.cli_sweep"]


def classes():
    return {name: value for name, value in vars(_core).items()
            if inspect.isclass(value) and not issubclass(value, Exception)}


class Messages(unittest.TestCase):
    def test_messages_of_ros_are_in_the_same_package(self):
        try:
            found = importlib.util.find_spec("contact_flow.msg") and importlib.util.find_spec("genpy")
        except ImportError:
            found = None
        if not found:
            self.skipTest("built without ROS: no contact_flow.msg")
        from contact_flow.msg import ContactTransition  # noqa: F401
        from contact_flow.srv import SimulateTrajectory
        self.assertTrue(hasattr(SimulateTrajectory, "_request_class"))
        self.assertEqual("soft_biped", cf.Model("soft_biped").name)

    def test_a_second_folder_of_this_name_joins(self):
        """As a message package elsewhere on the path, before or behind this one."""
        with tempfile.TemporaryDirectory() as folder:
            package = pathlib.Path(folder) / "contact_flow"
            (package / "there").mkdir(parents=True)
            (package / "there" / "__init__.py").write_text("value = 3\n")
            (package / "__init__.py").write_text(
                "from pkgutil import extend_path\n__path__ = extend_path(__path__, __name__)\n")
            program = "import contact_flow.there as t, contact_flow; assert t.value == 3; %s"
            own = str(FOLDER.parent)
            for path, more in (([own, folder], "contact_flow.Model"), ([folder, own],
                                                                      "import contact_flow._core")):
                subprocess.run([sys.executable, "-c", program % more], check=True,
                               env=dict(os.environ, PYTHONPATH=os.pathsep.join(path)))

    def test_messages_do_not_need_the_extension(self):
        with tempfile.TemporaryDirectory() as folder:
            package = pathlib.Path(folder) / "contact_flow"
            (package / "msg").mkdir(parents=True)
            (package / "msg" / "__init__.py").write_text("value = 3\n")
            (package / "__init__.py").write_text((FOLDER / "__init__.py").read_text(encoding="utf-8"))
            program = ("import contact_flow.msg\nassert contact_flow.msg.value == 3\n"
                       "try:\n    contact_flow.Model\nexcept ImportError as e:\n"
                       "    assert 'extension' in str(e), e\nelse:\n    raise SystemExit(1)")
            # -S: without the folders where this package may be installed
            subprocess.run([sys.executable, "-S", "-c", program], check=True,
                           env=dict(os.environ, PYTHONPATH=folder))


class Documentation(unittest.TestCase):
    def test_every_public_name_is_documented(self):
        missing = [name for name in cf.__all__ if not inspect.getdoc(getattr(cf, name))]
        self.assertEqual([], [name for name in missing
                              if not issubclass(getattr(cf, name), Exception)])
        for name, value in classes().items():
            self.assertIn(name, cf.__all__)
            for method, function in vars(value).items():
                if method.startswith("_"):
                    continue
                if isinstance(function, property):
                    self.assertTrue((function.__doc__ or "").strip(), name + "." + method)
                    continue
                text = inspect.getdoc(getattr(value, method)) or ""
                self.assertGreater(len(text.strip().split("\n")), 1, name + "." + method)

    def test_doctests(self):
        if int(np.__version__.split(".")[0]) > 1:
            np.set_printoptions(legacy="1.25")   # 1.2, not np.float64(1.2)
        attempted = 0
        for name in MODULES:
            module = importlib.import_module(name)
            result = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
            self.assertEqual(0, result.failed, name)
            attempted += result.attempted
        counts = {"docstrings": (attempted, 8)}
        for name, least in (("python", 30), ("gradients", 20)):
            if name == "python" and not cf.have_linear_programs():
                print("docs/python.md: not tried, built without Clp")
                continue
            page = case.ROOT / "docs" / (name + ".md")
            result = doctest.testfile(str(page), module_relative=False, encoding="utf-8",
                                      globs={"ROBOTS": case.ROBOTS},
                                      optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
            self.assertEqual(0, result.failed, name)
            counts["docs/%s.md" % name] = (result.attempted, least)
        print("doctests: " + ", ".join("%d in %s" % (count, name) for name, (count, _) in counts.items()))
        for name, (count, least) in counts.items():
            self.assertGreaterEqual(count, least, name)


class Types(unittest.TestCase):
    def test_stubs_have_what_the_extension_has(self):
        tree = ast.parse((FOLDER / "_core.pyi").read_text(encoding="utf-8"))
        stubs = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        own = {name for name, value in vars(_core).items() if not name.startswith("_")}
        self.assertEqual(own, set(stubs))
        for name, value in classes().items():
            declared = {node.name for node in stubs[name].body if isinstance(node, ast.FunctionDef)}
            have = {member for member in vars(value) if not member.startswith("_")}
            self.assertEqual(have, {member for member in declared if not member.startswith("_")}, name)

    def test_mypy(self):
        mypy = [sys.executable, "-m", "mypy"]
        if subprocess.run(mypy + ["--version"], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL).returncode:
            self.skipTest("mypy is not installed")
        with tempfile.TemporaryDirectory() as cache:
            path = "" if str(FOLDER.parent) in site.getsitepackages() else str(FOLDER.parent)
            sources = [str(FOLDER / name) for name in sorted(os.listdir(FOLDER))
                       if name.endswith((".py", ".pyi"))]
            for files in (sources, *[[str(example)] for example in EXAMPLES]):
                checked = subprocess.run(
                    mypy + ["--strict", "--cache-dir", cache, "--ignore-missing-imports"] + files,
                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                    env=dict(os.environ, MYPYPATH=path))
                self.assertEqual(0, checked.returncode, checked.stdout)


class Examples(unittest.TestCase):
    def test_they_print_what_they_say(self):
        self.assertGreaterEqual(len(EXAMPLES), 3)
        for example in EXAMPLES:
            with self.subTest(example.name):
                if ".feedback(" in example.read_text(encoding="utf-8") and not cf.have_linear_programs():
                    self.skipTest("built without Clp")
                wanted = re.search("^# Prints: (.*)$", example.read_text(encoding="utf-8"), re.M).group(1)
                printed = subprocess.run([sys.executable, str(example)], check=True, text=True,
                                         stdout=subprocess.PIPE).stdout
                self.assertIn(wanted, printed)


class Command(unittest.TestCase):
    def call(self, *words, code=0):
        done = subprocess.run([sys.executable, "-m", "contact_flow", *words], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=case.ROOT)
        self.assertEqual(code, done.returncode, done.stderr + done.stdout)
        return done.stdout if code < 2 else done.stderr

    def test_simulate(self):
        answer = json.loads(self.call("simulate", "soft_biped", "-x", "body_pitch=0.1", "--json"))
        run = cf.Model("soft_biped").simulate({"body_pitch": 0.1})
        self.assertEqual(run.final_state.tolist(), answer["final_state"])
        self.assertEqual([e.t for e in run.events], [e["t"] for e in answer["events"]])
        self.assertIn("touchdown of left_foot: oo -> lo", self.call("simulate", "soft_biped", "-x",
                                                                   "body_pitch=0.1"))
        csv = self.call("simulate", "config/soft_biped.yaml", "--csv", "-", "--samples", "5")
        self.assertEqual(8, len(csv.strip().split("\n")))
        self.call("simulate", "config/robots/quadruped.yaml", "-t", "0.1")
        self.call("simulate", "soft_biped", "-o", "max_steps=3", code=1)

    def test_derive_and_compare(self):
        text = self.call("derive", "soft_biped", "-w", "+body_pitch", "-w", "-body_pitch")
        self.assertIn("linear pieces: 2", text)
        self.assertRegex(text, "body_pitch +0.94339")
        self.assertRegex(text, "body_pitch +-0.8055")
        answer = json.loads(self.call("derive", "rigid_biped", "--json", code=1))
        self.assertEqual(2, len(answer["outcomes"]))
        self.assertIn("slope 1.0", self.call("compare", "soft_biped", "--by", "stiffness", "-w",
                                             "stiffness=1"))

    def test_orbit(self):
        text = self.call("orbit", "hopping_trot", "--apex", "body_z", "--translation", "body_x",
                         "left_foot_x", "right_foot_x")
        self.assertIn("stable: every piece contracts", text)
        self.assertIn("(verified)", text)

    @case.needs_linear_programs
    def test_stabilize(self):
        words = ["stabilize", "steered_trot", "-p", "hip_offset=0.25", "--apex", "body_z", "--translation",
                 "body_x", "left_foot_x", "right_foot_x", "--piecewise", "--starts", "2"]
        answer = json.loads(self.call(*words, "--json"))
        self.assertIn("35.3356", answer["without"])
        self.assertTrue(answer["certified"] and answer["verified"])
        self.assertEqual(2, len(answer["law"]))
        self.assertLess(max(answer["ends"]), 1e-4)
        self.assertIn("needs an input", self.call("stabilize", "hopping_trot", "--apex", "body_z", code=2))

    def test_names(self):
        self.assertEqual(cf.models(), list(json.loads(self.call("models", "--json"))))
        self.assertIn("hip [rad]", self.call("robot", "config/robots/monoped.yaml"))
        for command in ("simulate", "derive", "compare", "orbit", "stabilize", "report", "sweep", "models",
                        "robot"):
            self.assertIn("usage: contact_flow " + command, self.call(command, "--help"))

    def test_misuse(self):
        self.assertIn("did you mean 'soft_biped'", self.call("simulate", "sft_biped", code=2))
        self.assertIn("is not NAME=NUMBER", self.call("simulate", "soft_biped", "-x", "a=b", code=2))
        self.assertIn("no_such.yaml", self.call("simulate", "no_such.yaml", code=2))


if __name__ == "__main__":
    case.main()
