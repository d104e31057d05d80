#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""plot_fig1.py PNG BAG...: prints and draws Fig. 1 of the paper from the bags of fig1.py.

Nothing is computed here but what a picture needs: every number is a message of a bag.
"""
import itertools
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as pyplot
import numpy
import rosbag

BESIDE_ZERO = 1e-4  # [rad] runs with initial pitches nearer to 0 are printed
LEFT_FIRST, RIGHT_FIRST, BOTH = "#0072b2", "#d55e00", "black"


class Family:
    """What the bags of one model say: its outcomes θ(T), and the derivative or the limits at 0."""

    def __init__(self):
        self.runs = []            # (θ(0) [rad], θ(T) [rad], contact modes)
        self.limits = []          # θ(T) [rad] after each order of touchdowns
        self.derivative = None    # OutcomeDerivative
        self.comparisons = []     # DirectionComparison, along the family and against it

    def add(self, kind, message):
        if kind == "ModelDescription":
            self.model = message.name
            self.pitch = message.coordinates.index("body_pitch")
        elif kind == "SimulationRecord" and message.request.state.v:
            self.limits.append(message.result.final_q[self.pitch])
        elif kind == "SimulationRecord" and message.request.state.q:
            self.add_run(message.request, message.result)
        elif kind == "DerivativeRecord":
            self.derivative = message.result
            self.duration = message.result.duration
        elif kind == "ComparisonRecord":
            self.comparisons = message.result.comparisons

    def add_run(self, request, result):
        modes = ["{%s}" % ", ".join(arc.mode).replace("_foot", "") for arc in result.arcs]
        self.runs.append((request.state.q[self.pitch], result.final_q[self.pitch], " ".join(modes)))

    def curves(self, sign):
        """(θ(0), θ(T), number of touchdowns) on one side of 0, one a mode sequence."""
        side = sorted((run for run in self.runs if sign * run[0] > 0), key=lambda run: abs(run[0]))
        last = []  # where one curve ends the next begins
        for modes, group in itertools.groupby(side, key=lambda run: run[2]):
            points = last + [run[:2] for run in group]
            last = points[-1:]
            yield numpy.array(points).T[0], numpy.array(points).T[1], modes.count("{") - 1

    def one_sided_limits(self):
        """(first foot to land, θ(T)), when the outcome is discontinuous at 0."""
        return [(order.order[0], limit)
                for order, limit in zip(self.derivative.orders, self.limits)]

    def at_zero(self):
        return next(run[1] for run in self.runs if run[0] == 0)

    def slope(self, sign):
        """One-sided slope of θ(T) over θ(0): right of 0 it is B(w), left of it −B(−w)."""
        rows = numpy.array(self.derivative.derivatives.data).reshape(2, -1)
        return sign * rows[0 if sign > 0 else 1][self.pitch]

    def quotients(self, sign):
        """[(α, quotient of θ(T), largest error in (q, v))], and the power of α it falls with."""
        c = self.comparisons[0 if sign > 0 else 1]
        rows = numpy.array(c.quotients.data).reshape(len(c.alphas), -1)
        return zip(c.alphas, sign * rows[:, self.pitch], c.errors), c.slope


def read(paths):
    """{model: Family}; a long recording is in several bags, each begins with the model."""
    families = {}
    for path in paths:
        with rosbag.Bag(path) as bag:
            for _, message, _ in bag.read_messages():
                kind = message._type.split("/")[1]
                if kind.startswith("Recording"):  # its start, and the links of its chain
                    continue
                if kind == "ModelDescription":
                    family = families.setdefault(message.name, Family())
                family.add(kind, message)
    return families


## Numbers

def print_table(family):
    print("\n%s, T = %g s\n%14s %14s   contact modes" %
          (family.model, family.duration, "θ(0) [rad]", "θ(T) [rad]"))
    count = len(family.runs)
    for i, (start, end, modes) in enumerate(sorted(family.runs)):
        if i in (0, count // 4, count - 1 - count // 4, count - 1) or abs(start) < BESIDE_ZERO:
            print("%14.6g %14.8f   %s" % (start, end, modes))
    for foot, limit in family.one_sided_limits():
        print("%14s %14.8f   limit, by the order that begins with %s" %
              ("0+" if foot == "left_foot" else "0-", limit, foot))
    if family.limits:
        print("no derivative at θ(0) = 0: " + family.derivative.message)
    for sign, side in ((-1, "left"), (1, "right")) if family.comparisons else ():
        samples, power = family.quotients(sign)
        print("slope dθ(T)/dθ(0) at 0 from the %s: %.8f by the B-derivative" %
              (side, family.slope(sign)))
        for alpha, quotient, error in samples:
            print("  perturbed by %.0e rad %14.8f   largest error in (q, v): %.1e" %
                  (alpha, quotient, error))
        print("  the error falls as the perturbation to the power %.3f" % power)


## Figure

def draw_outcomes(axes, family):
    for sign, colour, label in ((1, LEFT_FIRST, "left foot lands first"),
                                (-1, RIGHT_FIRST, "right foot lands first")):
        for start, end, touchdowns in family.curves(sign):
            both = touchdowns > 1
            axes.plot(start, end, "-", color=colour, lw=1.8, alpha=1 if both else 0.45,
                      label=label if both else label.replace("lands first", "only"))


def draw_rigid(axes, family):
    draw_outcomes(axes, family)
    for foot, limit in family.one_sided_limits():
        colour = LEFT_FIRST if foot == "left_foot" else RIGHT_FIRST
        axes.plot(0, limit, "o", ms=6, mfc="white", mec=colour, mew=1.5, zorder=4)
    axes.plot(0, family.at_zero(), "o", ms=6, color=BOTH, zorder=4, ls="none",
              label="both land at once")
    axes.set_title("rigid legs: discontinuous", fontsize=10)


def draw_soft(axes, family):
    draw_outcomes(axes, family)
    reach = 0.75 * max(run[0] for run in family.runs)
    for sign, colour in ((1, LEFT_FIRST), (-1, RIGHT_FIRST)):
        ends = numpy.array([-0.25, 1]) * sign * reach
        axes.plot(ends, family.at_zero() + family.slope(sign) * ends, "--", color=colour, lw=1.1,
                  label="slope %.4f by the B-derivative" % family.slope(sign))
    axes.plot(0, family.at_zero(), "o", ms=6, color=BOTH, zorder=4)
    axes.set_title("soft legs: continuous, piecewise differentiable", fontsize=10)


def draw_body(axes, soft, pitch=0.3):
    """A sketch of the model, drawn with positive pitch."""
    c, s = numpy.cos(pitch), numpy.sin(pitch)

    def line(points, **style):
        x, z = numpy.array(points, float).T
        axes.plot(c * x - s * z, s * x + c * z, color="0.25", solid_capstyle="round", **style)

    for hip in (-1, 1):
        if soft:
            heights = numpy.concatenate([[0, -0.3], numpy.linspace(-0.4, -1.3, 9), [-1.4, -1.8]])
            wiggle = numpy.array([0, 0] + [0.16 * (-1) ** k for k in range(9)] + [0, 0])
            line(numpy.column_stack([hip + wiggle, heights]), lw=1)
        else:
            line([[hip, 0], [hip, -1.8]], lw=1.5)
        line([[hip, -1.8]], marker="o", ms=4)
    line([[-1.25, 0], [1.25, 0]], lw=5)
    axes.axhline(-2.6, color="0.25", lw=1)
    axes.plot([0, 1.7], [0, 0], ":", color="0.25", lw=1)
    axes.text(1.65, 0.12, r"$\theta$", fontsize=10, color="0.25")
    axes.set(xlim=(-2.2, 2.2), ylim=(-2.8, 0.9), aspect="equal")
    axes.axis("off")


def draw(families, path):
    pyplot.rcParams.update({"font.size": 9, "mathtext.fontset": "dejavusans"})
    figure, panels = pyplot.subplots(1, 2, figsize=(8.4, 3.7), constrained_layout=True)
    for axes, (model, draw_model) in zip(panels, (("rigid_biped", draw_rigid),
                                                  ("soft_biped", draw_soft))):
        family = families[model]
        draw_model(axes, family)
        axes.set_xlabel(r"initial pitch $\theta(0)$ [rad]")
        axes.set_ylabel(r"outcome: pitch $\theta(%g\,\mathrm{s})$ [rad]" % family.duration)
        axes.grid(True, color="0.9", lw=0.7)
        axes.set_axisbelow(True)
        axes.spines["top"].set_visible(False)
        axes.spines["right"].set_visible(False)
    draw_body(panels[0].inset_axes([0.16, 0.02, 0.28, 0.31]), soft=False)
    draw_body(panels[1].inset_axes([0.68, 0.02, 0.28, 0.31]), soft=True)
    panels[0].set_ylim(top=0.155)  # room for the legend
    panels[0].legend(fontsize=8, frameon=False, loc="upper right", handlelength=1.6)
    panels[1].legend(fontsize=8, frameon=False, loc="upper left")
    figure.savefig(path, dpi=180)


def main():
    if len(sys.argv) < 4 or not sys.argv[1].endswith(".png"):
        sys.exit(__doc__)
    families = read(sys.argv[2:])
    for family in families.values():
        print_table(family)
    print(flush=True)
    draw(families, sys.argv[1])


if __name__ == "__main__":
    main()
