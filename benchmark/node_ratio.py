#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compares nodes of several builds, side by side on one machine:

    . scripts/common.sh && source_devel
    benchmark/node_ratio.py [--calls N] [--rounds R] [--record] OLD/contact_flow_node NEW/contact_flow_node

One client with one connection calls short services, of one node and then the next, in rounds. Printed are, for each
service and node, calls a second and latency in the best round, and processor time of the node for a call, which other
processes of the machine change least; then the ratios to the first node. Messages must be the same in all."""
import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import rospy
from contact_flow.srv import (CheckAssumptions, ComputeBDerivative, DescribeModel, GetSimulatorState, LinearizeTrajectory,
                              SimulateTrajectory, StartRecording)

CALLS = [("simulate", SimulateTrajectory, dict(samples=20)),
         ("b_derivative", ComputeBDerivative, dict(directions=["+body_pitch"])),
         ("linearize", LinearizeTrajectory, {}),
         ("check_assumptions", CheckAssumptions, {}),
         ("describe_model", DescribeModel, {}),
         ("get_state", GetSimulatorState, {})]


class Node:
    def __init__(self, executable, number, directory):
        self.name = "node%d" % number
        self.process = subprocess.Popen([executable, "__name:=" + self.name, "_online:=true", "_bag_directory:=" + directory],
                                        stdout=subprocess.DEVNULL)
        self.services = {}
        for name, kind, _ in CALLS:
            rospy.wait_for_service("/%s/%s" % (self.name, name), timeout=30)
            self.services[name] = rospy.ServiceProxy("/%s/%s" % (self.name, name), kind, persistent=True)
        self.best = {name: [1e9, 1e9, 1e9] for name in self.services}

    def processor(self):
        total = 0
        for task in os.listdir("/proc/%d/task" % self.process.pid):
            try:
                with open("/proc/%d/task/%s/schedstat" % (self.process.pid, task)) as file:
                    total += int(file.read().split()[0])
            except OSError:  # it has just ended
                pass
        return 1e-9 * total

    def round(self, name, fields, calls):
        service, latencies = self.services[name], []
        service(**fields)
        begin, used = time.perf_counter(), self.processor()
        for _ in range(calls):
            asked = time.perf_counter()
            answer = service(**fields)
            latencies.append(time.perf_counter() - asked)
            if not answer.success:
                sys.exit("%s: %s" % (name, answer.message))
        figures = ((time.perf_counter() - begin) / calls, sorted(latencies)[calls // 2],
                   (self.processor() - used) / calls)
        self.best[name] = [min(pair) for pair in zip(self.best[name], figures)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("nodes", nargs="+")
    arguments = parser.parse_args()
    port = os.environ["ROS_MASTER_URI"].rsplit(":", 1)[1].strip("/")
    master = subprocess.Popen(["rosmaster", "--core", "-p", port], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    directory = tempfile.mkdtemp()
    nodes = []
    try:
        rospy.init_node("node_ratio", disable_signals=True)
        nodes = [Node(path, number, directory) for number, path in enumerate(arguments.nodes)]
        if arguments.record:
            for node in nodes:
                rospy.ServiceProxy("/%s/start_recording" % node.name, StartRecording)(name=node.name)
        for _ in range(arguments.rounds):
            for name, _, fields in CALLS:
                for node in nodes:
                    node.round(name, fields, arguments.calls)
        print("%-18s %-6s %10s %12s %14s" % ("", "node", "calls/s", "median [ms]", "processor [ms]"))
        for name, _, _ in CALLS:
            for number, node in enumerate(nodes):
                each, median, used = node.best[name]
                ratios = [mine / first for mine, first in zip((each, median, used), nodes[0].best[name])]
                print("%-18s %-6d %10.0f %12.3f %14.3f%s" % (
                    name, number, 1 / each, 1e3 * median, 1e3 * used,
                    "" if number == 0 else "   ratios of time %.3f %.3f %.3f" % tuple(ratios)))
    finally:
        for node in nodes:
            node.process.send_signal(signal.SIGINT)
        for node in nodes:
            node.process.wait(timeout=20)
        master.terminate()
        shutil.rmtree(directory)


if __name__ == "__main__":
    main()
