#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""bench_table.py FOLDER NAME …: what the benchmarks hold to, from FOLDER/NAME.txt, as one Markdown table."""
import datetime
import os
import pathlib
import platform
import re
import sys

# "  holds  what is measured    0.97  (at most 1)"
LINE = re.compile(r"\s*(holds|FAILS)\s+(.*?\S)\s+([-+.\d]\S*(?: \w+)?)\s+\((.*)\)$")


def processor():
    """The processor by its name, or the architecture."""
    info = pathlib.Path("/proc/cpuinfo")
    names = re.findall(r"^model name\s*: (.*)$", info.read_text(), re.MULTILINE) if info.exists() else []
    return names[0].strip() if names else platform.machine()


def main(folder, names):
    print("%s, %s, %d cores, %s, load %.1f\n" % (platform.node(), processor(), os.cpu_count(),
                                               datetime.date.today().isoformat(), os.getloadavg()[0]))
    print("| benchmark | what | is | bar | |\n|---|---|---|---|---|")
    for name in names:
        rows = [match.groups() for match in map(LINE.match, (pathlib.Path(folder) / (name + ".txt"))
                                                .read_text().splitlines()) if match]
        for verdict, what, value, bar in rows:
            print("| %s | %s | %s | %s | %s |" % (name, what.replace("|", "\\|"), value, bar, verdict))
        if not rows:
            print("| %s | no bar: see %s.txt | | | |" % (name, name))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
