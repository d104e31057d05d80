#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Commands to joints by standard messages, and what the sensors of a simulated robot tell."""
import sys
import unittest

import rospy
import rostest
from client import wait_until
from contact_flow.srv import SetInput
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from simulator_client import Listener, Simulator
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NODE = "/simulator"


class CommandsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.listen = {
            "joints": Listener("/joint_states", JointState), "odom": Listener("/odom", Odometry),
            "imu": Listener("/imu", Imu), "diagnostics": Listener("/diagnostics", DiagnosticArray),
            "foot": Listener(NODE + "/link_wrench/front_left_foot", WrenchStamped)}
        cls.robot = Simulator(NODE)
        cls.send = {name: rospy.Publisher(NODE + "/" + name, kind, queue_size=10) for name, kind in (
            ("joint_commands", JointState), ("commands", Float64MultiArray), ("joint_trajectory", JointTrajectory))}

    def inputs(self):
        now = self.robot.get_state().state
        return dict(zip(now.inputs, now.input))

    def told(self, kind):
        self.assertTrue(wait_until(self.listen[kind].all), kind)
        return self.listen[kind].all()

    def test_1_before_anything_moves(self):
        """Servos at their setpoints: the trunk falls freely, and an IMU in it feels nothing."""
        imu = self.told("imu")[0]
        self.assertEqual("base_link", imu.header.frame_id)
        for value in (imu.linear_acceleration.x, imu.linear_acceleration.y, imu.linear_acceleration.z):
            self.assertAlmostEqual(0, value, delta=1e-9)
        odometry = self.told("odom")[0]
        self.assertEqual(("odom", "base_link"), (odometry.header.frame_id, odometry.child_frame_id))
        self.assertAlmostEqual(0.42, odometry.pose.pose.position.z, delta=1e-12)
        foot = self.told("foot")[0]
        self.assertEqual("front_left_foot", foot.header.frame_id)
        self.assertEqual("quadruped", self.told("diagnostics")[0].status[0].hardware_id)

    def test_2_commands_become_inputs(self):
        self.assertTrue(wait_until(lambda: all(p.get_num_connections() == 1 for p in self.send.values())))
        self.send["joint_commands"].publish(JointState(name=["front_left_knee"], position=[-1.3]))
        self.assertTrue(wait_until(lambda: self.inputs()["front_left_knee_setpoint"] == -1.3))
        values = list(self.robot.get_state().state.input)
        values[0] = 0.03
        self.send["commands"].publish(Float64MultiArray(data=values))
        self.assertTrue(wait_until(lambda: self.inputs()["front_left_roll_setpoint"] == 0.03))
        # What is wrong changes nothing.
        self.send["joint_commands"].publish(JointState(name=["front_left_knee"], effort=[5]))
        self.send["commands"].publish(Float64MultiArray(data=values[1:]))
        point = JointTrajectoryPoint(positions=[-1.2], time_from_start=rospy.Duration(0.1))
        self.send["joint_trajectory"].publish(JointTrajectory(joint_names=["rear_left_knee"], points=[point]))
        rospy.sleep(1)
        self.assertEqual(0.03, self.inputs()["front_left_roll_setpoint"])
        # From the knee's own angle, −1.4, straight to −1.2, sampled 2 ms ahead at most.
        self.assertTrue(self.robot.step(seconds=0.05).success)
        self.assertAlmostEqual(-1.3, self.inputs()["rear_left_knee_setpoint"], delta=0.005)
        self.assertTrue(self.robot.step(seconds=0.06).success)
        self.assertEqual(-1.2, self.inputs()["rear_left_knee_setpoint"])

    def test_3_efforts_and_feet(self):
        self.assertTrue(self.robot.step(seconds=0.3).success)  # on its feet
        rospy.sleep(0.5)
        joints = self.told("joints")[-1]
        now = self.robot.get_state().state
        state = dict(zip(now.velocities, now.v))
        angles = dict(zip(now.coordinates, now.q))
        for name, effort in zip(joints.name, joints.effort):  # a servo's, of config/robots/quadruped.yaml
            self.assertAlmostEqual(
                80 * (self.inputs()[name + "_setpoint"] - angles[name]) - 3 * state[name], effort, delta=1e-9)
        force = dict(zip(now.constraints, now.force))["front_left_foot"]
        push = self.told("foot")[-1].wrench.force
        self.assertAlmostEqual(force, (push.x ** 2 + push.y ** 2 + push.z ** 2) ** 0.5, delta=1e-9)

    def test_4_a_trajectory_that_is_refused_changes_nothing(self):
        """Where no more inputs are taken; it was followed all the same, which ended the run."""
        self.robot.reset_simulation()
        ahead = self.robot.get_state().state.t + 100
        put = rospy.ServiceProxy(NODE + "/set_input", SetInput, persistent=True)
        answer = next(a for a in (put(names=["front_left_knee_setpoint"], values=[-1.4], at=ahead + 1e-3 * k)
                                  for k in range(20000)) if not a.success)
        self.assertIn("inputs are waiting", answer.message)
        point = JointTrajectoryPoint(positions=[-1.2], time_from_start=rospy.Duration(10))
        self.send["joint_trajectory"].publish(JointTrajectory(joint_names=["rear_left_knee"], points=[point]))
        rospy.sleep(1)
        self.assertTrue(self.robot.step(seconds=0.02).success)
        condition = self.robot.get_state().condition
        self.assertEqual(0, condition.outcome, condition.why)
        self.robot.reset_simulation()


if __name__ == "__main__":
    rospy.init_node("commands_test")
    rostest.rosrun("contact_flow", "commands", CommandsTest, sys.argv)
