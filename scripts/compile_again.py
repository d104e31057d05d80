#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compiles the library, the bindings and the programs as a build does, with more flags and without code.

usage: scripts/compile_again.py COMPILE_COMMANDS JOBS FLAG …

Prints what the compiler says; exits with 1 if it ends anywhere with an error (-Werror makes warnings such).
"""

import concurrent.futures
import json
import os
import shlex
import subprocess
import sys

FOLDERS = ("src", "python/src")


def command_of(entry, flags):
    """The command of one source: without launcher and output."""
    words = shlex.split(entry["command"])
    if os.path.basename(words[0]) == "ccache":
        words = words[1:]
    output = words.index("-o")
    return words[:output] + words[output + 2:] + ["-fsyntax-only"] + flags


def main():
    commands, jobs, flags = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    with open(commands, encoding="utf-8") as file:
        entries = json.load(file)
    folders = tuple(os.path.join(root, folder) + os.sep for folder in FOLDERS)
    entries = [entry for entry in entries if entry["file"].startswith(folders)]
    if not entries:
        sys.exit(f"no source of {root} in {commands}")

    def compile_again(entry):
        return subprocess.run(command_of(entry, flags), cwd=entry["directory"], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    failed = 0
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done, (entry, result) in enumerate(zip(entries, pool.map(compile_again, entries)), 1):
            failed += result.returncode != 0
            if result.stdout:
                print(result.stdout, end="", flush=True)
            if done % 50 == 0 or done == len(entries):
                print(f"-- {done} of {len(entries)} files, {failed} with findings", flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
