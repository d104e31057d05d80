#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Trajectories through contact and policies: against closed forms, under perturbations, as files; what is refused."""
import math
import pathlib
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest

GRID = cf.Grid([0, 0.25, 0.5, 0.75], np.zeros((4, 1)))
PROGRAM = """
import numpy as np, contact_flow as cf
ball = cf.Model("driven_ball")
print("ready", flush=True)
try:
    while True:
        ball.optimize_trajectory(cf.Grid(np.arange(250) * 0.004, np.zeros((250, 1))), {"z": 1, "d/dt z": 0}, effort=[1e-3],
                                 neighbours=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


class DrivenCorner(cf.Formulas):
    """A ball thrown into an elastic corner of 60 degrees, both walls of which it meets at once."""

    coordinates, constraints, inputs = ("x", "y"), ("floor", "wall"), ("push",)
    parameters = {"restitution": 0.5}

    def mass_matrix(self, q):
        return np.eye(2)

    def force(self, q, v, u):
        return [u[0], 0.0]

    def gaps(self, q):
        return [q[1], np.sin(np.pi * 2 / 3) * q[0] + np.cos(np.pi * 2 / 3) * q[1]]

    def nominal(self):
        s, c = np.sin(np.pi / 3), np.cos(np.pi / 3)
        return [s, c, -5 * s, -5 * c], [0.0], 0.4


class Trajectories(unittest.TestCase):
    def test_without_contact_by_hand(self):
        """Σ h r u² with z(T), v(T) given, of a ball in flight: least squares of two rows."""
        ball = cf.Model("driven_ball", gravity=0)
        T, h = 1.0, 0.25
        found = ball.optimize_trajectory(
            GRID, x0=[4.0, 0.0], duration=T, effort={"force": 1.0},
            conditions=[{"name": "z", "value": 5.0}, {"name": "d/dt z", "value": 1.0}])
        self.assertTrue(found, found.message)
        middle = np.array([0.125, 0.375, 0.625, 0.875])
        rows = h * np.array([T - middle, np.ones(4)])   # of z and of its rate
        u = rows.T @ np.linalg.solve(rows @ rows.T, [1.0, 1.0])
        self.assertLess(largest(found.inputs.u.ravel() - u), 1e-7)
        self.assertAlmostEqual(h * u @ u, found.cost, delta=1e-7)
        self.assertLess(largest(found.condition_values - [5, 1]), 1e-8)
        # λ: by how much J falls as a bound is relaxed: ∂J/∂c = 2 h (rows rowsᵀ)⁻¹ c, of the other sign
        self.assertLess(largest(np.abs(found.multipliers) - np.abs(2 * h * np.linalg.solve(rows @ rows.T, [1, 1]))), 1e-5)

    def test_through_an_impact(self):
        ball = cf.Model("driven_ball")
        seen = []
        found = ball.optimize_trajectory(GRID, {"z": 1, "d/dt z": 0}, {"z": 100, "d/dt z": 100}, effort=[0.01],
                                         progress=lambda *step: seen.append(step))
        self.assertEqual(("smooth minimum", True), (found.verdict, bool(found)))
        self.assertEqual(found.iterations, seen)
        run = found.run()
        self.assertEqual(1, len([e for e in run.events if "touchdown" in e.kinds]))
        z, v = run.final_state
        h = np.diff(np.append(found.inputs.t, found.duration))
        J = 0.01 * h @ found.inputs.u.ravel() ** 2 + 100 * (z - 1) ** 2 + 100 * v * v
        self.assertAlmostEqual(J, found.cost, delta=1e-9)
        gradient = run.gradient({"z": 1, "d/dt z": 0}, {"z": 200, "d/dt z": 200}, effort=[0.02])   # with factors ½
        self.assertLess(largest(gradient.inputs), 1e-5)

    def test_what_may_be_chosen(self):
        ball = cf.Model("driven_ball")
        found = ball.optimize_trajectory(
            cf.Grid([0.0], [[0.0]]), {"z": 2.0}, x0=[4.0, 0.0], duration=0.5, choose_inputs=False,
            choose_initial=["d/dt z"], choose_parameters=["gravity"], parameter_lower=[5.0], parameter_upper=[8.0],
            conditions=[{"name": "d/dt z", "lower": -3.0, "upper": 0.0}])
        self.assertTrue(found, found.message)
        # v(T) = v − g T ≥ −3 holds z(T) = 4 + v T − g T²/2 above 2.5 + g/8, which is least for g = 5.
        self.assertAlmostEqual(3.125, found.run().final_state[0], delta=1e-6)
        self.assertAlmostEqual(5.0, found.parameters["gravity"], delta=1e-9)
        self.assertEqual(found.parameters["gravity"], found.system.parameters["gravity"])
        when = ball.optimize_trajectory(GRID, effort=[0.01], conditions=[{"touchdown": "floor", "value": 0.8}])
        self.assertAlmostEqual(0.8, when.run().events[0].t if when.run().events[0].activated
                               else when.run().events[-1].t, delta=1e-6)
        shorter = ball.optimize_trajectory(GRID, {"z": 3.5}, effort=[0.01], duration_weight=0.5, duration=0.9,
                                           choose_durations=[3])
        self.assertNotEqual(0.9, shorter.duration)
        self.assertAlmostEqual(shorter.duration, shorter.run().t_end, delta=1e-12)

    def test_costs_by_name(self):
        """What the first iterate costs, in closed form."""
        ball = cf.Model("driven_ball")
        u, T = 3.0, 0.8
        a = u - 9.8
        hit = math.sqrt(-2 / a)
        v, rest = -0.7 * a * hit, T - hit
        squares = a * a * hit ** 3 / 3 + v * v * rest + a * v * rest ** 2 + a * a * rest ** 3 / 3
        for linear in (False, True):
            falling = dict(inputs=cf.Grid([0, 0.3], [[u], [u]]), x0=[1.0, 0.0], duration=T, effort=[0.1], linear_inputs=linear)
            found = ball.optimize_trajectory(power=[("force", "z", 0.25)], **falling)
            self.assertAlmostEqual(0.1 * T * u * u + 0.25 * u * u * squares, found.iterations[0][1], delta=1e-9)
            found = ball.optimize_trajectory(impulse={"floor": 0.5}, **falling)
            self.assertAlmostEqual(0.1 * T * u * u + 0.5 * (1.7 * a * hit) ** 2, found.iterations[0][1], delta=1e-9)
        block = cf.Model("block_on_incline", incline=0.2, friction=0.6)
        b = 9.81 * (0.6 * math.cos(0.2) - math.sin(0.2)) - 0.7
        found = block.optimize_trajectory(cf.Grid([0, 0.1], [[0.7], [0.7]]), x0=[0, 0, 0, 1.3, 0, 1], duration=1.0,
                                          effort=[0.01], slip={"floor": 0.5})
        self.assertAlmostEqual(0.01 * 0.49 + 0.5 * 1.3 ** 3 / (3 * b), found.iterations[0][1], delta=1e-9)

    def test_linear_inputs(self):
        """From rest to rest in 1 s over 1 m by u = 6 - 12 t, which costs 12."""
        mass = cf.Model("driven_ball", gravity=0)
        found = mass.optimize_trajectory(
            cf.Grid([0, 0.3, 0.45], np.zeros((3, 1))), x0=[5.0, 0.0], duration=1.0, effort=[1.0], linear_inputs=True,
            conditions=[{"name": "z", "value": 6.0}, {"name": "d/dt z", "value": 0.0}])
        self.assertTrue(found, found.message)
        self.assertAlmostEqual(12, found.cost, delta=1e-6)
        self.assertLess(largest(found.inputs.u.ravel() - (6 - 12 * found.inputs.t)), 1e-5)
        self.assertLess(largest(found.input_end - [-6]), 1e-5)
        run = found.run()
        self.assertLess(largest(run.final_state - [6, 1, 0, 1]), 1e-7)   # z, the clock, and their rates
        self.assertEqual(("z", "clock of inputs"), cf.LinearInputs(mass).coordinates)
        again = pickle.loads(pickle.dumps(cf.LinearInputs(mass)))
        self.assertEqual(0, again.base.parameters["gravity"])
        with self.assertRaisesRegex(ValueError, "t has 3 instants and u 2 rows"):
            again.lead_inputs([0, 1, 2], [[0.0], [1.0]])
        with self.assertRaisesRegex(ValueError, "not behind"):
            again.lead_inputs([0, 0], [[0.0], [1.0]])

    def test_multiple_shooting(self):
        ball = cf.Model("driven_ball")
        asked = dict(inputs=cf.Grid(np.arange(8) / 8, np.zeros((8, 1))), target={"z": 1, "d/dt z": 0},
                     weight={"z": 100, "d/dt z": 10}, effort=[0.01], x0=[1.5, 0.0], duration=1.0, linear_inputs=True)
        if not cf.have_ipopt():
            with self.assertRaisesRegex(RuntimeError, "coinor-libipopt-dev"):
                ball.optimize_trajectory(method="multiple_shooting", **asked)
            return
        found = ball.optimize_trajectory(method="multiple_shooting", segments=[2, 6], **asked)
        self.assertTrue(found, found.message)
        self.assertAlmostEqual(ball.optimize_trajectory(**asked).cost, found.cost, delta=1e-8)
        joined = ball.optimize_trajectory(method="multiple_shooting", segments=[2, 6], states=[[1.2, -2], [0.7, 2]], **asked)
        self.assertAlmostEqual(found.cost, joined.cost, delta=1e-8)

    def test_a_stall_is_not_infeasible(self):
        """A leg on the floor that its first input lifts at once has no derivative there; nothing is shown of the conditions."""
        leg = cf.Robot(case.ROOT / "config" / "robots" / "monoped.yaml")
        rest = np.array(leg.simulate(duration=3).final_state)
        rest[3:] = 0
        knee = np.array([0, 0.1, 0.25, 0.2, -0.6, -0.3, 0.1, 0.2])
        found = leg.optimize_trajectory(
            cf.Grid(0.05 * np.arange(8), leg.nominal.u + np.column_stack([-0.5 * knee, knee])), x0=rest, duration=0.4,
            linear_inputs=True, effort=[1, 1], input_reference=leg.nominal.u, lower=[-1.2, 0.1], upper=[0.4, 2],
            conditions=[{"name": "height", "value": 0.62}, {"name": "d/dt height", "value": 0}])
        self.assertEqual("stalled", found.verdict)
        self.assertRegex(found.message, "the start touches 'foot'.*; d/dt height at the end is .* off its bounds")

    def test_ends(self):
        ball = cf.Model("driven_ball")
        stopped = ball.optimize_trajectory(GRID, {"z": 1}, effort=[0.01], progress=lambda *step: step[0] < 1)
        self.assertEqual("cancelled", stopped.verdict)
        self.assertFalse(stopped)

        def fail(*step):
            raise ZeroDivisionError("mine")
        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            ball.optimize_trajectory(GRID, {"z": 1}, effort=[0.01], progress=fail)
        late = ball.optimize_trajectory(GRID, {"z": 1}, effort=[0.01], max_seconds_total=1e-6)
        self.assertEqual("cancelled", late.verdict)
        first = ball.optimize_trajectory(GRID, {"z": 1}, effort=[0.01], max_iterations=0)
        self.assertEqual("max iterations", first.verdict)
        self.assertEqual(1, len(first.iterations))
        self.assertIn("max_iterations = 0 were made", first.message)

    def test_interrupted(self):
        with subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True) as child:
            self.assertEqual("ready\n", child.stdout.readline())
            time.sleep(0.5)
            child.send_signal(signal.SIGINT)
            start = time.monotonic()
            self.assertEqual("interrupted\n", child.stdout.readline())
            self.assertLess(time.monotonic() - start, 5)

    def test_refusals(self):
        ball = cf.Model("driven_ball")
        ask = ball.optimize_trajectory
        for kind, call, what in (
                (ValueError, lambda: ask(GRID, {"zz": 1}), "target.*zz"),
                (ValueError, lambda: ask(GRID, [1.0]), r"target has shape 1, expected 2 numbers: z, d/dt z"),
                (ValueError, lambda: ask(GRID, {"z": 1}, effort=[-1.0]), "effort"),
                (ValueError, lambda: ask(GRID, {"z": math.nan}), "target"),
                (ValueError, lambda: ask(GRID, {"z": 1}, effort=[1, 2]), "effort has shape 2, expected 1 numbers: force"),
                (ValueError, lambda: ask(GRID, conditions=[{"name": "z", "valu": 1}]), r"conditions\[0\] has no field 'valu'"),
                (ValueError, lambda: ask(GRID, conditions=[{"value": 1}]), r"conditions\[0\] has either"),
                (ValueError, lambda: ask(GRID, conditions=[{"name": "z", "lower": 2, "upper": 1}]), "lower is 2.0, upper 1.0"),
                (ValueError, lambda: ask(GRID, conditions=[{"name": "z", "value": 1, "lower": 1}]), "'value' and bounds"),
                (ValueError, lambda: ask(GRID, conditions=[{"name": "z", "value": 1, "instant": 9}]), "instant|number|9"),
                (ValueError, lambda: ask(GRID, choose_parameters=["gravty"]), "did you mean 'gravity'"),
                (TypeError, lambda: ask(GRID, choose_parameters="gravity"), "choose_parameters is one text"),
                (ValueError, lambda: ask(GRID, path_reference=np.zeros((4, 1))), "needs a path_weight"),
                (ValueError, lambda: ask(GRID, power=[("forse", "z", 1.0)]), "did you mean 'force'"),
                (ValueError, lambda: ask(GRID, power=[("force", "z")]), "a term of 2 entries"),
                (ValueError, lambda: ask(GRID, impulse={"flor": 1.0}), "did you mean 'floor'"),
                (ValueError, lambda: ask(GRID, slip={"floor": 1.0}), "'floor' has no friction"),
                (ValueError, lambda: ask(GRID, input_end=[0.0]), "linear_inputs"),
                (ValueError, lambda: ask(GRID, method="shooting"), "method is 'shooting', expected one of pieces, multiple_shooting"),
                (ValueError, lambda: ask(GRID, segments=[1]), "segments and states are those of"),
                (ValueError, lambda: ask(GRID, max_iterations=-1), "max_iterations is -1, expected a whole number ≥ 0"),
                (ValueError, lambda: ask(GRID, max_seconds_total=0), "max_seconds is 0"),
                (TypeError, lambda: ask(GRID, relative_tolerence=1e-3), "did you mean 'relative_tolerance'"),
                (ValueError, lambda: ask(cf.Grid([0, 0.5], [[0.0], [0.0]]), {"z": 1}, duration=0.4), "horizon must lie behind"),
                (ValueError, lambda: cf.Model("soft_biped").optimize_trajectory([], {"body_z": 1}), "unknown|chosen|inputs")):
            with self.subTest(what), self.assertRaisesRegex(kind, what):
                call()


class Policies(unittest.TestCase):
    def setUp(self):
        self.ball = cf.Model("driven_ball")
        t = 0.02 * np.arange(40)
        u = np.where(np.arange(40) % 2 == 0, 1.0, -1.0).reshape((-1, 1))
        self.run_ = self.ball.simulate([1.0, 0.0], 0.8, cf.Grid(t, u), relative_tolerance=1e-12, absolute_tolerance=1e-12)
        self.policy = self.run_.policy({"z": 100, "d/dt z": 1}, [0.01])

    def close(self, policy, height, extend=True):
        """The closed loop at 1 kHz: (largest input, its events, end)."""
        tracker, flow, largest_input = policy.tracker(extend=extend), self.ball.online([height, 0.0], [0.0]), 0.0
        for k in range(800):
            event = flow.advance_to(1e-3 * k)
            while event is not None:
                if event["activated"] or event["released"]:
                    tracker.observe(event["t"], event["activated"], event["released"], event["mode_after"])
                event = flow.advance_to(1e-3 * k)
            u = tracker.input(1e-3 * k, flow.x)
            largest_input = max(largest_input, abs(u[0]))
            flow.set_input(u)
        return largest_input, tracker.events, flow.x

    def test_gains_solve_the_riccati_equation(self):
        """K of the last intervals, by hand along A, B of linearize()."""
        intervals = self.run_.linearize()
        Q, R, S = np.diag([100.0, 1.0]), np.array([[0.01]]), np.diag([100.0, 1.0])
        for k in range(39, 29, -1):
            A, B, h = intervals[k].A, intervals[k].B, intervals[k].t_end - intervals[k].t_begin
            K = np.linalg.solve(h * R + B.T @ S @ B, B.T @ S @ A)
            np.testing.assert_allclose(self.policy.gains[k], K, rtol=1e-7, atol=1e-9)
            S = h * Q + A.T @ S @ (A - B @ K)

    def test_followed(self):
        on_time, events, end = self.close(self.policy, 1.0)
        self.assertLess(on_time, 1.01)
        self.assertEqual(["on time"], [kind for kind, _, _, _ in events])
        for height, kind in ((1.1, "on time"), (1.4, "late"), (0.6, "early")):   # of a millisecond or more
            late, events, end = self.close(self.policy, height)
            (found, t, expected, constraints), = events
            self.assertEqual((kind, ("floor",)), (found, constraints))
            self.assertEqual(kind == "on time", abs(t - expected) <= 1e-3)
            self.assertLess(abs(end[0] - self.run_.final_state[0]), 0.01)
            if height > 1:   # v jumps by 7.5 m/s at the reference's touchdown
                self.assertGreater(self.close(self.policy, height, extend=False)[0], 3 * late)

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "ball.yaml"
            cf.write_policy(self.policy, path)
            again = cf.read_policy(path)
            self.assertEqual(self.policy.text, again.text)
            for K, L in zip(self.policy.gains, again.gains):
                np.testing.assert_array_equal(K, L)
            path.write_text(path.read_text().replace("gains:", "gians:", 1))
            with self.assertRaisesRegex(ValueError, "ball.yaml"):
                cf.read_policy(path)
        self.assertEqual(2, len(self.policy.phases))
        self.assertEqual(("floor",), self.policy.phases[0]["activated"])
        np.testing.assert_allclose(self.policy.x(0.2), self.run_.x(0.2), atol=1e-6)
        np.testing.assert_array_equal(self.policy.u(0.2), self.run_.u(0.2 + 1e-9))
        tracker = self.policy.tracker()
        text = repr(tracker)
        del self.policy
        self.assertEqual("<PolicyTracker of driven_ball, phase 0>", text)
        self.assertTrue(np.isfinite(tracker.input(0.1, [0.9, -1.0]))[0])

    def test_refusals(self):
        run = self.run_
        for kind, call, what in (
                (ValueError, lambda: run.policy(state=[-1.0, 1.0]), "state"),
                (ValueError, lambda: run.policy(input=[0.0]), "input"),
                (ValueError, lambda: run.policy(state=[1.0]), "state has shape 1, expected 2 numbers"),
                (ValueError, lambda: run.policy(reach=math.nan), "reach"),
                (ValueError, lambda: run.policy(lower=[1.0], upper=[0.0]), "lower|upper"),
                (ValueError, lambda: self.policy.u(math.nan), "t is nan"),
                (IndexError, lambda: self.policy.x(0.1, phase=7), "phase is 7, the policy has 2"),
                (ValueError, lambda: self.policy.tracker(on_time=math.nan), "on_time"),
                (ValueError, lambda: self.policy.tracker().observe(0.1, ["flor"]), "did you mean 'floor'"),
                (ValueError, lambda: self.policy.tracker().input(0.1, [1.0]), "x has shape 1, expected 2 numbers: z, d/dt z"),
                (ValueError, lambda: self.policy.tracker().input(0.1, [1.0, math.nan]), "x has a number that is not finite"),
                (ValueError, lambda: self.ball.simulate(dense=False).policy(), "dense=False"),
                (ValueError, lambda: cf.Model("rigid_biped").simulate().policy(), "no inputs"),
                (cf.NoDerivative, lambda: cf.PythonModel(DrivenCorner).simulate().policy(), "discontinuous")):
            with self.subTest(what), self.assertRaisesRegex(kind, what):
                call()


if __name__ == "__main__":
    case.main()
