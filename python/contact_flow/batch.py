# SPDX-License-Identifier: BSD-3-Clause
"""Many runs of one system at once, from states that are given."""
import dataclasses
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK = 8192   #: runs; those that are left when Ctrl-C ends one are not begun


class BatchEvent(NamedTuple):
    """A cluster of events of a run: when, what hit, what let go, the contact mode after it, impulses."""
    t: float
    activated: Tuple[str, ...]
    released: Tuple[str, ...]
    mode_after: Tuple[str, ...]
    impulse: Array


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class Batch:
    """What is kept of each run, in the order of their starts: the numbers of System.simulate, to the bit."""
    final_state: Array             #: [runs × nq+d]; NaN where the start was refused
    error: Array                   #: estimated errors added up in the last arc [runs × 2d]
    t_end: Array                   #: [runs], s
    outcome: List[str]             #: "ok", "zeno", …, or "refused"
    message: List[str]             #: why, where not ok
    first_mode: List[Tuple[str, ...]]   #: contact modes of the starts
    events: List[List[BatchEvent]]      #: of each run, in the order of time
    alone: NDArray[np.bool_]       #: [runs] which were made one at a time
    steps: NDArray[np.int_]        #: [runs] accepted
    field_evaluations: NDArray[np.int_]  #: [runs]
    width: int                     #: lanes; 1: there were none
    why: str                       #: why there were none

    def __len__(self) -> int:
        return len(self.outcome)

    def modes(self, run: int) -> List[Tuple[str, ...]]:
        """The contact modes that a run passed through, as Run.modes."""
        return [self.first_mode[run]] + [event.mode_after for event in self.events[run]]

    def __repr__(self) -> str:
        ok = sum(outcome == "ok" for outcome in self.outcome)
        return "<Batch of %d runs, %d ok, %d lanes>" % (len(self), ok, self.width)


def _joined(blocks: List[Dict[str, Any]]) -> Dict[str, Any]:
    """Columns of several blocks of runs as those of all; what is no column is that of the first."""
    joined = dict(blocks[0])
    for name, column in blocks[0].items():
        if isinstance(column, np.ndarray):
            joined[name] = np.concatenate([block[name] for block in blocks])
        elif isinstance(column, list):
            joined[name] = [one for block in blocks for one in block[name]]
    return joined


def simulate_batch(system: Any, states: Any, duration: Optional[float] = None, inputs: Any = None,
                   threads: int = 1, lanes: str = "best", **options: Any) -> Batch:
    """Runs from the rows of `states` [runs × nq+d], each as System.simulate makes it.

    inputs: one for all, or the rows of [runs × m]. lanes: "best", "none", "avx2", "avx512"; nothing of it,
    nor threads, changes a bit. Options are those of System.simulate. What simulate would refuse is an
    outcome "refused" of that run; ValueError for sizes and options.
    """
    states = np.asarray(states) if isinstance(states, (list, tuple)) else states
    inputs = np.asarray(inputs) if isinstance(inputs, (list, tuple)) else inputs
    rows = len(states) if isinstance(states, np.ndarray) and states.ndim == 2 else 0
    if rows <= BLOCK:
        columns = system._simulate_batch(states, duration, inputs, threads, lanes, **options)
    else:
        own = isinstance(inputs, np.ndarray) and inputs.ndim == 2 and len(inputs) == rows   # of each run
        columns = _joined([system._simulate_batch(states[k:k + BLOCK], duration, inputs[k:k + BLOCK] if own else inputs,
                                                  threads, lanes, **options) for k in range(0, rows, BLOCK)])
    columns["events"] = [[BatchEvent(*event) for event in run] for run in columns["events"]]
    for name, kind in (("alone", bool), ("steps", int), ("field_evaluations", int)):
        columns[name] = np.array(columns[name], dtype=kind)
    return Batch(**columns)
