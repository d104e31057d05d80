# SPDX-License-Identifier: BSD-3-Clause
"""Groups of arrays in a folder, of Zarr's format 2, by the library's versions 2 and 3. Each file of them appears whole."""
from __future__ import annotations

import os
from typing import Any, Tuple


def library() -> Any:
    try:
        import zarr
    except ImportError:
        raise ImportError("a sweep with a directory needs Zarr: apt install python3-zarr, or pip install zarr") from None
    return zarr


def is_of_3() -> bool:
    return int(str(library().__version__).split(".", 1)[0]) >= 3


def store_of(folder: str) -> Any:
    """The folder as a store. Zarr 3 writes into its files, where 2 renames temporary ones."""
    zarr = library()
    if not is_of_3():
        return zarr.DirectoryStore(folder)

    local: Any = getattr(zarr.storage, "LocalStore")

    class WholeFiles(local):  # type: ignore[misc]
        async def set(self, key: str, value: Any) -> None:
            path = os.path.join(folder, key)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            partial = "%s.%d.partial" % (path, os.getpid())
            try:
                with open(partial, "wb") as file:
                    file.write(value.to_bytes())
                os.replace(partial, path)
            except BaseException:
                if os.path.exists(partial):
                    os.unlink(partial)
                raise

    return WholeFiles(folder)


def create(folder: str) -> Any:
    """The group of a folder that holds none."""
    zarr = library()
    if is_of_3():
        return zarr.create_group(store_of(folder), zarr_format=2)   # open_group would empty the folder of its lock
    return zarr.group(store_of(folder))


def open_group(folder: str) -> Any:
    """The group that is there, to be written."""
    return library().open_group(store_of(folder), mode="r+")


def add(group: Any, name: str, shape: Tuple[int, ...], chunks: Tuple[int, ...], dtype: Any, fill_value: Any) -> Any:
    """A new array. Of dtype `object` its entries are bytes of any length."""
    import numcodecs
    coded = dtype is object
    if is_of_3():
        return group.create_array(name, shape=shape, chunks=chunks, dtype=dtype, fill_value=fill_value,
                                  filters=[numcodecs.VLenBytes()] if coded else None)
    return group.create_dataset(name, shape=shape, chunks=chunks, dtype=dtype, fill_value=fill_value,
                                object_codec=numcodecs.VLenBytes() if coded else None)
