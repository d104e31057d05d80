# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps chunk by chunk: into a Zarr store, or by the workers of Dask distributed, or both."""
from __future__ import annotations

import hashlib
import importlib
import pickle
from functools import lru_cache
from itertools import islice
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import _core
from .ensemble import BLOCK, Ensemble, Progress, Request, Ticker, chunk_runs, chunks_of
from .ensemble_store import Store

Chunk = Tuple[int, int, int]
#: A task that has ended its worker so often is not tried again.
MAX_ATTEMPTS = 30


class Mismatch(RuntimeError):
    """A worker has another version of library or model than the client."""


def run_once(system: _core.System, request: Request, first: int, count: int, threads: int) -> Dict[str, Any]:
    return _core._sweep(system, request, first, count, threads, 1e9, float("inf"), None, 60.0)


def fingerprint_of(system: _core.System, request: Request) -> str:
    """Of library, model and machine: a hash of names and of the bits of the run without draws."""
    reference = run_once(system, request, 0, 0, 1)["reference"]
    text = repr((_core.__version__, system.name, system.state_names, sorted(system.parameters.items())))
    return hashlib.sha256(text.encode() + np.ascontiguousarray(reference).tobytes()).hexdigest()


@lru_cache(maxsize=8)
def unpack(payload: bytes) -> Tuple[_core.System, Request, int]:
    """On a worker, once for all chunks: the request, if it means the same here."""
    version, fingerprint, threads, packed = pickle.loads(payload)
    if version != _core.__version__:
        raise Mismatch("the client has contact_flow %s, this worker %s" % (version, _core.__version__))
    system, request = pickle.loads(packed)
    if fingerprint_of(system, request) != fingerprint:
        raise Mismatch("the run without draws has other bits on this worker: library, model or machine "
                       "differ from the client's")
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

    def results(self, chunks: List[Chunk]) -> Any:
        """(chunk, answer) as they are done. ConnectionError where the scheduler is lost."""
        distributed: Any = importlib.import_module("distributed")
        killed: Any = importlib.import_module("distributed.scheduler").KilledWorker
        left = iter(chunks)
        attempts: Dict[int, int] = {}
        futures: Dict[str, Chunk] = {}
        done = distributed.as_completed()

        def submit(chunk: Chunk) -> None:
            future = self.client.submit(run_task, self.payload, chunk[1], chunk[2], pure=False)
            futures[future.key] = chunk
            done.add(future)

        threads = sum(self.client.nthreads().values())
        for chunk in islice(left, 2 * threads + 2):
            submit(chunk)
        if not futures:
            return
        for future in done:
            chunk = futures.pop(future.key)
            if future.status == "finished":
                answer = future.result()
                future.release()
                yield chunk, answer
                for more in islice(left, 1):
                    submit(more)
                continue
            error = future.exception() if future.status == "error" else None
            if isinstance(error, killed):
                attempts[chunk[0]] = attempts.get(chunk[0], 0) + 1
                if attempts[chunk[0]] < MAX_ATTEMPTS:
                    submit(chunk)
                    continue
            if error is not None:
                raise error
            raise ConnectionError("the scheduler is lost, or cancelled chunk %d; what is in the directory "
                                  "stays, and is resumed" % chunk[0])


def sweep_chunks(system: _core.System, request: Request, runs: int, *, threads: int,
                 progress: Optional[Progress], every: float, directory: Optional[str], resume: bool,
                 chunk: int, client: Any) -> Ensemble:
    """See contact_flow.sweep."""
    if chunk < 0 or chunk % BLOCK:
        raise ValueError("chunk is %d, expected a multiple of %d runs" % (chunk, BLOCK))
    fingerprint = fingerprint_of(system, request)
    sample = run_once(system, request, 0, min(runs, 1), 1)
    store: Optional[Store] = None
    if directory is not None and resume:
        store = Store.open(directory)
        store.check(system, request, runs, fingerprint)
        store.clean()
        chunk = store.chunk
    else:
        if resume:
            raise ValueError("resume needs a directory")
        chunk = chunk or chunk_runs(system, request, runs)
        if directory is not None:
            store = Store.create(directory, system, request, runs, chunk, sample, fingerprint)
    left = store.missing() if store else list(chunks_of(runs, chunk))
    tally = store.tally() if store else _core.Tally()
    kept: Dict[int, Dict[str, Any]] = {}
    ticker = Ticker(progress, runs, every)
    before = tally.total()
    ticker.add(before.runs, before.outcomes)
    if client is not None:
        payload = pickle.dumps((_core.__version__, fingerprint, threads or 1, pickle.dumps((system, request))))
        results = Pool(client, payload).results(left)
    else:
        results = ((one, run_once(system, request, one[1], one[2], threads)) for one in left)
    for (index, first, count), answer in results:
        if store:
            store.write(index, first, answer["columns"], answer["tally"])
        else:
            kept[index] = answer["columns"]
        tally.merge(answer["tally"])
        ticker.add(count, answer["tally"].total().outcomes)
    if tally.total().runs != runs:   # never, or a chunk was lost
        raise RuntimeError("%d of %d runs were done" % (tally.total().runs, runs))
    columns = store.columns() if store else {
        name: np.concatenate([kept[index][name] for index in sorted(kept)]) if kept else column[:0]
        for name, column in sample["columns"].items()}
    return Ensemble(system, request, {
        "status": _core._ok_status(), "columns": columns, "tally": tally, "reference": sample["reference"],
        "elapsed": 0.0})
