#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""count_lines.py ROOT BUILD: lines of src/ and include/ that were reached, by gcov's counters in BUILD. A line is
reached if it was in any translation unit. Called by scripts/coverage."""
import collections
import json
import os
import subprocess
import sys

# What the lines of a folder are to be [%]; others: CORE.
GOALS = {"ros": 90, "io": 90, "nodes": 90, "tools": 90}
CORE = 95
BATCH = 40  # files for one gcov


def counts(root, build):
    """{path below root: {line: how often}}"""
    found = collections.defaultdict(dict)
    data = [os.path.join(folder, name) for folder, _, names in os.walk(build) for name in names
            if name.endswith(".gcno") and "/test/" not in folder]
    for begin in range(0, len(data), BATCH):
        run = subprocess.run(["gcov", "--json-format", "--stdout", *data[begin:begin + BATCH]], cwd=build,
                             stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
        for text in run.stdout.decode().splitlines():
            if not text.startswith("{"):
                continue
            for file in json.loads(text)["files"]:
                path = os.path.relpath(os.path.normpath(os.path.join(build, file["file"])), root)
                if not path.startswith(("src/", "include/contact_flow/")):
                    continue
                lines = found[path]
                for line in file["lines"]:
                    number = line["line_number"]
                    lines[number] = max(lines.get(number, 0), line["count"])
    return found


def folder_of(path):
    parts = path.split("/")[1 if path.startswith("src/") else 2:]
    return parts[0] if len(parts) > 1 else "."


def ranges(numbers):
    """[3, 4, 5, 9] as "3-5, 9"."""
    parts = []
    for number in sorted(numbers):
        if parts and parts[-1][1] == number - 1:
            parts[-1][1] = number
        else:
            parts.append([number, number])
    return ", ".join(str(a) if a == b else "%d-%d" % (a, b) for a, b in parts)


def main():
    root, build = map(os.path.abspath, sys.argv[1:])
    found = counts(root, build)
    if not found:
        sys.exit("no counters in " + build)
    folders = collections.defaultdict(lambda: [0, 0])
    for path, lines in found.items():
        total = folders[folder_of(path)]
        total[0] += sum(count > 0 for count in lines.values())
        total[1] += len(lines)
    below = {}
    print("%-12s %8s %8s %7s %6s" % ("folder", "reached", "lines", "share", "goal"))
    for folder, (reached, lines) in sorted(folders.items()):
        share, goal = 100 * reached / lines, GOALS.get(folder, CORE)
        print("%-12s %8d %8d %6.1f%% %5d%%%s" % (folder, reached, lines, share, goal, "  <" if share < goal else ""))
        below[folder] = goal
    print("\nfiles below the goal of their folder, and their lines that nothing reached:")
    for path, lines in sorted(found.items()):
        missed = [number for number, count in lines.items() if count == 0]
        share = 100 * (1 - len(missed) / max(1, len(lines)))
        if share < below[folder_of(path)]:
            print("%s  %.0f%%: %s" % (path, share, ranges(missed)))


if __name__ == "__main__":
    main()
