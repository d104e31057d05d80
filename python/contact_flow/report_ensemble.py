# SPDX-License-Identifier: BSD-3-Clause
"""An ensemble in the report of a run: where which outcome comes from, distributions beside prediction, mode words."""
from __future__ import annotations

from typing import Any, Dict, List, Tuple

import numpy as np

from . import _core
from .ensemble import Ensemble
from .ensemble_shapes import Unmeasured, basin, distribution, word_branches

MAX_BINS = 120  #: of the map, each way
MAX_OBSERVABLES = 40  #: whose distributions are drawn


def digits(values: Any) -> List[float]:
    """With five digits."""
    listed: Any = np.asarray(values).tolist()
    return [float("%.5g" % value) for value in listed]


def prediction_of(ensemble: Ensemble, run: _core.Run) -> Tuple[Any, str]:
    """(the derivative that predicts it or None, what is said of that)."""
    if not np.array_equal(run.x0, ensemble.request["x0"]):
        return None, "Nothing is predicted: the run of this page has another start than the ensemble's without draws."
    derivative = run.derivative()
    if not derivative.status:
        return None, "Nothing is predicted: there is no derivative, %s." % derivative.status.message
    return derivative, "The line is what the B-derivative of this run predicts, to first order."


def distributions(ensemble: Ensemble, derivative: Any) -> List[Dict[str, Any]]:
    found: List[Dict[str, Any]] = []
    for k, name in enumerate(ensemble.names):
        if len(found) == MAX_OBSERVABLES or not ensemble.summary.smallest[k] < ensemble.summary.largest[k]:
            continue
        asked = name in [axis["name"] for axis in ensemble.request["histograms"]]
        if not asked and not {"final_state", "outcome"} <= set(ensemble.columns):
            continue
        is_cost = k >= 2 * len(ensemble.system.velocities)
        try:
            shape = distribution(ensemble, name, None if is_cost else derivative, 60)
        except Unmeasured:   # rotations have no column
            continue
        found.append({"name": name, "edges": digits(shape.edges), "density": digits(shape.density),
                      "predicted": None if shape.predicted is None else digits(shape.predicted)})
    return found


def section(run: _core.Run, ensemble: Ensemble) -> Dict[str, Any]:
    """What the page draws of it."""
    if ensemble.system.name != run.system.name:
        raise ValueError("the ensemble is of '%s', the run of '%s'" % (ensemble.system.name, run.system.name))
    counts = ", ".join("%s %d" % item for item in sorted(ensemble.outcomes.items(), key=lambda item: -item[1]))
    data: Dict[str, Any] = {"summary": "%d runs, drawn: %s. %s." % (
        ensemble.summary.runs, ", ".join(ensemble.drawn) or "nothing", counts)}
    derivative, data["prediction"] = prediction_of(ensemble, run)
    try:
        data["distributions"] = distributions(ensemble, derivative)
    except ValueError as reason:   # something else than the state is drawn
        data["distributions"], data["prediction"] = distributions(ensemble, None), "Nothing is predicted: %s." % reason
    drawn = [name[1:] if name.startswith("+") else name for name in ensemble.drawn]
    data["chosen"] = next((k for k, one in enumerate(data["distributions"]) if one["name"] in drawn), 0)
    data["branches"] = [{"arc": b.arc, "bottom": b.bottom, "share": b.share, "word": b.word, "parent": b.parent}
                        for b in word_branches(ensemble, 0.002, 6)]
    if len(ensemble.drawn) < 2 or "outcome" not in ensemble.columns or ensemble.summary.runs == 0:
        data["basin"], data["basin_refused"] = None, "A map needs two drawn numbers, and outcomes that are kept."
        return data
    by = "word" if "words" in ensemble.columns else "outcome"
    bins = int(min(MAX_BINS, max(10, (ensemble.summary.runs / 2) ** 0.5)))
    shape = basin(ensemble, ensemble.drawn[0], ensemble.drawn[1], by, bins)
    data["basin"] = {"x": ensemble.drawn[0], "y": ensemble.drawn[1], "labels": shape.labels,
                     "shares": digits(shape.shares), "others": shape.others, "bins": bins,
                     "limits": [digits(limit) for limit in shape.limits], "cells": shape.cells.ravel().tolist()}
    return data
