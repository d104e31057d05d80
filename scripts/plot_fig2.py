#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""plot_fig2.py PNG BAG...: prints and draws Fig. 2 of the paper from the bag of fig2.py.

Nothing is computed here but what a picture needs: every number is a message of a bag.
"""
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as pyplot
import numpy
import rosbag

WALL_FIRST, RELEASE_FIRST, BOTH = "#0072b2", "#d55e00", "black"
MODES = {"{floor}": "#f0e6c8", "{floor, wall}": "#c6dcec", "{}": "#f6d5c2", "{wall}": "#dddddd"}
WINDOW = 0.45  # [s] around the simultaneous events
TIE = 1e-9     # [s]


class Run:
    """One recorded run: the setting of its clock, its events, its outcome."""

    def __init__(self, record, clock, nominal):
        result = record.result
        self.setting = record.request.state.q[clock] - nominal
        self.hit = next(t.t for t in result.transitions if "wall" in t.activated)
        self.release = next(t.t for t in result.transitions if "floor" in t.released)
        self.modes = ["{%s}" % ", ".join(arc.mode) for arc in result.arcs]
        self.end = numpy.array(result.final_q + result.final_v)
        self.arcs = []  # (mode, q [samples × d])
        q = numpy.array(result.q.data).reshape(result.q.rows, result.q.cols)
        for arc, mode in zip(result.arcs, self.modes):
            self.arcs.append((mode, q[arc.first_sample:arc.first_sample + arc.num_samples]))
        self.corners = [numpy.array(t.q) for t in result.transitions]

    def colour(self):
        if abs(self.hit - self.release) <= TIE:
            return BOTH
        return WALL_FIRST if self.hit < self.release else RELEASE_FIRST


class Recording:
    """What the bag says."""

    def __init__(self, paths):
        self.runs, self.trajectories, self.derivatives = [], [], []
        for path in paths:
            with rosbag.Bag(path) as bag:
                for _, message, _ in bag.read_messages():
                    self.add(message._type.split("/")[1], message)
        self.runs.sort(key=lambda run: run.setting)
        self.nominal = min(self.runs, key=lambda run: abs(run.setting))

    def add(self, kind, message):
        if kind == "ModelDescription":
            self.coordinates = list(message.coordinates)
            self.clock = self.coordinates.index("clock")
            self.start = message.nominal_q[self.clock]
        elif kind == "SimulationRecord":
            runs = self.runs if message.request.samples == 1 else self.trajectories
            runs.append(Run(message, self.clock, self.start))
        elif kind == "DerivativeRecord":
            self.derivatives.append(message)
            self.duration = message.result.duration
        elif kind == "ComparisonRecord":
            self.comparisons = message.result.comparisons

    def nominal_trajectory(self):
        return min(self.trajectories, key=lambda run: abs(run.setting))

    def slopes(self, record):
        """[2×2d] d x(T) by an increase of the setting, from the right and from the left."""
        rows = numpy.array(record.result.derivatives.data).reshape(2, -1)
        return rows * [[1], [-1]]

    def at_zero(self):
        return next(d for d in self.derivatives if not d.request.state.q)

    def beside_zero(self):
        """[(setting, mode sequence, d x(T))] of derivatives where the events have an order."""
        for record in self.derivatives:
            if record.request.state.q:
                modes = ["{%s}" % ", ".join(m.active) for m in record.result.modes]
                yield (record.request.state.q[self.clock] - self.start, " ".join(modes),
                       self.slopes(record)[0])


## Numbers

def print_table(recording):
    print("\nwall_and_floor, T = %g s\n%12s %12s %12s   contact modes" %
          (recording.duration, "clock [s]", "hits at [s]", "lets go [s]"))
    count = len(recording.runs)
    for i, run in enumerate(recording.runs):
        if i in (0, count - 1) or abs(i - count // 2) <= 1:
            print("%12.6g %12.8f %12.8f   %s" %
                  (run.setting, run.hit, run.release, " ".join(run.modes)))
    at_zero = recording.at_zero()
    right, left = recording.slopes(at_zero)
    print("derivative at 0: %s piece%s, right and left differ by %.1e" %
          (len(at_zero.result.pieces), "s" if len(at_zero.result.pieces) > 1 else "",
           numpy.max(numpy.abs(right - left))))
    for setting, modes, slope in recording.beside_zero():
        print("derivative at %+.0e s, %s: differs by %.1e from that at 0" %
              (setting, modes, numpy.max(numpy.abs(slope - right))))
    for comparison in recording.comparisons:
        print("quotients %s: errors %s, falling with power %.3f" %
              (comparison.name, " ".join("%.1e" % e for e in comparison.errors), comparison.slope))


## Figure

def draw_states(axes, recording):
    """Trajectories around the state where the guard surfaces meet, coloured by their order."""
    i, j = recording.coordinates.index("x"), recording.clock
    for run in recording.trajectories:
        for mode, q in run.arcs:
            axes.plot(q[:, i], q[:, j], color=run.colour(), lw=1.3, alpha=0.85,
                      ls="-" if "floor" in mode else (0, (4, 2)))
        for corner in run.corners:
            axes.plot(corner[i], corner[j], "o", ms=3, color=run.colour(), zorder=4)
    releases = numpy.array([[c[i], c[j]] for run in recording.trajectories for c in run.corners
                            if run.hit >= run.release - TIE and c is run.corners[0]])
    order = numpy.argsort(releases[:, 0])
    axes.plot(releases[order, 0], releases[order, 1], color="0.45", lw=1, zorder=1)
    axes.text(*(releases[order][-1] + [0.01, 0.03]), r"$\lambda_\mathrm{floor} = 0$", color="0.35",
              ha="left", va="bottom")
    _, q = recording.nominal_trajectory().arcs[0]
    middle = numpy.searchsorted(-q[:, i], -0.2)
    axes.annotate("", q[middle + 1, [i, j]], q[middle, [i, j]],
                  arrowprops={"arrowstyle": "-|>", "color": BOTH, "lw": 1.3})
    for colour, style, label in ((WALL_FIRST, "-", "hits first"),
                                 (RELEASE_FIRST, "-", "leaves first"),
                                 ("0.4", (0, (4, 2)), "off the floor")):
        axes.plot([], [], color=colour, ls=style, label=label)
    axes.legend(fontsize=7.5, frameon=False, loc="upper right", handlelength=1.6)
    axes.axvline(0, color="0.25", lw=3, zorder=1)
    axes.text(-0.015, -0.44, r"$a_\mathrm{wall} = 0$", color="0.35", rotation=90, ha="right",
              va="bottom")
    axes.set(xlim=(-0.06, 0.52), ylim=(-0.45, 0.45), xlabel="distance $x$ to the wall [m]",
             ylabel="clock [s]", title="trajectories near the event")


def draw_modes(axes, recording):
    """Which contact mode holds when: four modes meet where both events coincide."""
    s = numpy.array([run.setting for run in recording.runs])
    hit = numpy.array([run.hit for run in recording.runs])
    release = numpy.array([run.release for run in recording.runs])
    first, last = numpy.minimum(hit, release), numpy.maximum(hit, release)
    t = recording.nominal.hit
    bottom, top = t - WINDOW, t + WINDOW
    axes.fill_between(s, bottom, first, color=MODES["{floor}"], lw=0)
    axes.fill_between(s, last, top, color=MODES["{wall}"], lw=0)
    axes.fill_between(s, first, last, where=hit <= release, color=MODES["{floor, wall}"], lw=0)
    axes.fill_between(s, first, last, where=hit >= release, color=MODES["{}"], lw=0)
    axes.plot(s, hit, color="0.25", lw=1.6, label="hits the wall")
    axes.plot(s, release, color="0.25", lw=1.6, ls="--", label="leaves the floor")
    axes.plot(0, t, "o", ms=6, color=BOTH, zorder=4)
    reach = s[-1]
    for x, y, mode in ((0, t - 0.7 * WINDOW, "{floor}"), (0, t + 0.6 * WINDOW, "{wall}"),
                       (-0.68 * reach, t + 0.09, "{floor, wall}")):
        axes.text(x, y, mode, ha="center", va="center")
    axes.annotate("{}", (0.8 * reach, (first + last)[int(0.9 * (len(s) - 1))] / 2),
                  (0.8 * reach, t - 0.2), ha="center",
                  arrowprops={"arrowstyle": "-", "color": "0.25", "lw": 0.8})
    axes.set(xlim=(s[0], reach), ylim=(bottom, top), xlabel=r"setting $\alpha$ of the clock [s]",
             ylabel="time [s]", title="contact modes of perturbed runs")
    axes.legend(fontsize=7.5, frameon=False, loc="upper right")


def draw_outcome(axes, recording):
    """One coordinate of the outcome: the slope at 0 is the same from both sides."""
    right, _ = recording.slopes(recording.at_zero())
    change = numpy.array([run.end - recording.nominal.end for run in recording.runs])
    k = recording.coordinates.index("y")
    s = numpy.array([run.setting for run in recording.runs])
    for colour, label, side in ((WALL_FIRST, "hits first", s <= 0),
                                (RELEASE_FIRST, "leaves first", s >= 0)):
        axes.plot(s[side], change[side, k], color=colour, lw=1.8, label=label)
    axes.plot(s, right[k] * s, "--", color=BOTH, lw=1,
              label="slope %.4f by the derivative,\neither order" % right[k])
    axes.plot(0, 0, "o", ms=6, color=BOTH, zorder=4)
    axes.set(xlabel=r"setting $\alpha$ of the clock [s]",
             ylabel="change of the height $y(%g\\,$s$)$ [m]" % recording.duration,
             title="outcome: one derivative")
    axes.grid(True, color="0.9", lw=0.7)
    axes.set_axisbelow(True)
    axes.legend(fontsize=8, frameon=False, loc="upper left")


def draw(recording, path):
    pyplot.rcParams.update({"font.size": 9, "axes.titlesize": 10, "mathtext.fontset": "dejavusans"})
    figure, panels = pyplot.subplots(1, 3, figsize=(11, 3.6), constrained_layout=True)
    for axes, panel in zip(panels, (draw_states, draw_modes, draw_outcome)):
        panel(axes, recording)
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
