#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""plot_fig4.py PNG BAG...: prints and draws Fig. 4 of the paper from the bags of fig4.py.

The unit ball of (pitch, pitch rate), each half in the colour of its selection, and its images under the derivative of the
return map, seen in that plane; with the eigenvectors that lie in the cone of their own selection.
"""
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as pyplot
import numpy
import rosbag

COLOURS = {"left_foot": "#0072b2", "right_foot": "#d55e00"}
LABELS = {"left_foot": "left foot lands first", "right_foot": "right foot lands first"}
RETURNS = 3      # that are drawn
DIRECTIONS = 721
IN_CONE = 1e-8   # a unit vector this far outside counts as on the boundary
VISIBLE = 1e-3   # a factor below this is drawn as zero


def matrix(message):
    return numpy.array(message.data).reshape(message.rows, message.cols)


class Gait:
    """What one bag says of one trot."""

    def __init__(self, path):
        self.returns = []  # (δ(pitch, rate) at the start, at the return) of simulated runs
        with rosbag.Bag(path) as bag:
            for _, message, _ in bag.read_messages():
                kind = message._type.split("/")[1]
                if kind == "ModelDescription":
                    self.parameters = {p.name: p.value for p in message.parameters}
                    self.pitch, self.dof = list(message.coordinates).index("body_pitch"), \
                        len(message.velocities)
                elif kind == "PoincareRecord":
                    self.add_return(message)
                elif kind == "StabilityRecord":
                    self.verdict = message.result
        self.basis = matrix(self.orbit.basis)
        self.plane = self.basis[[self.pitch, self.dof + self.pitch]]  # [2×k]
        self.pieces = [(piece.omega[0].names[0], matrix(piece.matrix), matrix(piece.cone))
                       for piece in self.orbit.reduced]

    def add_return(self, message):
        result, state = message.result, message.request.state
        if not state.positions:
            self.orbit = result
        elif result.q:
            self.returns.append(([state.positions[0], state.velocities[0]],
                                 [result.q[self.pitch], result.v[self.pitch]]))

    def apply(self, z):
        """(first foot, f(z)) by the piece whose cone holds z best."""
        foot, A, _ = max(self.pieces, key=lambda piece: numpy.min(piece[2] @ z))
        return foot, A @ z

    def active_eigenvectors(self):
        """[(first foot, λ, v)]: real eigenvectors, of either sign, that their own cone holds."""
        for foot, A, cone in self.pieces:
            values, vectors = numpy.linalg.eig(A)
            for value, vector in zip(values, vectors.T):
                if abs(value.imag) > 1e-12 or abs(value) < VISIBLE:
                    continue
                for v in (vector.real, -vector.real):
                    if numpy.min(cone @ v) >= -IN_CONE:
                        yield foot, value.real, v

    def name(self):
        return "hips %g m from the centre" % self.parameters["hip_offset"]


## Numbers

def print_table(name, gait):
    verdict = gait.verdict
    print("\n%s: %s (%s, %s)" % (name, verdict.message, verdict.test,
                                 "verified" if verdict.verified else "NOT VERIFIED"))
    for foot, value, v in gait.active_eigenvectors():
        if numpy.linalg.norm(gait.plane @ v) > VISIBLE * numpy.linalg.norm(v):
            print("%s eigenvalue %.6f of the selection '%s', active" % (name, value, LABELS[foot]))
    errors = [numpy.linalg.norm(numpy.array(end) - gait.plane @ gait.apply(gait.plane.T @ start)[1])
              / numpy.linalg.norm(start) for start, end in gait.returns]
    print("%s simulated returns differ from the derivative by %.1e of the perturbation" %
          (name, max(errors)))


## Figure

def draw_image(axes, gait, steps):
    """The image of the unit ball after so many returns, in the colours of the first selection."""
    angles = numpy.linspace(0, 2 * numpy.pi, DIRECTIONS)
    curves = {foot: [] for foot in COLOURS}
    points = numpy.full((DIRECTIONS, 2), numpy.nan)
    feet = []
    for k, angle in enumerate(angles):
        z = gait.plane.T @ numpy.array([numpy.cos(angle), numpy.sin(angle)])
        first = gait.apply(z)[0]
        for _ in range(steps):
            z = gait.apply(z)[1]
        points[k] = gait.plane @ z
        feet.append(first)
    for foot in curves:
        chosen = numpy.array([f == foot for f in feet])
        curve = numpy.where(chosen[:, None] | numpy.roll(chosen, 1)[:, None], points, numpy.nan)
        axes.fill(*points[chosen].T, color=COLOURS[foot], alpha=0.18, lw=0)
        axes.plot(*curve.T, color=COLOURS[foot], lw=1.8, label=LABELS[foot])
    reach = 1.25 * numpy.max(numpy.abs(points), axis=0)  # of each axis by itself: images are thin
    if steps == 0:
        draw_eigenvectors(axes, gait)
        axes.set_aspect("equal")
    if steps == 1 and gait.returns:
        starts = numpy.array([start for start, _ in gait.returns])
        ends = numpy.array([end for _, end in gait.returns])
        axes.plot(*(ends / numpy.linalg.norm(starts, axis=1)[:, None]).T, ".", color="black", ms=4,
                  label="simulated")
    axes.axhline(0, color="0.85", lw=0.7, zorder=0)
    axes.axvline(0, color="0.85", lw=0.7, zorder=0)
    axes.set(xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]), xlabel=r"$\delta\theta$")
    axes.ticklabel_format(axis="x", scilimits=(-2, 3))


def draw_eigenvectors(axes, gait):
    shown = 0
    for foot, value, v in gait.active_eigenvectors():
        seen = gait.plane @ v
        length = numpy.linalg.norm(seen)
        if length <= VISIBLE * numpy.linalg.norm(v):
            continue  # it does not show in this plane
        seen = seen / length
        shown += 1
        axes.annotate("", seen, (0, 0), arrowprops={"arrowstyle": "-|>", "color": COLOURS[foot],
                                                    "lw": 1.4, "shrinkA": 0, "shrinkB": 0})
        axes.text(*(seen * 0.6 + 0.07 * numpy.array([seen[1], -seen[0]])),
                  r"$\lambda=%.3g$" % value, color=COLOURS[foot], fontsize=7.5, ha="center",
                  va="center")
    if not shown:
        axes.text(0, -0.75, "no real eigenvector is active", ha="center", fontsize=7.5)


def draw(gaits, path):
    pyplot.rcParams.update({"font.size": 9, "axes.titlesize": 10, "mathtext.fontset": "dejavusans"})
    figure, panels = pyplot.subplots(len(gaits), RETURNS + 1, figsize=(12, 6),
                                     constrained_layout=True, squeeze=False)
    for (name, gait), row in zip(gaits, panels):
        for steps, axes in enumerate(row):
            draw_image(axes, gait, steps)
            axes.spines["top"].set_visible(False)
            axes.spines["right"].set_visible(False)
            if steps == 0:
                axes.set(ylabel="%s: %s\n$\\delta\\dot\\theta$" % (name, verdict_word(gait)))
    for steps, axes in enumerate(panels[0]):
        axes.set_title("unit ball, active eigenvectors" if steps == 0 else
                       "image under $DP$" if steps == 1 else "image under $DP^%d$" % steps)
    panels[0][1].legend(fontsize=7, frameon=False, loc="upper right")
    figure.savefig(path, dpi=130)


def verdict_word(gait):
    return gait.verdict.message.split(":")[0]


def main():
    if len(sys.argv) < 3 or not sys.argv[1].endswith(".png"):
        sys.exit(__doc__)
    gaits = sorted((Gait(path) for path in sys.argv[2:]), key=lambda g: -g.parameters["hip_offset"])
    named = list(zip(("wide", "narrow") if len(gaits) == 2 else [g.name() for g in gaits], gaits))
    for name, gait in named:
        print_table(name, gait)
    print(flush=True)
    draw(named, sys.argv[1])


if __name__ == "__main__":
    main()
