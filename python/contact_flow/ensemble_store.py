# SPDX-License-Identifier: BSD-3-Clause
"""A sweep on the disk: a Zarr group with an array for each column, and the tally of each chunk.

A chunk's columns are written first and its tally last; each is a file that appears whole (a temporary
one is renamed). A chunk without its tally is missing, whatever there is of its columns.
"""
from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import warnings
import zlib
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import _core, zarr_group
from .ensemble import MARGINS, Request, chunks_of, dimensions_of, tangent_names

FORMAT = 1
NOT_RUN = -3
LOCK = ".writer"


def fill_of(name: str, column: Any) -> Any:
    """What a column holds of runs that are not done."""
    return {"f": np.nan, "S": b"", "i": NOT_RUN if "outcome" in name else 0}[column.dtype.kind]


def system_text(system: _core.System) -> Dict[str, Any]:
    """What a system is made of, as JSON has it: a model's name, or a robot's texts."""
    text: Dict[str, Any] = {"parameters": dict(system.parameters)}
    if isinstance(system, _core.Robot):
        text.update(urdf=system.urdf, yaml=system.yaml, folder=getattr(system, "__getstate__")()[3])
    elif isinstance(system, _core.Model):
        text["model"] = system.name
    else:
        text["python"] = "%s.%s" % (type(system).__module__, system.name)
    return text


def system_of(text: Dict[str, Any]) -> _core.System:
    """The system again. A model in Python is known to its program alone."""
    if "model" in text:
        return _core.Model(text["model"], **text["parameters"])
    if "urdf" in text:
        robot = _core.Robot.from_strings(text["urdf"], text["yaml"], text["folder"])
        return robot.with_parameters(**text["parameters"])
    raise ValueError("the store is of the model '%s' in Python: resume it from a program that has it, "
                     "by sweep(..., directory=..., resume=True)" % text.get("python"))


def own(folder: str) -> int:
    """The lock of a folder."""
    lock = os.open(os.path.join(folder, LOCK), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise BlockingIOError(errno.EAGAIN, "another process is writing into it", folder) from None
    except OSError:   # a disk without locks: chunks are whole all the same
        pass
    return lock


def holds_sweep(folder: str) -> bool:
    return os.path.exists(os.path.join(folder, ".zattrs"))


class Store:
    """The Zarr group of one sweep."""

    def __init__(self, folder: str, attributes: Dict[str, Any], group: Any) -> None:
        self.folder = folder
        self.attributes = attributes
        self.group = group
        self.request: Request = attributes["request"]
        self.runs: int = attributes["runs"]
        self.chunk: int = attributes["chunk"]
        self.reference = np.array(attributes["reference"])
        self.lock: Optional[int] = None

    def own(self) -> None:
        """To be its only writer until it is closed, or this process ends. BlockingIOError where another one is.

        By flock(2), which holds among the machines of a network's disk where that offers it."""
        self.lock = own(self.folder)

    def close(self) -> None:
        """Nothing more is written."""
        if self.lock is not None:
            os.close(self.lock)
            self.lock = None

    @staticmethod
    def create(folder: str, system: _core.System, request: Request, runs: int, chunk: int,
               sample: Dict[str, Any], fingerprint: str) -> Store:
        """Makes the folder, and owns it. OSError where it is not empty, not writable or the disk is too small."""
        zarr_group.library()
        if os.path.exists(folder) and (not os.path.isdir(folder) or os.listdir(folder)):
            if os.path.exists(os.path.join(folder, LOCK)) and not holds_sweep(folder):
                raise FileExistsError(errno.EEXIST, "holds the beginning of a sweep that was ended before its first "
                                      "run; delete it", folder)
            raise FileExistsError(errno.EEXIST, "is there and not empty; resume what it holds, or name "
                                  "another", folder)
        os.makedirs(folder, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "no right to write", folder)
        width = sum(int(np.prod(a.shape[1:])) * a.dtype.itemsize for a in sample["columns"].values())
        needed, free = runs * width, shutil.disk_usage(folder).free
        if needed > free:
            raise OSError(errno.ENOSPC, "%d runs take up to %.3g GB there, and %.3g GB are free; keep less "
                          "of each" % (runs, needed * 1e-9, free * 1e-9), folder)
        lock = own(folder)
        try:
            store = Store.fill(folder, system, request, runs, chunk, sample, fingerprint)
        except BaseException:
            os.close(lock)
            raise
        store.lock = lock
        return store

    @staticmethod
    def fill(folder: str, system: _core.System, request: Request, runs: int, chunk: int, sample: Dict[str, Any],
             fingerprint: str) -> Store:
        """The arrays and attributes of an empty store."""
        observables, drawn, _, _ = _core._check_sweep(system, request)
        attributes = {
            "format": FORMAT, "version": _core.__version__, "system": system_text(system), "request": request,
            "runs": runs, "chunk": chunk, "seed": request["seed"], "reference": sample["reference"].tolist(),
            "fingerprint": fingerprint,
            "names": {"start": drawn, "final_state": list(system.state_names), "observables": observables,
                      "margins": list(MARGINS), "derivative": tangent_names(system)},
            "units": {"coordinates": list(system.units), "time": "s"},
            "outcomes": {str(k): _core._outcome_name(k) for k in range(NOT_RUN, 19)}}
        group = zarr_group.create(folder)
        for name, column in sample["columns"].items():
            array = zarr_group.add(group, name, (runs,) + column.shape[1:], (chunk,) + column.shape[1:], column.dtype,
                                   fill_of(name, column))
            array.attrs["_ARRAY_DIMENSIONS"] = dimensions_of(name, column.ndim)
        tally = zarr_group.add(group, "tally", ((runs + chunk - 1) // chunk,), (1,), object, None)
        tally.attrs["_ARRAY_DIMENSIONS"] = ["chunk"]
        group.attrs.update(attributes)   # last: a folder without them is no store
        return Store(folder, attributes, group)

    @staticmethod
    def open(folder: str) -> Store:
        """One that is there."""
        try:
            group = zarr_group.open_group(folder)
            attributes = dict(group.attrs)
        except Exception as error:
            raise ValueError("'%s' holds no sweep: %s" % (folder, error)) from None
        if attributes.get("format") != FORMAT:
            raise ValueError("'%s' holds no sweep of this format" % folder)
        return Store(folder, attributes, group)

    def check(self, system: _core.System, request: Request, runs: int, fingerprint: str) -> None:
        """ValueError unless this is the store of that sweep."""
        for key, wanted in (("version", _core.__version__), ("system", system_text(system)),
                            ("request", request), ("runs", runs), ("fingerprint", fingerprint)):
            if self.attributes[key] != json.loads(json.dumps(wanted)):
                raise ValueError("'%s' is of another sweep: its %s differs" % (self.folder, key))

    def missing(self) -> List[Tuple[int, int, int]]:
        """(chunk, first run, number of runs) of what is left."""
        path = os.path.join(self.folder, "tally")
        there = set(os.listdir(path))
        return [c for c in chunks_of(self.runs, self.chunk) if str(c[0]) not in there]

    def clean(self) -> None:
        """Removes temporary files of writers that were killed."""
        for path, _, names in os.walk(self.folder):
            for name in names:
                if name.endswith(".partial"):
                    os.unlink(os.path.join(path, name))

    def write(self, index: int, first: int, columns: Dict[str, Any], tally: _core.Tally) -> None:
        """One chunk, whole or not at all."""
        sums = {}
        for name, column in columns.items():
            sums[name] = zlib.crc32(np.ascontiguousarray(column).tobytes())
            self.group[name][first:first + len(column)] = column
        text = json.dumps(sums).encode()
        whole = np.empty(1, dtype=object)
        whole[0] = len(text).to_bytes(4, "little") + text + tally.to_bytes()
        self.group["tally"][index:index + 1] = whole

    def read(self, index: int) -> Tuple[Dict[str, int], _core.Tally]:
        """(checksums of its columns, tally) of a chunk. ValueError where it is damaged."""
        whole = self.group["tally"][index:index + 1][0]
        length = int.from_bytes(whole[:4], "little")
        return json.loads(whole[4:4 + length]), _core.Tally.from_bytes(whole[4 + length:])

    def tally(self) -> _core.Tally:
        """Of all chunks that are there."""
        tally = _core.Tally()
        missing = {index for index, _, _ in self.missing()}
        for index, _, _ in chunks_of(self.runs, self.chunk):
            if index not in missing:
                tally.merge(self.read(index)[1])
        return tally

    def verify(self) -> List[int]:
        """Chunks whose columns are not those that were written."""
        missing = {index for index, _, _ in self.missing()}
        damaged = []
        for index, first, count in chunks_of(self.runs, self.chunk):
            if index in missing:
                continue
            try:
                sums = self.read(index)[0]
                ok = all(zlib.crc32(np.ascontiguousarray(self.group[name][first:first + count]).tobytes()) == s
                         for name, s in sums.items())
            except Exception:   # of whatever a codec throws
                ok = False
            if not ok:
                damaged.append(index)
        return damaged

    def columns(self) -> Dict[str, Any]:
        """The arrays, which read what is asked of them from the disk."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")   # Zarr 3 tells of the lock, which is no array
            return {name: array for name, array in self.group.arrays() if name != "tally"}


def open_sweep(folder: str, system: Optional[_core.System] = None) -> Any:
    """The Ensemble of a store: its columns are Zarr arrays, read when they are indexed.

    Chunks that are missing are counted nowhere; `resume` them first."""
    from .ensemble import Ensemble
    store = Store.open(folder)
    found = system_of(store.attributes["system"]) if system is None else system
    return Ensemble(found, store.request, {"status": _core._ok_status(), "columns": store.columns(),
                                           "tally": store.tally(), "reference": store.reference,
                                           "elapsed": float("nan")})
