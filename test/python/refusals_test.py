#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What cannot be answered is refused with field and reason, and what is answered is what was asked."""
import copy
import json
import math
import pathlib
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import types
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest
from command import command
from contact_flow import jet


class Terms(unittest.TestCase):
    def test_impacts_have_friction(self):
        """System.impact is the impact of a run."""
        ball = cf.Model("spinning_ball")
        event = ball.simulate().events[0]
        nq = ball.num_positions
        v, p, hit = ball.impact(event.x_minus[:nq], event.x_minus[nq:], event.activated)
        np.testing.assert_allclose(v, event.x_plus[nq:], atol=1e-12)
        np.testing.assert_allclose(p[:len(event.impulse)], event.impulse[:len(p)], atol=1e-12)
        self.assertEqual(event.activated, hit)

    def test_modes_have_letters(self):
        block = cf.Model("block_on_incline")
        x = {"d/dt x": -1}
        own = block.accelerations(x)[0]
        self.assertGreater(own[0], 7)   # g sin 0.3 does not brake as friction does
        np.testing.assert_array_equal(own, block.accelerations(x, mode=["floor"])[0])
        np.testing.assert_array_equal(own, block.accelerations(x, mode="-")[0])
        np.testing.assert_array_equal(block.accelerations({"d/dt x": 0})[0],
                                      block.accelerations({"d/dt x": 0}, mode=["floor"])[0])
        self.assertEqual(0, block.accelerations({"d/dt x": 0}, mode="s")[0][0])
        run = block.simulate(x)
        for t in (0.05, run.t_end):
            a = block.accelerations(run.x(t), mode=run.mode(t))[0]
            np.testing.assert_array_equal(a, block.accelerations(run.x(t))[0])
        for mode, what in (("+", "slips at -1"), ("s", "slips at 1"), ("l", "has the letters os"),
                           ("ss", "a word of 1 letter")):
            with self.assertRaisesRegex(ValueError, what):
                block.accelerations(x, mode=mode)
        with self.assertRaisesRegex(ValueError, "that of x is {}"):
            block.accelerations({"z": 1}, mode=["floor"])
        puck = cf.Model("puck")
        rest = {"d/dt x": 0, "d/dt y": 0}
        self.assertTrue(np.isfinite(puck.accelerations(rest, mode=["floor"])[0]).all())
        with self.assertRaisesRegex(ValueError, "does not slip"):
            puck.accelerations(rest, mode="l")
        biped = cf.Model("soft_biped")   # without friction names say all
        np.testing.assert_array_equal(biped.accelerations(mode=["left_foot"])[0],
                                      biped.accelerations(mode="lo")[0])


class Quotients(unittest.TestCase):
    def test_a_failed_one_has_no_error(self):
        ball = cf.Model("bouncing_ball", restitution=1)
        B = ball.simulate(duration=1.2).derivative(by=["restitution"])
        sample, = B.compare("+restitution", [1e-3]).samples
        self.assertFalse(sample.status)
        self.assertTrue(math.isnan(sample.error))

    def test_the_command_does_not_take_it_for_right(self):
        code, out, _ = command("compare", "bouncing_ball", "-p", "restitution=1", "-t", "1.2", "--by",
                               "restitution", "-w", "+restitution", "--json")
        self.assertEqual(1, code)
        self.assertEqual([None] * 5, [s["error"] for s in json.loads(out)[0]["samples"]])
        self.assertEqual(1, command("compare", "soft_biped", "-w", "+body_pitch", "--alphas", "0.5")[0])
        self.assertEqual(0, command("compare", "soft_biped", "-w", "+body_pitch", "--alphas", "1e-3", "1e-4")[0])


class Options(unittest.TestCase):
    def test_out_of_their_range(self):
        double = cf.PiecewiseLinearMap([([[2.0]], None)])
        half = cf.PiecewiseLinearMap([([[0.5]], None)])
        for bad in (-5, math.nan, 1.0):
            for map_ in (double, half):
                with self.assertRaisesRegex(ValueError, "margin"):
                    map_.stability(margin=bad)
        self.assertEqual(("unstable", "stable"), (double.stability().verdict, half.stability(margin=0).verdict))
        for name in ("max_words", "max_word_length"):
            with self.assertRaisesRegex(ValueError, name):
                half.stability(**{name: -1})
        ramp = cf.PiecewiseLinearMap([([[1.0]], [[1.0]]), ([[0.0]], [[-1.0]])])
        with self.assertRaisesRegex(ValueError, "rotations"):
            ramp.covariance([[1.0]], rotations=-5)
        pendulum = cf.Model("double_pendulum")
        for name, value in (("radius", -1), ("radius", math.nan), ("tolerance", -1), ("max_iterations", -1)):
            with self.assertRaisesRegex(ValueError, name):
                pendulum.optimize(["shoulder_torque"], {"elbow": 2}, **{name: value})

    def test_what_is_not_finite(self):
        B = cf.Model("soft_biped").simulate().derivative()
        for ask in (B, B.radius, B.error, B.project, B.direction):
            for w in ({"body_pitch": math.nan}, [math.nan] * 14, {"body_pitch": math.inf}):
                with self.assertRaisesRegex(ValueError, "not finite"):
                    ask(w)
        with self.assertRaisesRegex(ValueError, "dt is nan"):
            B("+body_pitch", dt=math.nan)
        for bad in (math.nan, -1, 0):
            with self.assertRaisesRegex(ValueError, "max_seconds"):
                B.run.derivative(max_seconds=bad)
            with self.assertRaisesRegex(ValueError, "max_seconds"):
                B.radius("+body_pitch", max_seconds=bad)
        self.assertEqual(2, command("derive", "soft_biped", "-w", "body_pitch=nan")[0])

    def test_numbers_that_are_none(self):
        """NaN, hidden numbers of masked arrays, True where a number is meant."""
        biped, ball = cf.Model("soft_biped"), cf.Model("driven_ball")
        bad, q = np.full(7, math.nan), biped.nominal.x[:7]
        summary = biped.sweep({"body_pitch": cf.Uniform(-0.1, 0.1)}, runs=4, threads=1).summary
        for kind, call, what in (
                (ValueError, lambda: biped.impact(bad, q, ["left_foot"]), "q has a number that is not finite"),
                (ValueError, lambda: biped.impact(q, bad, ["left_foot"]), "v has a number that is not finite"),
                (ValueError, lambda: biped.mass_matrix(bad), "q has a number that is not finite"),
                (ValueError, lambda: biped.accelerations(np.full(14, math.nan), mode=[]), "x has a number that is not"),
                (ValueError, lambda: ball.force([1.0], [0.0], [math.inf]), "u has a number that is not finite"),
                (ValueError, lambda: biped.separation(np.full(14, math.nan), biped.nominal.x), "to has a number"),
                (ValueError, lambda: ball.optimize(["force"], {"z": math.nan}), "target has a number that is not"),
                (ValueError, lambda: biped.simulate(np.ma.array(biped.nominal.x, mask=[1] + [0] * 13)), "x0 is a masked"),
                (ValueError, lambda: biped.poincare(cf.Apex("body_z"), shortest=math.nan), "shortest is nan"),
                (ValueError, lambda: biped.poincare(cf.Apex("body_z"), shortest=-1), "shortest is -1"),
                (TypeError, lambda: biped.simulate(max_steps=True), "max_steps is True"),
                (TypeError, lambda: ball.online().set_input([1.0], "now"), "t is 'now', expected a number"),
                (ValueError, lambda: ball.optimize(["forc"], {"z": 1}), "number to be chosen 'forc'; did you mean 'force'"),
                (IndexError, lambda: summary.quantile(99, 0.5), "observable is 99, there are 14"),
                (IndexError, lambda: summary.histogram(5), "index is 5, there are 0"),
                (ValueError, lambda: summary.quantile(0, 1.5), r"p is 1.5, expected a number in \[0, 1\]"),
                (ValueError, lambda: biped.simulate().report("x.html", samples=10**7), "samples is 10000000, expected 2 to 1000000")):
            with self.subTest(what), self.assertRaisesRegex(kind, what):
                call()
        self.assertTrue(biped.simulate(np.ma.array(biped.nominal.x)).status)

    def test_numbers_by_name_of_any_mapping(self):
        biped = cf.Model("soft_biped")
        named = types.MappingProxyType({"body_pitch": 0.1})
        np.testing.assert_array_equal(biped.simulate({"body_pitch": 0.1}).x0, biped.simulate(named).x0)

    def test_of_other_kinds(self):
        """Messages are of this package's fields."""
        biped, pendulum = cf.Model("soft_biped"), cf.Model("double_pendulum")
        for call in (lambda: pendulum.optimize(["shoulder_torque"], {"elbow": 2}, duration="long"),
                     lambda: biped.poincare(cf.Apex("body_z")).fixed_point(
                         conditions=[{"kind": "period", "value": "long"}])):
            with self.assertRaisesRegex(TypeError, "'long', expected a number"):
                call()
        for call, what in ((lambda: pendulum.optimize(["shoulder_torque"], {"elbow": 2}, duration=-1), "duration"),
                           (lambda: cf.Crossing("body_z", math.nan), "value"),
                           (lambda: cf.Crossing("body_z", 1, 5), "sign"),
                           (lambda: cf.After(math.nan), "seconds"),
                           (lambda: biped.poincare(cf.Section("coordinate", "body_z", math.nan)), "value"),
                           (lambda: biped.poincare(cf.Section("coordinate", "body_z", 1.0, 5)), "sign"),
                           (lambda: biped.online(t=math.nan), "t is nan"),
                           (lambda: biped.simulate().csv(0), "count")):
            with self.assertRaisesRegex(ValueError, what):
                call()

    def test_of_the_command(self):
        code, _, err = command("orbit", "hopping_trot", "--apex", "body_z", "-t", "3")
        self.assertEqual(2, code)
        self.assertIn("-t", err)
        with tempfile.TemporaryDirectory() as folder:
            path = str(pathlib.Path(folder) / "run.html")
            self.assertEqual(1, command("report", "soft_biped", path, "-o", "max_steps=3")[0])
            self.assertEqual(0, command("report", "soft_biped", path)[0])


class Returns(unittest.TestCase):
    def test_their_run_is_the_request(self):
        block = cf.Model("rocking_block")
        period = block.nominal.duration / 4
        run = block.poincare(cf.After(period), impact_law="projection", max_step=0.01)(derivative=False).run
        self.assertEqual(("projection", 0.01), (run.options["impact_law"], run.options["max_step"]))
        again = pickle.loads(pickle.dumps(run))
        np.testing.assert_array_equal(run.final_state, again.final_state)
        self.assertEqual(len(run.events), len(again.events))

    def test_behind_an_event_nothing_repeats_it(self):
        run = cf.Model("bouncing_ball").poincare(cf.Touchdown("floor"))().run
        self.assertFalse(run.repeats)
        self.assertEqual(1, len(run.events))
        for ask in (lambda: pickle.dumps(run), run.derivative, run.linearize, run.input_map):
            with self.assertRaisesRegex(ValueError, "ends behind its event"):
                ask()
        with tempfile.TemporaryDirectory() as folder:
            run.report(pathlib.Path(folder) / "run.html")
        self.assertTrue(cf.Model("bouncing_ball").simulate().repeats)


class Memory(unittest.TestCase):
    def test_samples_that_no_memory_holds(self):
        """Refused before the first of them: 2·10⁹ rows are 240 GB, for which the process would be ended."""
        run = cf.Model("soft_biped").simulate()
        for ask in (run.samples, run.csv):
            with self.assertRaisesRegex(ValueError, r"count is 2000000000, whose rows take 240000.0 MB, more than the"):
                ask(2 * 10**9)


class Interruptions(unittest.TestCase):
    PROGRAM = """
import numpy as np, contact_flow as cf
run = cf.Model("soft_biped").simulate(max_megabytes=10000)
print("ready", flush=True)
try:
    while True:
        {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""

    def test_of_samples(self):
        """Each takes ten seconds or more if nothing ends it."""
        for call in ("run.samples(2 * 10**7)", "run.csv(2 * 10**7)", "run.x(np.linspace(0, 1.4, 10**7))"):
            with subprocess.Popen([sys.executable, "-c", self.PROGRAM.format(call=call)],
                                  stdout=subprocess.PIPE, text=True) as child:
                self.assertEqual("ready\n", child.stdout.readline())
                time.sleep(0.5)
                start = time.monotonic()
                child.send_signal(signal.SIGINT)
                self.assertEqual("interrupted\n", child.stdout.readline())
                self.assertLess(time.monotonic() - start, 5)

    def test_a_daemon_does_not_abort_the_exit(self):
        program = """
import threading, time, contact_flow as cf
biped = cf.Model("soft_biped")
def work():
    biped.simulate(duration=1e5, max_step=1e-4, max_steps=10**9, dense=False)
threading.Thread(target=work, daemon=True).start()
time.sleep(0.3)
"""
        for _ in range(3):
            done = subprocess.run([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True, timeout=60)
            self.assertEqual(0, done.returncode, done.stderr)


class Formulas(unittest.TestCase):
    def test_powers(self):
        x, = jet.variables([-2.0], 0, 1)
        self.assertTrue(math.isnan((x ** 0.5).value))
        np.testing.assert_array_equal([[-8.0, 12.0]], (x ** 3).c)
        np.testing.assert_allclose([[-0.125, -0.1875]], (x ** -3).c)
        zero, = jet.variables([0.0], 0, 1)
        np.testing.assert_array_equal([[0.0, 0.0]], (zero ** 1.5).c)
        np.testing.assert_array_equal([[0.0, math.inf]], (zero ** 0.5).c)
        np.testing.assert_array_equal([[0.0, math.inf]], zero.sqrt().c)
        self.assertTrue(math.isnan(zero.constant(0).sqrt().c[0, 1]))   # as of x² + y²: not known to first order
        both, = jet.variables([0.0], 0, 1, 1, True)   # the second derivative of x^1.5 is infinite
        np.testing.assert_array_equal([[0.0, 0.0], [0.0, math.inf]], (both ** 1.5).c)

    def make(self, **fields):
        methods = {"coordinates": ("z",), "mass_matrix": lambda self, q: [[1.0]],
                   "force": lambda self, q, v, u: [-9.81]}
        return cf.PythonModel(type("Ball", (cf.Formulas,), dict(methods, **fields)))

    def test_shapes_and_names(self):
        for what, fields in (("gaps", {"gaps": lambda self, q: [q[0]]}),
                             ("force", {"force": lambda self, q, v, u: [0.0, 0.0]}),
                             ("coordinates and in inputs", {"inputs": ("z",)}),
                             ("coordinates and in parameters", {"parameters": {"z": 1.0}}),
                             ("inputs and in parameters", {"inputs": ("push",), "parameters": {"push": 1.0}})):
            with self.assertRaisesRegex(ValueError, what):
                self.make(**fields)

    def test_arguments_are_not_changed(self):
        """Of floats, of jets, by differences: one formula would change what the next one sees."""
        def force(self, q, v, u):
            v[0] -= 1.0
            return [-v[0]]
        for fields in ({}, {"differentiation": "differences"}):
            with self.assertRaisesRegex(ValueError, "read-only"):
                self.make(force=force, **fields).simulate()
        jets = jet.variables([1.0], 0, 1)
        with self.assertRaisesRegex(ValueError, "read-only"):
            jets[0] = 2.0

    def test_what_formulas_throw(self):
        """As it is, whatever it is, from within a run and from within a derivative."""
        for error in (KeyError("mine"), SystemExit(3), RecursionError("deep")):
            def force(self, q, v, u, error=error):
                if v[0] < -1:
                    raise error
                return [-9.81]
            ball = self.make(force=force)
            with self.assertRaises(type(error)) as caught:
                ball.simulate(duration=1.0)
            self.assertEqual(error.args, caught.exception.args)
        gone = self.make(force=lambda self, q, v, u: [math.nan if v[0] < -1 else -9.81]).simulate(duration=1.0)
        self.assertEqual("non-finite", gone.status.outcome)

    def test_quotients_out_of_the_range_of_a_parameter(self):
        ball = self.make(constraints=("floor",), gaps=lambda self, q: [q[0]],
                         parameters={"restitution": (1.0, "", "", "unit_interval")},
                         nominal=lambda self: ([1.0, 0.0], [], 0.8))
        sample, = ball.simulate().derivative(by=["restitution"]).compare("+restitution", [1e-3]).samples
        self.assertFalse(sample.status)
        self.assertIn("restitution", sample.status.message)


class Values(unittest.TestCase):
    def test_copies_and_pickles(self):
        run = cf.Model("soft_biped").simulate()
        B = run.derivative(by=["stiffness"])
        for value in (B, run.events[0], run.arcs[0]):
            self.assertIs(value, copy.copy(value))
            self.assertIs(value, copy.deepcopy(value))
        again = pickle.loads(pickle.dumps(B))
        self.assertEqual(B.tangents, again.tangents)
        np.testing.assert_array_equal(B("+body_pitch"), again("+body_pitch"))
        event = pickle.loads(pickle.dumps(run.events[0]))
        np.testing.assert_array_equal(run.events[0].x_plus, event.x_plus)
        self.assertEqual(run.arcs[1].word, pickle.loads(pickle.dumps(run.arcs[1])).word)
        margins = pickle.loads(pickle.dumps(run.margins))
        self.assertEqual(repr(run.margins), repr(margins))

    def test_the_request_of_a_report(self):
        from contact_flow.report import request
        pendulum = cf.Model("double_pendulum")
        run = pendulum.simulate(duration=0.1, inputs=cf.Grid([5.0], [pendulum.nominal.u]))
        scope = {}
        exec(request(run), scope)
        self.assertEqual((5.0, run.t_end), (scope["run"].t_begin, scope["run"].t_end))
        Ball = type("Ball", (cf.Formulas,), {
            "name": "my ball", "coordinates": ("z",), "mass_matrix": lambda self, q: [[1.0]],
            "force": lambda self, q, v, u: [-9.81]})
        run = cf.PythonModel(Ball).simulate(duration=0.1)
        scope = {"Ball": Ball}
        exec(request(run), scope)
        self.assertEqual(0, largest(run.final_state - scope["run"].final_state))


if __name__ == "__main__":
    case.main()
