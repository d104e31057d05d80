#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""sweep: runs are those of simulate, statistics those of the runs; watched, cancelled, refused, limited, recorded."""
import contextlib
import os
import subprocess
import time
import unittest
import xmlrpc.client

import actionlib
import numpy as np
import rosgraph
import rospy
import rostest
import yaml
from actionlib_msgs.msg import GoalStatus
from client import Client, executable, matrix
from contact_flow.msg import (
    EnsembleBins, EnsembleCost, EnsembleDraw, EnsembleRequest, InitialState, RowMajorMatrix, SimulationOptions,
    SweepEnsembleAction, SweepEnsembleGoal, SweepEnsembleResult)


def pitch(**fields):
    """Pitch and its rate of the biped that lands."""
    return EnsembleRequest(
        runs=600, seed=2 ** 63 + 5, **fields,
        draws=[EnsembleDraw(kind="uniform", names=["body_pitch", "d/dt body_pitch"], low=[-0.3, -0.5], high=[0.3, 0.5])])


class Sweep(unittest.TestCase):
    def setUp(self):
        self.feedback = []
        self.action = self.connect("landing")

    def connect(self, node):
        action = actionlib.SimpleActionClient(node + "/sweep", SweepEnsembleAction)
        self.assertTrue(action.wait_for_server(rospy.Duration(20)))
        return action

    def ask(self, request, action=None):
        action = action or self.action
        self.feedback = []
        action.send_goal(SweepEnsembleGoal(request=request), feedback_cb=self.feedback.append)
        self.assertTrue(action.wait_for_result(rospy.Duration(60)))
        return action.get_result()

    def run_all(self, request, action=None):
        answer = self.ask(request, action)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, SweepEnsembleResult.OK, answer.message)
        return answer.result

    def test_runs_are_those_of_simulate(self):
        found = self.run_all(pitch(keep=["outcome", "start", "final_state", "words", "end_time"], events=2))
        columns = {one.name: np.array(one.values).reshape([600] + list(one.shape)) for one in found.columns}
        self.assertEqual((found.runs, found.measured), (600, 600))
        self.assertEqual(list(found.start_names), ["body_pitch", "d/dt body_pitch"])
        for k in (0, 255, 256, 599):
            # What numpy draws.
            u = np.random.Generator(np.random.Philox(key=np.array([2 ** 63 + 5, k], dtype=np.uint64))).random(2)
            start = [-0.3 + 0.6 * u[0], -0.5 + 1.0 * u[1]]
            self.assertEqual(columns["start"][k].tolist(), start)
            state = InitialState(names=["body_pitch"], positions=[start[0]], velocities=[start[1]])
            run = Client("landing").simulate(state=state)
            self.assertEqual(columns["final_state"][k].tolist(), list(run.trajectory.final_q + run.trajectory.final_v))
            self.assertEqual(found.run_words[k], ">".join(run.mode_words))
            self.assertEqual(found.num_events[k], len(run.event_times))
            self.assertEqual(columns["event_times"][k].tolist(), list(run.event_times[:2]))
        self.assertEqual(list(found.run_outcome), [0] * 600)
        # Statistics by numpy: rounding of 600 numbers of size 1.
        y = columns["final_state"] - np.array(found.reference_q + found.reference_v)
        np.testing.assert_allclose(found.mean, y.mean(axis=0), atol=1e-13)
        np.testing.assert_allclose(matrix(found.covariance), np.cov(y.T), atol=1e-12)
        self.assertEqual(list(found.smallest), y.min(axis=0).tolist())
        self.assertEqual(list(found.largest), y.max(axis=0).tolist())
        self.assertEqual(list(found.probabilities), [0.05, 0.25, 0.5, 0.75, 0.95])
        self.assertEqual(set(found.rank_error), {0.0})   # so few numbers are kept
        for p, quantiles in zip(found.probabilities, matrix(found.quantiles)):
            self.assertEqual(quantiles.tolist(), np.sort(y, axis=0)[int(np.ceil(p * 600)) - 1].tolist())
        counts = {word: found.run_words.count(word) for word in found.run_words}
        self.assertEqual({one.name: one.count for one in found.words}, counts)
        self.assertEqual([one.count for one in found.words], sorted(counts.values(), reverse=True))

    def test_costs_histograms_threads_and_sobol(self):
        request = pitch(costs=[EnsembleCost(name="low", outcomes=["body_z"], targets=[0.7], weights=[2])],
                        histograms=[EnsembleBins(observable="low", low=0, high=0.01, bins=5)],
                        keep=["final_state"], sobol=True)
        found = self.run_all(request)
        z = np.array(found.columns[0].values).reshape(600, 14)[:, found.observables.index("body_z")]
        cost = 0.5 * 2 * (z - 0.7) ** 2
        self.assertEqual(found.observables[-1], "low")
        np.testing.assert_allclose(found.mean[-1], cost.mean(), rtol=1e-13)
        counts, _ = np.histogram(cost, np.concatenate([[-np.inf], 0.002 * np.arange(6), [np.inf]]))
        self.assertEqual(list(found.histograms[0].counts), counts.tolist())
        request.threads = 5
        again = self.run_all(request)
        again.header = found.header
        self.assertEqual(found, again)

    def test_parameters_inputs_and_outcomes(self):
        stiffness = EnsembleDraw(kind="grid", names=["stiffness"], levels=[27, -1])
        found = self.run_all(EnsembleRequest(draws=[stiffness], keep=["outcome"]))
        self.assertEqual(found.runs, 2)
        outcomes = {one.name: one for one in found.outcomes}
        self.assertEqual(outcomes["inadmissible"].first, 1)
        self.assertIn("stiffness", outcomes["inadmissible"].message)
        self.assertEqual(list(found.run_outcome), [0, -1])
        torque = EnsembleDraw(kind="table", names=["shoulder_torque"], table=RowMajorMatrix(2, 1, [0.1, 0.2]))
        found = self.run_all(EnsembleRequest(draws=[torque], keep=["final_state"]), self.connect("pendulum"))
        run = Client("pendulum").simulate(input=[0.2, 0])
        self.assertEqual(list(found.columns[0].values[4:]), list(run.trajectory.final_q + run.trajectory.final_v))
        # A robot keeps the parameters that the node was given.
        gravity = EnsembleDraw(kind="grid", names=["+right_offset"], levels=[0, 0.01])
        found = self.run_all(EnsembleRequest(draws=[gravity], keep=["final_state"], duration=0.2), self.connect("robot"))
        run = Client("robot").simulate(duration=0.2)
        self.assertEqual(list(found.columns[0].values[:len(found.columns[0].values) // 2]),
                         list(run.trajectory.final_q + run.trajectory.final_v))

    def test_derivatives(self):
        row = np.zeros(14)
        row[6] = 1
        found = self.run_all(pitch(keep=["jacobian"], directions=RowMajorMatrix(1, 14, row.tolist())))
        columns = {one.name: one for one in found.columns}
        self.assertEqual(list(columns["derivative"].shape), [1, 14])
        along = np.array(columns["derivative"].values).reshape(600, 14)
        J = np.array(columns["jacobian"].values).reshape(600, 14, 14)
        np.testing.assert_array_equal(along, J[:, :, 6])
        # A start that grazes has none; all others do.
        self.assertEqual([outcome == 0 for outcome in found.derivative_outcome], np.isfinite(along[:, 0]).tolist())
        self.assertGreater(list(found.derivative_outcome).count(0), 590)

    def test_feedback(self):
        request = pitch()
        request.runs = 40000
        found = self.run_all(request)
        self.assertEqual(self.action.get_state(), GoalStatus.SUCCEEDED)
        last = self.feedback[-1]   # what comes behind the result, on another topic, is not told of
        self.assertEqual((last.total, last.fraction, last.left == 0), (40000, last.done / 40000, last.done == 40000))
        self.assertGreater(last.rate, 0)
        self.assertEqual([(one.name, one.count) for one in last.outcomes], [("ok", last.done)])
        done = [one.done for one in self.feedback]
        self.assertEqual(done, sorted(done))
        self.assertEqual(found.columns, [])

    def test_cancelled(self):
        request = pitch()
        request.runs = 10 ** 9
        self.action.send_goal(SweepEnsembleGoal(request=request), feedback_cb=self.feedback.append)
        end = time.time() + 60
        while not (self.feedback and self.feedback[-1].done > 5000) and time.time() < end:
            time.sleep(0.05)
        begin = time.time()
        self.action.cancel_goal()
        self.assertTrue(self.action.wait_for_result(rospy.Duration(60)))
        self.assertLess(time.time() - begin, 20)
        answer = self.action.get_result()
        self.assertEqual(self.action.get_state(), GoalStatus.PREEMPTED)
        self.assertEqual((answer.outcome, answer.recorded), (SweepEnsembleResult.CANCELLED, ""))
        # The first runs are counted, and are those of a sweep of as many.
        self.assertGreater(answer.result.runs, 0)
        request.runs = answer.result.runs
        self.assertEqual(self.run_all(request).mean, answer.result.mean)

    def test_limits(self):
        request = pitch(options=SimulationOptions(max_seconds=0.7))
        request.runs = 10 ** 9
        answer = self.ask(request)
        self.assertEqual(answer.outcome, SweepEnsembleResult.BUDGET_EXCEEDED)
        self.assertIn("max_seconds = 0.7 ", answer.message)
        request = pitch(keep=["final_state"], options=SimulationOptions(max_megabytes=1))
        request.runs = 10 ** 6   # 112 bytes each
        answer = self.ask(request)
        self.assertEqual((answer.outcome, answer.result.runs), (SweepEnsembleResult.BUDGET_EXCEEDED, 0))
        self.assertIn("max_megabytes", answer.message)
        request = pitch(options=SimulationOptions(max_steps=2))
        self.assertEqual([(one.name, one.count) for one in self.run_all(request).outcomes], [("budget exceeded", 600)])
        bins = [EnsembleBins(observable="body_z", low=0, high=1, bins=10 ** 6)] * 1000
        answer = self.ask(pitch(histograms=bins))
        self.assertEqual(answer.outcome, SweepEnsembleResult.BUDGET_EXCEEDED, answer.message)

    def test_refused(self):
        def draw(**fields):
            return {"draws": [EnsembleDraw(**fields)]}
        for fields, part in (
                (draw(kind="unifrom", names=["body_z"]), "'uniform'"),
                (draw(kind="uniform", names=["body_zz"], low=[0], high=[1]), "'body_z'"),
                (draw(kind="uniform", names=["body_z"], low=[1], high=[0]), "low is above high"),
                (draw(kind="uniform", names=["body_z"], low=[0]), "one for each name"),
                (draw(kind="uniform", names=["body_z"], low=[0], high=[1], levels=[2]), "draws[0].levels"),
                (draw(kind="normal", names=["body_z"], deviations=[-1]), "draws[0].deviations[0] is -1"),
                (draw(kind="normal", names=["body_z"], deviations=[float("nan")]), "draws[0].deviations[0] is nan"),
                (draw(kind="normal", names=["body_z"]), "covariance"),
                (draw(kind="grid", names=["body_z", "body_x"], levels=[1]), "2 names"),
                (draw(kind="grid", names=["body_z"]), "levels"),
                (draw(kind="table", names=["body_z"], table=RowMajorMatrix(2, 2, [1.0] * 4)), "1 columns"),
                ({"runs": 0}, "runs is 0"), ({"runs": 2 ** 63}, "runs is 9223372036854775808"),
                ({"keep": ["final_stat"]}, "'final_state'"), ({"samples": [0.2, 0.1]}, "samples"),
                ({"samples": [9.0]}, "within the run"), ({"probabilities": [1.5]}, "probabilities[0] is 1.5"),
                ({"threads": 65}, "threads is 65"), ({"directions": RowMajorMatrix(1, 2, [1.0, 2.0])}, "directions has 2"),
                ({"histograms": [EnsembleBins(observable="body_zz", low=0, high=1, bins=1)]}, "'body_z'"),
                ({"histograms": [EnsembleBins(observable="body_z", low=1, high=1, bins=1)]}, "low < high"),
                ({"costs": [EnsembleCost(name="c", outcomes=["body_z"], weights=[-1])]}, "costs[0].weights[0] is -1")):
            request = pitch()
            for name, value in fields.items():
                setattr(request, name, value)
            answer = self.ask(request)
            self.assertFalse(answer.success, part)
            self.assertEqual(answer.outcome, SweepEnsembleResult.REFUSED)
            self.assertIn(part, answer.message)
        self.assertEqual(self.action.get_state(), GoalStatus.ABORTED)

    def test_recorded_and_verified(self):
        client = Client("landing")
        path = client.start_recording(name="sweeps_%d" % os.getpid()).path
        recorded = self.ask(pitch(keep=["outcome", "final_state", "words"], threads=2)).recorded
        self.assertEqual(recorded, path)
        counted = set()
        for seconds in (0.3, 1.0, 2.5):   # time ends these with the runs that were counted by then
            request = pitch(keep=["final_state"], options=SimulationOptions(max_seconds=seconds))
            request.runs = 10 ** 6
            counted.add(self.ask(request).result.runs)
        self.assertGreater(max(counted), 0)
        bags = client.stop_recording().paths   # several, where many runs were counted
        for bag in bags:
            self.addCleanup(os.remove, bag)
        done = subprocess.run([executable("verify_bag"), *bags], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              universal_newlines=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("4 verified, 0 differ, 0 skipped", done.stdout)
        self.assertIn("ended by its budget of time", done.stdout)

    def test_short_requests_pass(self):
        """Beside a sweep with more threads than processors: its threads step back."""
        request = pitch(threads=8)
        request.runs = 10 ** 9
        self.action.send_goal(SweepEnsembleGoal(request=request), feedback_cb=self.feedback.append)
        end = time.time() + 60
        threads = threads_of("landing")
        while sum(nice > 0 for nice in threads) < 8 and time.time() < end:
            time.sleep(0.05)
            threads = threads_of("landing")
        self.assertGreaterEqual(sum(nice > 0 for nice in threads), 8, threads)
        self.action.cancel_goal()
        self.assertTrue(self.action.wait_for_result(rospy.Duration(60)))

    def test_from_the_command_line(self):
        done = subprocess.run(
            [executable("run_action.py"), "/landing/sweep",
             "{runs: 1000, draws: [{kind: normal, names: [+body_pitch], deviations: [0.01]}]}"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"\[#{30}\] 100 %  1000 runs: ok 1000")
        self.assertEqual(yaml.safe_load(done.stdout)["result"]["measured"], 1000)


def threads_of(node):
    """Niceness of each thread of a node. A thread that ends meanwhile is passed over."""
    uri = rosgraph.Master("/sweep_test").lookupNode("/" + node)
    pid = xmlrpc.client.ServerProxy(uri).getPid("/sweep_test")[2]
    niceness = []
    for thread in os.listdir("/proc/%d/task" % pid):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            with open("/proc/%d/task/%s/stat" % (pid, thread)) as stat:
                niceness.append(int(stat.read().rsplit(")", 1)[1].split()[16]))
    return niceness


if __name__ == "__main__":
    rospy.init_node("sweep_test")
    rostest.rosrun("contact_flow", "sweep", Sweep)
