# SPDX-License-Identifier: BSD-3-Clause
"""Margins and derivatives of a run in sentences, for its report."""
from __future__ import annotations

import math
from typing import Any, Dict, List

from . import _core

#: margin, what is said of it where it is finite, its unit
MARGINS = (("approach_speed", "Every touchdown comes with %s or more: the nearer to 0, the nearer to grazing.", "m/s"),
           ("release_rate", "Every force that lets go falls by %s or more.", "N/s"),
           ("gap", "Every contact that stays open keeps a gap of %s or more where it dips.", "m"),
           ("force", "Every contact that holds is pressed by %s or more where its force dips.", "N"),
           ("event_interval", "Events are %s or more apart.", "s"),
           ("cluster_spread", "Events that count as one are up to %s apart.", "s"),
           ("painleve", "Slips are regular by %s or more of what they are without friction (Painlevé: 0).", ""))


def margins(run: _core.Run) -> List[str]:
    """What did not happen, and how nearly it would have."""
    found = []
    for name, sentence, unit in MARGINS:
        value = getattr(run.margins, name)
        if math.isfinite(value) and not (name == "cluster_spread" and value == 0):
            found.append(sentence % ("%.4g %s" % (value, unit)).strip())
    return found or ["Nothing came near to an event that did not happen."]


def what(entry: Dict[str, Any]) -> str:
    return str(entry["limit"]) + (" of %s" % entry["constraint"] if entry.get("constraint") else "")


def trust(derivative: Dict[str, Any]) -> List[str]:
    """How far a derivative, as report.slopes describes it, holds and how well it is known."""
    if derivative["status"] != "ok":
        return []
    found = []
    known = derivative["trust"]["derivative_error"]
    if known is not None:
        found.append("Entries of the derivative are known to about %.1g." % known)
    finite = [(entry[key]["radius"], sign + entry["name"], what(entry[key]))
              for entry in derivative["directions"] for key, sign in (("up", "+"), ("down", "−"))
              if entry[key].get("radius") is not None]
    if finite:
        radius, name, limit = min(finite)
        found.append("It holds least far along %s: to %.3g, where events change (%s)." % (name, radius, limit))
    unknown = sum(entry[key].get("limit") == "unknown" for entry in derivative["directions"] for key in ("up", "down"))
    if unknown:
        found.append("How far it holds is not known along %d of %d directions."
                     % (unknown, 2 * len(derivative["directions"])))
    refused = sum("refused" in entry[key] for entry in derivative["directions"] for key in ("up", "down"))
    if refused:
        found.append("Along %d of %d directions no run may start: they leave the contacts of the start."
                     % (refused, 2 * len(derivative["directions"])))
    return found
