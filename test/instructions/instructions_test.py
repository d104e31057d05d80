#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""instructions_test.py BUILD COMPILER: instructions of a run of the trot and of its Jacobian, by callgrind.

Unlike times they repeat, so that they are held to limits. These are of GCC 12 on x86-64, in a Release build; ends with 77,
and says so, elsewhere and where valgrind is not installed.
"""
import os
import platform
import re
import shutil
import subprocess
import sys

SKIPPED = 77
COMPILER, MACHINE = "GNU 12", "x86_64"
FEW, MANY = 2, 12     # runs: what is done once falls out of the difference
# Half a percent above what there is. Sets of constraints that hold 128 of them take 3 % of a plain run, and 1 % of a Jacobian;
# errors of derivatives that are estimated along arcs 0.6 % of the Jacobian of B; guards that are known in one place 0.2 %, and 0.1 %.
# Grazes at the instants of other events, which each event looks for, take 1 % of a plain run.
# What has touched, however far below its floor, takes 0.1 % of plain B.
# What bounces that are made rest leave unknown, which each transition has room for, takes 0.05 % of plain A.
# Which of a folder's files are compiled together takes or gives as much: three more in flow/ took 0.4 % of plain A, 0.9 % of plain B.
# Sets that may hold more than 128 constraints take 4.2 % of a plain run, and 2.5 % of a Jacobian.
# Forces at the nodes of each step, of which the smallest minimum is told, take 0.8 % of plain A, 0.2 % of plain B.
LIMITS = {("plain", "A"): 422.5e3, ("plain", "B"): 723.5e3, ("jacobian", "A"): 2271e3, ("jacobian", "B"): 3506e3}


def skip(reason):
    print("SKIPPED: " + reason)
    sys.exit(SKIPPED)


def instructions(command):
    environment = dict(os.environ, OPENBLAS_NUM_THREADS="1", LC_ALL="C")
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"] + command,
                          env=environment, stderr=subprocess.PIPE, universal_newlines=True, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


def main(build, compiler):
    if not shutil.which("valgrind"):
        skip("valgrind is not installed")
    if compiler != COMPILER + " Release" or platform.machine() != MACHINE:
        skip("limits are of %s Release on %s, not %s on %s" % (COMPILER, MACHINE, compiler, platform.machine()))
    found = subprocess.run(["find", build, "-name", "trot_benchmark", "-type", "f"], check=True,
                           stdout=subprocess.PIPE, universal_newlines=True).stdout.split()
    if not found:
        skip("trot_benchmark is not built")
    failed = False
    for (what, scenario), limit in LIMITS.items():
        few, many = (instructions([found[0], "--loop", what, scenario, str(runs)]) for runs in (FEW, MANY))
        one = (many - few) / (MANY - FEW)
        failed |= not 0 < one <= limit
        print("%-8s %s %9.0f instructions  (at most %.0f)%s" % (what, scenario, one, limit,
                                                              "" if 0 < one <= limit else "  FAILS"))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
