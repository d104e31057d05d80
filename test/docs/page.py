# SPDX-License-Identifier: BSD-3-Clause
"""Pages of docs/ as tests read them: their blocks, the commands in them, and whether an output is as printed."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
BY_HAND = "# by hand:"  # after a command that no test runs as printed, with the reason


def pages():
    return [ROOT / "README.md"] + sorted((ROOT / "docs").glob("*.md"))


def blocks(text):
    """[(language, body, the line before the block)] of the fenced blocks of a page."""
    found = []
    for match in re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S):
        before = text[:match.start()].rstrip("\n").split("\n")[-1]
        found.append((match.group(1), match.group(2), before))
    return found


def commands(text):
    """[(command, expected lines)] of the console blocks; a command goes on while a quote is open."""
    found = []
    for language, body, _ in blocks(text):
        if language != "console":
            continue
        for part in re.split(r"^\$ ", body, flags=re.M)[1:]:
            lines = part.rstrip("\n").split("\n")
            command = lines.pop(0)
            while command.count('"') % 2:
                command += "\n" + lines.pop(0)
            found.append((command, lines))
    return found


def tokens(text):
    """Words and numbers, without what YAML may write in several ways: quotes, lists on one line or many."""
    return [t for t in re.findall(r"[^\s\[\]{},'\"\\]+", text) if t != "-"]


def same(printed, found):
    """Numbers to 1e-6, as other compilers round differently, stamps and home folders not at all."""
    if printed == found:   # also nan, inf
        return True
    try:
        a, b = float(printed), float(found)
    except ValueError:
        return re.sub(r"^/.*?(?=/\.ros/)", "", found) == printed.replace("/home/you", "")
    return a > 1e9 or abs(a - b) <= 1e-6 * abs(a) + 1e-9


def missing(expected, output):
    """The first printed line that the output does not have, in this order; "…" stands for anything."""
    have, at = tokens(output), 0
    for line in expected:
        for run in line.split("…"):
            want = tokens(run)
            for start in range(at, len(have) - len(want) + 1):
                if all(same(w, h) for w, h in zip(want, have[start:start + len(want)])):
                    at = start + len(want)
                    break
            else:
                return line
    return None
