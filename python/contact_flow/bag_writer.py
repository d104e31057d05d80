# SPDX-License-Identifier: BSD-3-Clause
"""Runs as bags: what a node would have recorded of them. Needs ROS's rosbag.

    contact_flow.bags.write("landing.bag", [run])          # then: rosbag play, contact_flow.bags.runs, a report

They are on the topics of a node, its model first, so that `contact_flow.bags.runs` gives them back to the bit.
There is no hash chain, which is a node's alone: verify_bag says so.
"""
from __future__ import annotations

import importlib
import os
from typing import Any, Iterable, List, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _core

Array = NDArray[np.float64]
SAMPLES = 200  #: instants of a run between its events
CONSTANTS = {  #: of SimulateTrajectory.srv, of outcomes that have other names there
    "sliding or not unique (Filippov)": "FILIPPOV", "no contact forces (Painleve)": "PAINLEVE_INCONSISTENT",
    "several motions (Painleve)": "PAINLEVE_INDETERMINATE", "singular slip (Painleve)": "PAINLEVE_CROSSING"}


def check(run: _core.Run) -> None:
    """ValueError for what no request of a node says."""
    if isinstance(run.system, _core.PythonModel):
        raise ValueError("%s is a model in Python: a bag cannot hold its formulas" % run.system.name)
    if not run.repeats:
        raise ValueError("the run ends behind its event, and no request repeats it")
    if run.duration == 0:
        raise ValueError("the run has duration 0, which as a request stands for the nominal one")
    if not run.options["dense"]:
        raise ValueError("the run was made with dense=False")
    if run.input_grid[0][0] != 0:
        raise ValueError("the grid of the run begins at %g s, a request's at 0" % run.input_grid[0][0])


def options_of(run: _core.Run, kind: Any) -> Any:
    """The options as a message. ValueError where one is 0 that a request takes for its default."""
    message, usual = kind(), _core._options_of()
    for name in message.__slots__:
        value = run.options[name]
        if value in (0, "", False) and value != usual[name]:
            raise ValueError("option %s is %r, which as a request stands for the default" % (name, value))
        setattr(message, name, value)
    return message


def description_of(run: _core.Run, msg: Any) -> Any:
    """ModelDescription of the run's system, with its options."""
    system, nq = run.system, run.system.num_positions
    told = msg.ModelDescription(
        name=system.name, summary=system.summary, coordinates=list(system.coordinates), units=list(system.units),
        velocities=list(system.velocities), bilateral=list(system.bilateral),
        constraints=list(system.constraints), restitution=system.restitution.tolist(), inputs=list(system.inputs),
        parameters=[msg.ModelParameter(p.name, p.unit, p.meaning, p.value) for p in system.parameter_list],
        nominal_q=system.nominal.x[:nq].tolist(), nominal_v=system.nominal.x[nq:].tolist(),
        nominal_input=system.nominal.u.tolist(), nominal_duration=system.nominal.duration,
        options=options_of(run, msg.SimulationOptions), samples=SAMPLES)
    if isinstance(system, _core.Robot):
        told.urdf, told.robot_yaml, told.warnings = system.urdf, system.yaml, list(system.warnings)
    return told


def request_of(run: _core.Run, msg: Any) -> Any:
    nq, (t, u) = run.system.num_positions, run.input_grid
    asked = msg.SimulationRequest(duration=run.duration, samples=SAMPLES)
    asked.state = msg.InitialState(q=run.x0[:nq].tolist(), v=run.x0[nq:].tolist())
    asked.options = options_of(run, msg.SimulationOptions)
    if len(t) == 1:
        asked.input = u[0].tolist()
    else:
        asked.input_grid = msg.InputGrid(times=t.tolist(), values=matrix(u, msg))
    return asked


def matrix(values: Array, msg: Any) -> Any:
    return msg.RowMajorMatrix(values.shape[0], values.shape[1], values.ravel().tolist())


def transition_of(event: _core.Event, run: _core.Run, msg: Any) -> Any:
    system, nq, n = run.system, run.system.num_positions, len(run.system.constraints)
    m = msg.ContactTransition(
        t=event.t, mode_before=list(event.mode_before), mode_after=list(event.mode_after),
        mode_words=[event.word_before, event.word_after], activated=list(event.activated),
        released=list(event.released), switched=list(event.switched), spread=event.spread)
    m.q = event.x_minus[:nq].tolist()
    m.v_before, m.v_after = event.x_minus[nq:].tolist(), event.x_plus[nq:].tolist()
    m.impulse = event.impulse[:n].tolist()
    m.tangential_impulse = event.impulse[n + len(system.bilateral):].tolist()
    m.completes_zeno = "zeno" in event.kinds
    return m


def arc_samples(run: _core.Run, arc: _core.Arc) -> Tuple[Array, Array]:
    """Both ends of an arc, and the instants of the run inside."""
    t = run.t_begin + (run.t_end - run.t_begin) * np.arange(SAMPLES) / (SAMPLES - 1.0)
    t = t[(t > arc.t_begin) & (t < arc.t_end)]
    inside = run.x(t)
    return np.concatenate([[arc.t_begin], t, [arc.t_end]]), np.vstack([arc.x_begin, inside, arc.x_end])


def result_of(run: _core.Run, msg: Any, outcome: int) -> Any:
    system, nq = run.system, run.system.num_positions
    m = msg.ContactTrajectory(
        model=system.name, coordinates=list(system.coordinates), velocities=list(system.velocities),
        constraints=list(system.constraints), outcome=outcome, message=run.status.message, duration=run.duration,
        t_end=run.t_end, final_q=run.final_state[:nq].tolist(), final_v=run.final_state[nq:].tolist(),
        mode_words=[arc.word for arc in run.arcs], method=run.options["method"])
    for name in m.margins.__slots__:
        setattr(m.margins, name, getattr(run.margins, name))
    m.field_evaluations, m.steps = run.statistics.field_evaluations, run.statistics.steps
    m.rejected_steps, m.implicit_steps = run.statistics.rejected_steps, run.statistics.implicit_steps
    m.transitions = [transition_of(event, run, msg) for event in run.events]
    times: List[Array] = []
    states: List[Array] = []
    for arc in run.arcs:
        t, x = arc_samples(run, arc)
        m.arcs.append(msg.TrajectoryArc(mode=list(arc.mode), mode_word=arc.word, t_begin=arc.t_begin, t_end=arc.t_end,
                                        input=arc.u.tolist(), first_sample=sum(len(one) for one in times), num_samples=len(t)))
        times.append(t)
        states.append(x)
    x = np.vstack(states)
    m.t, m.q, m.v = np.concatenate(times).tolist(), matrix(x[:, :nq], msg), matrix(x[:, nq:], msg)
    return m


def outcome_number(name: str) -> int:
    """Of the constants of SimulateTrajectory.srv."""
    response: Any = importlib.import_module("contact_flow.srv").SimulateTrajectoryResponse
    return int(getattr(response, CONSTANTS.get(name, name.upper().replace(" ", "_").replace("-", "_"))))


def write(path: Union[str, "os.PathLike[str]"], runs: Iterable[_core.Run], node: str = "/contact_flow") -> None:
    """Writes runs as those of `node`, in their order. ImportError without rosbag; ValueError, before anything is
    written, for runs that no request repeats: of models in Python, of duration 0, returns to an event."""
    try:
        import rosbag
        msg: Any = importlib.import_module("contact_flow.msg")
    except ImportError:
        raise ImportError("bags are written by ROS's python3-rosbag, which is not installed") from None
    messages: List[Tuple[str, Any]] = []
    last = None
    for run in runs:
        check(run)
        description = description_of(run, msg)
        if last is None or description != last:
            messages.append((node + "/model_description", description))
            last = description
        record = msg.SimulationRecord(request=request_of(run, msg),
                                      result=result_of(run, msg, outcome_number(run.status.outcome)))
        messages.append((node + "/record/simulation", record))
    if not messages:
        raise ValueError("there are no runs")
    with rosbag.Bag(os.fspath(path), "w") as bag:
        for topic, message in messages:
            bag.write(topic, message)
