# SPDX-License-Identifier: BSD-3-Clause
"""Runs out of recorded bags, computed again: of `simulate` and `b_derivative`, and the epochs of a simulator;
and runs into bags. Needs ROS's rosbag.

    recorded = contact_flow.bags.runs("landing.bag")       # in the order of the bag
    recorded[-1].run.report("landing.html", by=recorded[-1].by)
    recorded[-1].same                                      # bit for bit what was recorded
    contact_flow.bags.write("mine.bag", [run])
"""
from __future__ import annotations

import os
import warnings
from typing import Any, Dict, List, NamedTuple, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _core
from .bag_writer import write
from .sections import Grid

__all__ = ["Recorded", "runs", "write"]

Array = NDArray[np.float64]


BEHIND = 1e-9  #: an event this near to the end of a simulator's epoch [s], relative, is passed there


class NoStart(ValueError):
    """A record does not tell where its run begins."""


class Recorded(NamedTuple):
    """A run of a bag: its topic, what was differentiated by, the run, how its recorded end differs [largest], and
    whether that is the same, bit for bit."""
    topic: str
    by: Tuple[str, ...]
    run: _core.Run
    difference: float
    same: bool


def system_of(description: Any) -> _core.System:
    """The system of a ModelDescription. ValueError for a model that this process does not have."""
    parameters = {p.name: p.value for p in description.parameters}
    if description.urdf:
        return _core.Robot.from_strings(description.urdf, description.robot_yaml, **parameters)
    if description.name not in _core.models():
        raise ValueError("the bag is of the model '%s', which is not here: load its library first "
                         "(ctypes.CDLL)" % description.name)
    return _core.Model(description.name, **parameters)


def options_of(asked: Any, usual: Any) -> Dict[str, Any]:
    """Options of a request by name; 0, False and "" mean those of the node."""
    found: Dict[str, Any] = {}
    for name in asked.__slots__:
        value = getattr(asked, name) or getattr(usual, name)
        if value not in (0, "", False):
            found[name] = value
    return found


def start_of(request: Any, result: Any, system: _core.System) -> Array:
    """x(0) of a request: numbers, some by name, or where it was projected on what must hold, the first sample."""
    state, x, nq = request.state, system.nominal.x.copy(), system.num_positions
    if state.project:
        if not getattr(result, "t", ()):
            raise NoStart("its start was projected, and it has no samples that tell where to")
        return np.array(list(result.q.data[:result.q.cols]) + list(result.v.data[:result.v.cols]))
    if state.q:
        x[:nq] = state.q
    if state.v:
        x[nq:] = state.v
    for values, names, first in ((state.positions, system.coordinates, 0),
                                 (state.velocities, system.velocities, nq)):
        for name, value in zip(state.names, values):
            x[first + list(names).index(name)] = value
    return x


def inputs_of(request: Any, system: _core.System) -> Union[Array, Grid]:
    """The constant input, or that of the grid."""
    u = np.array(request.input or system.nominal.u, dtype=float)
    grid = request.input_grid
    if not grid.times and not grid.values.data:
        return u
    values = np.array(grid.values.data, dtype=float).reshape((-1, len(system.inputs))) if grid.values.data \
        else np.tile(u, (len(grid.times), 1))
    return Grid(grid.times or [0], values)


def answer(topic: str, message: Any, description: Any) -> Recorded:
    """Of a SimulationRecord or DerivativeRecord."""
    request, result, system = message.request, message.result, system_of(description)
    by: List[str] = ["state"]
    if getattr(request, "by_inputs", False):
        by.append("inputs")
    by += list(getattr(request, "by_parameters", ()))
    run = system.simulate(start_of(request, result, system), request.duration or None, inputs_of(request, system),
                          **options_of(request.options, description.options))
    return recorded(topic, tuple(by), run, list(result.final_q) + list(result.final_v))


def recorded(topic: str, by: Tuple[str, ...], run: _core.Run, end: List[float]) -> Recorded:
    """With what the bag says of its end, (q, v) or a shorter beginning of both."""
    nq = run.system.num_positions
    own = np.concatenate([run.final_state[:nq][:len(end) - run.system.dof], run.final_state[nq:]])
    if len(own) != len(end):
        return Recorded(topic, by, run, float("nan"), False)
    difference = float(np.max(np.abs(own - np.array(end)))) if end else 0.0
    return Recorded(topic, by, run, difference, difference == 0)


class Epochs:
    """A simulator's bag: each epoch is a run under the inputs that it took, to its last recorded state."""

    def __init__(self) -> None:
        self.found: List[Recorded] = []
        self.description: Any = None
        self.epoch: Any = None
        self.state: Any = None
        self.inputs: List[Any] = []

    def take(self, topic: str, message: Any) -> None:
        kind = message._type.split("/")[1]
        if kind == "SimulatorEpoch":
            self.end()
            self.epoch, self.topic, self.state, self.inputs = message, topic, None, []
        elif kind == "SimulatorInput" and self.epoch is not None and message.epoch == self.epoch.epoch:
            self.inputs.append(message)
        elif kind == "HybridState" and self.epoch is not None and message.epoch == self.epoch.epoch:
            self.state = message

    def end(self) -> None:
        """The epoch is over: its run, on a clock that begins with it."""
        epoch, state = self.epoch, self.state
        if epoch is None or state is None or self.description is None or state.t <= epoch.t:
            return
        system = system_of(self.description).with_parameters(
            **dict(zip(epoch.parameter_names, epoch.parameter_values)))
        times, values = [0.0], [list(epoch.input)]
        for taken in self.inputs:
            if taken.t >= state.t:
                break
            if taken.t - epoch.t > times[-1]:
                times.append(taken.t - epoch.t)
                values.append(list(taken.input))
            else:
                values[-1] = list(taken.input)
        grid = Grid(times, np.array(values).reshape((len(times), -1)))

        def simulate(duration: float) -> _core.Run:
            return system.simulate(list(epoch.q) + list(epoch.v), duration, grid,
                                   **options_of(self.description.options, self.description.options))

        duration, end = state.t - epoch.t, [float(number) for number in list(state.q) + list(state.v)]
        found = recorded(self.topic, ("state",), simulate(duration), end)
        # A run ends before an event at its end, a simulator that stops there is behind it.
        if not found.same:
            for event in simulate(duration + BEHIND * (1 + duration)).events:
                if abs(event.t - duration) > BEHIND * (1 + duration) or len(event.x_plus) != len(end):
                    continue
                difference = float(np.max(np.abs(event.x_plus - end)))
                if difference < found.difference:
                    found = found._replace(difference=difference, same=difference == 0)
        self.found.append(found)
        self.epoch = None


def runs(path: Union[str, "os.PathLike[str]"]) -> List[Recorded]:
    """The runs of a bag, in its order. ImportError without rosbag; ValueError where there are none. The end of a
    simulator's epoch is its last state, where the last step is cut: it is the same to the tolerance."""
    try:
        import rosbag
    except ImportError:
        raise ImportError("bags are read by ROS's python3-rosbag, which is not installed") from None
    found: List[Recorded] = []
    epochs, description = Epochs(), None
    with rosbag.Bag(os.fspath(path)) as bag:
        for topic, message, _ in bag.read_messages():
            kind = message._type.split("/")[1] if message._type.startswith("contact_flow/") else ""
            if kind == "ModelDescription":
                if topic.endswith("online_model"):
                    epochs.description = message
                else:
                    description = message
            elif kind in ("SimulationRecord", "DerivativeRecord") and description is not None:
                try:
                    found.append(answer(topic, message, description))
                except NoStart as reason:
                    warnings.warn("%s in %s is left out: %s" % (topic, os.fspath(path), reason))
            elif kind:
                epochs.take(topic, message)
    epochs.end()
    found += epochs.found
    if not found:
        raise ValueError("%s has no runs: none of simulate, b_derivative or the simulator" % os.fspath(path))
    return found
