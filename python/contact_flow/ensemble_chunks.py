# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps chunk by chunk: into a Zarr store, or by the workers of Dask distributed, or both."""
from __future__ import annotations

import hashlib
import importlib
import pickle
import time
from concurrent.futures import CancelledError
from functools import lru_cache
from itertools import islice
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np

from . import _core
from .ensemble import BLOCK, Ensemble, Progress, Request, Ticker, chunk_runs, chunks_of
from .ensemble_store import Store, fill_of

Chunk = Tuple[int, int, int]
#: A task that has ended its worker so often is not tried again.
MAX_ATTEMPTS = 30
#: The first runs, whose bits are compared.
PROBES = 4
LOOK_EVERY = 0.02   #: at the deadline, and while connecting [s]


class Mismatch(RuntimeError):
    """A worker has another version of library or model than the client."""


def run_once(system: _core.System, request: Request, first: int, count: int, threads: int,
             seconds: float = float("inf")) -> Dict[str, Any]:
    return _core._sweep(system, request, first, count, threads, 1e9, seconds, None, 60.0)


def fingerprint_of(system: _core.System, request: Request, runs: int) -> str:
    """Of library, model and machine: a hash of names and of the bits of the run without draws and of the first
    ones with them."""
    text = repr((_core.__version__, system.name, system.state_names, sorted(system.parameters.items())))
    found = hashlib.sha256(text.encode())
    found.update(np.ascontiguousarray(run_once(system, request, 0, 0, 1)["reference"]).tobytes())
    found.update(run_once(system, request, 0, min(runs, PROBES), 1)["tally"].to_bytes())
    return found.hexdigest()


@lru_cache(maxsize=8)
def unpack(payload: bytes) -> Tuple[_core.System, Request, int]:
    """On a worker, once for all chunks: the request, if it means the same here."""
    version, fingerprint, runs, threads, packed = pickle.loads(payload)
    if version != _core.__version__:
        raise Mismatch("the client has contact_flow %s, this worker %s" % (version, _core.__version__))
    system, request = pickle.loads(packed)
    if fingerprint_of(system, request, runs) != fingerprint:
        raise Mismatch("the first runs have other bits on this worker: library, model or machine differ from the "
                       "client's")
    return system, request, threads


def run_task(payload: bytes, first: int, count: int) -> Dict[str, Any]:
    """A chunk, on a worker."""
    system, request, threads = unpack(payload)
    answer = run_once(system, request, first, count, threads)
    return {"columns": answer["columns"], "tally": answer["tally"]}


def check_worker(payload: bytes) -> str:
    """'', or why a worker cannot take part."""
    try:
        unpack(payload)
    except Exception as error:
        return "%s: %s" % (type(error).__name__, error)
    return ""


def answer_of(future: Any) -> Any:
    """What a future that is done has brought, or None. A scheduler that is lost cancels those that are finished, too,
    until their answers are here."""
    if future.status != "finished":
        return None
    try:
        return future.result()
    except CancelledError:
        return None
    finally:
        future.release()


def lost(chunk: Chunk) -> ConnectionError:
    return ConnectionError("the scheduler is lost, or cancelled chunk %d; what is in the directory stays, and is resumed"
                           % chunk[0])


class Pool:
    """Chunks in the hands of Dask's workers, a few each. A worker's death costs the chunk it had."""

    def __init__(self, client: Any, payload: bytes) -> None:
        self.client, self.payload = client, payload
        answers = client.run(check_worker, payload)
        if not answers:
            raise RuntimeError("the client has no workers yet")
        for worker, reason in answers.items():
            if reason:
                raise Mismatch("%s: %s" % (worker, reason))

    def results(self, chunks: List[Chunk], deadline: float) -> Any:
        """(chunk, answer) as they are done, up to a deadline by time.monotonic. ConnectionError where the
        scheduler is lost."""
        distributed: Any = importlib.import_module("distributed")
        killed: Any = importlib.import_module("distributed.scheduler").KilledWorker
        left = iter(chunks)
        attempts: Dict[int, int] = {}
        futures: Dict[str, Chunk] = {}
        done = distributed.as_completed()

        def submit(chunk: Chunk) -> None:
            if not self.connected(deadline):
                raise lost(chunk)
            future = self.client.submit(run_task, self.payload, chunk[1], chunk[2], pure=False)
            futures[future.key] = chunk
            done.add(future)

        threads = sum(self.client.nthreads().values())
        for chunk in islice(left, 2 * threads + 2):
            submit(chunk)
        if not futures:
            return
        while futures:
            while time.monotonic() <= deadline < float("inf") and not done.has_ready():
                time.sleep(LOOK_EVERY)
            if time.monotonic() > deadline:   # however many answers wait
                self.client.cancel(list(done.futures))
                return
            future = next(done)
            chunk = futures.pop(future.key)
            answer = answer_of(future)
            if answer is not None:
                yield chunk, answer
                for more in islice(left, 1):
                    submit(more)
                continue
            error = future.exception() if future.status == "error" else None
            if isinstance(error, killed) or error is None and self.connected(deadline):
                attempts[chunk[0]] = attempts.get(chunk[0], 0) + 1
                if attempts[chunk[0]] < MAX_ATTEMPTS:
                    submit(chunk)
                    continue
            if error is not None:
                raise error
            raise lost(chunk)

    def connected(self, deadline: float) -> bool:
        """Whether the client has its scheduler. One that lost its connection for a moment finds it again, or gives
        it up, by Dask's own timeout; what it had asked for is cancelled in either case."""
        while self.client.status == "connecting" and time.monotonic() < deadline:
            time.sleep(LOOK_EVERY)
        return bool(self.client.status == "running")


def sweep_chunks(system: _core.System, request: Request, runs: int, *, threads: int,
                 progress: Optional[Progress], every: float, directory: Optional[str], resume: bool,
                 chunk: int, client: Any, max_megabytes: float = 4000,
                 max_seconds_total: float = float("inf")) -> Ensemble:
    """See contact_flow.sweep."""
    deadline = time.monotonic() + max_seconds_total
    if chunk < 0 or chunk % BLOCK:
        raise ValueError("chunk is %d, expected a multiple of %d runs" % (chunk, BLOCK))
    fingerprint = fingerprint_of(system, request, runs)
    sample = run_once(system, request, 0, min(runs, 1), 1)
    store: Optional[Store] = None
    if directory is not None and resume:
        store = Store.open(directory)
        store.check(system, request, runs, fingerprint)
        store.own()
        chunk = store.chunk
    elif resume:
        raise ValueError("resume needs a directory")
    else:
        chunk = chunk or chunk_runs(system, request, runs)
    if directory is not None and store is None:
        store = Store.create(directory, system, request, runs, chunk, sample, fingerprint)
    megabytes = 1e-6 * runs * sum(column.nbytes for column in sample["columns"].values())   # it has one run
    if store is None and megabytes > max_megabytes:
        raise _core.BudgetExceeded("the columns of %d runs take %.0f MB, more than max_megabytes; keep less of each, "
                                   "or name a directory" % (runs, megabytes))

    def results(left: List[Chunk]) -> Any:
        if client is None:
            return results_here(system, request, left, threads, deadline)
        return Pool(client, pickle.dumps((_core.__version__, fingerprint, runs, threads or 1,
                                          pickle.dumps((system, request))))).results(left, deadline)
    ticker = Ticker(progress, runs, every)
    kept: Dict[int, Dict[str, Any]] = {}
    try:
        tally = run_chunks(results, store, runs, chunk, kept, ticker)
    finally:
        if store:
            store.close()
    done = tally.total().runs
    if done != runs and time.monotonic() < deadline:   # never, or a chunk was lost
        raise RuntimeError("%d of %d runs were done" % (done, runs))
    return Ensemble(system, request, {
        "status": _core._ok_status() if done == runs else _core._budget_status(
            "max_seconds_total = %g are used up: %d of %d runs are done" % (max_seconds_total, done, runs)),
        "columns": store.columns() if store else joined(kept, sample["columns"], chunk, runs), "tally": tally,
        "reference": sample["reference"], "elapsed": time.monotonic() - ticker.begin})


def run_chunks(results: Callable[[List[Chunk]], Any], store: Optional[Store], runs: int, chunk: int,
               kept: Dict[int, Dict[str, Any]], ticker: Ticker) -> _core.Tally:
    """What is left, into the store or into `kept`, and the tally of all."""
    if store:
        store.clean()
    tally = store.tally() if store else _core.Tally()
    before = tally.total()
    ticker.add(before.runs, before.outcomes)
    for (index, first, count), answer in results(store.missing() if store else list(chunks_of(runs, chunk))):
        if store:
            store.write(index, first, answer["columns"], answer["tally"])
        else:
            kept[index] = answer["columns"]
        tally.merge(answer["tally"])
        ticker.add(count, answer["tally"].total().outcomes)
    return tally


def results_here(system: _core.System, request: Request, left: List[Chunk], threads: int, deadline: float) -> Any:
    """(chunk, answer) one after the other, up to a deadline: a chunk that it cuts is none."""
    for one in left:
        seconds = deadline - time.monotonic()
        answer = run_once(system, request, one[1], one[2], threads, seconds) if seconds > 0 else None
        if answer is None or not answer["status"]:
            return
        yield one, answer


def joined(kept: Dict[int, Dict[str, Any]], sample: Dict[str, Any], chunk: int, runs: int) -> Dict[str, Any]:
    """Columns of all runs; of those that were not done what Zarr fills in."""
    found = {}
    for name, column in sample.items():
        whole = np.full((runs,) + column.shape[1:], fill_of(name, column), dtype=column.dtype)
        for index, columns in kept.items():
            part = columns.pop(name)
            whole[index * chunk:index * chunk + len(part)] = part
        found[name] = whole
    return found
