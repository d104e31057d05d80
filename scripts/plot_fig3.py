#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""plot_fig3.py PNG BAG...: prints and draws Fig. 3 of the paper from the bag of fig3.py.

Nothing is computed here but what a picture needs: every number is a message of a bag.
"""
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as pyplot
import numpy
import rosbag
from matplotlib.colors import ListedColormap

LEFT, RIGHT, BOTH = "#0072b2", "#d55e00", "black"
REGIONS = ListedColormap(["#c6dcec", "#f6d5c2"])
SNAPSHOTS = 7
SPACING = 1.2  # between snapshots [m]


class Recording:
    """What the bag says."""

    def __init__(self, paths):
        self.landings = {}  # (pitch, rate) → the foot that lands first, or "" for both
        for path in paths:
            with rosbag.Bag(path) as bag:
                for _, message, _ in bag.read_messages():
                    self.add(message._type.split("/")[1], message)

    def add(self, kind, message):
        if kind == "ModelDescription":
            self.coordinates = list(message.coordinates)
            self.parameters = {p.name: p.value for p in message.parameters}
        elif kind == "PoincareRecord":
            self.orbit = message.result
        elif kind == "SimulationRecord" and message.request.samples > 1:
            self.period = message.result
        elif kind == "SimulationRecord":
            first = message.result.transitions[0].activated
            state = message.request.state
            self.landings[state.positions[0], state.velocities[0]] = \
                first[0] if len(first) == 1 else ""

    def pieces(self):
        """[(first foot, cone on (pitch, pitch rate))] of the selections."""
        i, d = self.coordinates.index("body_pitch"), len(self.coordinates)
        for piece in self.orbit.map:
            cone = numpy.array(piece.cone.data).reshape(piece.cone.rows, piece.cone.cols)
            yield piece.omega[0].names[0], cone[:, [i, d + i]]


def predicted(recording, point):
    """The foot that lands first by the selection whose cone holds the point."""
    return max(recording.pieces(), key=lambda piece: min(piece[1] @ point))[0]


## Numbers

def print_table(recording):
    orbit = recording.orbit
    print("\ntrot: period %.10f s, |P(x) - x| = %.1e, %d selections" %
          (orbit.time, orbit.distance, len(orbit.map)))
    agree = total = 0
    for point, foot in recording.landings.items():
        if foot and max(map(abs, point)) > 0:
            total += 1
            agree += foot == predicted(recording, numpy.array(point))
    print("first feet of %d of %d perturbed runs are those of the cone that holds them" %
          (agree, total))


## Figure

def draw_robot(axes, q, name, parameters, offset):
    """The robot at one instant, moved aside by `offset`."""
    def at(coordinate):
        return q[name.index(coordinate)]

    body = numpy.array([at("body_x"), at("body_z")])
    along = numpy.array([numpy.cos(at("body_pitch")), numpy.sin(at("body_pitch"))])
    hips = [body - parameters["hip_offset"] * along, body + parameters["hip_offset"] * along]
    shift = numpy.array([offset, 0])
    axes.plot(*numpy.transpose([hip + shift for hip in hips]), color="0.2", lw=4,
              solid_capstyle="round")
    for foot, hip, colour in (("left_foot", hips[0], LEFT), ("right_foot", hips[1], RIGHT)):
        end = numpy.array([at(foot + "_x"), at(foot + "_z")])
        axes.plot(*numpy.transpose([hip + shift, end + shift]), color=colour, lw=1.6)
        axes.plot(*(end + shift), "o", ms=4, color=colour)


def draw_period(axes, recording):
    """Snapshots over one period, the instants of touchdown and lift-off among them."""
    result = recording.period
    q = numpy.array(result.q.data).reshape(result.q.rows, result.q.cols)
    t = numpy.array(result.t)
    events = [event.t for event in result.transitions]
    instants = numpy.linspace(0, result.t_end, SNAPSHOTS)
    for event in events:
        instants[numpy.argmin(numpy.abs(instants - event))] = event
    for k, instant in enumerate(instants):
        row = q[numpy.argmin(numpy.abs(t - instant))]
        draw_robot(axes, row, list(result.coordinates), recording.parameters, k * SPACING)
        label = "%.2f s" % instant
        for event, what in zip(events, ("touchdown", "lift-off")):
            if instant == event:
                label = what + "\n" + label
        axes.text(k * SPACING, -0.08, label, ha="center", va="top", fontsize=8)
    heights = q[:, recording.coordinates.index("body_z")]
    axes.plot(numpy.interp(t, instants, numpy.arange(SNAPSHOTS) * SPACING), heights, color="0.6", lw=0.8, ls=":")
    axes.axhline(0, color="0.4", lw=1)
    axes.set(xlim=(-0.75, (SNAPSHOTS - 1) * SPACING + 0.75), ylim=(-0.32, 1.0), aspect="equal",
             yticks=[0, 0.4, 0.8], ylabel="height [m]", xticks=[],
             title="one period from apex to apex: both feet land, and lift off, at once")
    axes.spines["bottom"].set_visible(False)


def draw_section(axes, recording):
    """The section at the apex: regions of the selections, and runs that start there."""
    reach = max(abs(p) for p, _ in recording.landings)
    grid = numpy.linspace(-1.1 * reach, 1.1 * reach, 301)
    feet = [piece[0] for piece in recording.pieces()]
    cones = [piece[1] for piece in recording.pieces()]
    x, y = numpy.meshgrid(grid, grid)
    points = numpy.stack([x.ravel(), y.ravel()])
    margins = numpy.stack([numpy.min(cone @ points, axis=0) for cone in cones])
    best = numpy.array([foot != "left_foot" for foot in feet])[numpy.argmax(margins, axis=0)]
    axes.pcolormesh(x, y, best.reshape(x.shape).astype(float), cmap=REGIONS, vmin=0, vmax=1,
                    shading="auto", rasterized=True)
    for foot, colour, label in (("left_foot", LEFT, "left foot lands first"),
                                ("right_foot", RIGHT, "right foot lands first"),
                                ("", BOTH, "both at once")):
        chosen = numpy.array([p for p, f in recording.landings.items() if f == foot])
        if len(chosen):
            axes.plot(chosen[:, 0], chosen[:, 1], "o", ms=3, color=colour, label=label)
    axes.set(xlabel=r"pitch $\theta$ [rad]", ylabel=r"pitch rate $\dot\theta$ [rad/s]",
             xlim=(grid[0], grid[-1]), ylim=(grid[0], grid[-1]),
             title="section at the apex: selections of $DP$\n(shaded) and simulated runs (dots)")
    axes.legend(fontsize=7.5, loc="upper center", bbox_to_anchor=(0.5, -0.22), ncol=3, columnspacing=1,
                handletextpad=0.2, frameon=False)


def draw(recording, path):
    pyplot.rcParams.update({"font.size": 9, "axes.titlesize": 10, "mathtext.fontset": "dejavusans"})
    figure, (period, section) = pyplot.subplots(
        1, 2, figsize=(13, 3.6), gridspec_kw={"width_ratios": [2.5, 1]}, constrained_layout=True)
    draw_period(period, recording)
    draw_section(section, recording)
    for axes in (period, section):
        axes.spines["top"].set_visible(False)
        axes.spines["right"].set_visible(False)
    figure.savefig(path, dpi=130)


def main():
    if len(sys.argv) < 3 or not sys.argv[1].endswith(".png"):
        sys.exit(__doc__)
    recording = Recording(sys.argv[2:])
    print_table(recording)
    print(flush=True)
    draw(recording, sys.argv[1])


if __name__ == "__main__":
    main()
