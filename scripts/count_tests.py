#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ctest … | count_tests.py RESULTS: ctest's output, with the true number of cases before its summary.

CTest counts executables. The cases are in the JUnit files that they leave under RESULTS. Failed and
skipped ones are named. The exit status is 1 when a case failed or none passed.
"""
import pathlib
import re
import sys
import xml.etree.ElementTree as ElementTree


def outcome(case):
    """'passed', 'failed' or 'skipped', and the reason for a skip, of one <testcase>."""
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed", ""
    skipped = case.find("skipped")
    if skipped is not None:
        return "skipped", skipped.get("message", "").strip().split("\n")[-1]
    if case.get("result") in ("skipped", "suppressed") or case.get("status") == "notrun":
        return "skipped", ""
    return "passed", ""


def read_cases(results):
    """[(name, state, reason)] of every case in the result files under `results`."""
    cases = []
    for path in sorted(pathlib.Path(results).rglob("*.xml")):
        try:
            root = ElementTree.parse(str(path)).getroot()
        except ElementTree.ParseError as error:
            cases.append((path.stem, "failed", "unreadable result file: %s" % error))
            continue
        for case in root.iter("testcase"):
            state, reason = outcome(case)
            # rostest wraps each of its clients in a case; theirs are in the client's own file.
            wrapper = case.get("classname") == "rostest.runner.RosTest"
            if wrapper and (state == "passed" or has_failure(path, case)):
                continue
            name = "%s: %s.%s" % (path.stem, case.get("classname"), case.get("name"))
            cases.append((name, state, reason))
    return cases


def has_failure(path, wrapper):
    """Whether the client that `wrapper` ran has reported a failure of its own."""
    client = path.with_name("rosunit-%s.xml" % wrapper.get("name")[len("test"):])
    return client.exists() and re.search(r"<(failure|error)\b", client.read_text()) is not None


def main():
    for stream in (sys.stdin, sys.stdout):
        stream.reconfigure(encoding="utf-8", errors="replace")
    summary = []  # ctest's closing lines, held back
    for line in sys.stdin:
        if summary or re.match(r"\d+% tests passed", line):
            summary.append(line)
        else:
            sys.stdout.write(line)
            sys.stdout.flush()

    cases = read_cases(sys.argv[1])
    for name, state, reason in cases:
        if state != "passed":
            print("%-7s %s%s" % (state, name, " (%s)" % reason if reason else ""))
    count = {s: sum(c[1] == s for c in cases) for s in ("passed", "failed", "skipped")}
    print("Test cases: %(passed)d passed, %(failed)d failed, %(skipped)d skipped" % count)
    sys.stdout.writelines(["\n"] + summary)
    return 1 if count["failed"] or not count["passed"] else 0


if __name__ == "__main__":
    sys.exit(main())
