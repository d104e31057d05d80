#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes drop_quadruped and drop_humanoid (URDF and YAML) beside itself: robots of the proportions
of public ones, a quadruped with 12 joints and point feet (12 kg) and a humanoid with 30 joints and
four points under each foot (35 kg). And config/robots/humanoid, the same one with shapes, friction
and stiffer servos, which is pushed."""
import os

HERE = os.path.dirname(os.path.abspath(__file__))
CONFIG = os.path.join(HERE, "..", "..", "config", "robots")


class Robot:
    def __init__(self, name, about, folder=HERE, shapes=False):
        self.name, self.about, self.folder, self.shapes = name, about, folder, shapes
        self.links, self.joints, self.servos, self.contacts = [], [], [], []

    def link(self, name, mass, size, origin=(0, 0, 0)):
        """A box of this size [m] with its centre at origin."""
        x, y, z = size
        inertia = [mass * s / 12 for s in (y * y + z * z, x * x + z * z, x * x + y * y)]
        self.links.append(
            f'  <link name="{name}"><inertial><origin xyz="{origin[0]:g} {origin[1]:g} {origin[2]:g}"/>'
            f'<mass value="{mass:g}"/>\n    <inertia ixx="{inertia[0]:.4g}" ixy="0" ixz="0" '
            f'iyy="{inertia[1]:.4g}" iyz="0" izz="{inertia[2]:.4g}"/></inertial>'
            + (f'\n    <visual><origin xyz="{origin[0]:g} {origin[1]:g} {origin[2]:g}"/><geometry>'
               f'<box size="{x:g} {y:g} {z:g}"/></geometry></visual>' if self.shapes else "") +
            "</link>")

    def joint(self, name, parent, child, origin, axis, stiffness, damping, angle=0.0):
        self.joints.append(
            f'  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>\n'
            f'    <origin xyz="{origin[0]:g} {origin[1]:g} {origin[2]:g}"/><axis xyz="{axis}"/>'
            f'<limit lower="-3.1" upper="3.1" effort="500" velocity="50"/></joint>')
        self.servos.append((name, stiffness, damping, angle))

    def write(self, height, points, friction="", more="", setpoints=None, duration=1):
        """`more`: lines behind the efforts; `setpoints`: of servos that hold other angles than the
        nominal ones."""
        with open(os.path.join(self.folder, self.name + ".urdf"), "w") as out:
            out.write('<?xml version="1.0"?>\n<!-- SPDX-License-Identifier: BSD-3-Clause -->\n'
                      f'<!-- {self.about} Written by make_drop_robots.py. -->\n'
                      f'<robot name="{self.name}">\n' + "\n".join(self.links + self.joints) +
                      "\n</robot>\n")
        with open(os.path.join(self.folder, self.name + ".yaml"), "w") as out:
            out.write(f"# {self.about} Written by make_drop_robots.py.\n"
                      f"urdf: {self.name}.urdf\nbase: floating\ngravity: 9.81\n\nconstraints:\n")
            for name, link, (x, y, z), radius in points:
                out.write(f"  {name}: {{kind: plane, link: {link}, point: [{x:g}, {y:g}, {z:g}], "
                          f"radius: {radius:g}{friction}}}\n")
            out.write("\ninputs:\n" + "".join(f"  - {s[0]}_setpoint\n" for s in self.servos))
            out.write("\nefforts:\n")
            for name, stiffness, damping, _ in self.servos:
                out.write(f"  {name}_servo: {{kind: servo, joint: {name}, input: {name}_setpoint, "
                          f"stiffness: {stiffness:g}, damping: {damping:g}}}\n")
            out.write(more)
            out.write(f"\nnominal:\n  positions:\n    base_z: {height:g}\n")
            bent = [s for s in self.servos if s[3] != 0]
            out.write("".join(f"    {s[0]}: {s[3]:g}\n" for s in bent) + "  inputs:\n")
            held = dict({s[0]: s[3] for s in bent}, **(setpoints or {}))
            out.write("".join(f"    {name}_setpoint: {angle:g}\n" for name, angle in held.items()))
            out.write(f"  duration: {duration:g}\n")


def quadruped():
    robot = Robot("drop_quadruped", "A quadruped of 12 kg with twelve joints and point feet.")
    robot.link("trunk", 5.2, (0.38, 0.094, 0.114))
    points = []
    for leg, front, left in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)):
        robot.link(leg + "_hip", 0.59, (0.08, 0.06, 0.08))
        robot.link(leg + "_thigh", 0.92, (0.04, 0.03, 0.213), (-0.003, -0.02 * left, -0.03))
        robot.link(leg + "_calf", 0.14, (0.016, 0.016, 0.213), (0.005, 0, -0.11))
        robot.link(leg + "_foot", 0.06, (0.02, 0.02, 0.02))
        robot.joint(leg + "_abduction", "trunk", leg + "_hip", (0.188 * front, 0.047 * left, 0),
                    "1 0 0", 80, 3)
        robot.joint(leg + "_hip_pitch", leg + "_hip", leg + "_thigh", (0, 0.08 * left, 0), "0 1 0",
                    80, 3, 0.8)
        robot.joint(leg + "_knee", leg + "_thigh", leg + "_calf", (0, 0, -0.213), "0 1 0", 80, 3,
                    -1.6)
        robot.joints.append(
            f'  <joint name="{leg}_toe" type="fixed"><parent link="{leg}_calf"/>'
            f'<child link="{leg}_foot"/><origin xyz="0 0 -0.213"/></joint>')
        points.append((leg + "_toe", leg + "_foot", (0, 0, 0), 0.02))
    robot.write(0.32, points)


PUSH = """  push:              # [N], [s]
    kind: timed_force
    link: pelvis
    force: [1, 0, 0]
    reference: {times: [0.3, 0.35, 0.4], values: [0, 200, 0]}

parameters:
  torso_mass: links/torso/mass
"""


def humanoid(name, pushed=False):
    about = "A humanoid of 35 kg with thirty joints and four points under each foot."
    robot = Robot(name, about + (" It stands and is pushed." if pushed else ""),
                  CONFIG if pushed else HERE, pushed)
    ankle = (300, 15) if pushed else (60, 2)
    robot.link("pelvis", 3.8, (0.12, 0.2, 0.12))
    points = []
    for side, left in (("left", 1), ("right", -1)):
        leg = lambda part: f"{side}_{part}"
        robot.link(leg("hip_yoke"), 1.35, (0.09, 0.09, 0.09))
        robot.link(leg("hip_fork"), 1.5, (0.09, 0.09, 0.1), (0, 0, -0.03))
        robot.link(leg("thigh"), 1.7, (0.1, 0.1, 0.28), (0, 0, -0.13))
        robot.link(leg("shank"), 1.9, (0.08, 0.08, 0.3), (0, 0, -0.13))
        robot.link(leg("ankle"), 0.2, (0.05, 0.05, 0.05))
        robot.link(leg("foot"), 0.6, (0.2, 0.06, 0.035), (0.03, 0, -0.02))
        robot.joint(leg("hip_pitch"), "pelvis", leg("hip_yoke"), (0, 0.065 * left, -0.1), "0 1 0",
                    200, 5, -0.3)
        robot.joint(leg("hip_roll"), leg("hip_yoke"), leg("hip_fork"), (0, 0.05 * left, -0.03),
                    "1 0 0", 200, 5)
        robot.joint(leg("hip_yaw"), leg("hip_fork"), leg("thigh"), (0, 0, -0.12), "0 0 1", 150, 4)
        robot.joint(leg("knee"), leg("thigh"), leg("shank"), (0, 0, -0.2), "0 1 0", 250, 6, 0.6)
        robot.joint(leg("ankle_pitch"), leg("shank"), leg("ankle"), (0, 0, -0.3), "0 1 0", *ankle,
                    -0.3)
        robot.joint(leg("ankle_roll"), leg("ankle"), leg("foot"), (0, 0, -0.018), "1 0 0", *ankle)
        for corner, x, y in (("heel_in", -0.05, -0.025), ("heel_out", -0.05, 0.025),
                             ("toe_in", 0.12, -0.03), ("toe_out", 0.12, 0.03)):
            points.append((leg(corner), leg("foot"), (x, y * left, -0.035), 0))
    robot.link("waist_yoke", 0.3, (0.06, 0.06, 0.06))
    robot.link("waist_fork", 0.4, (0.06, 0.06, 0.06))
    robot.link("torso", 8.6, (0.14, 0.24, 0.32), (0, 0, 0.14))
    robot.link("head", 1.1, (0.14, 0.14, 0.18), (0, 0, 0.08))
    robot.joint("waist_yaw", "pelvis", "waist_yoke", (0, 0, 0.06), "0 0 1", 200, 5)
    robot.joint("waist_roll", "waist_yoke", "waist_fork", (0, 0, 0.03), "1 0 0", 200, 5)
    robot.joint("waist_pitch", "waist_fork", "torso", (0, 0, 0.03), "0 1 0", 200, 5)
    robot.joint("neck_yaw", "torso", "head", (0, 0, 0.34), "0 0 1", 20, 1)
    for side, left in (("left", 1), ("right", -1)):
        arm = lambda part: f"{side}_{part}"
        robot.link(arm("shoulder_yoke"), 0.72, (0.06, 0.06, 0.06))
        robot.link(arm("shoulder_fork"), 0.64, (0.06, 0.06, 0.08), (0, 0, -0.03))
        robot.link(arm("upper_arm"), 0.73, (0.06, 0.06, 0.14), (0, 0, -0.05))
        robot.link(arm("forearm"), 0.6, (0.06, 0.06, 0.12), (0, 0, -0.06))
        robot.link(arm("wrist_yoke"), 0.3, (0.05, 0.05, 0.06))
        robot.link(arm("wrist_fork"), 0.3, (0.05, 0.05, 0.06))
        robot.link(arm("hand"), 0.35, (0.05, 0.07, 0.12), (0, 0, -0.06))
        robot.joint(arm("shoulder_pitch"), "torso", arm("shoulder_yoke"), (0, 0.13 * left, 0.26),
                    "0 1 0", 40, 2, 0.2)
        robot.joint(arm("shoulder_roll"), arm("shoulder_yoke"), arm("shoulder_fork"),
                    (0, 0.04 * left, 0), "1 0 0", 40, 2, 0.15 * left)
        robot.joint(arm("shoulder_yaw"), arm("shoulder_fork"), arm("upper_arm"), (0, 0, -0.1),
                    "0 0 1", 40, 2)
        robot.joint(arm("elbow"), arm("upper_arm"), arm("forearm"), (0, 0, -0.1), "0 1 0", 40, 2,
                    -0.7)
        robot.joint(arm("wrist_roll"), arm("forearm"), arm("wrist_yoke"), (0, 0, -0.1), "0 0 1", 20,
                    0.5)
        robot.joint(arm("wrist_pitch"), arm("wrist_yoke"), arm("wrist_fork"), (0, 0, -0.04),
                    "0 1 0", 20, 0.5)
        robot.joint(arm("wrist_yaw"), arm("wrist_fork"), arm("hand"), (0, 0, -0.04), "1 0 0", 20,
                    0.5)
    if not pushed:
        robot.write(0.75, points)
        return
    ankles = tuple(side + "_ankle_pitch" for side in ("left", "right"))
    robot.servos = [(joint, 1.5 * stiffness, 1.5 * damping, angle)
                    for joint, stiffness, damping, angle in robot.servos]
    robot.write(0.7745, points, ", friction: 0.8", PUSH, dict.fromkeys(ankles, -0.33), 2)


quadruped()
humanoid("drop_humanoid")
humanoid("humanoid", pushed=True)
