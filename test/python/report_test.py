#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a run: one file, complete, and right in a browser."""
import html.parser
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import unittest.mock

import numpy as np

import contact_flow as cf
import case
from case import largest
from contact_flow import report, report_three

# WebGL by the processor, where there is no graphics card.
WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def data_of(text):
    return json.loads(re.search(r"^const D=(.*);$", text, re.M).group(1))


class Links(html.parser.HTMLParser):
    """What a browser would load from elsewhere."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attributes):
        self.found += [value for name, value in attributes if name in ("src", "href")]


class Report(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def write(self, run, **arguments):
        path = pathlib.Path(self.folder.name) / "run.html"
        run.report(path, **arguments)
        return path, path.read_text(encoding="utf-8")

    def test_it_is_the_run(self):
        run = cf.Model("soft_biped").simulate({"body_pitch": 0.1})
        _, text = self.write(run, by=["stiffness"])
        data = data_of(text)
        self.assertEqual([e.t for e in run.events], [e["t"] for e in data["events"]])
        self.assertEqual([list(mode) for mode in run.modes], [arc["mode"] for arc in data["arcs"]])
        for arc, own in zip(data["arcs"], run.arcs):
            x = np.array(arc["x"], dtype=float)
            # nine digits
            np.testing.assert_allclose(x[:, 0], own.x_begin, rtol=1e-8, atol=1e-20)
            np.testing.assert_allclose(x[:, -1], own.x_end, rtol=1e-8, atol=1e-20)
        B = run.derivative(by=["stiffness"])
        entry = data["derivative"]["directions"][-1]
        self.assertEqual("stiffness", entry["name"])
        self.assertLess(largest(np.array(entry["up"]["value"]) - B("+stiffness")), 1e-8)
        scope = {}
        exec(data["request"], scope)   # what the page says repeats it
        np.testing.assert_array_equal(run.final_state, scope["run"].final_state)

    def test_it_stands_alone(self):
        robot = cf.Robot(case.ROBOTS / "quadruped.yaml")
        path, text = self.write(robot.simulate(duration=0.5))
        links = Links()
        links.feed(text)
        self.assertEqual([], links.found)
        own = text.replace("/*! %s*/\n%s</script>" % (report_three.LICENCE, report_three.library()[0]), "")
        self.assertNotRegex(own.split("const D=")[0] + own.split("};\n")[-1], r"https?://")
        self.assertIn("default-src 'none'", text)
        self.assertLess(path.stat().st_size, 8_000_000)
        self.assertNotIn("/*SCENE*/", text)
        data = data_of(text)
        self.assertEqual(len(robot.links), len(data["figure"]["poses"][0]))
        self.assertIn("Every touchdown comes with", data["words"][0])

    def test_names_do_not_end_the_script(self):
        class Odd(cf.Formulas):
            name = "</script><script>alert(1)</script>"
            coordinates = ("x",)

            def mass_matrix(self, q):
                return [[1.0]]

            def force(self, q, v, u):
                return [-q[0]]
        _, text = self.write(cf.PythonModel(Odd).simulate({"x": 1}))
        self.assertEqual(2 if report_three.library()[0] else 1, text.count("</script>"))
        self.assertEqual(Odd.name, data_of(text)["name"])

    def test_refusals(self):
        run = cf.Model("rigid_biped").simulate()
        data = data_of(self.write(run)[1])
        self.assertEqual("discontinuous", data["derivative"]["status"])
        self.assertEqual([], data["figure"]["ghosts"])
        self.assertEqual(2, len(data["derivative"]["outcomes"]))
        with self.assertRaisesRegex(ValueError, "dense"):
            self.write(cf.Model("soft_biped").simulate(dense=False))
        with self.assertRaisesRegex(ValueError, "more than 8000000"):
            self.write(run, samples=200_000)

    def test_three(self):
        """The library as it is on the disk, with its licence; without it, and with another, why there is none."""
        library, reason = report_three.library()
        if not library:
            self.skipTest(reason)
        run = cf.Model("soft_biped").simulate()
        text = self.write(run)[1]
        self.assertIn(library, text)
        licence = data_of(text)["three"]["licence"]
        for words in ("MIT License", "2010-2019 three.js authors", "above copyright notice and this permission notice"):
            self.assertIn(words, licence)
            self.assertEqual(2, text.count(words))   # before the library and to be read
        other = pathlib.Path(self.folder.name) / report_three.FILE
        for found, why in ((None, "was not there"), (library.replace('"111"', '"112"'), "is r112, not r111"),
                           (library + "</script>", "cannot be a part of a page")):
            with self.subTest(why), unittest.mock.patch.object(report_three, "PLACES", (self.folder.name,)):
                if found:
                    other.write_text(found, encoding="utf-8")
                text = self.write(run)[1]
                self.assertIn(why, data_of(text)["three"]["missing"])
                self.assertNotIn("MIT License", text)
                self.assertEqual(1, text.count("</script>"))
        alone = len(text.encode())
        with unittest.mock.patch.object(report, "MAX_BYTES", alone + 1000):   # rather without than not at all
            path, text = self.write(run)
            self.assertIn("would be larger", data_of(text)["three"]["missing"])
            self.assertLessEqual(path.stat().st_size, alone + 1000)

    def test_in_a_browser(self):
        """Drawn, without an error on the console, interactive after 2 s of the page's clock."""
        browser = shutil.which("chromium") or shutil.which("chromium-browser")
        if not browser:
            self.skipTest("chromium is not installed")
        for run, words in ((cf.Model("soft_biped").simulate(), ["One-sided", "left_foot, then right_foot"]),
                           (cf.Model("rigid_biped").simulate(), ["order of impacts"]),
                           (cf.Model("bouncing_ball").simulate(duration=3, complete_zeno=True), ["zeno"]),
                           (cf.Robot(case.ROBOTS / "gripper.yaml").simulate(), ["Motion", "play"])):
            with self.subTest(run.system.name):
                path, _ = self.write(run)
                done = subprocess.run(
                    [browser, "--headless", "--no-sandbox", *WEBGL, "--enable-logging=stderr",
                     "--virtual-time-budget=2000", "--dump-dom", path.as_uri()],
                    env={name: value for name, value in os.environ.items() if name != "LD_PRELOAD"},  # of sanitizers
                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120)
                self.assertEqual([], [line for line in done.stderr.split("\n") if "CONSOLE" in line])
                self.assertIn('data-ready="yes"', done.stdout)
                for word in words:
                    self.assertIn(word, done.stdout)


if __name__ == "__main__":
    case.main()
