#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""100 clients call the services of a running simulator at once: none waits for ever, every answer is consistent, and
the recording of it all is repeated to the bit."""
import math
import os
import random
import tempfile
import threading
import unittest

import rospy
import rostest
from client import wait_until
from contact_flow.msg import InitialState
from simulator_client import RecordingNode, Simulator, verified, verify

CLIENTS, CALLS = 100, 12


class SimulatorStress(unittest.TestCase):
    def test_a_hundred_clients(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "stressed", model="falling_box", rate=500, threads=8,
                                 bag_split_size=4, **{"options/complete_zeno": "true"})
            try:
                self.stress(Simulator("stressed"))
            finally:
                node.stop()
            parts = [node.bag]
            while os.path.exists(self.part(node.bag, len(parts))):
                parts.append(self.part(node.bag, len(parts)))
            result = verify(*parts)
            differ = [line for line in result.stdout.split("\n") if not line.endswith("same, bit for bit")]
            self.assertEqual(result.returncode, 0, "\n".join(differ)[-4000:])
            self.assertGreater(verified(result), CLIENTS)

    @staticmethod
    def part(bag, number):
        return bag.replace(".bag", "_%d.bag" % number)

    def stress(self, simulator):
        wrong, answered = [], []

        def client(number):
            dice = random.Random(number)
            last = (0, -1.0)
            try:
                for _ in range(CALLS):
                    call = dice.randrange(9)
                    if call == 0:
                        z = 2 + dice.random()
                        answer = simulator.set_state(state=InitialState(
                            names=["z", "y"], positions=[z, number], velocities=[0.5, 0.25]))
                        if answer.success:
                            i = answer.state.coordinates.index("z")
                            if answer.state.q[i] != z or answer.state.q[i - 1] != number:
                                wrong.append("another client's state")
                    elif call == 1:
                        # Each client has its own value for all inputs: a mixture would be two commands in one.
                        inputs = len(simulator.get_state().state.inputs)
                        answer = simulator.set_input(values=[1e-3 * number] * inputs)
                    elif call == 2:
                        answer = simulator.apply_impulse(names=["x"], impulse=[1e-3])
                    elif call == 3:
                        (simulator.pause_physics if dice.random() < 0.5 else simulator.unpause_physics)()
                        simulator.unpause_physics()
                        continue
                    elif call == 4:
                        simulator.reset_world()
                        continue
                    elif call == 5:
                        answer = simulator.step(seconds=0.001)
                    elif call == 6:
                        # Some are refused: what an answer was asked for, and what was not, is told apart.
                        answer = simulator.predict(horizon=0.05, directions=[dice.choice(["+x", "+v_x", "+w"])])
                    elif call == 7:
                        answer = simulator.mark(directions=["+x", "-x"], project_directions=True)
                    else:
                        answer = simulator.get_state()
                        if len(set(answer.state.input)) != 1:
                            wrong.append("inputs of two commands: %s" % (answer.state.input,))
                        if not all(map(math.isfinite, answer.state.q + answer.state.v)):
                            wrong.append("not finite")
                        now = (answer.state.epoch, answer.state.t)
                        if now < last or now[1] < last[1]:
                            wrong.append("time went back: %s after %s" % (now, last))
                        last = now
                    if not answer.success and not answer.message:
                        wrong.append("refused without a reason")
                    answered.append(call)
            except Exception as error:  # pylint: disable=broad-except
                # The run may have ended in a graze: then unpause fails, as it says.
                if "unpause_physics" not in str(error) and "returned false" not in str(error):
                    wrong.append("%s: %s" % (type(error).__name__, error))

        inputs = len(simulator.get_state().state.inputs)
        self.assertTrue(simulator.set_input(values=[0.0] * inputs).success)
        threads = [threading.Thread(target=client, args=(k,), daemon=True) for k in range(CLIENTS)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=120)
        self.assertFalse([t for t in threads if t.is_alive()], "clients that wait for ever")
        self.assertEqual(wrong, [])
        self.assertGreater(len(answered), CLIENTS * CALLS // 3)
        simulator.reset_simulation()
        simulator.unpause_physics()
        self.assertTrue(wait_until(lambda: simulator.get_state().state.t > 0.05), "it still runs")


if __name__ == "__main__":
    rospy.init_node("simulator_stress_test")
    rostest.rosrun("contact_flow", "simulator_stress", SimulatorStress)
