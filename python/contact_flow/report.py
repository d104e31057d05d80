# SPDX-License-Identifier: BSD-3-Clause
"""A run as one HTML file: contacts, events, states, forces, its derivative, what is near. It needs no
network and no other file; zoom and cursor are common to all pictures."""
from __future__ import annotations

import json
import math
import os
from typing import Any, Dict, List, Optional, Sequence, Union

import numpy as np

from . import _core, report_ensemble, report_three, report_words
from .ensemble import Ensemble
from .report_scene import scene

MAX_BYTES = 8_000_000  #: a larger report is refused
MAX_SAMPLES = 1_000_000  #: of which even a ball would be larger
MAX_PIECES = 64  #: more are counted, not drawn
FOLDER = os.path.dirname(__file__)


def numbers(values: Any) -> Any:
    """With nine digits, as lists; null for what is not finite."""
    if isinstance(values, np.ndarray):
        return numbers(values.tolist())
    if isinstance(values, (list, tuple)):
        return [numbers(value) for value in values]
    if isinstance(values, float):
        return float("%.9g" % values) if math.isfinite(values) else None
    return values


def rate_units(system: _core.System) -> List[str]:
    """Units of the velocities: of angular ones where a quaternion turns."""
    units = dict(zip(system.coordinates, system.units))
    return [units[name] + "/s" if name in units else "rad/s" for name in system.velocities]


def motion(run: _core.Run, count: int) -> Dict[str, Any]:
    """States and forces arc by arc, so that jumps are jumps. `count` instants in all, two an arc at least."""
    span = max(run.t_end - run.t_begin, 1e-300)
    arcs: List[Dict[str, Any]] = []
    for arc in run.arcs:
        k = max(2, int(round(count * (arc.t_end - arc.t_begin) / span)))
        t = np.linspace(arc.t_begin, arc.t_end, k)
        x, force = run.x(t), run.force(t)
        x[0], x[-1] = arc.x_begin, arc.x_end   # at an event run.x is the limit from before
        force[0] = run.force(arc.t_begin + 1e-9 * (arc.t_end - arc.t_begin))
        arcs.append({"t": t.tolist(), "x": numbers(x.T), "force": numbers(force.T),
                     "mode": arc.mode, "word": arc.word, "u": numbers(arc.u)})
    return {"arcs": arcs}


def slopes(run: _core.Run, by: Sequence[str]) -> Dict[str, Any]:
    """The derivative along every unit direction, to both sides, and its pieces."""
    if not run.repeats:
        return {"status": "not differentiable", "message": "the run ends behind its event", "tangents": (),
                "rows": (), "outcomes": []}
    B = run.derivative(by=by)
    data: Dict[str, Any] = {"status": B.status.outcome, "message": B.status.message, "tangents": B.tangents,
                            "rows": run.system.velocities + tuple("d/dt " + n for n in run.system.velocities)}
    if not B.status:
        data["outcomes"] = [{"order": o["order"], "v_plus": numbers(o["v_plus"]),
                             "mode_after": o["mode_after"]} for o in B.outcomes()]
        return data
    data["differentiable"] = B.is_differentiable
    data["directions"] = []
    for name in B.tangents:
        entry: Dict[str, Any] = {"name": name}
        for key, sign in (("up", "+"), ("down", "-")):
            try:
                radius = B.radius(sign + name)
                entry[key] = {"value": numbers(B(sign + name)), "radius": numbers(radius.radius),
                              "limit": radius.limit, "constraint": radius.constraint or "",
                              "modes": B.perturbed_modes(sign + name)}
            except ValueError as reason:   # it leaves the domain at the start
                entry[key] = {"refused": str(reason)}
        data["directions"].append(entry)
    piecewise = B.piecewise_linear
    data["piecewise"] = piecewise.message if not piecewise else ""
    if piecewise:
        pieces = B.pieces()
        data["count"] = len(pieces)
        if len(pieces) <= MAX_PIECES:
            data["pieces"] = [{"matrix": numbers(p.matrix), "cone": numbers(p.cone), "omega": p.omega,
                               "eta": p.eta} for p in pieces]
    trust = B.trust
    data["trust"] = {"derivative_error": numbers(trust.derivative_error), "flow_law": numbers(trust.flow_law),
                     "event_law": numbers(trust.event_law), "condition": numbers(trust.condition)}
    return data


def request(run: _core.Run) -> str:
    """Python that repeats the run."""
    if not run.repeats:
        return "# a return to an event, which ends behind it: ask a PoincareMap"
    system, (t, u) = run.system, run.input_grid
    if isinstance(system, _core.Model):
        made = "cf.Model(%r, **%r)" % (system.name, system.parameters)
    elif isinstance(system, _core.Robot):
        made = "cf.Robot.from_strings(urdf, yaml, **%r)   # its texts are below" % system.parameters
    elif isinstance(system, _core.PythonModel):
        made = "cf.PythonModel(%s, **%r)" % (system.formulas.__name__, system.parameters)
    else:
        made = repr(system)
    inputs = "%r" % u[0].tolist() if len(t) == 1 and t[0] == 0 else "cf.Grid(%r, %r)" % (t.tolist(), u.tolist())
    usual = _core.Model("bouncing_ball").simulate(duration=0.0).options
    options = "".join(", %s=%r" % item for item in run.options.items() if item[1] != usual[item[0]])
    return "import contact_flow as cf\nsystem = %s\nrun = system.simulate(%r, %r, %s%s)" % (
        made, run.x0.tolist(), run.duration, inputs, options)


def collect(run: _core.Run, by: Sequence[str], count: int) -> Dict[str, Any]:
    """All that the page shows."""
    system = run.system
    data: Dict[str, Any] = {
        "version": _core.__version__, "name": system.name, "summary": system.summary,
        "status": run.status.outcome, "message": run.status.message,
        "begin": run.t_begin, "end": run.t_end, "states": system.state_names, "units": system.units,
        "rates": rate_units(system),
        "positions": system.num_positions, "constraints": system.constraints,
        "forces": list(system.constraints + system.bilateral), "inputs": system.inputs,
        "parameters": [[p.name, numbers(p.value), p.unit, p.meaning] for p in system.parameter_list],
        "events": [{"t": e.t, "kinds": e.kinds, "constraints": e.constraints, "before": e.mode_before,
                    "after": e.mode_after, "word": e.word_after, "impulse": numbers(e.impulse),
                    "obstacle": "" if e.obstacle else str(e.obstacle)} for e in run.events],
        "warnings": ["%g s: %s" % (w.t, w.message) for w in run.warnings],
        "near": run.near_grazing(),
        "request": request(run)}
    if isinstance(system, _core.Robot):
        data["texts"] = {"urdf": system.urdf, "yaml": system.yaml}
    data.update(motion(run, count))
    data["derivative"] = slopes(run, by)
    data["words"] = report_words.margins(run) + report_words.trust(data["derivative"])
    data["figure"] = scene(run, data["derivative"])
    return data


def part(name: str) -> str:
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        return file.read()


def assembled(data: Dict[str, Any], three: str, missing: str) -> str:
    """The page: its parts in the template, and three.js with its licence in a script of its own, where it is there."""
    licence = report_three.LICENCE if three else ""
    page = part("report_template.html").replace(
        "/*THREE*/", "<script>/*! %s*/\n%s</script>\n" % (licence, three) if three else "", 1)
    for mark, name in (("/*SCENE*/", "report_scene.js"), ("/*FLAT*/", "report_flat.js"),
                       ("/*PAINTER*/", "report_three.js"), ("/*ENSEMBLE*/", "report_ensemble.js")):
        page = page.replace(mark, part(name), 1)
    data = dict(data, three={"revision": report_three.REVISION if three else "", "licence": licence,
                             "missing": missing})
    # "<" could end the script where a name has it.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return page.replace("/*DATA*/null", text, 1)


def write_report(run: _core.Run, path: Union[str, "os.PathLike[str]"], by: Sequence[str] = ("state",),
                 samples: int = 600, source: str = "", ensemble: Optional[Ensemble] = None) -> None:
    """Writes the report of a run to `path`, with three.js where that is installed (libjs-three). `by` as in
    Run.derivative; `source` says where it is from; `ensemble` is shown beside the run without its draws. ValueError
    where it would be larger than 8 MB, or where the run was made with dense=False."""
    if not run.options["dense"]:
        raise ValueError("the run was made with dense=False")
    if not 2 <= samples <= MAX_SAMPLES:
        raise ValueError("samples is %d, expected 2 to %d" % (samples, MAX_SAMPLES))
    data = dict(collect(run, by, samples), source=source,
                ensemble=None if ensemble is None else report_ensemble.section(run, ensemble))
    page = assembled(data, *report_three.library())
    size = len(page.encode())
    if size > MAX_BYTES:   # then rather without a library
        page = assembled(data, "", "with three.js the report would be larger than %g MB" % (MAX_BYTES / 1e6))
        size = len(page.encode())
    if size > MAX_BYTES:
        raise ValueError("the report has %d bytes, more than %d: ask for fewer samples or directions"
                         % (size, MAX_BYTES))
    with open(path, "w", encoding="utf-8") as file:
        file.write(page)
