#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every class of the package: pickled, copied, in another process, and without its owners."""
import concurrent.futures
import copy
import gc
import inspect
import multiprocessing
import pathlib
import pickle
import tempfile
import unittest
import weakref

import numpy as np

import contact_flow as cf
import case
from contact_flow import _core
from python_models import SoftBiped

TRANSLATION = ["body_x", "left_foot_x", "right_foot_x"]
#: what goes on, and is what it has been told
LIVING = {"OnlineFlow", "PolicyTracker", "RecedingLoop"}


def shown(value):
    """All that a value shows, as plain values."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {str(key): shown(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [shown(one) for one in value]
    kind = type(value)
    if kind.__module__.startswith("contact_flow") and not isinstance(value, cf.System):
        found = {"": repr(value)}
        for name, member in inspect.getmembers(kind, lambda m: isinstance(m, property)):
            if name in ("run", "system", "closing"):
                continue
            try:
                found[name] = shown(getattr(value, name))
            except ValueError as error:
                found[name] = str(error)
        return found
    return repr(value)


def values():
    """One of each class, at least."""
    biped, trot, ball = cf.Model("soft_biped"), cf.Model("hopping_trot"), cf.Model("driven_ball")
    run = biped.simulate()
    B = run.derivative(by=["stiffness"])
    poincare = trot.poincare(cf.Apex("body_z"), by=(name for name in ["state"]))
    orbit = poincare.fixed_point(conditions=[{"kind": "period", "value": 0.8}], free=["flywheel"]) \
        if "flywheel" in trot.parameters else poincare.fixed_point()
    feedback = cf.Model("steered_trot", hip_offset=0.25).poincare(cf.Apex("body_z")).feedback(
        translation=TRANSLATION, piecewise=True)
    ramp = cf.PiecewiseLinearMap([([[1.0]], [[1.0]]), ([[0.0]], [[-1.0]])])
    fall = ball.simulate(duration=0.6, inputs=cf.Grid([0, 0.3], [[0.5], [-0.5]]), relative_tolerance=1e-10)
    linear = cf.PiecewiseLinearMap([([[0.5]], None)])
    loop = ball.receding_horizon([1, 0], cf.Grid([0, 0.2], np.zeros((2, 1))), 0.4, target=[0.5, 0], weight=100.0,
                                 effort=0.01, budget=10.0, state_weights=1.0, input_weights=0.01)
    flow = biped.online()
    flow.mark(["+body_pitch"])
    ensemble = biped.sweep({"body_pitch": cf.Uniform(-0.1, 0.1)}, runs=20, threads=1)
    return [
        biped, cf.LinearInputs(ball), cf.Robot(case.ROBOTS / "monoped.yaml"), cf.PythonModel(SoftBiped), biped.parameter_list[0], biped.nominal,
        run, run.status, run.arcs[0], run.events[0], run.margins, run.statistics, run.assumptions()[0],
        cf.Model("bouncing_ball").simulate(duration=5.0, complete_zeno=True).warnings[0],
        B, B.trust, B.radius("+body_pitch"), B.compare("+body_pitch", [1e-3, 1e-4]),
        B.compare("+body_pitch", [1e-3]).samples[0], B.pieces(), B.pieces()[0], B.pieces().consistency(),
        fall.linearize()[0], fall.gradient({"z": 0}), fall.policy(), poincare, poincare(), orbit, orbit.closing,
        orbit.stability(TRANSLATION), orbit.stability(TRANSLATION).certificate, feedback,
        feedback.follow(feedback.state(np.full(feedback.basis.shape[1], 1e-3)), 3), ramp.covariance([[1.0]]),
        ramp.controllability(), linear.stability(),
        cf.Model("double_pendulum").optimize(["shoulder_torque"], {"elbow": 2.03}),
        ball.optimize_trajectory(cf.Grid([0, 0.5], [[0.0], [0.0]]), {"z": 1}, effort=[0.1]),
        loop.solve(0.1, [0.9, -1.0], 0.2), flow.tangents, ensemble.tally, ensemble.summary, cf.Grid([0], [[1.0]]), cf.Apex("body_z"), cf.Uniform(0, 1)]


def shown_of_pickle(data):
    return shown(pickle.loads(data))


class Pickles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.values = values()

    def test_of_all_classes(self):
        classes = {name for name, kind in vars(_core).items()
                   if inspect.isclass(kind) and not issubclass(kind, Exception)} - {"System"}
        missing = classes - LIVING - {type(value).__name__ for value in self.values}
        self.assertEqual(set(), missing)

    def test_reprs_tell(self):
        for value in self.values:
            self.assertNotRegex(repr(value), "object at 0x|^$", type(value).__name__)

    def test_show_the_same(self):
        for value in self.values:
            with self.subTest(type(value).__name__):
                again = pickle.loads(pickle.dumps(value))
                self.assertIs(type(value), type(again))
                self.assertEqual(shown(value), shown(again))
                for other in (copy.copy(value), copy.deepcopy(value)):
                    self.assertEqual(shown(value), shown(other))

    def test_in_another_process(self):
        chosen = [v for v in self.values if type(v).__name__ in ("Orbit", "Stability", "Policy", "Derivative", "Feedback")]
        self.assertEqual(6, len(chosen))
        with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            for value, there in zip(chosen, pool.map(shown_of_pickle, map(pickle.dumps, chosen))):
                self.assertEqual(shown(value), there)

    def test_robots_hold_their_meshes(self):
        """Of texts, too: on another machine there is no such file."""
        urdf = """<robot name="egg"><link name="egg"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
            ixz="0" iyz="0"/></inertial><collision><geometry><mesh filename="egg.stl"/></geometry></collision></link></robot>"""
        corners = [f"vertex {x} {y} -0.1" for x, y in ((0, 0.1), (0.1, -0.1), (-0.1, -0.1))]
        lines = ["solid egg", "facet normal 0 0 1", "outer loop", *corners, "endloop", "endfacet", "endsolid egg"]
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "egg.stl").write_text("\n".join(lines), encoding="utf-8")
            run = cf.Robot.from_strings(urdf, "{base: floating}", folder=folder).simulate(duration=0.3)
            kept = pickle.dumps(run)
        again = pickle.loads(kept)
        self.assertEqual((3, 1), (len(again.system.constraints), len(again.events)))
        np.testing.assert_array_equal(run.final_state, again.final_state)

    def test_what_goes_on_is_refused(self):
        ball = cf.Model("driven_ball")
        for value in (ball.online(), ball.simulate(inputs=[0.0]).policy().tracker()):
            with self.assertRaisesRegex(TypeError, "pickle"):
                pickle.dumps(value)

    def test_exceptions(self):
        for kind in (cf.NoDerivative, cf.NotPiecewiseLinear, cf.BudgetExceeded):
            again = pickle.loads(pickle.dumps(kind("why")))
            self.assertIs(kind, type(again))
            self.assertEqual(("why",), again.args)

    def test_what_was_given_may_change(self):
        """Conditions, targets and starts are those of the call."""
        trot = cf.Model("hopping_trot")
        x, condition = trot.nominal.x.copy(), {"kind": "period", "value": 0.8}
        orbit = trot.poincare(cf.Apex("body_z")).fixed_point(x, free=["axial_stiffness"], conditions=[condition])
        self.assertTrue(orbit, orbit.message)
        condition["value"], x[:] = 7.0, 0.0
        again = pickle.loads(pickle.dumps(orbit))
        np.testing.assert_array_equal(orbit.x, again.x)
        self.assertEqual(orbit.parameters, again.parameters)


class Owners(unittest.TestCase):
    def test_views_outlive_them(self):
        def kept(make):
            array = make()
            before = np.array(array)
            gc.collect()
            junk = [np.full(array.shape, 7.0) for _ in range(50)]
            np.testing.assert_array_equal(before, array)
            self.assertFalse(array.flags.writeable)
            del junk

        biped, ball = cf.Model, cf.Model("driven_ball")
        for make in (lambda: biped("soft_biped").nominal.x, lambda: biped("soft_biped").simulate().x0,
                     lambda: biped("soft_biped").simulate().final_state,
                     lambda: biped("soft_biped").simulate().events[0].x_plus,
                     lambda: biped("soft_biped").simulate().arcs[1].x_end,
                     lambda: biped("soft_biped").simulate().derivative().time,
                     lambda: biped("soft_biped").simulate().derivative().trust.state_error,
                     lambda: biped("soft_biped").simulate().derivative().pieces()[1].matrix,
                     lambda: biped("hopping_trot").poincare(cf.Apex("body_z"))().x,
                     lambda: biped("hopping_trot").poincare(cf.Apex("body_z")).fixed_point().x,
                     lambda: biped("hopping_trot").poincare(cf.Apex("body_z")).fixed_point().closing.start_basis,
                     lambda: ball.simulate(inputs=[0.0]).linearize()[0].A,
                     lambda: ball.simulate(inputs=[0.0]).gradient({"z": 0}).initial):
            kept(make)

    def test_nothing_keeps_itself(self):
        """Questions hold their owners, and no owner its answers."""
        system = cf.PythonModel(SoftBiped)
        gone = weakref.ref(system.formulas)
        self.assertIsNotNone(gone())
        before = len(gc.get_objects())
        for _ in range(20):
            trot = cf.Model("hopping_trot")
            orbit = trot.poincare(cf.Apex("body_z")).fixed_point()
            del trot, orbit
        gc.collect()
        self.assertLess(len(gc.get_objects()) - before, 50)


if __name__ == "__main__":
    case.main()
