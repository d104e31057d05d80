#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A simulator that is paused, or whose run has ended, says so and why."""
import subprocess
import unittest

import rospy
import rostest
from client import wait_until
from contact_flow.msg import InitialState, ResultWarning, SimulatorStatus
from simulator_client import Listener, Simulator

BALL, ZENO = "simulator", 2


class StandingStill(unittest.TestCase):
    def test_every_answer_says_why(self):
        """The bounces of a ball accumulate: there its run ends, unless it is completed."""
        ball, statuses = Simulator(BALL), Listener(BALL + "/status", SimulatorStatus)
        fresh = ball.get_state().condition
        self.assertEqual((fresh.paused, fresh.outcome), (True, 0))
        self.assertIn("from the start", fresh.why)
        answer = ball.step(seconds=0.1)
        self.assertEqual((answer.success, answer.message, answer.warnings), (True, "", []))
        self.assertEqual(answer.condition, fresh)
        ball.unpause_physics()
        going = ball.get_state().condition
        self.assertEqual((going.paused, going.outcome, going.why), (False, 0, ""))
        ball.pause_physics()
        self.assertEqual(ball.get_state().condition.why, "paused by pause_physics")

        ball.reset_simulation()
        answer = ball.step(seconds=100)
        self.assertTrue(answer.success, answer.message)
        self.assertLess(answer.t, 100)
        self.assertEqual([w.code for w in answer.warnings], [ZENO])
        self.assertEqual(answer.warnings[0].t, answer.t)
        self.assertIn(answer.warnings[0].message, answer.message)
        end = answer.condition
        self.assertEqual((end.paused, end.outcome), (True, ZENO))
        self.assertIn("the run has come to its end: ", end.why)
        self.assertIn(answer.warnings[0].message, end.why)

        with self.assertRaises(rospy.ServiceException) as refused:
            ball.unpause_physics()
        self.assertIn(end.why, str(refused.exception))
        shown = subprocess.run(["rosservice", "call", "/" + BALL + "/unpause_physics"], text=True,
                               timeout=60, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertIn(end.why, shown.stdout)
        for answer in (ball.get_state(), ball.step(seconds=1), ball.step(), ball.set_input(),
                       ball.set_state(state=InitialState(names=["zz"], positions=[1])),
                       ball.set_parameters(names=["mas"], values=[1]),
                       ball.apply_impulse(names=["zz"], impulse=[1]), ball.predict()):
            self.assertEqual(answer.condition, end, answer)
        self.assertIn(end.why, ball.step(seconds=1).message)
        self.assertTrue(wait_until(lambda: statuses.all()[-1].why == end.why))
        self.assertEqual((statuses.all()[-1].paused, statuses.all()[-1].outcome), (True, ZENO))

        ball.reset_simulation()
        again = ball.get_state().condition
        self.assertEqual((again.paused, again.outcome), (True, 0))
        self.assertIn("since the run before has come to its end", again.why)
        answer = ball.step(seconds=1e-3, events=3)
        self.assertEqual([w.code for w in answer.warnings], [ResultWarning.NO_MORE_EVENTS])


if __name__ == "__main__":
    rospy.init_node("simulator_end_test")
    rostest.rosrun("contact_flow", "simulator_end", "__main__")
