# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of an Ensemble, by matplotlib: outcomes over the starts, prediction beside truth, mode words.

Each function draws on `axes` (new ones unless given) and returns them.
"""
from __future__ import annotations

from typing import Any, Dict, Optional

import numpy as np

from .ensemble import Ensemble
from .ensemble_shapes import basin, distribution, predicted, word_branches

__all__ = ["basin_map", "outcome_histogram", "predicted", "word_tree"]


def new_axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt
    return plt.subplots(figsize=(6.4, 4.4), constrained_layout=True)[1]


def basin_map(ensemble: Ensemble, x: str, y: str, by: Any = "outcome", bins: int = 400, axes: Any = None,
              names: Optional[Dict[str, str]] = None) -> Any:
    """Which outcome, mode word or label from where, over two drawn numbers.

    Each cell has the colour of what most of its starts lead to; white cells had none. `by` is 'outcome', 'word' or a
    function of the ensemble; `names` are what the legend calls labels."""
    axes = new_axes(axes)
    shape = basin(ensemble, x, y, by, bins)
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch
    import matplotlib
    tab10: Any = matplotlib.colormaps["tab10"]
    palette = list(tab10.colors)[:len(shape.labels)] + [(0.6, 0.6, 0.6)] * (shape.others > 0)
    masked: Any = np.ma
    axes.imshow(masked.masked_less(shape.cells.T, 0), origin="lower", aspect="auto", interpolation="nearest",
                extent=shape.limits[0] + shape.limits[1], cmap=ListedColormap(palette), vmin=-0.5,
                vmax=len(palette) - 0.5)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    legend = [Patch(color=palette[k], label="%s: %.3g %%" % ((names or {}).get(label, label), 100 * share))
              for k, (label, share) in enumerate(zip(shape.labels, shape.shares))]
    if shape.others:
        legend.append(Patch(color=palette[-1], label="%d others" % shape.others))
    axes.legend(handles=legend, fontsize="small", loc="upper right")
    return axes


def outcome_histogram(ensemble: Ensemble, name: str, derivative: Any = None, bins: int = 80,
                      axes: Any = None) -> Any:
    """The distribution of one observable, and beside it that which the B-derivative predicts."""
    axes = new_axes(axes)
    shape = distribution(ensemble, name, derivative, bins)
    axes.stairs(shape.density, shape.edges, fill=True, color="0.8", label="%d runs" % shape.runs)
    if shape.predicted is not None:
        axes.stairs(shape.predicted, shape.edges, color="C3", label="B-derivative")
    axes.set_xlabel("%s, from the run without draws" % name)
    axes.set_ylabel("density")
    axes.legend(fontsize="small")
    return axes


def word_tree(ensemble: Ensemble, axes: Any = None, least: float = 0.002, arcs: int = 6) -> Any:
    """The modes that runs pass through, from left to right; heights are shares of the runs.

    The first `arcs` of them; branches with less than the share `least` are not drawn; what was cut off a
    long word is '~'."""
    axes = new_axes(axes)
    for branch in word_branches(ensemble, least, arcs):
        middle = branch.bottom + branch.share / 2
        axes.fill_between([branch.arc - 0.12, branch.arc + 0.12], branch.bottom, branch.bottom + branch.share,
                          color="C%d" % (branch.arc % 10), alpha=0.35, linewidth=0)
        if branch.share > 0.03:
            axes.text(branch.arc, middle, "%s %.0f %%" % (branch.word, 100 * branch.share), ha="center", va="center",
                      fontsize=8)
        if branch.parent is not None:
            axes.plot([branch.arc - 0.88, branch.arc - 0.12], [branch.parent, middle], color="0.5",
                      linewidth=0.5 + 6 * branch.share)
    axes.set_xlabel("arc")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_ylabel("share of the runs")
    axes.set_ylim(0, 1)
    return axes
