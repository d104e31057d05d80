#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The online simulator: its services, its topics, and that it is one run of `simulate`."""
import math
import os
import pty
import select
import subprocess
import sys
import time
import unittest

import rospy
import rostest
from client import matrix, package_path, wait_until
from contact_flow.msg import (
    HybridState, InitialState, InputCommand, InputGrid, ModelDescription, RollingTangents,
    RowMajorMatrix, SimulatorEvent, SimulatorStatus)
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from simulator_client import Listener, Simulator, state
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

BOX, TROT, ROBOT = "first/simulator", "second/simulator", "third/simulator"


class SimulatorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.clock = Listener("/clock", Clock)
        cls.tf = Listener("/tf", TFMessage)
        cls.box, cls.trot, cls.robot = Simulator(BOX), Simulator(TROT), Simulator(ROBOT)

    def test_an_online_run_is_one_call_of_simulate(self):
        """To the bit, with inputs by service and by topic, steps by seconds and by events, and pauses."""
        box = self.box
        box.reset_simulation()
        events = Listener(BOX + "/events", SimulatorEvent)
        inputs = rospy.Publisher(BOX + "/input", InputCommand, queue_size=10)
        self.assertTrue(wait_until(lambda: inputs.get_num_connections() == 1))
        description = box.get_state().state
        u = list(description.input)
        times, values, seen = [0.0], [list(u)], {}
        for k in range(12):
            answer = box.step(events=1, seconds=0.2) if k % 3 == 2 else box.step(seconds=0.008 * (k + 1))
            self.assertTrue(answer.success, answer.message)
            now = box.get_state().state
            self.assertEqual(now.t, answer.t)
            if k % 2 == 0:
                seen[now.t] = state(now)
            u[k % len(u)] += 0.5 - 0.1 * k
            if k % 3 == 1:
                inputs.publish(InputCommand(names=[], values=u))
                self.assertTrue(wait_until(lambda: list(box.get_state().state.input) == u))
            else:
                name = description.inputs[k % len(u)]
                answer = box.set_input(names=[name], values=[u[k % len(u)]])
                self.assertTrue(answer.success, answer.message)
                self.assertEqual(answer.t, now.t)
            if now.t == times[-1]:
                values[-1] = list(u)
            else:
                times.append(now.t)
                values.append(list(u))
        box.step(seconds=0.1)
        end = box.get_state().state.t
        self.assertTrue(wait_until(lambda: events.all() and
                                   events.all()[-1].index == box.get_state().state.events))
        grid = InputGrid(times=times, values=RowMajorMatrix(data=[v for row in values for v in row]))
        answer = box.simulate(duration=end + 5, input_grid=grid, samples=1)
        self.assertTrue(answer.success, answer.message)
        # `simulate` knows each change of the input as an arc; those without change of mode are no events online.
        offline = [t for t in answer.trajectory.transitions
                   if t.t <= end and (t.activated or t.released or t.switched)]
        online = [event.transition for event in events.all()]
        self.assertGreater(len(online), 2)
        self.assertEqual(len(online), len(offline))
        for a, b in zip(online, offline):
            self.assertEqual(a, b)
        # A state right before an input is the left limit where an arc ends.
        ends = {t.t: list(t.q) + list(t.v_before) for t in answer.trajectory.transitions}
        for t, x in seen.items():
            if t in ends and not any(event.t == t for event in online):
                # looked at before the step was cut: the same up to the interpolation's error
                self.assertLess(max(abs(a - b) for a, b in zip(x, ends[t])), 1e-7)

    def test_events_are_announced_at_their_time_not_before(self):
        """The trot lands twice in 0.8 s, in real time."""
        status = rospy.wait_for_message(TROT + "/status", SimulatorStatus, 10)
        self.assertFalse(status.paused)
        arrivals = []
        rospy.Subscriber(TROT + "/events", SimulatorEvent,
                         lambda event: arrivals.append((time.monotonic(), event.transition.t)))
        self.assertTrue(wait_until(lambda: len(arrivals) >= 6))
        wall, simulated = zip(*arrivals)
        for k in range(1, 6):
            # Early is wrong; late is the machine's.
            self.assertGreater(wall[k] - wall[0], simulated[k] - simulated[0] - 0.15)

    def test_topics(self):
        joints = rospy.wait_for_message("second/joint_states", JointState, 10)
        self.assertIn("body_z", joints.name)
        self.assertEqual(len(joints.position), 7)
        self.assertTrue(wait_until(lambda: any(
            t.child_frame_id == "second/body" for m in self.tf.all() for t in m.transforms)))
        self.assertTrue(rospy.wait_for_message(TROT + "/contacts", MarkerArray, 10).markers)
        wrench = Listener(TROT + "/wrench/left_foot", WrenchStamped)
        self.assertTrue(wait_until(lambda: any(m.wrench.force.z > 1 for m in wrench.all())))
        for message in wrench.all():
            self.assertEqual((message.wrench.force.x, message.wrench.force.y), (0, 0))
        diagnostics = Listener("/diagnostics", DiagnosticArray)
        self.assertTrue(wait_until(lambda: any("second" in s.name for m in diagnostics.all()
                                               for s in m.status)))

    def test_reset_world_keeps_time_and_stamps_go_on(self):
        robot = self.robot
        states = Listener(ROBOT + "/state", HybridState)
        joints = Listener("third/joint_states", JointState)
        robot.unpause_physics()
        self.assertTrue(wait_until(lambda: robot.get_state().state.t > 0.3))
        for _ in range(3):
            before = robot.get_state().state
            robot.reset_world()
            after = robot.get_state().state
            self.assertGreaterEqual(after.t, before.t)
            self.assertGreater(after.epoch, before.epoch)
            time.sleep(0.2)
        robot.reset_simulation()
        self.assertLess(robot.get_state().state.t, before.t)
        time.sleep(0.3)
        robot.pause_physics()
        for listener in (states, joints):
            stamps = [m.header.stamp for m in listener.all()]
            self.assertGreater(len(stamps), 20)
            self.assertEqual(stamps, sorted(stamps))
            self.assertEqual(len(set(stamps)), len(stamps))
        by_frame = {}
        for message in self.tf.all():
            for t in message.transforms:
                by_frame.setdefault(t.child_frame_id, []).append(t.header.stamp)
        self.assertTrue(any(frame.startswith("third/") for frame in by_frame), by_frame.keys())
        clock = [m.clock for m in self.clock.all()]
        self.assertEqual(clock, sorted(clock))
        for frame, stamps in by_frame.items():
            if "joint" not in frame and frame.startswith("third/base"):
                self.assertEqual(stamps, sorted(stamps), frame)

    def test_set_state_impulse_and_parameters(self):
        box = self.box
        box.reset_simulation()
        box.step(seconds=0.05)
        before = box.get_state().state
        answer = box.set_state(state=InitialState(names=["z"], positions=[2.5]))
        self.assertTrue(answer.success, answer.message)
        z = before.coordinates.index("z")
        self.assertEqual(answer.state.q[z], 2.5)
        self.assertEqual(answer.state.t, before.t)
        self.assertEqual(answer.state.epoch, before.epoch + 1)
        for i, (a, b) in enumerate(zip(answer.state.q, before.q)):
            if i != z:
                self.assertAlmostEqual(a, b, 7)
        mass = self.mass()
        pushed = box.apply_impulse(names=["x"], impulse=[3.0])
        self.assertTrue(pushed.success, pushed.message)
        x = before.velocities.index("x")
        self.assertAlmostEqual(pushed.state.v[x] - answer.state.v[x], 3.0 / mass, 9)
        heavier = box.set_parameters(names=["mass"], values=[2 * mass])
        self.assertTrue(heavier.success, heavier.message)
        self.assertTrue(wait_until(lambda: self.mass() == 2 * mass))
        again = box.apply_impulse(names=["x"], impulse=[3.0])
        self.assertAlmostEqual(again.state.v[x] - heavier.state.v[x], 1.5 / mass, 9)
        box.reset_simulation()

    def test_forces_are_those_of_the_present_input(self):
        """A box at rest on one corner: g − u/m is all that drives it, so that λ is proportional to it."""
        box, weight = self.box, 9.81
        box.reset_simulation()
        w, x, y = math.cos(0.4), 0.6 * math.sin(0.4), 0.8 * math.sin(0.4)
        height = 0.4 * w * y + 0.3 * w * x + 0.1 * (w * w - x * x - y * y)
        answer = box.set_state(state=InitialState(q=[0, 0, height, w, x, y, 0], v=[0] * 6))
        self.assertTrue(answer.success, answer.message)
        alone = sum(answer.state.force)
        self.assertEqual(len(answer.state.mode), 1)
        self.assertGreater(alone, 0)
        for lift in (2.5, -4.0):
            self.assertTrue(box.set_input(names=["force_z"], values=[lift]).success)
            self.assertAlmostEqual(sum(box.get_state().state.force), alone * (1 - lift / weight), 9)
        box.reset_simulation()

    @staticmethod
    def mass():
        model = rospy.wait_for_message(BOX + "/online_model", ModelDescription, 10)
        return next(p.value for p in model.parameters if p.name == "mass")

    def test_rolling_derivative_is_b_derivative_from_the_mark(self):
        box = self.box
        box.reset_simulation()
        tangents = Listener(BOX + "/rolling_derivative", RollingTangents)
        time.sleep(0.3)
        answer = box.mark(directions=["+z", "-z", "+d/dt pitch"])
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.directions, ["+z", "-z", "+d/dt pitch"])
        answer = box.predict(horizon=0.55, directions=["+z", "-z", "+d/dt pitch"], size=0.001)
        self.assertTrue(answer.success, answer.message)
        predicted = answer.prediction
        self.assertEqual(predicted.outcome, 0, predicted.message)
        self.assertEqual(len(predicted.event_times), 3, "corners bounce on the way")
        box.step(seconds=0.55)
        now = box.get_state().state
        self.assertTrue(wait_until(lambda: tangents.all() and tangents.all()[-1].t == now.t))
        rolled = tangents.all()[-1]
        self.assertEqual(rolled.outcome, 0, rolled.message)
        error = abs(matrix(rolled.tangents) - matrix(predicted.derivatives)).max()
        self.assertLess(error, 1e-5 * (1 + abs(matrix(rolled.tangents)).max()))
        self.assertAlmostEqual(predicted.t_end, now.t, 9)
        for a, b in zip(predicted.q, now.q):
            self.assertAlmostEqual(a, b, 6)
        self.assertEqual(matrix(predicted.fan).shape, (3, 13))
        self.assertTrue(box.mark(clear=True).success)

    def test_malformed_commands_are_refused_by_name_and_change_nothing(self):
        box = self.box
        box.reset_simulation()
        box.step(seconds=0.02)
        before = box.get_state().state
        refused = {
            "did you mean": box.set_state(state=InitialState(names=["zz"], positions=[1])),
            "state.v has 1": box.set_state(state=InitialState(v=[1.0])),
            "finite": box.set_input(values=[float("nan")] * len(before.inputs)),
            "penetrates": box.set_state(state=InitialState(names=["z"], positions=[-3])),
            "not before": box.set_input(values=list(before.input), at=0.001),
            "expected 6": box.apply_impulse(impulse=[1, 2]),
            "named twice": box.apply_impulse(names=["x", "x"], impulse=[1, 2]),
            "unknown parameter": box.set_parameters(names=["mas"], values=[1]),
            "is 0": box.set_parameters(names=["mass"], values=[0]),
            "both 0": box.step(),
            "seconds is -1": box.step(seconds=-1),
            "horizon is 0": box.predict(),
            "horizon is nan": box.predict(horizon=float("nan")),
            "directions[0]": box.mark(directions=["+heigth"]),
            "expected": box.mark(direction_matrix=RowMajorMatrix(data=[1, 2])),
        }
        for text, answer in refused.items():
            self.assertFalse(answer.success, text)
            self.assertIn(text, answer.message)
        after = box.get_state().state
        self.assertEqual((after.q, after.v, after.t, after.epoch, after.input),
                         (before.q, before.v, before.t, before.epoch, before.input))
        running = self.trot.step(seconds=1)
        self.assertFalse(running.success)
        self.assertIn("pause_physics first", running.message)

    def test_drive_from_the_command_line_and_by_keys(self):
        box = self.box
        box.reset_simulation()
        tool = os.path.join(package_path(), "scripts", "drive.py")

        def drive(*words):
            return subprocess.run([sys.executable, tool, "/" + BOX, *words], text=True, timeout=60,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual(drive("step", "0.05").returncode, 0)
        self.assertAlmostEqual(box.get_state().state.t, 0.05, 12)
        shown = drive("show").stdout
        self.assertIn("t = 0.050000 s", shown)
        self.assertIn("corner_000", shown)
        refused = drive("push", "zz", "1")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("did you mean 'z'", refused.stderr)
        self.assertEqual(drive("fly").returncode, 2)
        # Keys: two steps, a push along the first velocity, quit.
        velocity = box.get_state().state.v[0]
        child, terminal = pty.fork()
        if child == 0:
            os.environ["TERM"] = "xterm"
            os.execv(sys.executable, [sys.executable, tool, "/" + BOX])
        seen = b""
        for keys in (None, b"s", b"s", b"\x1bOA", b"q"):
            if keys:
                os.write(terminal, keys)
            end = time.time() + (4 if keys is None else 1.5)
            while time.time() < end:
                if select.select([terminal], [], [], 0.1)[0]:
                    try:
                        seen += os.read(terminal, 65536)
                    except OSError:  # it has ended
                        break
        os.waitpid(child, 0)
        os.close(terminal)
        self.assertIn(b"margins", seen)
        now = box.get_state().state
        self.assertAlmostEqual(now.t, 0.07, 12)
        self.assertGreater(now.v[0], velocity)

    def test_step_by_events_says_when_there_are_none(self):
        box = self.box
        box.reset_simulation()
        answer = box.step(events=1, seconds=0.001)
        self.assertTrue(answer.success)
        self.assertEqual(answer.events, 0)
        self.assertIn("no more events", answer.message)
        one = box.step(events=1)
        self.assertEqual(one.events, 1)
        self.assertEqual(box.get_state().state.t, one.t)


if __name__ == "__main__":
    rospy.init_node("simulator_test")
    rostest.rosrun("contact_flow", "simulator", SimulatorTest)
