# SPDX-License-Identifier: BSD-3-Clause
"""Ensembles: one model from many starts, inputs and parameters, with statistics on the way.

>>> from contact_flow import Model, Uniform, sweep
>>> landing = sweep(Model("soft_biped"), {"body_pitch": Uniform(-0.3, 0.3)}, runs=512, seed=1)
>>> landing.outcomes
{'ok': 512}
>>> max(landing.words, key=landing.words.get)
'oo>lo>ll'
>>> landing["final_state"].shape
(512, 14)
"""
from __future__ import annotations

import operator
import os
import sys
import time
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _core
from .draws import Draws, parts_of
from .sections import Grid

Array = Any
Request = Dict[str, Any]
#: called with runs done, runs in all, seconds, and counts by outcome
Progress = Callable[[int, int, float, Dict[str, int]], None]

BLOCK = 256
COLUMNS = ("outcome", "start", "final_state", "end_time", "words", "margins", "jacobian")
MARGINS = ("approach_speed", "release_rate", "gap", "force", "event_interval", "cluster_spread")


def tangent_names(system: _core.System) -> List[str]:
    return list(system.velocities) + ["d/dt " + name for name in system.velocities]


def direction_of(system: _core.System, w: Any) -> List[float]:
    """A tangent (δq, δv) [2d] from numbers, "+name" or numbers by name."""
    names = tangent_names(system)
    if isinstance(w, str):
        w = {w.lstrip("+-"): -1.0 if w.startswith("-") else 1.0}
    if not isinstance(w, Mapping):
        return [float(x) for x in w]
    found = [0.0] * len(names)
    for name, value in w.items():
        if name not in names:
            raise ValueError("unknown direction '%s'; those of the state are %s" % (name, ", ".join(names)))
        found[names.index(name)] = float(value)
    return found


def cost_of(system: _core.System, name: str, cost: Mapping[str, Any]) -> Dict[str, Any]:
    """½ Σ w (x(T) − target)² + ½ Σ r u², from {"target": {…}, "weight": {…}, "effort": {…}} by name; without
    "weight" it is 1 for each target."""
    unknown = set(cost) - {"target", "weight", "effort"}
    if unknown:
        raise ValueError("unknown key '%s' of the cost '%s'" % (sorted(unknown)[0], name))
    if "weight" not in cost:
        cost = {**cost, "weight": dict.fromkeys(cost.get("target", {}), 1.0)}

    def filled(key: str, names: Sequence[str]) -> List[float]:
        values = [0.0] * len(names)
        for one, value in cost.get(key, {}).items():
            if one not in names:
                raise ValueError("unknown name '%s' in '%s' of the cost '%s'" % (one, key, name))
            values[list(names).index(one)] = float(value)
        return values
    return {"name": name, "target": filled("target", system.state_names),
            "weight": filled("weight", system.state_names), "effort": filled("effort", system.inputs)}


def whole(name: str, value: Any, least: int = 0, most: int = 2 ** 64 - 1) -> int:
    """A whole number as it is: 1.5 is none, nor is a text. ValueError, or TypeError, with its name."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError("%s is %r, expected a whole number" % (name, value)) from None
    if not least <= number <= most:
        raise ValueError("%s is %d, expected %d to %d" % (name, number, least, most))
    return number


def make_request(system: _core.System, draws: Draws, *, x0: Any = None, inputs: Any = None,
                 duration: Optional[float] = None, seed: int = 0, sobol: bool = False,
                 keep: Sequence[str] = ("outcome", "start", "final_state", "words"), events: int = 0,
                 samples: Sequence[float] = (), directions: Sequence[Any] = (),
                 costs: Mapping[str, Mapping[str, Any]] = {},
                 histograms: Mapping[str, Tuple[float, float, int]] = {},
                 derivative_options: Mapping[str, Any] = {}, **options: Any) -> Request:
    """The whole of a sweep but for its number of runs, as plain values; checked."""
    x, t, u = _core._start_of(system, x0, inputs)
    request = {
        "x0": x.tolist(), "inputs": {"t": list(t), "u": u.tolist()},
        "duration": float(system.nominal.duration if duration is None else duration),
        "options": _core._options_of(**options), "seed": whole("seed", seed), "sobol": bool(sobol),
        "parts": parts_of(draws),
        "keep": {"columns": list(keep), "events": whole("events", events, most=10 ** 6), "samples": [float(s) for s in samples],
                 "directions": [direction_of(system, w) for w in directions],
                 "costs": [cost_of(system, name, cost) for name, cost in costs.items()],
                 "derivative_options": dict(derivative_options)},
        "histograms": [{"name": name, "low": float(low), "high": float(high),
                        "bins": whole("bins of '%s'" % name, bins, 1, 10 ** 6)}
                       for name, (low, high, bins) in histograms.items()]}
    _core._sweep(system, request, 0, 0, 1, 1.0, float("inf"), None, 1.0)   # refuses what is wrong
    return request


class Ensemble:
    """What is known of the runs of a sweep: columns, a row each, and counts and statistics of all.

    ensemble["final_state"] is a column; ensemble.columns names them. Observables are the final state
    as a tangent at `reference`, the final state of the run without draws, and costs."""

    def __init__(self, system: _core.System, request: Request, answer: Dict[str, Any]) -> None:
        self.system = system
        self.request = request
        self.status: _core.Status = answer["status"]
        self.columns: Dict[str, Array] = answer["columns"]
        self.tally: _core.Tally = answer["tally"]
        self.summary = self.tally.total()
        self.reference: Array = answer["reference"]
        self.elapsed: float = answer["elapsed"]
        #: of the observables
        self.names: List[str] = _core._check_sweep(system, request)[0]
        #: what is drawn
        self.drawn: List[str] = _core._check_sweep(system, request)[1]

    def __getitem__(self, column: str) -> Array:
        if column not in self.columns:
            raise KeyError("'%s' was not kept; %s were" % (column, ", ".join(self.columns)))
        return self.columns[column]

    def __repr__(self) -> str:
        counts = ", ".join("%s %d" % item for item in self.outcomes.items())
        return "<Ensemble of %d runs of %s: %s>" % (self.summary.runs, self.system.name, counts)

    def _index(self, name: str) -> int:
        if name not in self.names:
            raise ValueError("unknown observable '%s'; there are %s" % (name, ", ".join(self.names)))
        return self.names.index(name)

    @property
    def outcomes(self) -> Dict[str, int]:
        """Runs by outcome."""
        return self.summary.outcomes

    @property
    def words(self) -> Dict[str, int]:
        """Runs by mode word."""
        return self.summary.words

    @property
    def mean(self) -> Array:
        """Of the observables of the runs that are 'ok'."""
        return self.summary.mean

    @property
    def covariance(self) -> Array:
        """Of the observables of the runs that are 'ok'."""
        return self.summary.covariance

    def quantile(self, name: str, p: float) -> float:
        """The value of an observable below which the share p of the 'ok' runs lies."""
        return self.summary.quantile(self._index(name), p)

    def rank_error(self, name: str) -> float:
        """By which share of the runs a quantile's rank may be off at most."""
        return self.summary.rank_error(self._index(name))

    def histogram(self, name: str) -> Tuple[Array, Array]:
        """(counts, edges) of an observable for which a histogram was asked; outer bins are open."""
        index = self._index(name)
        for k in range(len(self.request["histograms"])):
            observable, low, high, counts = self.summary.histogram(k)
            bins = len(counts) - 2
            if observable == index:
                edges = np.concatenate([[-np.inf], np.linspace(low, high, bins + 1), [np.inf]])
                return np.array(counts), edges
        raise ValueError("no histogram of '%s' was asked for" % name)

    def to_xarray(self) -> Any:
        """The columns as an xarray.Dataset, with names of states, draws, … as coordinates. Those of a store are
        read here."""
        try:
            import xarray
        except ImportError:
            raise ImportError("to_xarray needs xarray: apt install python3-xarray") from None
        sizes: Dict[str, int] = {}
        variables = {}
        for name, column in self.columns.items():
            dimensions = dimensions_of(name, np.ndim(column))
            sizes.update(zip(dimensions, np.shape(column)))
            variables[name] = (dimensions, np.asarray(column))
        return xarray.Dataset(variables, coords={
            name: values for name, values in coordinates_of(self.system, self.request).items()
            if sizes.get(name) == len(values)}, attrs={"system": self.system.name, "seed": self.request["seed"]})

    def report(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the run without draws, and the ensemble beside it, as one HTML file; see write_report."""
        from .report import write_report
        t, u = self.request["inputs"]["t"], np.array(self.request["inputs"]["u"])
        constant = len(t) == 1 and t[0] == 0
        run = self.system.simulate(self.request["x0"], self.request["duration"], u[0] if constant else Grid(t, u),
                                   **dict(self.request["options"], dense=True))
        write_report(run, path, ensemble=self)

    def draws(self, first: int = 0, count: Optional[int] = None) -> Array:
        """The numbers of runs [count × drawn], drawn again."""
        return _core._draw_sweep(self.system, self.request, first,
                                 self.summary.runs if count is None else count)

    def outcome_names(self) -> Array:
        """The column of outcomes as texts."""
        codes = np.asarray(self["outcome"])   # of a store it is an array of Zarr's
        names = {code: _core._outcome_name(int(code)) for code in np.unique(codes)}
        return np.array([names[code] for code in codes], dtype=object)


def text_progress(done: int, total: int, elapsed: float, outcomes: Dict[str, int]) -> None:
    """Progress as a line on the terminal's error stream."""
    rate = done / elapsed if elapsed > 0 else 0.0
    left = (total - done) / rate if rate > 0 else float("nan")
    counts = ", ".join("%s %d" % item for item in sorted(outcomes.items()))
    line = "%d of %d runs (%.0f %%), %.0f /s, %.0f s left: %s" % (
        done, total, 100.0 * done / max(total, 1), rate, left, counts)
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K" + line + ("\n" if done == total else ""))
    else:
        sys.stderr.write(line + "\n")
    sys.stderr.flush()


#: of each column behind "run"
DIMENSIONS: Dict[str, Tuple[str, ...]] = {
    "start": ("drawn",), "final_state": ("state",), "margins": ("margin",), "event_times": ("event",),
    "samples": ("sample", "state"), "derivative": ("direction", "tangent"), "jacobian": ("outcome_tangent", "tangent"),
    "costs": ("cost",)}


def dimensions_of(column: str, count: int) -> List[str]:
    """Names of the axes of a column."""
    return ["run"] + list(DIMENSIONS.get(column, ()))[:count - 1]


def coordinates_of(system: _core.System, request: Request) -> Dict[str, List[Any]]:
    """What the entries along each axis are called."""
    drawn = _core._check_sweep(system, request)[1]
    tangents = tangent_names(system)
    return {"drawn": list(drawn), "state": list(system.state_names), "margin": list(MARGINS),
            "sample": list(request["keep"]["samples"]), "tangent": tangents, "outcome_tangent": tangents,
            "cost": [cost["name"] for cost in request["keep"]["costs"]]}


def chunks_of(runs: int, chunk: int) -> Iterator[Tuple[int, int, int]]:
    """(index, first run, number of runs)."""
    for index in range((runs + chunk - 1) // chunk):
        yield index, index * chunk, min(chunk, runs - index * chunk)


def number_of_runs(system: _core.System, request: Request, runs: Optional[int]) -> int:
    _, _, period, random = _core._check_sweep(system, request)
    if runs is None:
        if random:
            raise ValueError("runs: how many? Random numbers are drawn for as many as you like")
        return int(period)
    return whole("runs", runs, most=2 ** 61)


def chunk_runs(system: _core.System, request: Request, runs: int, seconds: float = 2.0) -> int:
    """Runs that take some seconds of one core: a power of two of blocks, at most 2**20 runs and 64 MB."""
    probe = min(runs, BLOCK)
    answer = _core._sweep(system, request, 0, probe, 1, 4000.0, float("inf"), None, 1.0)
    width = sum(column.nbytes for column in answer["columns"].values()) / max(probe, 1)
    wanted = min(seconds * probe / max(answer["elapsed"], 1e-6), 2.0 ** 20, 64e6 / max(width, 1))
    chunk = BLOCK
    while 2 * chunk <= wanted:
        chunk *= 2
    return chunk


def sweep(system: _core.System, draws: Draws, runs: Optional[int] = None, *, threads: int = 0,
          progress: Union[bool, Progress] = False, every: float = 0.5, max_megabytes: float = 4000,
          max_seconds_total: float = float("inf"), directory: Optional[str] = None, resume: bool = False,
          chunk: int = 0, client: Any = None, **keywords: Any) -> Ensemble:
    """Many runs of one system, as an Ensemble.

    draws: by name Uniform(low, high), Normal(mean, std), or the levels of a grid; JointNormal(names,
    covariance), Table(names, rows); several as a list. A plain name draws a value, "+name" what is added.
    runs: how many; may be left out where nothing is random. seed, sobol: of the random numbers, which are
    a function of seed and number of the run. threads: 0 for all cores.
    keep: of 'outcome', 'start', 'final_state', 'end_time', 'words', 'margins', 'jacobian'; also events
    (times of so many), samples (states at instants), directions (B(w) of each), costs by name as
    {"target": …, "weight": …, "effort": …}, each by name; weight 1 for each target where left out.
    histograms: {observable: (low, high, bins)}.
    x0, inputs, duration and options are those of simulate. progress: True for a line of text.
    directory: a Zarr store that is written chunk by chunk; resume=True does what is missing in it.
    client: of Dask distributed, whose workers run chunks.
    max_seconds_total: then it ends, and `status` is 'budget exceeded'; the runs that are done are counted.

    A start that is not admissible, a run that throws or exceeds its budget is that run's outcome. The same
    request and seed give the same bits for any threads, chunks and workers."""
    request = make_request(system, draws, **keywords)
    total = number_of_runs(system, request, runs)
    report: Optional[Progress] = text_progress if progress is True else progress or None
    if directory is not None or client is not None:
        from .ensemble_chunks import sweep_chunks
        return sweep_chunks(system, request, total, threads=threads, progress=report, every=every,
                            directory=directory, resume=resume, chunk=chunk, client=client,
                            max_megabytes=max_megabytes, max_seconds_total=max_seconds_total)
    if resume or chunk:
        raise ValueError("resume and chunk are for sweeps with a directory or a client")
    return Ensemble(system, request, _core._sweep(system, request, 0, total, threads, max_megabytes,
                                                  max_seconds_total, report, every))


class Ticker:
    """Calls a progress with what was done by now, at most every so many seconds."""

    def __init__(self, report: Optional[Progress], total: int, every: float) -> None:
        self.report, self.total, self.every = report, total, every
        self.begin = self.last = time.monotonic()
        self.done = 0
        self.outcomes: Dict[str, int] = {}

    def add(self, done: int, outcomes: Dict[str, int]) -> None:
        self.done += done
        for name, count in outcomes.items():
            self.outcomes[name] = self.outcomes.get(name, 0) + count
        now = time.monotonic()
        if self.report and (now - self.last >= self.every or self.done == self.total):
            self.last = now
            self.report(self.done, self.total, now - self.begin, dict(self.outcomes))
