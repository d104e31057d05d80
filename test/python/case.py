# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the Python module share: a main that writes JUnit, data, systems."""
import argparse
import json
import os
import pathlib
import sys
import unittest
from xml.sax.saxutils import quoteattr

import numpy as np

import contact_flow as cf

#: of tests
needs_linear_programs = unittest.skipUnless(cf.have_linear_programs(), "built without Clp")

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "test" / "data"
ROBOTS = ROOT / "config" / "robots"
#: Linux's count of pages
PAGE = os.sysconf("SC_PAGE_SIZE")


def resident():
    """Memory of this process that is in use [bytes]."""
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * PAGE


def state(entry):
    return np.concatenate([np.array(entry["q"], dtype=float), np.array(entry["v"], dtype=float)])


def reference(name):
    return json.loads((DATA / (name + ".json")).read_text(encoding="utf-8"))


def largest(array):
    return float(np.max(np.abs(array))) if np.size(array) else 0.0


def main(module="__main__"):
    parser = argparse.ArgumentParser()
    parser.add_argument("--junit", help="write the results to this file")
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    load = unittest.defaultTestLoader
    module = sys.modules[module]
    suite = (load.loadTestsFromNames(arguments.names, module) if arguments.names
             else load.loadTestsFromModule(module))
    cases = [case.id() for case in flatten(suite)]
    result = unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(suite)
    for test, reason in result.skipped:
        print("skipped: %s: %s" % (test, reason))
    if arguments.junit:
        pathlib.Path(arguments.junit).parent.mkdir(parents=True, exist_ok=True)
        write(arguments.junit, cases, result)
    sys.exit(0 if result.wasSuccessful() else 1)


def flatten(suite):
    for item in suite:
        if isinstance(item, unittest.TestSuite):
            yield from flatten(item)
        else:
            yield item


def write(path, cases, result):
    """What scripts/count_tests.py reads. A subtest's failure is its test's."""
    failed = [(test.id(), text) for test, text in result.failures + result.errors]
    skipped = {test.id(): reason for test, reason in result.skipped}
    with open(path, "w", encoding="utf-8") as out:
        out.write("<testsuite name='python' tests='%d'>\n" % len(cases))
        for name in cases:
            inside = "".join("<failure message=%s/>" % quoteattr(text[-2000:]) for test, text in failed
                             if test.split(" ")[0] == name or test.startswith("setUp"))
            if name in skipped:
                inside += "<skipped message=%s/>" % quoteattr(skipped[name])
            out.write("<testcase classname=%s name=%s>%s</testcase>\n"
                      % (quoteattr(name.split(".")[-2].replace("__main__", "python")),
                         quoteattr(name.split(".")[-1]), inside))
        out.write("</testsuite>\n")
