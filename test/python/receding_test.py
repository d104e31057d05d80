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

    def test_mistakes_are_refused(self):
        for wrong in (dict(weight=[1]), dict(effort=-1.0), dict(lower=1.0, upper=-1.0), dict(intervals=-1)):
            with self.assertRaises(ValueError):
                self.loop(**wrong)
        with self.assertRaises(ValueError):
            self.loop().solve(0.3, [0.5, 0], 0.2)


if __name__ == "__main__":
    case.main()
