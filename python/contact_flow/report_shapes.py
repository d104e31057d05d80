# SPDX-License-Identifier: BSD-3-Clause
"""What a robot looks like: the shapes of its URDF, with meshes made small."""
from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from typing import Any, Dict, List, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _core

Array = NDArray[np.float64]

MAX_TRIANGLES = 1500  #: of one mesh: finer ones are made coarser
COLOUR = "#8a97a5"


def rotation(rpy: List[float]) -> Array:
    """Of roll, pitch and yaw about fixed axes [3×3]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]])


def three(text: str, otherwise: float) -> List[float]:
    numbers = [float(word) for word in text.split()]
    return numbers if len(numbers) == 3 else [otherwise] * 3


def read_stl(data: bytes) -> Array:
    """Triangles [k×3×3]."""
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    if len(data) >= 84 + 50 * count and (not data.startswith(b"solid") or len(data) == 84 + 50 * count):
        kind = np.dtype([("numbers", "<f4", 12), ("attribute", "<u2")])
        return np.frombuffer(data, kind, count, 84)["numbers"][:, 3:].reshape(-1, 3, 3).astype(float)
    corners = re.findall(rb"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", data, re.M)
    return np.array(corners, dtype=float).reshape(-1, 3, 3)


def read_obj(data: bytes) -> Array:
    """Triangles [k×3×3]; faces of more corners as fans."""
    vertices: List[List[float]] = []
    corners: List[int] = []
    for line in data.decode(errors="replace").split("\n"):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            face = [int(word.split("/")[0]) for word in words[1:]]
            face = [k - 1 if k > 0 else len(vertices) + k for k in face]
            for a, b in zip(face[1:], face[2:]):
                corners += [face[0], a, b]
    return np.array(vertices, dtype=float).reshape(-1, 3)[corners].reshape(-1, 3, 3)


def coarse(triangles: Array, limit: int = MAX_TRIANGLES) -> Tuple[Array, Array]:
    """(vertices, corners) with at most `limit` triangles: vertices in one cell of a grid become their mean."""
    points = triangles.reshape(-1, 3)
    low, span = points.min(axis=0), float(np.max(np.ptp(points, axis=0))) or 1.0
    for cells in (4096, 256, 128, 64, 48, 32, 24, 16, 12, 8, 6, 4):
        keys = np.floor((points - low) / span * cells).astype(int)
        _, index = np.unique(keys, axis=0, return_inverse=True)
        index = index.reshape(-1)
        means = np.stack([np.bincount(index, points[:, k]) for k in range(3)], axis=1)
        vertices = means / np.bincount(index)[:, None]
        corners = index.reshape(-1, 3)
        whole = ((corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
                 & (corners[:, 2] != corners[:, 0]))
        corners = np.unique(corners[whole], axis=0)
        if len(corners) <= limit:
            break
    return vertices, corners[:limit]


def mesh(robot: _core.Robot, name: str, scale: List[float]) -> Dict[str, Any]:
    """Vertices [m] and corners of a mesh that the URDF names. ValueError where it cannot be shown."""
    path = robot.mesh_path(name)
    if not path:
        raise ValueError("the mesh '%s' is not found" % name)
    ending = path.rsplit(".", 1)[-1].lower()
    if ending not in ("stl", "obj"):
        raise ValueError("the mesh '%s' is not shown: STL and OBJ are" % name)
    with open(path, "rb") as file:
        data = file.read()
    triangles = read_stl(data) if ending == "stl" else read_obj(data)
    if not len(triangles):
        raise ValueError("the mesh '%s' has no triangles" % name)
    vertices, corners = coarse(triangles * np.array(scale))
    return {"v": vertices.round(4).tolist(), "f": corners.tolist()}


def colours(root: ElementTree.Element) -> Dict[str, str]:
    """"#rrggbb" of the materials by name."""
    found = {}
    for material in root.iter("material"):
        colour = material.find("color")
        if colour is not None:
            red, green, blue = [float(v) for v in colour.get("rgba", "0.5 0.5 0.5 1").split()][:3]
            found[material.get("name", "")] = "#%02x%02x%02x" % tuple(
                int(round(255 * min(1.0, max(0.0, v)))) for v in (red, green, blue))
    return found


def shapes(robot: _core.Robot) -> Tuple[List[Dict[str, Any]], List[str]]:
    """(shapes: link, kind, size, at, turn, colour; reasons why one is not shown). Visuals, or where there are none
    collision geometry."""
    try:
        root = ElementTree.fromstring(robot.urdf)
    except ElementTree.ParseError as error:
        return [], ["the URDF is not shown: %s" % error]
    found: List[Dict[str, Any]] = []
    missing: List[str] = []
    named = colours(root)
    for tag in ("visual", "collision"):
        for link in root.findall("link"):
            if link.get("name") not in robot.links:
                continue
            for visual in link.findall(tag):
                geometry = visual.find("geometry")
                if geometry is None or not len(geometry):
                    continue
                origin, form, material = visual.find("origin"), geometry[0], visual.find("material")
                at, rpy = ("", "") if origin is None else (origin.get("xyz", ""), origin.get("rpy", ""))
                shape: Dict[str, Any] = {
                    "link": robot.links.index(link.get("name", "")), "kind": form.tag, "at": three(at, 0),
                    "turn": rotation(three(rpy, 0)).round(6).ravel().tolist(),
                    "colour": named.get(material.get("name", ""), COLOUR) if material is not None else COLOUR}
                if form.tag == "box":
                    shape["size"] = three(form.get("size", ""), 0)
                elif form.tag in ("cylinder", "capsule"):
                    shape["kind"] = "cylinder"
                    shape["size"] = [float(form.get("radius", 0)), float(form.get("length", 0))]
                elif form.tag == "sphere":
                    shape["size"] = [float(form.get("radius", 0))]
                elif form.tag == "mesh":
                    try:
                        shape["mesh"] = mesh(robot, form.get("filename", ""), three(form.get("scale", ""), 1))
                    except (ValueError, OSError) as reason:
                        missing.append(str(reason))
                        continue
                else:
                    continue
                found.append(shape)
        if found:
            break
    return found, missing
