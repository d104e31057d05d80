# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of an Ensemble, by matplotlib: outcomes over the starts, prediction beside truth, mode words.

Each function draws on `axes` (new ones unless given) and returns them.
"""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from .ensemble import Ensemble

#: Words or outcomes with a colour of their own; the rest is grey.
MAX_COLOURS = 10


def new_axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt
    return plt.subplots(figsize=(6.4, 4.4), constrained_layout=True)[1]


def labels_of(ensemble: Ensemble, by: Any) -> Any:
    """A text for each run: its outcome, its mode word, or what a function makes of the ensemble."""
    if callable(by):
        return np.asarray(by(ensemble))
    if by == "outcome":
        return ensemble.outcome_names()
    if by == "word":
        words = np.asarray(ensemble["words"]).astype(str)
        return np.where(words == "", ensemble.outcome_names(), words)
    raise ValueError("by is %r, expected 'outcome', 'word' or a function" % (by,))


def basin_map(ensemble: Ensemble, x: str, y: str, by: Any = "outcome", bins: int = 400, axes: Any = None,
              names: Optional[Dict[str, str]] = None) -> Any:
    """Which outcome, mode word or label from where, over two drawn numbers.

    Each cell has the colour of what most of its starts lead to; white cells had none. `names` are what
    the legend calls labels."""
    axes = new_axes(axes)
    start = ensemble["start"] if "start" in ensemble.columns else ensemble.draws()
    start = np.asarray(start)
    a, b = (start[:, ensemble.drawn.index(name)] for name in (x, y))
    labels = labels_of(ensemble, by)
    found, code, counts = np.unique(labels.astype(str), return_inverse=True, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    place = np.empty(len(found), dtype=int)
    place[order] = np.arange(len(found))
    shown = min(len(found), MAX_COLOURS)
    limits = [[float(a.min()), float(a.max())], [float(b.min()), float(b.max())]]
    layers = [np.histogram2d(a[chosen], b[chosen], bins=bins, range=limits)[0]
              for k in range(shown + (len(found) > shown))
              for chosen in [place[code] == k if k < shown else place[code] >= shown]]
    stack = np.stack(layers)
    best = np.where(stack.sum(axis=0) > 0, stack.argmax(axis=0), -1)
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch
    import matplotlib
    palette = list(matplotlib.colormaps["tab10"].colors)[:shown] + [(0.6, 0.6, 0.6)] * (len(found) > shown)
    masked: Any = np.ma
    axes.imshow(masked.masked_less(best.T, 0), origin="lower", aspect="auto", interpolation="nearest",
                extent=limits[0] + limits[1], cmap=ListedColormap(palette), vmin=-0.5, vmax=len(palette) - 0.5)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    legend = [Patch(color=palette[k], label="%s: %.3g %%" % (
        (names or {}).get(found[order[k]], found[order[k]]), 100 * counts[order[k]] / len(labels)))
        for k in range(shown)]
    if len(found) > shown:
        legend.append(Patch(color=palette[-1], label="%d others" % (len(found) - shown)))
    axes.legend(handles=legend, fontsize="small", loc="upper right")
    return axes


def predicted(ensemble: Ensemble, derivative: Any, name: str, count: int = 20000) -> Any:
    """B(w) of an observable for the first draws, by a derivative at the start without them.

    Every draw must be of the state: deviations w are those from x0."""
    system = ensemble.system
    x0 = np.array(ensemble.request["x0"])
    state, tangents = list(system.state_names), ensemble.names
    draws = ensemble.draws(0, min(count, ensemble.summary.runs))
    w = np.zeros((len(draws), derivative.shape[1]))
    for k, drawn in enumerate(ensemble.drawn):
        plain = drawn.lstrip("+")
        if plain not in tangents or (not drawn.startswith("+") and plain not in state):
            raise ValueError("'%s' is not of the state: the derivative by the state does not predict it" % drawn)
        offset = 0.0 if drawn.startswith("+") else x0[state.index(plain)]
        w[:, tangents.index(plain)] = draws[:, k] - offset
    return derivative(w)[:, tangents.index(name)]


def outcome_histogram(ensemble: Ensemble, name: str, derivative: Any = None, bins: int = 80,
                      axes: Any = None) -> Any:
    """The distribution of one observable, and beside it that which the B-derivative predicts."""
    axes = new_axes(axes)
    low, high = (ensemble.quantile(name, p) for p in (0.001, 0.999))
    edges = np.linspace(low, high if high > low else low + 1e-12, bins + 1)
    counted = [h["name"] for h in ensemble.request["histograms"]]
    if name in counted:
        counts, own = ensemble.histogram(name)
        edges = own[1:-1]
        density = counts[1:-1] / max(counts.sum(), 1) / np.diff(edges)
        axes.stairs(density, edges, fill=True, color="0.8", label="%d runs" % ensemble.summary.measured)
    else:
        x = np.asarray(ensemble["final_state"])[np.asarray(ensemble["outcome"]) == 0]
        if list(ensemble.system.state_names) != ensemble.names[:x.shape[1]]:
            raise ValueError("ask for a histogram of '%s': the states are not numbers alone" % name)
        index = ensemble.names.index(name)
        values = x[:, index] - ensemble.reference[index]
        axes.hist(values, edges, density=True, color="0.8", label="%d runs" % len(values))
    if derivative is not None:
        values = predicted(ensemble, derivative, name)
        density, _ = np.histogram(values, edges, density=False)
        axes.stairs(density / len(values) / np.diff(edges), edges, color="C3", label="B-derivative")
    axes.set_xlabel("%s, from the run without draws" % name)
    axes.set_ylabel("density")
    axes.legend(fontsize="small")
    return axes


def word_tree(ensemble: Ensemble, axes: Any = None, least: float = 0.002, arcs: int = 6) -> Any:
    """The modes that runs pass through, from left to right; widths are shares of the runs.

    The first `arcs` of them; branches with less than the share `least` are not drawn; what was cut off a
    long word is '~'."""
    axes = new_axes(axes)
    total = max(ensemble.summary.runs, 1)
    words: List[Tuple[Tuple[str, ...], float]] = [
        (tuple(word.split("~")[0].split(">")) + (("~",) if "~" in word else ()), count / total)
        for word, count in ensemble.words.items()]

    def draw(entries: Sequence[Tuple[Tuple[str, ...], float]], depth: int, bottom: float,
             parent: Optional[Tuple[float, float]]) -> None:
        children: Dict[str, List[Tuple[Tuple[str, ...], float]]] = {}
        for word, share in entries:
            if len(word) > depth and depth < arcs:
                children.setdefault(word[depth], []).append((word, share))
        ends = sum(share for word, share in entries if len(word) == depth or depth == arcs)
        bottom += ends   # runs that end here are below those that go on
        for letters, inside in sorted(children.items(), key=lambda item: -sum(s for _, s in item[1])):
            share = sum(s for _, s in inside)
            middle = bottom + share / 2
            if share >= least:
                axes.fill_between([depth - 0.12, depth + 0.12], bottom, bottom + share,
                                  color="C%d" % (depth % 10), alpha=0.35, linewidth=0)
                if share > 0.03:
                    axes.text(depth, middle, "%s %.0f %%" % (letters, 100 * share), ha="center", va="center",
                              fontsize=8)
                if parent is not None:
                    axes.plot([parent[0] + 0.12, depth - 0.12], [parent[1], middle], color="0.5",
                              linewidth=0.5 + 6 * share)
                draw(inside, depth + 1, bottom, (depth, middle))
            bottom += share
    draw(words, 0, 0.0, None)
    axes.set_xlabel("arc")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_ylabel("share of the runs")
    axes.set_ylim(0, 1)
    return axes
