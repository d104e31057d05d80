#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs out of bags, of records made here by hand; test/ros/python_client_test.py reads those of a node."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import contact_flow as cf
import case
from contact_flow import bags
from contact_flow.bag_writer import outcome_number
from python_models import Pendulum

try:
    import rosbag
    from contact_flow import msg
except ImportError as reason:
    MISSING = str(reason)
else:
    MISSING = ""


def description(system):
    """As a node describes it, with its options."""
    told = msg.ModelDescription(name=system.name, parameters=[
        msg.ModelParameter(name=p.name, value=p.value) for p in system.parameter_list])
    if isinstance(system, cf.Robot):
        told.urdf, told.robot_yaml = system.urdf, system.yaml
    usual = cf.Model("bouncing_ball").simulate(duration=0.0).options
    for name in told.options.__slots__:
        setattr(told.options, name, usual[name])
    return told


def ended(run, kind):
    nq = run.system.num_positions
    return kind(final_q=run.final_state[:nq].tolist(), final_v=run.final_state[nq:].tolist())


class Sound(unittest.TestCase):
    def test_without_rosbag(self):
        if not MISSING:
            self.skipTest("rosbag is installed")
        with self.assertRaisesRegex(ImportError, "python3-rosbag"):
            bags.runs("any.bag")


@unittest.skipIf(MISSING, MISSING)
class Bags(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "made.bag"

    def write(self, *messages):
        with rosbag.Bag(str(self.path), "w") as bag:
            for topic, message in messages:
                bag.write(topic, message)
        return bags.runs(self.path)

    def test_requests(self):
        """By names, numbers, a grid and options: each the run that was asked for."""
        ball = cf.Model("driven_ball", restitution=0.5)
        grid = cf.Grid([0, 0.25], [[1.0], [-2.0]])
        runs = [ball.simulate({"z": 3.0, "d/dt z": -1.0}, 1.5), ball.simulate([2.0, 0.0], inputs=grid, relative_tolerance=1e-6),
                ball.simulate(duration=0.5, inputs=[0.7])]
        by_name = msg.SimulationRecord(result=ended(runs[0], msg.ContactTrajectory))
        by_name.request.duration = 1.5
        by_name.request.state = msg.InitialState(names=["z"], positions=[3.0], velocities=[-1.0])
        gridded = msg.SimulationRecord(result=ended(runs[1], msg.ContactTrajectory))
        gridded.request.state = msg.InitialState(q=[2.0], v=[0.0])
        gridded.request.input_grid = msg.InputGrid(times=[0, 0.25], values=msg.RowMajorMatrix(2, 1, [1.0, -2.0]))
        gridded.request.options.relative_tolerance = 1e-6
        derived = msg.DerivativeRecord(result=ended(runs[2], msg.OutcomeDerivative))
        derived.request.duration, derived.request.input = 0.5, [0.7]
        derived.request.by_inputs, derived.request.by_parameters = True, ["gravity"]
        found = self.write(("/n/model_description", description(ball)), ("/n/record/simulation", by_name),
                           ("/n/record/simulation", gridded), ("/n/record/derivative", derived))
        self.assertEqual(3, len(found))
        for run, one in zip(runs, found):
            self.assertTrue(one.same, one)
            np.testing.assert_array_equal(run.final_state, one.run.final_state)
            self.assertEqual(len(run.events), len(one.run.events))
        self.assertEqual([("state",), ("state",), ("state", "inputs", "gravity")], [one.by for one in found])

    def test_a_robot_and_a_difference(self):
        robot = cf.Robot(case.ROBOTS / "monoped.yaml").with_parameters(body_mass=3.5)
        record = msg.SimulationRecord(result=ended(robot.simulate(), msg.ContactTrajectory))
        record.result.final_v = [record.result.final_v[0] + 1e-9] + list(record.result.final_v[1:])
        one, = self.write(("/n/model_description", description(robot)), ("/n/record/simulation", record))
        self.assertFalse(one.same)
        self.assertAlmostEqual(1e-9, one.difference, delta=1e-12)
        self.assertEqual(3.5, one.run.system.parameters["body_mass"])

    def test_epochs(self):
        """A simulator's: to its last state, under the inputs that it took, each epoch with its parameters."""
        ball = cf.Model("driven_ball")
        run = ball.simulate(duration=1.2, inputs=cf.Grid([0, 0.5], [[0.0], [3.0]]))
        heavy = ball.with_parameters(mass=2.0)
        after = heavy.simulate(run.final_state, 0.6, [3.0])

        def epoch(number, t, x, u, system):
            return msg.SimulatorEpoch(epoch=number, t=t, q=[x[0]], v=[x[1]], input=[u],
                                      parameter_names=list(system.parameters),
                                      parameter_values=list(system.parameters.values()))

        def state(number, t, x):
            return msg.HybridState(epoch=number, t=t, q=[x[0]], v=[x[1]])
        found = self.write(
            ("/s/online_model", description(ball)), ("/s/epoch", epoch(1, 0.0, run.x0, 0.0, ball)),
            ("/s/state", state(1, 0.2, run.x(0.2))), ("/s/input_taken", msg.SimulatorInput(epoch=1, t=0.5, input=[3.0])),
            ("/s/state", state(1, 1.2, run.final_state)), ("/s/epoch", epoch(2, 1.2, run.final_state, 3.0, heavy)),
            ("/s/state", state(2, 1.8, after.final_state)))
        self.assertEqual(2, len(found))
        self.assertTrue(found[0].same)
        self.assertLess(found[1].difference, 1e-12)       # 1.8 − 1.2 is not 0.6, to the bit
        self.assertEqual(2.0, found[1].run.system.parameters["mass"])

    def test_an_epoch_that_ends_at_an_event(self):
        """The simulator stops behind it; grids may have values alone; starts that nothing tells are left out."""
        ball = cf.Model("bouncing_ball")
        bounce = ball.simulate().events[0]
        driven = cf.Model("driven_ball")
        pushed = driven.simulate(duration=0.5, inputs=[0.7])
        gridded = msg.SimulationRecord(result=ended(pushed, msg.ContactTrajectory))
        gridded.request.duration = 0.5
        gridded.request.input_grid = msg.InputGrid(values=msg.RowMajorMatrix(1, 1, [0.7]))
        projected = msg.DerivativeRecord(result=ended(pushed, msg.OutcomeDerivative))
        projected.request.state.project = True
        nominal, nq = ball.nominal.x, ball.num_positions
        with self.assertWarnsRegex(UserWarning, "projected"):
            found = self.write(
                ("/n/model_description", description(driven)), ("/n/record/simulation", gridded),
                ("/n/record/derivative", projected), ("/s/online_model", description(ball)),
                ("/s/epoch", msg.SimulatorEpoch(epoch=1, t=0.0, q=nominal[:nq].tolist(), v=nominal[nq:].tolist())),
                ("/s/state", msg.HybridState(epoch=1, t=bounce.t, q=bounce.x_plus[:nq].tolist(),
                                             v=bounce.x_plus[nq:].tolist())))
        self.assertEqual(2, len(found))
        self.assertTrue(found[0].same, found[0])
        self.assertLess(found[1].difference, 1e-9)

    def test_written_and_read(self):
        """Of models, robots, with a grid, friction, options: each run is the same again, to the bit."""
        ball, robot = cf.Model("driven_ball", restitution=0.5), cf.Robot(case.ROBOTS / "monoped.yaml", body_mass=3.5)
        runs = [ball.simulate([2.0, 0.0], 1.5, cf.Grid([0, 0.25], [[1.0], [-2.0]]), relative_tolerance=1e-6),
                ball.simulate({"z": 3.0}, 1.0, [0.7]), robot.simulate(), cf.Model("spinning_ball").simulate(),
                cf.Model("soft_biped").simulate(max_steps=3), cf.Model("bouncing_ball").simulate(duration=5.0)]
        bags.write(self.path, runs, node="/mine")
        found = bags.runs(self.path)
        self.assertEqual(len(runs), len(found))
        for run, one in zip(runs, found):
            self.assertTrue(one.same, one)
            self.assertEqual("/mine/record/simulation", one.topic)
            np.testing.assert_array_equal(run.final_state, one.run.final_state)
            self.assertEqual(run.status, one.run.status)
            self.assertEqual(run.system.parameters, one.run.system.parameters)
            self.assertEqual(run.options, one.run.options)
        with rosbag.Bag(str(self.path)) as bag:
            self.assertEqual(6, bag.get_message_count("/mine/model_description"))   # with other options, too
            result = next(m.result for _, m, _ in bag.read_messages("/mine/record/simulation"))
        self.assertEqual([e.t for e in runs[0].events], [m.t for m in result.transitions])
        self.assertEqual([e.impulse[0] for e in runs[0].events], [m.impulse[0] for m in result.transitions])
        self.assertEqual(len(result.t), sum(arc.num_samples for arc in result.arcs))
        for arc in result.arcs:   # its samples are the motion
            rows = slice(arc.first_sample, arc.first_sample + arc.num_samples)
            self.assertEqual((arc.t_begin, arc.t_end), (result.t[rows][0], result.t[rows][-1]))
            np.testing.assert_allclose(np.array(result.q.data)[rows][1:],
                                       runs[0].x(np.array(result.t[rows][1:]))[:, 0], atol=1e-9)

    def test_outcomes_have_numbers(self):
        names = ("ok", "grazing", "zeno", "budget exceeded", "non-finite", "cancelled", "discontinuous", "not differentiable",
                 "too many pieces", "sliding or not unique (Filippov)", "no contact forces (Painleve)",
                 "several motions (Painleve)", "singular slip (Painleve)", "indeterminate forces", "no consistent impact",
                 "ambiguous impact", "energy gain", "not piecewise linear", "chatter")
        self.assertEqual(list(range(len(names))), [outcome_number(name) for name in names])

    def test_what_cannot_be_written(self):
        """Before anything is."""
        ball = cf.Model("bouncing_ball")
        for run, what in ((cf.PythonModel(Pendulum).simulate(), "a model in Python"),
                          (ball.poincare(cf.Touchdown("floor"))().run, "ends behind its event"),
                          (ball.simulate(duration=0.0), "duration 0"), (ball.simulate(dense=False), "dense=False"),
                          (cf.Model("driven_ball").simulate(inputs=cf.Grid([1.0], [[0.0]])), "begins at 1 s")):
            with self.assertRaisesRegex(ValueError, what):
                bags.write(self.path, [ball.simulate(), run])
            self.assertFalse(self.path.exists())
        with self.assertRaisesRegex(ValueError, "no runs"):
            bags.write(self.path, [])

    def test_refusals(self):
        with self.assertRaisesRegex(ValueError, "has no runs"):
            self.write(("/n/model_description", description(cf.Model("puck"))))
        strange = description(cf.Model("puck"))
        strange.name = "my_own"
        with self.assertRaisesRegex(ValueError, "'my_own', which is not here"):
            self.write(("/n/model_description", strange), ("/n/record/simulation", msg.SimulationRecord()))

    def test_the_command(self):
        ball = cf.Model("bouncing_ball")
        record = msg.SimulationRecord(result=ended(ball.simulate(duration=0.4), msg.ContactTrajectory))
        record.request.duration = 0.4
        self.write(("/n/model_description", description(ball)), ("/n/record/simulation", record))

        def call(*words):
            return subprocess.run([sys.executable, "-m", "contact_flow", "report", str(self.path), *words], text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=str(self.path.parent),
                                  env=dict(os.environ, PYTHONPATH=os.pathsep.join(p for p in sys.path if p)))
        done = call()
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("Run 0 of 1 of made.bag, from /n/record/simulation; computed again: the same, bit for bit.",
                      done.stdout)
        self.assertIn("made.bag", (self.path.parent / "made.html").read_text(encoding="utf-8"))
        for words, reason in ((("x.html", "--number", "1"), "the bag has 1 runs"),
                              (("x.html", "-x", "z=1"), "--state: a run of a bag is as it was recorded")):
            done = call(*words)
            self.assertEqual(2, done.returncode)
            self.assertIn(reason, done.stderr)


if __name__ == "__main__":
    case.main()
