#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""robot.launch: every robot answers, one is shown by joint_states, tf and markers, bags are verified."""
import copy
import os
import signal
import subprocess
import tempfile
import time
import unittest

import numpy
import rospy
import rostest
from client import Client, case, executable, labels, matrix, wait_until
from contact_flow.msg import ContactTrajectory, OutcomeDerivative
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

ROBOTS = {  # the contact modes of their nominal runs
    "monoped": ["{}", "{foot}"],
    "soft_biped": labels(case("soft_biped_simultaneous")["mode_sequence"]),
    "hopping_trot": labels(case("hopping_trot_stable")["mode_sequence"]),
    "planar_biped": ["{}", "{right_foot}"],
    "compliant_quadruped": ["{}", "{front_left_foot, front_right_foot, rear_left_foot, rear_right_foot}"],
    "gripper": ["{}", "{front_pad, left_pad, right_pad}"],
    "contact_flow": ["{}", "{front_left_foot, front_right_foot, rear_left_foot, rear_right_foot}"],
}
FEET = ["front_left_foot", "front_right_foot", "rear_left_foot", "rear_right_foot"]


def rotation(q):
    """Matrix of a quaternion message."""
    w, v = q.w, numpy.array([q.x, q.y, q.z])
    cross = numpy.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return numpy.eye(3) + 2 * w * cross + 2 * cross @ cross


def vector(v):
    return numpy.array([v.x, v.y, v.z])


class Robots(unittest.TestCase):
    def test_every_robot_passes_through_its_modes(self):
        for name, modes in ROBOTS.items():
            answer = Client(name).simulate()
            self.assertTrue(answer.success, answer.message)
            self.assertEqual((answer.outcome, answer.mode_sequence[:len(modes)]), (0, modes), name)

    def test_description_has_names_and_texts(self):
        description = Client("contact_flow").describe_model().description
        self.assertEqual(description.name, "quadruped")
        self.assertEqual(len(description.velocities), 18)
        self.assertIn("<robot name=\"quadruped\">", description.urdf)
        self.assertIn("urdf: quadruped.urdf", description.robot_yaml)
        self.assertIn("limits", description.warnings[0])

    def test_trot_from_urdf_is_the_reference_case(self):
        answer = Client("soft_biped").simulate()
        expected = case("soft_biped_simultaneous")
        final = dict(zip(answer.trajectory.coordinates, answer.trajectory.final_q))
        self.assertEqual(sorted(final), sorted(expected["coordinates"]))
        for name, value in zip(expected["coordinates"], expected["final_state"]["q"]):
            self.assertAlmostEqual(final[name], value, delta=1e-7)

    def test_derivatives_of_a_robot_have_slope_one(self):
        answer = Client("planar_biped").compare(
            directions=["+base_pitch", "-d/dt left_hip", "+parameter torso_mass", "-parameter stiffness"],
            by_parameters=["torso_mass", "stiffness"], alphas=[1e-2, 1e-3, 1e-4])
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        for comparison in answer.comparison.comparisons:
            small = max(comparison.errors) < 1e-6
            self.assertTrue(small or abs(comparison.slope - 1) < 0.1,
                            (comparison.name, comparison.slope, comparison.errors))

    def test_other_services(self):
        client = Client("compliant_quadruped")
        self.assertTrue(client.check_assumptions().report.differentiable)
        interval, = client.linearize(duration=0.2).linearization.intervals
        self.assertEqual((interval.outcome, matrix(interval.A).shape), (0, (60, 60)))
        rigid = Client("contact_flow").b_derivative(directions=["base_wx"])
        self.assertEqual(rigid.outcome, rigid.DISCONTINUOUS)

    def test_wrong_names_are_answered_with_the_nearest(self):
        answer = Client("planar_biped").b_derivative(directions=["left_kne"])
        self.assertFalse(answer.success)
        self.assertIn("'left_knee'", answer.message)

    def test_bags_are_verified_from_their_texts_alone(self):
        with tempfile.TemporaryDirectory() as directory:
            for name in ("quadruped.urdf", "quadruped.yaml"):
                source = os.path.join(os.path.dirname(__file__), "../../config/robots", name)
                with open(source) as old, open(os.path.join(directory, name), "w") as new:
                    new.write(old.read())
            node = subprocess.Popen(
                [executable("contact_flow_node"), "__name:=recorded_robot", "_record:=true",
                 "_bag_name:=run", "_bag_directory:=" + directory, "_parameters/trunk_mass:=7.5",
                 "_robot:=" + os.path.join(directory, "quadruped.yaml")],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                client = Client("recorded_robot")
                client.simulate()
                client.b_derivative(directions=["base_wx"], continue_orders=True)
                client.compare(duration=0.1, directions=["+parameter trunk_mass"],
                               by_parameters=["trunk_mass"], alphas=[1e-2])
            finally:
                node.send_signal(signal.SIGINT)
                node.wait(timeout=30)
            os.remove(os.path.join(directory, "quadruped.yaml"))
            os.remove(os.path.join(directory, "quadruped.urdf"))
            done = subprocess.run([executable("verify_bag"), os.path.join(directory, "run.bag")],
                                  stdout=subprocess.PIPE, timeout=60)
            self.assertEqual(done.returncode, 0, done.stdout.decode())
            self.assertIn("3 verified, 0 differ", done.stdout.decode())


class Display(unittest.TestCase):
    """What robot.launch shows of the quadruped."""
    @classmethod
    def setUpClass(cls):
        cls.joints, cls.contacts, cls.tf, cls.fixed = {}, {}, {}, {}
        subscribers = [
            rospy.Subscriber("joint_states", JointState,
                             lambda m: cls.joints.update({m.header.stamp: m})),
            rospy.Subscriber("robot_player/contacts", MarkerArray,
                             lambda m: cls.contacts.update({m.markers[0].header.stamp: m.markers})),
            rospy.Subscriber("tf", TFMessage, lambda m: [
                cls.tf.setdefault(t.header.stamp, {}).update({t.child_frame_id: t})
                for t in m.transforms]),
            rospy.Subscriber("tf_static", TFMessage, lambda m: [
                cls.fixed.update({t.child_frame_id: t}) for t in m.transforms])]
        # A whole cycle: 0.2 s at a fifth of the speed, and a pause of 1 s.
        assert wait_until(lambda: len(cls.contacts) > 110, 30)
        for subscriber in subscribers:
            subscriber.unregister()

    def place(self, stamp, frame):
        """Position in odom of the origin of a frame, from the transforms of one stamp."""
        point = numpy.zeros(3)
        while frame != "odom":
            transform = self.tf[stamp].get(frame) or self.fixed.get(frame)
            if transform is None:
                return None
            point = rotation(transform.transform.rotation) @ point + vector(
                transform.transform.translation)
            frame = transform.header.frame_id
        return point

    def test_joint_states_have_the_names_of_the_urdf(self):
        expected = [leg + "_" + joint for leg in
                    ("front_left", "front_right", "rear_left", "rear_right")
                    for joint in ("roll", "pitch", "knee")]
        for message in self.joints.values():
            self.assertEqual(message.name, expected)
            self.assertEqual((len(message.position), len(message.velocity)), (12, 12))

    def test_tf_is_one_tree_and_its_feet_are_the_contact_points(self):
        """robot_state_publisher's kinematics against our markers."""
        complete = 0
        for stamp, markers in self.contacts.items():
            if stamp not in self.tf:
                continue
            for marker in markers:
                if marker.ns != "contacts":
                    continue
                foot = self.place(stamp, FEET[marker.id])
                if foot is None:  # robot_state_publisher leaves out what comes too fast
                    continue
                complete += 1
                error = foot - [0, 0, 0.02] - vector(marker.pose.position)
                self.assertLess(numpy.abs(error).max(), 1e-9)
        self.assertGreater(complete, 40)

    def test_contacts_are_coloured_by_mode_and_push_upwards(self):
        seen, touching, open_ = set(), 0, 0
        for markers in self.contacts.values():
            for sphere, arrow in zip(markers[0::2], markers[1::2]):
                self.assertEqual((sphere.ns, arrow.ns, sphere.id), ("contacts", "forces", arrow.id))
                active = sphere.color.r > sphere.color.b
                seen.add(active)
                height = sphere.pose.position.z
                self.assertGreater(height, -1e-6)
                if active:
                    self.assertLess(height, 1e-6)
                else:  # a frame may fall on the instant of a touchdown
                    open_ += 1
                    touching += height < 1e-4
                if arrow.action == Marker.ADD:
                    self.assertTrue(active)
                    tail, head = (vector(p) for p in arrow.points)
                    self.assertLess(numpy.abs((head - tail)[:2]).max(), 1e-12)
                    self.assertGreater((head - tail)[2], 0)
        self.assertEqual(seen, {False, True})
        self.assertLess(touching, 0.1 * open_ + 3)

    def test_terrain_is_a_plane_under_the_feet(self):
        terrain, = rospy.wait_for_message("robot_player/terrain", MarkerArray, 10).markers
        heights = [p.z for p in terrain.points]
        self.assertEqual((terrain.type, terrain.header.frame_id), (Marker.TRIANGLE_LIST, "odom"))
        self.assertLess(max(heights) - min(heights), 1e-9)
        self.assertLess(abs(heights[0]), 0.01)

    def test_where_orders_decide_each_order_is_a_ghost(self):
        self.assertTrue(wait_until(lambda: any(
            "order" in m.ns for m in
            rospy.wait_for_message("robot_player/ghosts", MarkerArray, 10).markers)))

    def test_ghosts_are_predicted_outcomes(self):
        client = Client("compliant_quadruped")
        names = ["+base_wx", "-base_wx"]
        answer = client.b_derivative(directions=names)
        self.assertEqual((answer.success, answer.outcome), (True, 0), answer.message)
        base = [answer.derivative.coordinates.index("base_" + axis) for axis in "xyz"]
        markers = rospy.wait_for_message("compliant_player/ghosts", MarkerArray, 10).markers
        self.assertEqual(markers[0].action, Marker.DELETEALL)
        for name, row in zip(names, matrix(answer.derivative.derivatives)):
            trunk, = [m for m in markers if m.ns == "outcome of " + name and m.scale.x == 0.5]
            outcome = numpy.array(answer.derivative.final_q)[base] + 0.2 * row[:3]
            self.assertGreater(numpy.abs(row[:3]).max(), 1e-3)
            self.assertLess(numpy.abs(vector(trunk.pose.position) - outcome).max(), 1e-12)

    def test_runs_of_nobody_are_left_out(self):
        """What a run or a derivative says of its own sizes is not believed."""
        def shown():
            return rospy.wait_for_message("gripper_player/contacts", MarkerArray, 10)

        gripper = Client("gripper")
        run, derivative = gripper.simulate().trajectory, gripper.b_derivative(directions=["+box_z"]).derivative
        self.assertTrue(wait_until(shown))
        runs = rospy.Publisher("gripper/trajectory", ContactTrajectory, queue_size=10)
        derivatives = rospy.Publisher("gripper/b_derivative", OutcomeDerivative, queue_size=10)
        self.assertTrue(wait_until(lambda: runs.get_num_connections() and derivatives.get_num_connections()))
        for change in (lambda m: m.q.__setattr__("data", m.q.data[:3]), lambda m: m.v.__setattr__("data", ()),
                       lambda m: m.__setattr__("t", list(m.t) + [9.0] * 100000),
                       lambda m: m.arcs[0].__setattr__("first_sample", 2 ** 32 - 1),
                       lambda m: m.arcs[0].__setattr__("num_samples", 2 ** 32 - 1),
                       lambda m: m.arcs[-1].__setattr__("input", [0.0] * 100),
                       lambda m: m.__setattr__("t", [float("nan")] * len(m.t)),
                       lambda m: m.arcs[0].__setattr__("mode_word", "l" * 1000)):
            false = copy.deepcopy(run)
            change(false)
            runs.publish(false)
            shown()
        for change in (lambda m: m.derivatives.__setattr__("data", ()),
                       lambda m: m.__setattr__("direction_names", ["d"] * 100000),
                       lambda m: m.__setattr__("final_q", [float("nan")] * len(m.final_q))):
            false = copy.deepcopy(derivative)
            change(false)
            derivatives.publish(false)
            shown()
        time.sleep(0.5)
        shown()

    def test_free_bodies_and_prefixes(self):
        found = {}
        subscriber = rospy.Subscriber("tf", TFMessage, lambda m: [
            found.update({t.child_frame_id: t.header.frame_id}) for t in m.transforms])
        self.assertTrue(wait_until(lambda: "gripper/box" in found and "gripper/base_link" in found))
        subscriber.unregister()
        self.assertEqual((found["gripper/box"], found["gripper/base_link"]),
                         ("gripper/table", "odom"))


if __name__ == "__main__":
    rospy.init_node("robot_test")
    rostest.rosrun("contact_flow", "robot", "__main__")
