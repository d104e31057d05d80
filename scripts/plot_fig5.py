#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""plot_fig5.py PNG BAG...: prints and draws friction from the bags of fig5.py.

Left, the force between block and floor and its cone over time, with the letters of the contact: s sticks, + and - slips
forward and backward. Right, the limit cycle of a compass walker in the plane of each leg, a run from beside it, and the
eigenvalues of its step.
"""
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as pyplot
import numpy
import rosbag

LETTERS = {"s": "#009e73", "+": "#0072b2", "-": "#d55e00"}
LEGS = {"left_leg": "#0072b2", "right_leg": "#d55e00"}
STILL = 1e-9  # [m/s] slower than this it sticks


def matrix(message):
    return numpy.array(message.data).reshape(message.rows, message.cols)


class Bag:
    """Parameters, and the results by their kind."""

    def __init__(self, path):
        self.results = {}
        with rosbag.Bag(path) as bag:
            for _, message, _ in bag.read_messages():
                kind = message._type.split("/")[1]
                if kind == "ModelDescription":
                    self.model = message.name
                    self.parameters = {p.name: p.value for p in message.parameters}
                elif kind.endswith("Record"):
                    self.results[kind] = message.result
        self.run = self.results["SimulationRecord"]
        self.t = numpy.array(self.run.t)
        self.q = matrix(self.run.q)
        self.v = matrix(self.run.v)


class Block(Bag):
    """Forces between block and floor, from its equation of motion."""

    def forces(self):
        """(letters of the arcs, normal force, tangential force) at the samples."""
        p = self.parameters
        x, clock, speed = self.q[:, 0], self.q[:, 2], self.v[:, 0]
        weight = p["mass"] * p["gravity"]
        drive = weight * numpy.sin(p["incline"]) - p["stiffness"] * x + \
            p["amplitude"] * numpy.sin(p["frequency"] * clock + p["phase"])
        normal = weight * numpy.cos(p["incline"]) - \
            p["normal_amplitude"] * numpy.sin(p["normal_frequency"] * clock)
        tangential = -drive
        letters = []
        for arc in self.run.arcs:
            rows = slice(arc.first_sample, arc.first_sample + arc.num_samples)
            fastest = speed[rows][numpy.argmax(numpy.abs(speed[rows]))]
            letter = "s" if abs(fastest) < STILL else "+" if fastest > 0 else "-"
            if letter != "s":
                tangential[rows] = -numpy.sign(fastest) * p["friction"] * normal[rows]
            letters.append(letter)
        return letters, normal, tangential


def print_block(block):
    letters, normal, tangential = block.forces()
    cone = block.parameters["friction"] * normal
    print("block: %s, events at %s s" % ("".join(letters), ", ".join(
        "%.6f" % t.t for t in block.run.transitions)))
    print("block: the force leaves its cone by %.1e N at most" %
          max(0, numpy.max(numpy.abs(tangential) - cone)))


def print_walker(walker):
    step, verdict = walker.results["PoincareRecord"], walker.results["StabilityRecord"]
    values = eigenvalues(step)
    print("walker: period %.9f s, |P(x) - x| = %.1e" % (step.time, step.distance))
    print("walker: eigenvalues %s" % ", ".join(
        "%.6f%+.6fi" % (z.real, z.imag) if z.imag else "%.6f" % z.real for z in values))
    print("walker: %s (%s, %s)" % (verdict.message, verdict.test,
                                   "verified" if verdict.verified else "NOT VERIFIED"))


def eigenvalues(step):
    values = numpy.linalg.eigvals(matrix(step.reduced[0].matrix))
    return sorted(values, key=lambda z: (-round(abs(z), 6), -z.imag))


## Figure

def draw_block(axes, block):
    letters, normal, tangential = block.forces()
    cone = block.parameters["friction"] * normal
    axes.fill_between(block.t, -cone, cone, color="0.92", lw=0, label=r"cone $|\lambda_t|\leq\mu\lambda_n$")
    top = 1.15 * numpy.max(cone)
    for arc, letter in zip(block.run.arcs, letters):
        rows = slice(arc.first_sample, arc.first_sample + arc.num_samples)
        axes.plot(block.t[rows], tangential[rows], color=LETTERS[letter], lw=1.8)
        axes.text((arc.t_begin + arc.t_end) / 2, top, letter, color=LETTERS[letter], ha="center",
                  va="center", fontsize=11, family="monospace")
        axes.axvline(arc.t_end, color="0.8", lw=0.6, zorder=0)
    axes.set(xlabel="t [s]", ylabel=r"$\lambda_t$ [N]", title="a block that sticks and slips",
             ylim=(-1.05 * numpy.max(cone), 1.25 * numpy.max(cone)))
    axes.legend(fontsize=7, frameon=False, loc="center right")


def draw_walker(axes, walker):
    names = list(walker.run.coordinates)
    step = walker.results["PoincareRecord"]
    for leg, colour in LEGS.items():
        i = names.index(leg)
        for arc in walker.run.arcs:
            rows = slice(arc.first_sample, arc.first_sample + arc.num_samples)
            late = arc.t_end > walker.run.t_end - 2.2 * step.time
            axes.plot(walker.q[rows, i], walker.v[rows, i], color=colour, lw=1.8 if late else 0.6,
                      alpha=1 if late else 0.35, label=leg.replace("_", " ") if arc is walker.run.arcs[-1] else None)
    axes.set(xlabel=r"$\theta$ [rad]", ylabel=r"$\dot\theta$ [rad/s]",
             title="a compass walker finds its gait")
    axes.legend(fontsize=7, frameon=False, loc="upper right")


def draw_circle(axes, walker):
    angles = numpy.linspace(0, 2 * numpy.pi, 181)
    axes.plot(numpy.cos(angles), numpy.sin(angles), color="0.7", lw=0.8)
    values = eigenvalues(walker.results["PoincareRecord"])
    axes.plot([z.real for z in values], [z.imag for z in values], "o", color="black", ms=4)
    for z in values:
        text = "%.4f" % z.real + (" %s %.4f i" % ("+" if z.imag > 0 else "−", abs(z.imag)) if z.imag else "")
        axes.annotate(text, (z.real, z.imag), (5, 5), textcoords="offset points", fontsize=7)
    axes.axhline(0, color="0.9", lw=0.7, zorder=0)
    axes.axvline(0, color="0.9", lw=0.7, zorder=0)
    axes.set(aspect="equal", title="eigenvalues of a step", xlim=(-1.1, 1.1), ylim=(-1.1, 1.1))


def main():
    if len(sys.argv) < 3 or not sys.argv[1].endswith(".png"):
        sys.exit(__doc__)
    pyplot.rcParams.update({"font.size": 9, "axes.titlesize": 10, "mathtext.fontset": "dejavusans"})
    figure, panels = pyplot.subplots(1, 3, figsize=(13, 3.8), constrained_layout=True,
                                     gridspec_kw={"width_ratios": [1.5, 1.2, 1]})
    for path in sys.argv[2:]:
        bag = Bag(path)
        if bag.model == "block_on_incline":
            block = Block(path)
            print_block(block)
            draw_block(panels[0], block)
        else:
            print_walker(bag)
            draw_walker(panels[1], bag)
            draw_circle(panels[2], bag)
    for axes in panels:
        axes.spines["top"].set_visible(False)
        axes.spines["right"].set_visible(False)
    print(flush=True)
    figure.savefig(sys.argv[1], dpi=130)


if __name__ == "__main__":
    main()
