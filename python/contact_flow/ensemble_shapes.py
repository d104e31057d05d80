# SPDX-License-Identifier: BSD-3-Clause
"""What pictures of an Ensemble are made of, as numbers: for matplotlib (ensemble_plots) and for the report of a run."""
from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .ensemble import Ensemble

Array = Any
#: Words or outcomes with a colour of their own; the rest is one.
MAX_COLOURS = 10
NOT_RUN = -3   #: code of an outcome


class Unmeasured(ValueError):
    """An observable that is in no column."""


class Basin(NamedTuple):
    """Which label most starts of a cell lead to. cells: [bins × bins] its place in labels, the first index along x;
    len(labels) for the others, −1 where no start is. shares: of all runs. limits: of x and of y."""
    labels: List[str]
    shares: List[float]
    others: int
    cells: Array
    limits: List[List[float]]


class Distribution(NamedTuple):
    """Densities of one observable between edges, and what the B-derivative predicts of it."""
    edges: Array
    density: Array
    runs: int
    predicted: Optional[Array]


class Branch(NamedTuple):
    """Runs that have passed the same modes so far: which arc, from where to where as shares, and the middle of the
    branch that they come from."""
    arc: int
    bottom: float
    share: float
    word: str
    parent: Optional[float]


def labels_of(ensemble: Ensemble, by: Any) -> Array:
    """A text for each run: its outcome, its mode word, or what a function makes of the ensemble."""
    if callable(by):
        return np.asarray(by(ensemble))
    if by == "outcome":
        return ensemble.outcome_names()
    if by == "word":
        words = np.asarray(ensemble["words"]).astype(str)
        return np.where(words == "", ensemble.outcome_names(), words)
    raise ValueError("by is %r, expected 'outcome', 'word' or a function" % (by,))


def basin(ensemble: Ensemble, x: str, y: str, by: Any, bins: int) -> Basin:
    """Over two drawn numbers, from all runs."""
    labels = labels_of(ensemble, by).astype(str)
    start = np.asarray(ensemble["start"] if "start" in ensemble.columns else ensemble.draws(0, len(labels)))
    if "outcome" in ensemble.columns:   # of a store in which chunks are missing
        done = np.asarray(ensemble["outcome"]) != NOT_RUN
        labels, start = labels[done], start[done]
    for name in (x, y):
        if name not in ensemble.drawn:
            raise ValueError("'%s' is not drawn; there are %s" % (name, ", ".join(ensemble.drawn)))
    a, b = (start[:, ensemble.drawn.index(name)] for name in (x, y))
    found, code, counts = np.unique(labels, return_inverse=True, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    place = np.empty(len(found), dtype=int)
    place[order] = np.arange(len(found))
    shown = min(len(found), MAX_COLOURS)
    limits = [widened(a), widened(b)]
    layers = [np.histogram2d(a[chosen], b[chosen], bins=bins, range=limits)[0]
              for k in range(shown + (len(found) > shown))
              for chosen in [place[code] == k if k < shown else place[code] >= shown]]
    stack = np.stack(layers) if layers else np.zeros((1, bins, bins))
    cells = np.where(stack.sum(axis=0) > 0, stack.argmax(axis=0), -1)
    return Basin([str(found[k]) for k in order[:shown]], [float(counts[k]) / max(len(a), 1) for k in order[:shown]],
                 len(found) - shown, cells, limits)


def widened(values: Array) -> List[float]:
    """Lowest and highest, apart even where they are one."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    if high > low:
        return [low, high]
    room = max(abs(low), 1e-9) * 1e-3
    return [low - room, high + room]


def predicted(ensemble: Ensemble, derivative: Any, name: str, count: int = 20000) -> Array:
    """B(w) of an observable for the first draws, by a derivative at the start without them.

    Every draw must be of the state: deviations w are those from x0."""
    system = ensemble.system
    x0 = np.array(ensemble.request["x0"])
    state, tangents = list(system.state_names), ensemble.names
    draws = ensemble.draws(0, min(count, ensemble.summary.runs))
    w = np.zeros((len(draws), derivative.shape[1]))
    for k, drawn in enumerate(ensemble.drawn):
        plain = drawn[1:] if drawn.startswith("+") else drawn
        if plain not in tangents or (not drawn.startswith("+") and plain not in state):
            raise ValueError("'%s' is not of the state: the derivative by the state does not predict it" % drawn)
        offset = 0.0 if drawn.startswith("+") else x0[state.index(plain)]
        w[:, tangents.index(plain)] = draws[:, k] - offset
    return derivative(w)[:, tangents.index(name)]


def distribution(ensemble: Ensemble, name: str, derivative: Any = None, bins: int = 80) -> Distribution:
    """By its histogram where one was asked for, else from the final states."""
    if name in [axis["name"] for axis in ensemble.request["histograms"]]:
        counts, own = ensemble.histogram(name)
        edges, inside, measured = own[1:-1], counts[1:-1], int(counts.sum())
    else:
        low, high = widened(np.array([ensemble.quantile(name, p) for p in (0.001, 0.999)]))
        edges = np.linspace(low, high, bins + 1)
        values = measured_values(ensemble, name)
        inside, measured = np.histogram(values, edges)[0], len(values)
    density = inside / max(measured, 1) / np.diff(edges)
    guess = None
    if derivative is not None:
        values = predicted(ensemble, derivative, name)
        guess = np.histogram(values, edges)[0] / max(len(values), 1) / np.diff(edges)
    return Distribution(edges, density, ensemble.summary.measured, guess)


def measured_values(ensemble: Ensemble, name: str) -> Array:
    """Of an observable, from the columns."""
    ok = np.asarray(ensemble["outcome"]) == 0
    index = ensemble.names.index(name)
    velocities = len(ensemble.system.velocities)
    if index >= 2 * velocities:
        return np.asarray(ensemble["costs"])[ok, index - 2 * velocities]
    x = np.asarray(ensemble["final_state"])[ok]
    if list(ensemble.system.state_names) != ensemble.names[:x.shape[1]]:
        raise Unmeasured("ask for a histogram of '%s': the states are not numbers alone" % name)
    return x[:, index] - ensemble.reference[index]


def word_branches(ensemble: Ensemble, least: float, arcs: int) -> List[Branch]:
    """The modes that runs pass through. Branches with less than the share `least` are left out; what was cut off a
    long word is '~'."""
    total = max(ensemble.summary.runs, 1)
    words: List[Tuple[Tuple[str, ...], float]] = [
        (tuple(word.split("~")[0].split(">")) + (("~",) if "~" in word else ()), count / total)
        for word, count in ensemble.words.items()]
    found: List[Branch] = []

    def grow(entries: Sequence[Tuple[Tuple[str, ...], float]], arc: int, bottom: float,
             parent: Optional[float]) -> None:
        children: Dict[str, List[Tuple[Tuple[str, ...], float]]] = {}
        for word, share in entries:
            if len(word) > arc and arc < arcs:
                children.setdefault(word[arc], []).append((word, share))
        # Runs that end here are below those that go on.
        bottom += sum(share for word, share in entries if len(word) == arc or arc == arcs)
        for letters, inside in sorted(children.items(), key=lambda item: (-sum(s for _, s in item[1]), item[0])):
            share = sum(s for _, s in inside)
            if share >= least:
                found.append(Branch(arc, bottom, share, letters, parent))
                grow(inside, arc + 1, bottom, bottom + share / 2)
            bottom += share
    grow(words, 0, 0.0, None)
    return found
