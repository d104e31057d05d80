#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Batches from Python: against single runs, to the bit; numpy in and out; misuse."""
import dataclasses
import pickle
import unittest
import unittest.mock

import numpy as np

import case
import contact_flow as cf


def starts(system, runs, spread=0.005, seed=1):
    x = np.array(system.nominal.x)
    return x + spread * np.random.default_rng(seed).standard_normal((runs, len(x)))


class Batches(unittest.TestCase):
    def test_gives_the_bits_of_single_runs(self):
        for name in ("soft_biped", "hopping_trot", "rigid_biped"):
            system = cf.Model(name)
            states = starts(system, 13)
            batch = system.simulate_batch(states)
            self.assertEqual(13, len(batch))
            self.assertEqual(batch.width == 1, bool(batch.why))
            for k, x in enumerate(states):
                try:
                    run = system.simulate(x, dense=False)
                except ValueError as refused:
                    self.assertEqual("refused", batch.outcome[k])
                    self.assertEqual(str(refused), batch.message[k])
                    self.assertTrue(np.isnan(batch.final_state[k]).all())
                    continue
                self.assertEqual(run.final_state.tobytes(), batch.final_state[k].tobytes())
                self.assertEqual(run.modes, batch.modes(k))
                self.assertEqual([event.t for event in run.events], [event.t for event in batch.events[k]])
                self.assertEqual(run.statistics.steps, batch.steps[k])

    def test_inputs_threads_and_lanes(self):
        trot = cf.Model("steered_trot")
        states = starts(trot, 5, 0.001)
        inputs = np.linspace(-0.02, 0.02, 5)[:, None]
        one = cf.simulate_batch(trot, states, 0.8, inputs)
        two = cf.simulate_batch(trot, states, 0.8, inputs, threads=2, lanes="none", dense=False)
        np.testing.assert_array_equal(one.final_state, two.final_state)
        np.testing.assert_array_equal(one.final_state[4],
                                      trot.simulate(states[4], 0.8, inputs[4]).final_state)
        self.assertTrue(two.alone.all())
        self.assertIn("asked for", two.why)
        shared = trot.simulate_batch(states, 0.3, [0.01])
        np.testing.assert_array_equal(shared.final_state[1], trot.simulate(states[1], 0.3, [0.01]).final_state)

    def test_blocks(self):
        """Of two runs each: the same as at once; what Ctrl-C leaves is not begun."""
        trot = cf.Model("steered_trot")
        states, inputs = starts(trot, 5, 0.001), np.linspace(-0.02, 0.02, 5)[:, None]
        for given in (inputs, inputs[0], None):
            whole = trot.simulate_batch(states, 0.8, given)
            with unittest.mock.patch("contact_flow.batch.BLOCK", 2):
                parts = trot.simulate_batch(states, 0.8, given)
            for field in dataclasses.fields(whole):
                np.testing.assert_equal(getattr(parts, field.name), getattr(whole, field.name), field.name)
        with unittest.mock.patch("contact_flow.batch.BLOCK", 2):
            with self.assertRaisesRegex(ValueError, "inputs has 4 columns"):
                trot.simulate_batch(states, 0.8, inputs[:4])
        begun = []

        class Interrupted:
            def _simulate_batch(self, block, *rest):
                begun.append(len(block))
                if len(begun) == 2:
                    raise KeyboardInterrupt
                return trot._simulate_batch(block, *rest)

        with unittest.mock.patch("contact_flow.batch.BLOCK", 2), self.assertRaises(KeyboardInterrupt):
            cf.simulate_batch(Interrupted(), states, 0.1)
        self.assertEqual([2, 2], begun)

    def test_pickles(self):
        batch = cf.Model("soft_biped").simulate_batch(starts(cf.Model("soft_biped"), 2))
        again = pickle.loads(pickle.dumps(batch))
        np.testing.assert_array_equal(batch.final_state, again.final_state)
        self.assertEqual("<Batch of 2 runs, 2 ok, %d lanes>" % batch.width, repr(again))

    def test_misuse(self):
        biped = cf.Model("soft_biped")
        for arguments, keywords, words in (
                ((np.zeros((2, 13)),), {}, "states"),
                ((starts(biped, 2),), {"lanes": "sse"}, "lanes is 'sse'"),
                ((starts(biped, 2),), {"threads": 0}, "threads"),
                ((starts(biped, 2), -1), {}, "duration"),
                ((starts(biped, 3), 1, np.zeros((2, 0))), {}, "inputs has 2 columns"),
                ((starts(biped, 2),), {"max_steps": 0}, "max_steps")):
            with self.assertRaisesRegex(ValueError, words):
                biped.simulate_batch(*arguments, **keywords)
        self.assertEqual(0, len(biped.simulate_batch(np.zeros((0, 14)))))


if __name__ == "__main__":
    case.main()
