#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A receding horizon from Python: a ball that is kicked comes to its goal by solving again, by a thread of its own, too."""
import threading
import unittest

import numpy as np

import contact_flow as cf
import case

GOAL, COUNT, STEPS = 0.5, 24, 64   # [m], intervals, steps of the loop in one
LENGTH = 1 / 16                     # of an interval [s]
HORIZON = COUNT * LENGTH


class Receding(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ball = cf.Model("driven_ball")

    def loop(self, **options):
        grid = cf.Grid(np.arange(COUNT) * LENGTH, np.zeros((COUNT, 1)))
        asked = dict(x0=[1, 0], inputs=grid, duration=HORIZON, target=[GOAL, 0], weight=100.0, effort=0.01,
                     lower=-3.0, upper=3.0, budget=10.0, max_iterations=200, state_weights=0.0, input_weights=0.01,
                     terminal_weights=100.0, period=LENGTH / STEPS)
        asked.update(options)
        return self.ball.receding_horizon(**asked)

    def close(self, loop, solve):
        """The state at the end, kicked by 3 m/s at the fifth instant."""
        flow = self.ball.online([1, 0], [0])

        def advance(flow, t):
            while True:
                event = flow.advance_to(t)
                if event is None:
                    return
                if event["activated"] or event["released"]:
                    loop.observe(event["t"], event["activated"], event["released"], event["mode_after"])

        for i in range(COUNT * STEPS):
            t = LENGTH / STEPS * i
            advance(flow, t)
            if i == 5 * STEPS:
                flow = self.ball.online(flow.x + [0, 3.0], flow.u, t=t)
            if solve and i % STEPS == STEPS // 2 and t + LENGTH < HORIZON:
                solve(loop, t, flow.x, t + LENGTH / 2)
            flow.set_input(loop.input(t, flow.x), t)
        advance(flow, HORIZON)
        return flow.x

    def test_comes_to_the_goal_by_solving_again(self):
        fixed = self.close(self.loop(), None)
        loop = self.loop()
        again = self.close(loop, lambda loop, *task: self.assertTrue(loop.solve(*task)))
        self.assertLess(np.abs(again - [GOAL, 0]).max(), 0.2 * np.abs(fixed - [GOAL, 0]).max())
        self.assertEqual(COUNT - 1, len(loop.reports))
        for solution, followed, message in loop.reports:
            self.assertIn(solution.verdict, ("solved", "unfinished"), solution.message)
            self.assertEqual((True, ""), (followed, message))
            self.assertLessEqual(solution.cost, solution.first_cost + 1e-12)
        t, u = loop.inputs
        self.assertEqual((len(t), 1), u.shape)

    def test_a_thread_solves_beside_the_loop(self):
        """Whatever the clock says, the loop is answered, and each solve tells what became of it."""
        threads = []

        def solve(loop, *task):
            threads.append(threading.Thread(target=loop.solve, args=task))
            threads[-1].start()

        loop = self.loop(budget=0.02, max_iterations=5)
        end = self.close(loop, solve)
        for thread in threads:
            thread.join()
        self.assertTrue(np.isfinite(end).all())
        self.assertGreater(len(loop.reports), 20)
        for solution, followed, message in loop.reports:
            self.assertIn(solution.verdict, ("solved", "unfinished", "late", "failed"))
            self.assertTrue(followed or message)

    def test_late_and_failed_solves_say_so(self):
        loop = self.loop(budget=1e-7)
        late = loop.solve(0.1, [0.9, -1])
        self.assertFalse(late)
        self.assertEqual("late", late.verdict)
        self.assertIn("the last policy is kept", late.message)
        failed = self.loop().solve(0.1, [-0.5, 0], 0.15)
        self.assertEqual("failed", failed.verdict)
        self.assertIn("floor", failed.message)

    def test_power_and_impulses_cost(self):
        """The ball falls without inputs; what is promised is the closed form of its impact, and of power none."""
        a = -9.8
        hit = np.sqrt(-2 / a)
        grid = cf.Grid([0.0], np.zeros((1, 1)))
        asked = dict(x0=[1, 0], inputs=grid, duration=0.6, weight=0.0, search=False, budget=10.0, max_iterations=0)
        plain = self.ball.receding_horizon(**asked).solve(0.1, [1 + a * 0.005, a * 0.1], 0.11)
        impulse = self.ball.receding_horizon(impulse={"floor": 0.5}, **asked).solve(0.1, [1 + a * 0.005, a * 0.1], 0.11)
        self.assertAlmostEqual(0, plain.first_cost)
        self.assertAlmostEqual(0.5 * (1.7 * a * hit) ** 2, impulse.first_cost, places=6)
        pushed = dict(asked, inputs=cf.Grid([0.0], np.full((1, 1), 2.0)), effort=0.0)
        power = self.ball.receding_horizon(power=[("force", "z", 0.25)], **pushed).solve(0.0, [1, 0], 0.1)
        b, v = a + 2, 0.7 * -(a + 2) * np.sqrt(-2 / (a + 2))
        down, up = np.sqrt(-2 / b), 0.6 - np.sqrt(-2 / b)
        squares = b ** 2 * (down ** 3 - 0.1 ** 3) / 3 + v ** 2 * up + b * v * up ** 2 + b ** 2 * up ** 3 / 3
        self.assertAlmostEqual(0.25 * 4 * squares, power.first_cost, places=6)
        with self.assertRaisesRegex(ValueError, "unknown input 'forse'"):
            self.ball.receding_horizon(power=[("forse", "z", 1.0)], **asked)
        with self.assertRaisesRegex(ValueError, "unknown constraint 'flor'"):
            self.ball.receding_horizon(impulse={"flor": 1.0}, **asked)

    def test_mistakes_are_refused(self):
        for wrong in (dict(weight=[1]), dict(effort=-1.0), dict(lower=1.0, upper=-1.0), dict(intervals=-1)):
            with self.assertRaises(ValueError):
                self.loop(**wrong)
        with self.assertRaises(ValueError):
            self.loop().solve(0.3, [0.5, 0], 0.2)


if __name__ == "__main__":
    case.main()
