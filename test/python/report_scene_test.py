#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What moves in a report: poses of links, contact forces, terrain, meshes, ghosts, walls of models."""
import pathlib
import struct
import tempfile
import unittest
import unittest.mock
import xml.etree.ElementTree

import numpy as np

import contact_flow as cf
import case
from case import largest
from contact_flow import report_scene, report_shapes, report_words

CUBE = [[[x, y, z] for x in (0, 2) for y in (0, 2)] for z in (0, 2)]


def matrices(quaternions):
    """By the sandwich product, not by the formula that is tested."""
    w, v = quaternions[..., :1], quaternions[..., 1:]
    columns = [e + 2 * np.cross(v, np.cross(v, e) + w * e) for e in np.eye(3)]
    return np.stack(columns, axis=-1)


class Poses(unittest.TestCase):
    def test_quaternions(self):
        random = np.random.default_rng(3)
        axes = random.normal(size=(300, 3))
        axes[:3] = np.eye(3)
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        for angles in (random.uniform(-4, 4, 300), np.full(300, np.pi), np.zeros(300)):
            q = np.concatenate([np.cos(angles / 2)[:, None], np.sin(angles / 2)[:, None] * axes], axis=1)
            self.assertLess(largest(matrices(report_scene.quaternions(matrices(q))) - matrices(q)), 1e-12)

    def test_links_hang_where_the_urdf_says(self):
        """A joint's frame is fixed in its parent: child = parent + R xyz, but for sliding joints."""
        checked = 0
        for name in ("quadruped", "planar_biped", "gripper"):
            robot = cf.Robot(case.ROBOTS / (name + ".yaml"))
            x = robot.perturb(robot.nominal.x, 0.3 * np.sin(1.0 + np.arange(2 * robot.dof)))
            q = x[:robot.num_positions]
            at, R = robot.link_positions(q), robot.link_rotations(q)
            self.assertLess(largest(R @ R.transpose(0, 2, 1) - np.eye(3)), 1e-12)
            np.testing.assert_array_equal(robot.link_rotations(np.array([q, q]))[1], R)
            for joint in xml.etree.ElementTree.fromstring(robot.urdf).findall("joint"):
                if joint.get("type") not in ("fixed", "revolute", "continuous"):
                    continue
                parent, child = (robot.links.index(joint.find(k).get("link")) for k in ("parent", "child"))
                origin = joint.find("origin")
                xyz = np.zeros(3) if origin is None else np.array(origin.get("xyz", "0 0 0").split(), dtype=float)
                self.assertLess(largest(at[child] - at[parent] - R[parent] @ xyz), 1e-12, joint.get("name"))
                checked += 1
        self.assertGreater(checked, 15)

    def test_forces_do_the_work_of_their_gaps(self):
        """F · ∂(point)/∂v = λ ∂a/∂v along every velocity: points by quotients, gradients of gaps by the core."""
        for name in ("quadruped", "planar_biped", "hopping_trot"):
            robot = cf.Robot(case.ROBOTS / (name + ".yaml"))
            run = robot.simulate()
            t = np.array([e.t for e in run.events if e.mode_after][:1]) + 1e-3
            x, force = run.x(t), run.force(t)
            n, nq = len(robot.constraints), robot.num_positions
            places = robot.contact_forces(x[:, :nq], force)[0]
            self.assertGreater(largest(places[:, 1]), 1)
            A = robot.constraint_terms(x[0, :nq], x[0, nq:])[1][:n]
            step = 1e-6
            for k, w in enumerate(np.eye(2 * robot.dof)[:robot.dof]):
                ends = [robot.contact_points(robot.perturb(x[0], sign * step * w)[:nq]) for sign in (1, -1)]
                work = np.einsum("ij,ij->i", places[:, 1], (ends[0] - ends[1]) / (2 * step))
                wanted = force[0, :n] * A[:, k]
                touches = np.isfinite(work)
                self.assertLess(largest((work - wanted)[touches]), 1e-5 * (1 + largest(force)), (name, k))
            with self.assertRaisesRegex(ValueError, "same number of rows"):
                robot.contact_forces(x[:, :nq], force[0])
            with self.assertRaisesRegex(ValueError, "force has not %d numbers" % force.shape[1]):
                robot.contact_forces(x[0, :nq], force[0, 1:])

    def test_friction_pushes_with_its_contact(self):
        """Along every velocity forces do on the material of the feet what rows of the core do: Σ F · ∂p/∂v = Σ λ ∂a/∂v."""
        robot = cf.Robot(case.ROBOTS / "planar_biped_friction.yaml")
        run = robot.simulate()
        arc = [arc for arc in run.arcs if arc.word == "s+oo"][0]
        t, nq = 0.5 * (arc.t_begin + arc.t_end), robot.num_positions
        x, force = run.x(t), run.force(t)
        places = robot.contact_forces(x[:nq], force)[:2]
        self.assertGreater(np.abs(places[:, 1, 0]).min(), 1e-3)     # friction, along x
        feet = [robot.links.index(name) for name in robot.constraints[:2]]
        at, R = robot.link_positions(x[:nq])[feet], robot.link_rotations(x[:nq])[feet]
        local = np.einsum("fji,fj->fi", R, places[:, 0] - at)
        self.assertLess(largest(np.linalg.norm(local, axis=1) - 0.03), 1e-12)    # the radius of the feet

        def material(w):
            q = robot.perturb(x, w)[:nq]
            return robot.link_positions(q)[feet] + np.einsum("fij,fj->fi", robot.link_rotations(q)[feet], local)

        A = robot.constraint_terms(x[:nq], x[nq:])[1]
        for k, w in enumerate(1e-6 * np.eye(2 * robot.dof)[:robot.dof]):
            work = float(np.sum(places[:, 1] * (material(w) - material(-w)) / 2e-6))
            self.assertLess(abs(work - float(force @ A[:, k])), 1e-6 * (1 + largest(force)), k)

    def test_terrain_is_where_gaps_vanish(self):
        urdf = (case.DATA / "waves.urdf").read_text(encoding="utf-8")
        robot = cf.Robot(case.DATA / "waves.yaml")
        self.assertIn("<robot", urdf)
        patches = robot.terrain([0, 0, 0], 1.0, 4)
        self.assertGreaterEqual(len(patches), 1)
        for patch in patches:
            self.assertEqual((5, 5, 3), patch.shape)
            self.assertLess(largest(np.abs(patch[..., 0]).max() - 1), 1e-12)
        ground = cf.Robot(case.ROBOTS / "quadruped.yaml").terrain([0.3, 0.2, 5], 2.0, 2)
        self.assertEqual(1, len(ground))          # four feet, one ground
        np.testing.assert_allclose(ground[0][..., 2], 0, atol=1e-12)
        for field, arguments in (("near", ([0, 0],)), ("half_width", ([0, 0, 0], -1.0)), ("tiles", ([0, 0, 0], 1.0, 0))):
            with self.assertRaisesRegex(ValueError, field):
                robot.terrain(*arguments)


class Shapes(unittest.TestCase):
    def cube(self):
        corners = np.array(CUBE, dtype=float).reshape(-1, 3)
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return corners, faces

    def test_formats_agree(self):
        corners, faces = self.cube()
        triangles = np.array([[corners[f[0]], corners[f[i]], corners[f[i + 1]]] for f in faces for i in (1, 2)])
        binary = b"\0" * 80 + struct.pack("<I", 12) + b"".join(
            struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
        words = "solid a\n" + "".join("facet normal 0 0 0\nouter loop\n" + "".join(
            "vertex %g %g %g\n" % tuple(p) for p in t) + "endloop\nendfacet\n" for t in triangles) + "endsolid a\n"
        obj = "".join("v %g %g %g\n" % tuple(p) for p in corners) + "".join(
            "f %s\n" % " ".join("%d//1" % (k + 1) for k in f) for f in faces)
        for found in (report_shapes.read_stl(binary), report_shapes.read_stl(words.encode()),
                      report_shapes.read_obj(obj.encode())):
            np.testing.assert_array_equal(triangles, found)

    def test_coarse_meshes_stay_near(self):
        u, v = np.meshgrid(np.linspace(0, np.pi, 121), np.linspace(0, 2 * np.pi, 121), indexing="ij")
        ball = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1)
        quads = [ball[:-1, :-1], ball[1:, :-1], ball[1:, 1:], ball[:-1, 1:]]
        triangles = np.concatenate([np.stack([quads[0], quads[1], quads[2]], axis=2).reshape(-1, 3, 3),
                                    np.stack([quads[0], quads[2], quads[3]], axis=2).reshape(-1, 3, 3)])
        vertices, corners = report_shapes.coarse(triangles)
        self.assertLessEqual(len(corners), report_shapes.MAX_TRIANGLES)
        self.assertGreater(len(corners), report_shapes.MAX_TRIANGLES // 8)
        self.assertLess(largest(np.linalg.norm(vertices, axis=1) - 1), 0.1)
        same, kept = report_shapes.coarse(np.array(self.cube()[0][[0, 1, 3]])[None])
        self.assertEqual((3, 1), (len(same), len(kept)))

    def test_meshes_of_a_robot(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            corners, faces = self.cube()
            (folder / "cube.obj").write_text("".join("v %g %g %g\n" % tuple(p) for p in corners) + "".join(
                "f %s\n" % " ".join("%d" % (k + 1) for k in f) for f in faces), encoding="utf-8")
            visual = '<visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/><geometry>' \
                '<mesh filename="%s" scale="0.5 1 1"/></geometry></visual>'
            (folder / "box.urdf").write_text(
                '<robot name="box"><link name="box"><inertial><mass value="1"/>'
                '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>%s%s%s</link></robot>'
                % tuple(visual % file for file in ("cube.obj", "none.stl", "cube.dae")), encoding="utf-8")
            (folder / "cube.dae").write_text("<COLLADA/>", encoding="utf-8")
            (folder / "box.yaml").write_text(
                "urdf: box.urdf\nbase: floating\nconstraints:\n  sole: {kind: plane, link: box}\n"
                "nominal: {positions: {base_z: 1}, duration: 0.1}\n", encoding="utf-8")
            robot = cf.Robot(folder / "box.yaml")
            self.assertEqual("", robot.mesh_path("none.stl"))
            shapes, missing = report_shapes.shapes(robot)
        self.assertEqual(["mesh"], [shape["kind"] for shape in shapes])
        self.assertEqual([0, 0, 1], shapes[0]["at"])
        np.testing.assert_allclose(np.array(shapes[0]["turn"]).reshape(3, 3) @ [1, 0, 0], [0, 1, 0], atol=1e-6)
        self.assertEqual([1.0, 2.0, 2.0], np.max(shapes[0]["mesh"]["v"], axis=0).tolist())
        self.assertEqual(12, len(shapes[0]["mesh"]["f"]))
        self.assertIn("'none.stl' is not found", missing[0])
        self.assertIn("'cube.dae' is not shown", missing[1])

    def test_primitives(self):
        shapes, missing = report_shapes.shapes(cf.Robot(case.ROBOTS / "quadruped.yaml"))
        self.assertEqual([], missing)
        self.assertEqual({"box", "sphere", "cylinder"}, {shape["kind"] for shape in shapes})
        self.assertEqual("#404c59", shapes[0]["colour"])     # 0.25 0.3 0.35


class Scene(unittest.TestCase):
    def test_ghosts_are_perturbed_outcomes(self):
        """To first order: what is missed is of second order in their size."""
        robot = cf.Robot(case.ROBOTS / "hopping_trot.yaml")
        run = robot.simulate()
        B = run.derivative()
        entry = {"name": "base_pitch", "up": {"value": B("+base_pitch").tolist()}, "down": {}}
        errors = []
        for size in (0.01, 0.001):
            with unittest.mock.patch.object(report_scene, "GHOST", size), \
                    unittest.mock.patch.object(report_scene, "numbers", lambda array, digits=5: array):
                ghost, = report_scene.ghosts(run, {"directions": [entry]}, lambda q: report_scene.poses(robot, q))
            self.assertNotIn("down", ghost)
            moved = robot.simulate(robot.perturb(run.x0, B.direction("+base_pitch") * size)).final_state
            errors.append(largest(ghost["up"] - report_scene.poses(robot, moved[None, :robot.num_positions])[0]))
        self.assertLess(errors[1], 0.02 * errors[0])
        self.assertLess(errors[1], 1e-5)

    def test_models_stand_on_their_walls(self):
        data = report_scene.scene(cf.Model("corner").simulate(), {})
        self.assertEqual("xy", data["plane"])
        model = cf.Model("corner")
        ends = np.array(data["walls"], dtype=float).reshape(-1, 3)
        gaps = np.array([model.gaps(end[:2]) for end in ends])
        self.assertGreater(len(ends), 50)
        self.assertLess(largest(np.min(np.abs(gaps), axis=1)), 1e-4)     # five digits
        self.assertLess(np.min(np.abs(gaps[:, 0])), 1e-4)
        self.assertLess(np.min(np.abs(gaps[:, 1])), 1e-4)

    def test_zero_lines(self):
        u, v = np.meshgrid(np.arange(41) - 20, np.arange(41) - 20, indexing="ij")
        lines = np.array(report_scene.zero_lines(np.hypot(u, v) - 13.3)) - 20
        self.assertLess(largest(np.linalg.norm(lines, axis=2) - 13.3), 0.05)
        self.assertAlmostEqual(2 * np.pi * 13.3, np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum(), delta=0.5)

    def test_force_of_a_model(self):
        """A puck's weight is borne upward."""
        puck = cf.Model("puck").simulate()
        data = report_scene.scene(puck, {}, frames=3)
        self.assertGreater(data["contacts"][1][0][5], 0)
        self.assertEqual([0, 0], data["contacts"][1][0][3:5])

    def test_without_places(self):
        self.assertEqual({}, report_scene.scene(cf.Model("double_pendulum").simulate(), {}))


class Words(unittest.TestCase):
    def test_margins(self):
        run = cf.Model("soft_biped").simulate()
        said = " ".join(report_words.margins(run))
        self.assertIn("%.4g m/s" % run.margins.approach_speed, said)
        self.assertNotIn("inf", said)
        still = cf.Model("bouncing_ball").simulate(duration=1e-3)
        self.assertEqual(["Nothing came near to an event that did not happen."], report_words.margins(still))


if __name__ == "__main__":
    case.main()
