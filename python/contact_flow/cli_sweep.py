# SPDX-License-Identifier: BSD-3-Clause
"""The command contact_flow sweep: an ensemble from a YAML file, or what is left of one in a directory."""
from __future__ import annotations

import importlib
import os
from argparse import Namespace
from typing import Any, Callable, Dict, List, Mapping, Tuple

import numpy as np

from . import _core
from .draws import JointNormal, Normal, Table, Uniform
from .ensemble import Ensemble, sweep, text_progress

KEYS = ("model", "robot", "parameters", "options", "state", "inputs", "duration", "runs", "seed", "sobol", "draws",
        "joint", "keep", "events", "samples", "directions", "costs", "histograms", "derivative_options")
KINDS = ("uniform", "normal", "levels", "linspace")


def number(value: Any, what: str) -> float:
    """YAML's 1e-9 is a text to its readers, and a number here."""
    try:
        if isinstance(value, bool):
            raise ValueError
        return float(value)
    except (TypeError, ValueError):
        raise ValueError("%s is %r, expected a number" % (what, value)) from None


def count(value: Any, what: str) -> int:
    """A whole number, also as 1e6."""
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    found = number(value, what)
    if not found.is_integer():
        raise ValueError("%s is %r, expected a whole number" % (what, value))
    return int(found)


def axis(value: Any, what: str) -> Tuple[float, float, int]:
    """[low, high, bins] of a histogram."""
    low, high, bins = numbers(value, what, 3)
    return low, high, count(bins, "the bins of " + what)


def numbers(values: Any, what: str, size: int = -1) -> List[float]:
    if not isinstance(values, list) or (size >= 0 and len(values) != size):
        raise ValueError("%s is %r, expected %s numbers" % (what, values, size if size >= 0 else "a list of"))
    return [number(value, what) for value in values]


def mapping(value: Any, what: str) -> Dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ValueError("%s is %r, expected keys and values" % (what, value))
    return {str(key): item for key, item in value.items()}


def draw_of(name: str, value: Any) -> Any:
    """{uniform: [low, high]}, {normal: [mean, std]}, {levels: […]} or {linspace: [first, last, count]}."""
    entry = mapping(value, "the draw of " + name)
    if len(entry) != 1 or next(iter(entry)) not in KINDS:
        raise ValueError("the draw of %s is %r, expected one of %s" % (name, value, ", ".join(KINDS)))
    (kind, given), = entry.items()
    if kind == "uniform":
        return Uniform(*numbers(given, name, 2))
    if kind == "normal":
        return Normal(*numbers(given, name, 2))
    if kind == "levels":
        return numbers(given, name)
    first, last, values = numbers(given, name, 3)
    if values != int(values) or values < 1:
        raise ValueError("linspace of %s: %r values, expected a whole number from 1 on" % (name, values))
    return list(np.linspace(first, last, int(values)))


def joint_of(entry: Any) -> Any:
    keys = mapping(entry, "an entry of joint")
    names = keys.pop("names", None)
    if not isinstance(names, list):
        raise ValueError("an entry of joint needs names")
    if set(keys) == {"table"}:
        return Table(names, [numbers(row, "a row of the table", len(names)) for row in keys["table"]])
    if set(keys) - {"mean"} == {"covariance"}:
        mean = numbers(keys["mean"], "the mean", len(names)) if "mean" in keys else None
        return JointNormal(names, [numbers(row, "the covariance", len(names)) for row in keys["covariance"]], mean)
    raise ValueError("an entry of joint has names, and table, or covariance and mean")


def plain_options(options: Mapping[str, Any]) -> Dict[str, Any]:
    found: Dict[str, Any] = {}
    for name, value in options.items():
        try:
            found[name] = value if isinstance(value, (bool, int)) else float(value)
        except ValueError:
            found[name] = value
    return found


def read(path: str) -> Tuple[_core.System, Dict[str, Any], Dict[str, Any]]:
    """(system, draws and runs, keywords of sweep) of a file. ValueError for what is wrong in it."""
    try:
        yaml: Any = importlib.import_module("yaml")
    except ImportError:
        raise ValueError("reading %s needs python3-yaml" % path) from None
    try:
        with open(path, encoding="utf-8") as file:
            content = mapping(yaml.safe_load(file), path)
    except yaml.YAMLError as error:
        raise ValueError("%s: %s" % (path, error)) from None
    for key in content:
        if key not in KEYS:
            raise ValueError("%s: unknown key '%s'; there are %s" % (path, key, ", ".join(KEYS)))
    if ("model" in content) == ("robot" in content):
        raise ValueError("%s: needs one of 'model' and 'robot'" % path)
    parameters = {k: number(v, k) for k, v in mapping(content.get("parameters"), "parameters").items()}
    if "model" in content:
        system: _core.System = _core.Model(str(content["model"]), **parameters)
    else:
        robot = os.path.join(os.path.dirname(path), str(content["robot"]))
        system = _core.Robot(robot).with_parameters(**parameters)
    draws: List[Any] = [{name: draw_of(name, value)
                         for name, value in mapping(content.get("draws"), "draws").items()}]
    draws += [joint_of(entry) for entry in content.get("joint") or []]
    keywords: Dict[str, Any] = plain_options(mapping(content.get("options"), "options"))
    if "duration" in content:
        keywords["duration"] = number(content["duration"], "duration")
    for key, name in (("state", "x0"), ("inputs", "inputs")):
        if key in content:
            keywords[name] = {k: number(v, k) for k, v in mapping(content[key], key).items()}
    for key in ("seed", "sobol", "keep", "events", "samples", "directions", "derivative_options"):
        if key in content:
            keywords[key] = content[key]
    if "histograms" in content:
        keywords["histograms"] = {name: axis(value, "the histogram of " + name)
                                  for name, value in mapping(content["histograms"], "histograms").items()}
    if "costs" in content:
        keywords["costs"] = {name: {key: {k: number(v, k) for k, v in mapping(values, key).items()}
                                    for key, values in mapping(cost, name).items()}
                             for name, cost in mapping(content["costs"], "costs").items()}
    for key in ("seed", "events"):
        if key in keywords:
            keywords[key] = count(keywords[key], key)
    runs = None if content.get("runs") is None else count(content["runs"], "runs")
    return system, {"draws": draws, "runs": runs}, keywords


def report(ensemble: Ensemble) -> str:
    summary = ensemble.summary
    lines = ["%s: %d runs" % (ensemble.system.name, summary.runs)]
    lines += ["  %-14s %d" % item for item in sorted(summary.outcomes.items(), key=lambda i: -i[1])]
    lines += ["first %s: run %d: %s" % (name, run, why) for name, (run, why) in sorted(summary.examples.items())]
    words = sorted(summary.words.items(), key=lambda item: (-item[1], item[0]))
    lines += ["modes"] + ["  %9d  %s" % (count, word) for word, count in words[:10]]
    if len(words) > 10 or summary.other_words:
        lines.append("  %9d  in %d more words" % (sum(c for _, c in words[10:]) + summary.other_words,
                                                 len(words) - 10))
    width = max(len(name) for name in ensemble.names)
    lines.append("%-*s  %12s %12s %12s %12s" % (width + 2, "final state - reference", "mean", "std", "5 %", "95 %"))
    deviations = np.sqrt(np.diag(ensemble.covariance))
    for k, name in enumerate(ensemble.names):
        lines.append("  %-*s  %12.5g %12.5g %12.5g %12.5g" % (
            max(width, 21), name, ensemble.mean[k], deviations[k], ensemble.quantile(name, 0.05),
            ensemble.quantile(name, 0.95)))
    return "\n".join(lines)


def sweep_command(arguments: Namespace, load: Callable[..., Any]) -> Tuple[Any, str, bool]:
    client = None
    if arguments.scheduler:
        try:
            distributed: Any = importlib.import_module("distributed")
        except ImportError:
            raise ValueError("--scheduler needs Dask distributed: apt install python3-distributed") from None
        client = distributed.Client(arguments.scheduler)
    shared = {"threads": arguments.threads, "client": client,
              "progress": None if arguments.quiet else text_progress}
    if arguments.resume:
        if arguments.file or arguments.directory:
            raise ValueError("--resume takes system and request from the directory: no FILE, no --directory")
        from .ensemble_store import Store, system_of
        from .ensemble_chunks import sweep_chunks
        store = Store.open(arguments.resume)
        system = system_of(store.attributes["system"])
        ensemble = sweep_chunks(system, store.request, store.runs, every=0.5, directory=arguments.resume,
                                resume=True, chunk=0, **shared)
    else:
        if not arguments.file:
            raise ValueError("sweep needs a FILE, or --resume DIR")
        system, what, keywords = read(arguments.file)
        if arguments.runs is not None:
            what["runs"] = arguments.runs
        if arguments.directory:
            keywords.update(directory=arguments.directory, chunk=arguments.chunk)
        ensemble = sweep(system, what["draws"], what["runs"], **shared, **keywords)
    if arguments.report:
        ensemble.report(arguments.report)
    summary = ensemble.summary
    data = {"runs": summary.runs, "outcomes": summary.outcomes, "examples": summary.examples,
            "words": summary.words, "names": ensemble.names, "reference": ensemble.reference,
            "mean": ensemble.mean, "covariance": ensemble.covariance, "status": ensemble.status.outcome}
    return data, report(ensemble), bool(ensemble.status)
