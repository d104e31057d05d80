# SPDX-License-Identifier: BSD-3-Clause
"""The commands of cli.py: each takes the arguments, and answers (data, text, whether all is well)."""
from __future__ import annotations

import math
import os
from argparse import Namespace
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np

from . import _core
from .sections import After, Apex, Crossing, Section, Touchdown

Answer = Tuple[Any, str, bool]
BACK = 0.01   # of where a run began: it has come back
Load = Callable[[str, Dict[str, float]], Tuple[_core.System, Dict[str, Any], Dict[str, Any]]]


def models(arguments: Namespace, load: Load) -> Answer:
    found = {}
    for name in _core.models():
        system = _core.Model(name)
        found[name] = {"summary": system.summary, "coordinates": system.coordinates,
                       "constraints": system.constraints, "inputs": system.inputs,
                       "parameters": system.parameters}
    width = max(len(name) for name in found)
    return found, "\n".join("%-*s  %s" % (width, name, entry["summary"]) for name, entry in found.items()), True


def robot(arguments: Namespace, load: Load) -> Answer:
    system, _, _ = load(arguments.system, dict(arguments.parameter))
    warnings = system.warnings if isinstance(system, _core.Robot) else []
    data = {"name": system.name, "summary": system.summary, "coordinates": system.coordinates,
            "units": system.units, "velocities": system.velocities, "constraints": system.constraints,
            "bilateral": system.bilateral, "inputs": system.inputs, "warnings": warnings,
            "parameters": [{"name": p.name, "unit": p.unit, "meaning": p.meaning, "value": p.value}
                           for p in system.parameter_list],
            "nominal": {"x": system.nominal.x, "u": system.nominal.u, "duration": system.nominal.duration}}
    return data, "\n".join([system.describe().rstrip()] + ["warning: " + w for w in warnings]), True


def run_of(arguments: Namespace, load: Load) -> Tuple[_core.Run, Dict[str, Any]]:
    """The run that is asked for, and the options of its derivative."""
    system, options, derivative = load(arguments.system, dict(arguments.parameter))
    options.update(arguments.option)
    arguments.tell("the run")
    run = system.simulate(dict(arguments.state), arguments.duration, dict(arguments.input), **options)
    return run, derivative


def events_of(run: _core.Run) -> List[Dict[str, Any]]:
    return [{"t": e.t, "kinds": e.kinds, "constraints": e.constraints, "mode_before": e.mode_before,
             "mode_after": e.mode_after, "word_after": e.word_after, "impulse": e.impulse,
             "x_minus": e.x_minus, "x_plus": e.x_plus} for e in run.events]


def named(names: Sequence[str], values: Any, indent: str = "  ") -> List[str]:
    width = max([len(name) for name in names] + [0])
    return ["%s%-*s  %.10g" % (indent, width, name, value) for name, value in zip(names, values)]


def simulate(arguments: Namespace, load: Load) -> Answer:
    run, _ = run_of(arguments, load)
    if arguments.csv and arguments.csv != "-":
        with open(arguments.csv, "w", encoding="utf-8") as file:
            file.write(run.csv(arguments.samples))
    data = {"status": run.status.outcome, "message": run.status.message, "t_begin": run.t_begin,
            "t_end": run.t_end, "modes": run.modes, "mode_words": run.mode_words,
            "state_names": run.system.state_names, "final_state": run.final_state,
            "events": events_of(run),
            "warnings": [{"code": w.code, "t": w.t, "message": w.message} for w in run.warnings]}
    if arguments.csv == "-":
        return data, run.csv(arguments.samples).rstrip("\n"), bool(run.status)
    text = ["%s, %g to %g s: %s" % (run.system.name, run.t_begin, run.t_end, run.status)]
    text += ["%12.6f s  %s of %s: %s -> %s" % (e.t, ", ".join(e.kinds), ", ".join(e.constraints),
                                              e.word_before, e.word_after) for e in run.events]
    text += ["warning at %g s: %s: %s" % (w.t, w.code, w.message) for w in run.warnings]
    text += ["final state"] + named(run.system.state_names, run.final_state)
    return data, "\n".join(text), bool(run.status)


def directions_of(arguments: Namespace, B: _core.Derivative) -> List[Tuple[str, Any]]:
    """(label, w) of each: "+name" one by itself, the NAME=VALUE together another one."""
    found: List[Tuple[str, Any]] = []
    together: Dict[str, float] = {}
    for text in arguments.direction:
        name, equals, value = text.rpartition("=")
        if equals:
            together[name] = float(value)
        else:
            found.append((text, B.direction(text)))
    if together:
        found.append((", ".join("%s=%g" % item for item in together.items()), B.direction(together)))
    if not found:
        found = [(sign + name, B.direction(sign + name)) for name in B.tangents for sign in "+-"]
    return found


def derive(arguments: Namespace, load: Load) -> Answer:
    run, options = run_of(arguments, load)
    arguments.tell("its derivative")
    B = run.derivative(by=arguments.by, **options)
    rows = list(run.system.velocities) + ["d/dt " + name for name in run.system.velocities]
    data: Dict[str, Any] = {"status": B.status.outcome, "message": B.status.message,
                            "tangents": B.tangents, "rows": rows}
    text = ["%s at %g s: %s" % (run.system.name, run.t_end, B.status)]
    if not B.status:
        data["outcomes"] = [dict(o, status=str(o["status"])) for o in B.outcomes()]
        text += ["  %s: v+ = %s, then %s" % (" before ".join(o["order"]), np.round(o["v_plus"], 6),
                                             "{%s}" % ", ".join(o["mode_after"])) for o in B.outcomes()]
        return data, "\n".join(text), False
    data["is_differentiable"] = B.is_differentiable
    piecewise = B.piecewise_linear
    text.append("continuously differentiable: " + ("yes" if B.is_differentiable else "no"))
    if piecewise:
        pieces = B.pieces()
        data["pieces"] = [{"matrix": p.matrix, "cone": p.cone, "omega": p.omega, "eta": p.eta} for p in pieces]
        text.append("linear pieces: %d" % len(pieces))
    else:
        text.append("no linear pieces: %s" % piecewise.message)
    data["directions"] = []
    directions = directions_of(arguments, B)
    for number, (label, w) in enumerate(directions):
        arguments.tell("directions", number, len(directions))
        try:
            value, radius = B(w), B.radius(w)
        except ValueError as reason:   # it leaves the domain at the start
            data["directions"].append({"name": label, "w": w, "refused": str(reason)})
            text.append("%s: %s" % (label, reason))
            continue
        data["directions"].append({"name": label, "w": w, "value": value, "error": B.error(w),
                                   "radius": radius.radius, "limit": radius.limit,
                                   "constraint": radius.constraint,
                                   "modes": B.perturbed_modes(w)})
        text.append("%s   (holds to %.3g: %s)" % (label, radius.radius, radius.limit))
        if arguments.direction:
            text += named(rows, value)
    return data, "\n".join(text), True


def agrees(report: _core.QuotientReport) -> bool:
    """Whether quotients say what the derivative says: their errors fall like α, or, where too few of
    them stand clear of rounding to tell, none of them does."""
    compared = [s for s in report.samples if s.status]
    if not compared:
        return False
    if not math.isnan(report.slope):
        return report.slope > 0.8
    return all(s.error <= max(report.prediction_error, 20 * report.resolution / s.alpha) for s in compared)


def compare(arguments: Namespace, load: Load) -> Answer:
    run, options = run_of(arguments, load)
    arguments.tell("its derivative")
    B = run.derivative(by=arguments.by, **options)
    if not B.status:
        return {"status": B.status.outcome, "message": B.status.message}, str(B.status), False
    if not arguments.direction:
        raise ValueError("compare needs a --direction")
    data, text, ok = [], [], True
    directions = directions_of(arguments, B)
    for number, (label, w) in enumerate(directions):
        arguments.tell("quotients", number, len(directions))
        report = B.compare(w, arguments.alphas)
        data.append({"name": label, "slope": report.slope, "resolution": report.resolution,
                     "prediction_error": report.prediction_error,
                     "samples": [{"alpha": s.alpha, "status": s.status.outcome, "error": s.error,
                                  "quotient": s.quotient} for s in report.samples]})
        text += [label, str(report)]
        if not agrees(report):
            text.append("the quotients do not confirm it")
        ok = ok and agrees(report)
    return data, "\n".join(text), ok


def section_of(arguments: Namespace) -> Section:
    if arguments.apex:
        return Apex(arguments.apex)
    if arguments.crossing:
        return Crossing(*arguments.crossing)
    if arguments.touchdown:
        return Touchdown(arguments.touchdown)
    return After(arguments.after)


def return_map(arguments: Namespace, load: Load) -> _core.PoincareMap:
    if arguments.duration is not None:
        raise ValueError("-t %g: an orbit lasts until its section, as --after SECONDS" % arguments.duration)
    system, _, _ = load(arguments.system, dict(arguments.parameter))
    chosen = dict(arguments.option)   # tolerances of a configuration are those of runs, not of orbits
    return system.poincare(section_of(arguments), dict(arguments.input), **chosen)


def orbit(arguments: Namespace, load: Load) -> Answer:
    returns = return_map(arguments, load)
    system = returns.system
    arguments.tell("the orbit")
    found = returns.fixed_point(dict(arguments.state), free=arguments.free, conditions=arguments.condition)
    data: Dict[str, Any] = {"status": found.status, "message": found.message, "x": found.x,
                            "period": found.period, "parameters": found.parameters,
                            "residual": found.residual}
    text = [found.message] + named(system.state_names, found.x)
    text += ["period %.10g s" % found.period] + named(list(found.parameters), found.parameters.values())
    if not found:
        return data, "\n".join(text), False
    arguments.tell("its stability")
    try:
        stability = found.stability(arguments.translation)
    except ValueError as reason:
        data["stability"] = {"verdict": "undetermined", "message": str(reason)}
        return data, "\n".join(text + ["stability: %s" % reason]), True
    data["stability"] = {"verdict": stability.verdict, "message": stability.message,
                         "verified": stability.verify(), "test": stability.certificate.test,
                         "bound": stability.certificate.bound}
    text.append(stability.message + (" (verified)" if stability.verify() else ""))
    return data, "\n".join(text), True


def stabilize(arguments: Namespace, load: Load) -> Answer:
    if arguments.starts < 0 or arguments.returns < 0 or not arguments.away >= 0:
        raise ValueError("--starts, --returns and --away are numbers >= 0")
    returns = return_map(arguments, load)
    state = dict(arguments.state)
    arguments.tell("the feedback")
    without = returns(state).stability(arguments.translation)
    found = returns.feedback(state, arguments.translation, arguments.inputs, arguments.piecewise)
    verified = found.verify()
    text = ["without: " + without.message, found.message + (" (verified)" if verified else "")]
    data: Dict[str, Any] = {
        "without": without.message, "message": found.message, "certified": found.certified,
        "verified": verified, "rate": found.rate, "inputs": found.inputs, "basis": found.basis,
        "law": [{"gain": piece.matrix, "cone": piece.cone} for piece in found.law]}
    if not found:
        return data, "\n".join(text), False
    text.append("%d gains of %s" % (len(found.law), ", ".join(found.inputs)))
    draw = np.random.default_rng(1)
    ends = []
    for number in range(arguments.starts):
        arguments.tell("starts", number, arguments.starts)
        z = draw.normal(size=found.basis.shape[1])
        run = found.follow(found.state(arguments.away * z / np.linalg.norm(z)), arguments.returns)
        ends.append(run.away[-1] if len(run.u) == arguments.returns else math.inf)
    back = [end for end in ends if end <= BACK * arguments.away]
    data["ends"] = ends
    if ends:
        text.append("%d of %d starts %g away come back within %d returns%s" % (
            len(back), len(ends), arguments.away, arguments.returns,
            ", the furthest to %.3g" % max(back) if back else ""))
    return data, "\n".join(text), True


def recorded_run(arguments: Namespace) -> Tuple[_core.Run, Sequence[str], str]:
    """(run, what it was differentiated by, where it is from) of a bag."""
    from .bags import runs
    for name in ("parameter", "state", "input", "option", "duration"):
        if getattr(arguments, name):
            raise ValueError("--%s: a run of a bag is as it was recorded" % name)
    found = runs(arguments.system)
    try:
        one = found[arguments.number]
    except IndexError:
        raise ValueError("--number %d: the bag has %d runs" % (arguments.number, len(found))) from None
    number = arguments.number % len(found)
    how = "the same, bit for bit" if one.same else "its end differs by %.3g" % one.difference
    return one.run, one.by, "Run %d of %d of %s, from %s; computed again: %s." % (
        number, len(found), os.path.basename(arguments.system), one.topic, how)


def report(arguments: Namespace, load: Load) -> Answer:
    from .report import write_report
    if arguments.system.endswith(".bag"):
        arguments.tell("the bag")
        run, by, source = recorded_run(arguments)
    else:
        run, by, source = run_of(arguments, load)[0], ["state"], ""
    stem = os.path.splitext(os.path.basename(arguments.system))[0]
    path = arguments.file or stem + ".html"
    arguments.tell("the page")
    write_report(run, path, by=arguments.by or by, source=source)
    text = "written: %s, %s" % (path, run.status)
    return {"file": path, "status": run.status.outcome, "source": source}, \
        "\n".join([text] + ([source] if source else [])), bool(run.status)
