#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The README and the pages of docs/: short, linked, complete, and true to the files that they quote."""
import argparse
import pathlib
import re
import sys
import unittest

import layouts_test
import page
from page import ROOT

sys.path.insert(0, str(ROOT / "test" / "layout"))
from include_direction_test import write_junit  # noqa: E402

MAX_README = 150


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def anchors(content):
    """The names of the headings, as sites make them."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", content, flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


def links(content):
    return [link for link in re.findall(r"\]\(([^)\s]+)\)", content) if "://" not in link]


class Pages(unittest.TestCase):
    def test_readme_is_short(self):
        self.assertLessEqual(len(text("README.md").split("\n")), MAX_README)

    def test_limits_come_first(self):
        headings = re.findall(r"^## (.*)$", text("README.md"), re.M)
        self.assertEqual("What it does not do", headings[0])

    def test_readme_links_to_every_page(self):
        linked = set(links(text("README.md")))
        for path in page.pages()[1:]:
            self.assertIn("docs/" + path.name, linked)

    def test_links_lead_somewhere(self):
        for path in page.pages():
            content = path.read_text(encoding="utf-8")
            for link in links(content):
                name, _, anchor = link.partition("#")
                target = (path.parent / name) if name else path
                self.assertTrue(target.exists(), "%s: %s" % (path.name, link))
                if anchor:
                    self.assertIn(anchor, anchors(target.read_text(encoding="utf-8")), link)

    def test_excerpts_are_in_their_files(self):
        """A block after a line "`path` …" or "`path`, in short:" has its lines in that file, in order."""
        checked = 0
        for path in page.pages():
            for _, body, before in page.blocks(path.read_text(encoding="utf-8")):
                match = re.match(r"`([\w/.]+/[\w.]+)`", before)
                if not match or not (ROOT / match.group(1)).is_file():
                    continue
                checked += 1
                source = [" ".join(l.split()) for l in text(match.group(1)).split("\n")]
                at = 0
                for line in filter(None, (" ".join(l.split()) for l in body.split("\n"))):
                    wanted = line.split("  //")[0]
                    found = [k for k in range(at, len(source)) if wanted.split(" //")[0] in source[k]]
                    self.assertTrue(found, "%s: not in %s: %s" % (path.name, match.group(1), line))
                    at = found[0] + 1
        self.assertGreaterEqual(checked, 6)

    def test_by_hand_is_said_with_a_reason(self):
        for path in page.pages():
            for command, _ in page.commands(path.read_text(encoding="utf-8")):
                if "by hand" in command:
                    self.assertRegex(command, page.BY_HAND + r" \w+")

    def constants(self):
        for folder in ("msg", "srv", "action"):
            for path in sorted((ROOT / folder).iterdir()):
                # of records and certificates, which are not outcomes
                if path.stem in ("RecordingLink", "StabilityProof"):
                    continue
                for name in re.findall(r"^uint8 ([A-Z_]+) *=", path.read_text(encoding="utf-8"), re.M):
                    yield path.name, name

    def test_every_outcome_is_explained(self):
        explained = set(re.findall(r"^### ([A-Z_]+)$", text("docs/troubleshooting.md"), re.M))
        defined = dict((name, file) for file, name in self.constants())
        for name, file in defined.items():
            self.assertIn(name, explained, file)
        self.assertEqual(set(), explained - set(defined), "explained, but not defined")

    def test_interface_is_complete(self):
        interface = text("docs/interface.md")
        sources = "".join(p.read_text(encoding="utf-8") for p in sorted((ROOT / "src/ros").rglob("*.cc")))
        names = set(re.findall(r'advertise(?:Service|<[\w:]+>)?\(\s*"/?([a-z_]+)', sources))
        names |= set(re.findall(r'reader(?:->|\.)Read\("(\w+)"', "".join(
            p.read_text(encoding="utf-8") for p in (ROOT / "src/ros").rglob("*.cc"))))
        names |= set(layouts_test.result_topics())
        names -= {"find_periodic_orbit", "optimize"}
        self.assertGreater(len(names), 40)
        for name in sorted(names | {"find_periodic_orbit", "optimize", "input"}):
            self.assertRegex(interface, r"[`~/]%s[`/]" % name)
        for path in sorted((ROOT / "srv").glob("*.srv")) + sorted((ROOT / "action").glob("*.action")):
            self.assertIn("`%s`" % path.stem, interface)

    def test_every_kind_and_model_is_in_a_table(self):
        for folder, name in (("rigid_body/constraint", "robot"), ("rigid_body/effort", "robot"),
                             ("example", "interface")):
            content = text("docs/%s.md" % name)
            headers = [path for base in ("include/contact_flow/model", "src/model")
                       for path in sorted((ROOT / base / folder).glob("*.h"))]
            self.assertGreater(len(headers), 10)
            for path in headers:
                for kind in re.findall(r'kName = "(.*?)"', path.read_text(encoding="utf-8")):
                    self.assertIn("`" + kind + "`", content)


class Matcher(unittest.TestCase):
    """What is taken for printed as it is, and what not."""

    def test_takes(self):
        for expected, output in ((["a: 1.00000001"], "a: 1"), (["x: [p, q]"], "x: \n  - p\n  - 'q'"),
                                 (["a: 1", "…", "b: 2"], "a: 1\nc: 3\nb: 2"), (["a: [1, …"], "a: [1, 2]"),
                                 (["1795258171.7 /n: same"], "1795258999.1 /n: same"),
                                 (["path: /home/you/.ros/a"], "path: /tmp/x/.ros/a")):
            self.assertIsNone(page.missing(expected, output), expected)

    def test_refuses(self):
        for expected, output in ((["a: 1.01"], "a: 1"), (["b: 2", "a: 1"], "a: 1\nb: 2"),
                                 (["success: True"], "success: False"), (["x"], "")):
            self.assertIsNotNone(page.missing(expected, output), expected)

    def test_commands(self):
        found = page.commands('```console\n$ a "{x:\n  1}"\nout\n$ b\n```\n```\n$ c\n```\n')
        self.assertEqual([('a "{x:\n  1}"', ["out"]), ("b", [])], found)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--junit", help="write the results to this file")
    arguments = parser.parse_args()
    load = unittest.defaultTestLoader.loadTestsFromTestCase
    suites = [load(Pages), load(Matcher)]
    cases = [case.id() for suite in suites for case in suite]
    result = unittest.TextTestRunner(stream=sys.stdout).run(unittest.TestSuite(suites))
    if arguments.junit:
        write_junit(arguments.junit, cases, result)
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
