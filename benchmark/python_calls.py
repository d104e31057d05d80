#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What Python adds to calls of the core, and what threads of Python are worth:

    cmake --build build --target call_benchmark contact_flow_python
    . scripts/common.sh && source_devel
    benchmark/python_calls.py build/devel/lib/contact_flow/call_benchmark [runs]

Calls: processor time of one from Python, the same from C++ by the program that is named, and the difference, which holds
to 2 µs. Threads: so many runs of a quadruped by 1, 2 and 8 threads that share it, by turns; times by the clock and of
processors, the speed-up, and whether all runs have the same bits."""
import concurrent.futures
import os
import subprocess
import sys
import time

import numpy as np

import contact_flow as cf

BAR = 2.0   #: µs
ROUNDS = 15


def python_calls():
    """Name: call, as call_benchmark has them."""
    biped = cf.Model("soft_biped")
    x = np.array(biped.nominal.x)
    run = biped.simulate()
    B, w = run.derivative(), np.eye(14)[6]
    return {"simulate 0.00": lambda: biped.simulate(x, 0.0), "simulate 0.01": lambda: biped.simulate(x, 0.01),
            "simulate 1.40": lambda: biped.simulate(x, 1.4), "run.x(t)": lambda: run.x(0.7), "B(w)": lambda: B(w)}


def best(call, seconds=0.02):
    """Processor time of a call [µs], the least of some batches."""
    def batch(number):
        start = time.process_time_ns()
        for _ in range(number):
            call()
        return (time.process_time_ns() - start) / number
    number = max(1, int(1e9 * seconds / batch(10)))
    return min(batch(number) for _ in range(ROUNDS)) / 1e3


def cpp_calls(program):
    lines = subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    return {line[:14].strip(): float(line[14:]) for line in lines}


def print_calls(program):
    calls = python_calls()
    both = [(cpp_calls(program), {name: best(call) for name, call in calls.items()}) for _ in range(3)]
    print("call             C++ [us]  Python [us]")
    held = True
    for name in calls:
        cpp, python = (min(times[k][name] for times in both) for k in (0, 1))
        held &= python - cpp <= BAR
        print("%-14s %10.2f %12.2f" % (name, cpp, python))
        print("  %s  %s from Python over C++   %.2f us   (at most %g us)"
              % ("holds" if python - cpp <= BAR else "FAILS", name, python - cpp, BAR))
    return held


def print_threads(runs):
    robot = cf.Robot(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../config/robots/quadruped.yaml"))
    alone = robot.simulate(duration=0.5).final_state
    same = []

    def work(_):
        same.append(np.array_equal(alone, robot.simulate(duration=0.5).final_state))

    def clock(threads):
        with concurrent.futures.ThreadPoolExecutor(threads) as pool:
            start = time.monotonic(), time.process_time()
            list(pool.map(work, range(runs)))
            return time.monotonic() - start[0], time.process_time() - start[1]
    turns = [[clock(threads) for threads in (1, 2, 8)] for _ in range(5)]
    print("\n%d runs of a quadruped, %d processors\nthreads  clock [s]  processors [s]  speed-up"
          % (runs, len(os.sched_getaffinity(0))))
    first = min(turn[0][0] for turn in turns)
    for k, threads in enumerate((1, 2, 8)):
        seconds, processor = min(turn[k][0] for turn in turns), min(turn[k][1] for turn in turns)
        print("%7d %10.3f %15.3f %9.2f" % (threads, seconds, processor, first / seconds))
    print("  %s  runs that differ from the one alone   %d of %d   (at most 0)"
          % ("holds" if all(same) else "FAILS", same.count(False), len(same)))
    return all(same)


if __name__ == "__main__":
    good = print_calls(sys.argv[1])
    good &= print_threads(int(sys.argv[2]) if len(sys.argv) > 2 else 100)
    sys.exit(0 if good else 1)
