#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps from Python: draws against numpy, runs against simulate, statistics, pictures, misuse."""
import importlib.util
import json
import pathlib
import pickle
import re
import statistics
import tempfile
import unittest

import numpy as np

import case
import contact_flow as cf
from python_models import SoftBiped

PITCH = {"body_pitch": cf.Uniform(-0.3, 0.3), "d/dt body_pitch": cf.Uniform(-0.5, 0.5)}


class OutOfOrder(SoftBiped):
    """Throws where the body is tilted."""

    def force(self, q, v, u):
        if float(np.real(getattr(q[6], "value", q[6]))) > 0.05:
            raise RuntimeError("out of order")
        return super().force(q, v, u)


def philox(seed, run):
    return np.random.Philox(key=np.array([seed, run], dtype=np.uint64))


class Draws(unittest.TestCase):
    def test_uniform_numbers_are_numpys(self):
        biped = cf.Model("soft_biped")
        drawn = biped.sweep(PITCH, 300, seed=2 ** 63 + 5)["start"]
        for run in (0, 1, 255, 299):
            u = np.random.Generator(philox(2 ** 63 + 5, run)).random(2)
            np.testing.assert_array_equal([-0.3 + 0.6 * u[0], -0.5 + 1.0 * u[1]], drawn[run])

    def test_normal_numbers_are_those_of_pythons_library(self):
        """Its inv_cdf is AS 241, too, with another log: 1e-15 of each."""
        biped = cf.Model("soft_biped")
        drawn = biped.sweep({"+body_pitch": cf.Normal(0, 1e-3)}, 2000, seed=9, duration=0.1)["start"][:, 0]
        normal = statistics.NormalDist()
        for run in range(2000):
            bits = int(philox(9, run).random_raw())
            self.assertAlmostEqual(1.0, drawn[run] / (1e-3 * normal.inv_cdf(((bits >> 12) + 0.5) * 2.0 ** -52)),
                                   delta=4e-15)

    def test_grids_tables_and_joint_normals(self):
        biped = cf.Model("soft_biped")
        grid = biped.sweep({"body_pitch": [0, 0.1, 0.2], "stiffness": [25, 30]}, duration=0.1)
        self.assertEqual([[0, 25], [0, 30], [0.1, 25], [0.1, 30], [0.2, 25], [0.2, 30]], grid["start"].tolist())
        table = biped.sweep(cf.Table(["body_pitch", "stiffness"], [[0, 26], [0.1, 27]]), duration=0.1)
        self.assertEqual([[0, 26], [0.1, 27]], table["start"].tolist())
        P = np.array([[4e-4, 1e-4], [1e-4, 1e-4]])
        joint = biped.sweep([cf.JointNormal(["+body_pitch", "+d/dt body_pitch"], P), {"stiffness": [27]}], 4096,
                            duration=0.1, sobol=True)
        self.assertEqual((4096, 3), joint["start"].shape)
        # Sobol's points do better than n random ones: 5 of their standard errors are ample.
        np.testing.assert_allclose(np.cov(joint["start"][:, :2].T), P, rtol=5 * np.sqrt(2 / 4096))

    def test_what_is_wrong_is_said(self):
        biped = cf.Model("soft_biped")
        for draws, message in (({"body_pich": [0]}, "body_pitch"), ({"body_pitch": "wide"}, "expected Uniform"),
                               ({"body_pitch": cf.Uniform(1, 0)}, "low is above high"),
                               ([{"body_pitch": [0]}, {"+body_pitch": [0]}], "twice"),
                               ({"body_pitch": cf.Normal(0, -1)}, "deviation")):
            with self.assertRaisesRegex((ValueError, TypeError), message):
                biped.sweep(draws, 10)
        with self.assertRaisesRegex(ValueError, "how many"):
            biped.sweep(PITCH)
        with self.assertRaisesRegex(ValueError, "did you mean"):
            biped.sweep(PITCH, 10, keep=["final_stat"])
        with self.assertRaisesRegex(TypeError, "max_stps"):
            biped.sweep(PITCH, 10, max_stps=3)
        with self.assertRaisesRegex(ValueError, "observable"):
            biped.sweep(PITCH, 10, histograms={"pitch": (0, 1, 5)})
        with self.assertRaises(cf.BudgetExceeded):
            biped.sweep(PITCH, 10000, max_megabytes=0.1)
        # Numbers that are no whole ones were cut off in silence.
        for keywords, message in (({"seed": 1.5}, "seed is 1.5"), ({"seed": -1}, "seed is -1"), ({"seed": 2 ** 64}, "seed is"),
                                  ({"runs": 10.5}, "runs is 10.5"), ({"runs": "1e6"}, "runs is '1e6'"),
                                  ({"events": 2.5}, "events is 2.5"),
                                  ({"histograms": {"body_z": (0, 1, 2.5)}}, "bins of 'body_z' is 2.5")):
            with self.assertRaisesRegex((ValueError, TypeError), message):
                biped.sweep(PITCH, **dict({"runs": 10}, **keywords))
        nan = float("nan")
        for draws, message in (({"body_pitch": cf.Normal(0, nan)}, "deviation"), ({"body_pitch": cf.Normal(0, 1e-170)}, "square"),
                               ({"body_pitch": [0, nan]}, "finite"), ({"body_pitch": cf.Uniform(0, nan)}, "finite"),
                               (cf.Table(["body_pitch"], [[0], [nan]]), "finite"), (cf.Table(["body_pitch"], [[0, 1]]), "column"),
                               (cf.JointNormal(["body_pitch"], [[-1e-3]]), "semidefinite"),
                               (cf.JointNormal(["body_pitch"], [[nan]]), "finite")):
            with self.assertRaisesRegex((ValueError, TypeError), message):
                biped.sweep(draws, 10)


class Runs(unittest.TestCase):
    def test_they_are_those_of_simulate(self):
        biped = cf.Model("soft_biped")
        swept = biped.sweep(PITCH, 300, seed=1, keep=["outcome", "start", "final_state", "words", "margins",
                                                      "end_time"], events=2, samples=[0.5, 1.2],
                            directions=["+body_pitch", {"d/dt body_z": 2.0}], histograms={"body_pitch": (-1, 1, 10)},
                            costs={"low": {"weight": {"body_z": 2}, "target": {"body_z": 1}},
                                   "plain": {"target": {"body_z": 1, "d/dt body_x": 0}}})
        self.assertEqual({"ok": 300}, swept.outcomes)
        for run in (0, 17, 299):
            pitch, rate = swept["start"][run]
            one = biped.simulate({"body_pitch": pitch, "d/dt body_pitch": rate})
            np.testing.assert_array_equal(one.final_state, swept["final_state"][run])
            np.testing.assert_array_equal(one.x([0.5, 1.2]), swept["samples"][run])
            self.assertEqual(">".join(one.mode_words), swept["words"][run].decode())
            self.assertEqual(len(one.events), swept["num_events"][run])
            self.assertEqual([e.t for e in one.events][:2], swept["event_times"][run].tolist())
            B = one.derivative()
            np.testing.assert_array_equal(B("+body_pitch"), swept["derivative"][run][0])
            np.testing.assert_array_equal(B({"d/dt body_z": 2}), swept["derivative"][run][1])
            z = one.final_state[list(biped.state_names).index("body_z")]
            speed = one.final_state[7 + list(biped.velocities).index("body_x")]
            self.assertAlmostEqual((z - 1) ** 2, swept["costs"][run][0], delta=1e-15)
            self.assertAlmostEqual(((z - 1) ** 2 + speed ** 2) / 2, swept["costs"][run][1], delta=1e-15)
        final = swept["final_state"] - swept.reference
        np.testing.assert_allclose(swept.mean[:14], final.mean(axis=0), atol=1e-14)
        np.testing.assert_allclose(swept.covariance[:14, :14], np.cov(final.T), atol=1e-14)
        self.assertEqual(np.sort(final[:, 6])[149], swept.quantile("body_pitch", 0.5))
        counts, edges = swept.histogram("body_pitch")
        np.testing.assert_array_equal(np.histogram(final[:, 6], np.linspace(-1, 1, 11))[0], counts[1:-1])
        self.assertEqual(300, sum(swept.words.values()))
        self.assertEqual(["low", "plain"], swept.names[14:])

    def test_threads_and_halves_have_the_same_bits(self):
        biped = cf.Model("soft_biped")
        one = biped.sweep(PITCH, 1500, seed=4, threads=1)
        many = cf.sweep(biped, PITCH, 1500, seed=4, threads=4)
        self.assertEqual(one.tally.to_bytes(), many.tally.to_bytes())
        self.assertEqual(one["final_state"].tobytes(), many["final_state"].tobytes())
        self.assertEqual(one.tally.to_bytes(), pickle.loads(pickle.dumps(one.tally)).to_bytes())
        np.testing.assert_array_equal(one["start"], one.draws())
        with self.assertRaisesRegex(ValueError, "in common"):
            many.tally.merge(one.tally)
        self.assertEqual(one.tally.to_bytes(), many.tally.to_bytes())

    def test_bad_runs_are_outcomes(self):
        biped = cf.Model("soft_biped")
        swept = biped.sweep({"stiffness": [27, -1], "body_pitch": [0, 0.1]}, duration=0.1)
        self.assertEqual({"ok": 2, "inadmissible": 2}, swept.outcomes)
        self.assertIn("stiffness", swept.summary.examples["inadmissible"][1])
        self.assertEqual({"budget exceeded": 16}, biped.sweep(PITCH, 16, max_steps=2).outcomes)
        broken = cf.PythonModel(OutOfOrder).sweep({"body_pitch": [0, 0.1]}, duration=0.01)
        self.assertEqual({"ok": 1, "threw": 1}, broken.outcomes)
        self.assertIn("out of order", broken.summary.examples["threw"][1])
        self.assertEqual(["ok", "threw"], broken.outcome_names().tolist())

    def test_progress_and_what_it_raises(self):
        seen = []
        biped = cf.Model("soft_biped")
        biped.sweep(PITCH, 1000, progress=lambda *a: seen.append(a), every=0)
        self.assertEqual((1000, 1000), seen[-1][:2])
        self.assertEqual({"ok": 1000}, seen[-1][3])

        def stop(*_):
            raise KeyError("enough")
        with self.assertRaisesRegex(KeyError, "enough"):
            biped.sweep(PITCH, 200000, keep=[], progress=stop, every=0)
        ended = biped.sweep(PITCH, 10 ** 7, keep=["outcome"], max_seconds_total=0.3)
        self.assertEqual("budget exceeded", ended.status.outcome)
        self.assertEqual(ended.summary.runs, np.count_nonzero(ended["outcome"] != -3))


class Pictures(unittest.TestCase):
    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is not installed")
    def test_they_show_what_there_is(self):
        import matplotlib
        matplotlib.use("Agg")
        from contact_flow import ensemble_plots as plots
        biped = cf.Model("soft_biped")
        swept = biped.sweep(PITCH, 2000, seed=1)
        legend = plots.basin_map(swept, "body_pitch", "d/dt body_pitch", by="word", bins=40).get_legend()
        shares = [float(text.get_text().split(": ")[1].split(" ")[0]) for text in legend.get_texts()
                  if "others" not in text.get_text()]
        self.assertAlmostEqual(100 * max(swept.words.values()) / 2000, shares[0], delta=0.1)
        plots.word_tree(swept)
        small = biped.sweep({"+body_pitch": cf.Normal(0, 1e-3)}, 2000)
        B = biped.simulate().derivative()
        axes = plots.outcome_histogram(small, "body_pitch", B)
        self.assertEqual(2, len(axes.get_legend().get_texts()))
        # B(w) beside the runs: what is left is of second order, 1e-6 of curvatures up to 100.
        actual = small["final_state"][:, 6] - small.reference[6]
        self.assertLess(np.max(np.abs(plots.predicted(small, B, "body_pitch") - actual)), 1e-3)
        self.assertLess(np.std(plots.predicted(small, B, "body_pitch") - actual), 0.02 * np.std(actual))
        with self.assertRaisesRegex(ValueError, "not of the state"):
            plots.predicted(biped.sweep({"stiffness": [27]}), B, "body_pitch")
        # One value alone, and far from zero.
        still = biped.sweep({"body_x": [1e6] * 3}, duration=0.01)
        self.assertEqual(1, len(plots.outcome_histogram(still, "body_x").get_legend().get_texts()))
        with self.assertRaisesRegex(ValueError, "is not drawn"):
            plots.basin_map(still, "body_x", "body_pitch")

    def test_they_are_in_the_report_of_the_run(self):
        biped = cf.Model("soft_biped")
        swept = biped.sweep(PITCH, 2000, seed=1, costs={"low": {"weight": {"body_z": 2}}})
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "page.html")
            swept.report(path)
            text = path.read_text(encoding="utf-8")
            self.assertNotIn("/*ENSEMBLE*/", text)
            data = json.loads(re.search(r"^const D=(.*);$", text, re.M).group(1))
            biped.simulate().report(path)   # without one
            self.assertIn('"ensemble":null', path.read_text(encoding="utf-8"))
            with self.assertRaisesRegex(ValueError, "is of 'soft_biped'"):
                cf.write_report(cf.Model("bouncing_ball").simulate(duration=0.1), path, ensemble=swept)
            found = biped.sweep({"stiffness": [25, 27]})
            found.report(path)
            self.assertIn("'stiffness' is not of the state", path.read_text(encoding="utf-8"))
        shown = data["ensemble"]
        self.assertIn("2000 runs, drawn: body_pitch, d/dt body_pitch. ok 2000.", shown["summary"])
        words = sorted(swept.words.values(), reverse=True)
        self.assertEqual([round(n / 2000, 4) for n in words][:10], [round(s, 4) for s in shown["basin"]["shares"]])
        bins = shown["basin"]["bins"]
        self.assertEqual(bins * bins, len(shown["basin"]["cells"]))
        drawn = swept["start"] if "start" in swept.columns else swept.draws()
        i, j = (min(int((drawn[7, k] - low) / (high - low) * bins), bins - 1)
                for k, (low, high) in enumerate(shown["basin"]["limits"]))
        self.assertGreaterEqual(shown["basin"]["cells"][i * bins + j], 0)   # a start is there
        pitch, = [d for d in shown["distributions"] if d["name"] == "body_pitch"]
        edges = np.array(pitch["edges"])
        self.assertAlmostEqual(1, float(np.sum(np.array(pitch["density"]) * np.diff(edges))), delta=0.01)
        inside = float(np.sum(np.array(pitch["predicted"]) * np.diff(edges)))   # a part lies beyond where the runs do
        self.assertTrue(0.7 < inside < 1.001, inside)
        self.assertEqual("low", shown["distributions"][-1]["name"])
        self.assertAlmostEqual(1, sum(b["share"] for b in shown["branches"] if b["arc"] == 0))


if __name__ == "__main__":
    case.main()
