#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What goes wrong on the way of a sweep: disks that fill or cannot be written, two writers, time that ends; and readers."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import case
import contact_flow as cf
from ensemble_test import OutOfOrder

ZARR = importlib.util.find_spec("zarr")
PITCH = {"body_pitch": cf.Uniform(-0.3, 0.3)}
RUNS = 5000
#: Another mount namespace, as root or as who may be root in one of its own.
NAMESPACE = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", "--mount"]

#: On a disk of 4 MB that somebody else fills meanwhile; then there is room again.
FULL = """
import os, subprocess, sys
import numpy as np
import contact_flow as cf
disk = sys.argv[1]
subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "none", disk], check=True)
biped, draws, folder = cf.Model("soft_biped"), {"body_pitch": cf.Uniform(-0.3, 0.3)}, disk + "/store"
filler = os.path.join(disk, "filler")

def fill(done, total, *_):
    if done > total / 3 and not os.path.exists(filler):
        with open(filler, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(4096))
            except OSError as error:
                print("filled:", error.strerror)
try:
    biped.sweep(draws, 5000, seed=3, directory=folder, chunk=256, progress=fill, every=0)
except OSError as error:
    print("ended:", error.strerror)
print("left:", len(cf.ensemble_store.Store.open(folder).missing()))
try:
    biped.sweep(draws, 5000, seed=3, directory=disk + "/other")
except OSError as error:
    print("refused:", error)
os.unlink(filler)
found = biped.sweep(draws, 5000, seed=3, directory=folder, resume=True)
whole = biped.sweep(draws, 5000, seed=3)
print("same:", found.tally.to_bytes() == whole.tally.to_bytes() and all(
    column.tobytes() == np.asarray(found[name][:]).tobytes() for name, column in whole.columns.items()))
"""

READ_ONLY = """
import os, subprocess, sys
import contact_flow as cf
disk = sys.argv[1]
subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "none", disk], check=True)
calls = []
for folder in (disk, disk + "/store"):
    try:
        cf.Model("soft_biped").sweep({"body_pitch": cf.Uniform(-0.3, 0.3)}, 5000, directory=folder,
                                     progress=lambda *a: calls.append(a), every=0)
    except OSError as error:
        print("refused:", error)
print("runs:", len(calls))
"""

#: No file may be larger than this: what a quota does.
SMALL_FILES = """
import resource, sys
import contact_flow as cf
store = cf.ensemble_store.Store
write, count = store.write, [0]

def limited(self, *arguments):
    count[0] += 1
    if count[0] == 5:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, resource.RLIM_INFINITY))
    write(self, *arguments)
store.write = limited
try:
    cf.Model("soft_biped").sweep({"body_pitch": cf.Uniform(-0.3, 0.3)}, 5000, seed=3, directory=sys.argv[1], chunk=256)
except OSError as error:
    print("ended:", error.strerror)
"""


class Folder(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.disk = temporary.name
        self.folder = os.path.join(temporary.name, "store")

    def in_namespace(self, program):
        if subprocess.run(NAMESPACE + ["true"], stderr=subprocess.DEVNULL).returncode:
            self.skipTest("no mount namespace is to be had")
        done = subprocess.run(NAMESPACE + [sys.executable, "-c", program, self.disk], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stdout.splitlines()

    def same(self, ensemble, runs=RUNS):
        whole = cf.Model("soft_biped").sweep(PITCH, runs, seed=3)
        self.assertEqual(whole.tally.to_bytes(), ensemble.tally.to_bytes())
        for name, column in whole.columns.items():
            self.assertEqual(column.tobytes(), np.asarray(ensemble[name][:]).tobytes(), name)

    def sweep(self, **more):
        return cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, directory=self.folder, **more)


@unittest.skipUnless(ZARR, "python3-zarr is not installed")
class Disks(Folder):
    def test_one_that_fills_loses_nothing(self):
        lines = self.in_namespace(FULL)
        self.assertEqual("filled: No space left on device", lines[0])
        self.assertEqual("ended: No space left on device", lines[1])
        left = int(lines[2].split()[1])
        self.assertTrue(5 < left < 20, left)
        self.assertIn("GB are free", lines[3])   # before the first run
        self.assertEqual("same: True", lines[4])

    def test_one_that_may_not_be_written_is_refused_before_the_start(self):
        lines = self.in_namespace(READ_ONLY)
        self.assertEqual(["runs: 0"], lines[2:])
        for line in lines[:2]:
            self.assertRegex(line, r"refused: \[Errno \d+\] (no right to write|Read-only file system)")

    def test_files_that_may_not_grow_end_it_with_its_chunks_in_place(self):
        done = subprocess.run([sys.executable, "-c", SMALL_FILES, self.folder], text=True, check=True,
                              stdout=subprocess.PIPE)
        self.assertEqual("ended: File too large\n", done.stdout)
        self.assertEqual(20 - 4, len(cf.ensemble_store.Store.open(self.folder).missing()))
        done = subprocess.run([sys.executable, "-m", "contact_flow", "sweep", "--quiet", "--resume", self.folder],
                              text=True, stdout=subprocess.PIPE)
        self.assertEqual(0, done.returncode)
        self.same(cf.open_sweep(self.folder))

    def test_what_a_run_does_is_its_own(self):
        """A model that throws for a part of the starts, and one whose runs take more steps than they may."""
        draws = {"body_pitch": cf.Uniform(-0.1, 0.1)}
        swept = cf.PythonModel(OutOfOrder).sweep(draws, 60, seed=1, duration=0.01, directory=self.folder, threads=1)
        pitch = np.asarray(swept["start"] if "start" in swept.columns else swept.draws())[:, 0]
        np.testing.assert_array_equal(pitch > 0.05, np.asarray(swept["outcome"]) == -2)
        self.assertEqual(int(np.sum(pitch > 0.05)), swept.outcomes["threw"])
        state = np.asarray(swept["final_state"])
        np.testing.assert_array_equal(pitch > 0.05, np.isnan(state[:, 0]))
        biped = cf.Model("soft_biped")
        whole = biped.sweep(PITCH, 512, seed=3)
        starts = np.tile(biped.nominal.x, (512, 1))
        starts[:, 6] = whole.draws()[:, 0]
        steps = biped.simulate_batch(starts).steps
        most = int(np.median(steps))   # attempts count, too: at most so many runs get through
        few = biped.sweep(PITCH, 512, seed=3, max_steps=most, directory=self.folder + "2")
        self.assertEqual({"ok", "budget exceeded"}, set(few.outcomes))
        ok = np.asarray(few["outcome"]) == 0
        self.assertTrue(np.all(steps[ok] <= most))
        np.testing.assert_array_equal(whole["final_state"][ok], np.asarray(few["final_state"])[ok])


@unittest.skipUnless(ZARR, "python3-zarr is not installed")
class Writers(Folder):
    def test_two_at_once_are_one_too_many(self):
        first = []

        def second(*_):
            if not first:
                try:
                    self.sweep(resume=True)
                except BlockingIOError as error:
                    first.append(str(error))
        self.same(self.sweep(chunk=512, progress=second, every=0))
        self.assertIn("another process is writing", first[0])
        self.same(self.sweep(resume=True))   # it has ended: nothing is left to do

    def test_other_runs_options_and_keeps_are_refused(self):
        self.sweep(chunk=512)
        biped = cf.Model("soft_biped")
        for more, what in (({"relative_tolerance": 1e-8}, "request"), ({"keep": ["outcome"]}, "request"),
                           ({"duration": 1.0}, "request"), ({"sobol": True}, "request")):
            with self.assertRaisesRegex(ValueError, "its %s differs" % what):
                self.sweep(resume=True, **more)
        with self.assertRaisesRegex(ValueError, "its runs differs"):
            biped.sweep(PITCH, RUNS + 1, seed=3, directory=self.folder, resume=True)

    def test_a_beginning_without_a_sweep_is_told(self):
        os.mkdir(self.folder)
        pathlib.Path(self.folder, ".writer").touch()
        with self.assertRaisesRegex(OSError, "beginning of a sweep"):
            self.sweep()

    def test_time_that_ends_keeps_what_is_done(self):
        ended = self.sweep(chunk=256, threads=1, max_seconds_total=1e-9)
        self.assertEqual("budget exceeded", ended.status.outcome)
        self.assertIn("max_seconds_total", ended.status.message)
        self.assertEqual(0, ended.summary.runs)
        self.same(self.sweep(resume=True))


@unittest.skipUnless(ZARR, "python3-zarr is not installed")
class Readers(Folder):
    def test_numpy(self):
        self.sweep(chunk=512)
        found = cf.open_sweep(self.folder)
        self.same(found)
        np.testing.assert_array_equal(found["final_state"][100:200], np.asarray(found["final_state"])[100:200])

    def test_pictures_of_what_is_there_by_now(self):
        from contact_flow.ensemble_shapes import basin
        biped = cf.Model("soft_biped")
        draws = {"body_pitch": cf.Uniform(-0.3, 0.3), "d/dt body_pitch": cf.Uniform(-0.5, 0.5)}
        calls = []

        def enough(*_):
            calls.append(1)
            if len(calls) == 3:
                raise KeyboardInterrupt
        with self.assertRaises(KeyboardInterrupt):
            biped.sweep(draws, RUNS, seed=3, directory=self.folder, chunk=512, progress=enough, every=0)
        found = cf.open_sweep(self.folder)
        self.assertLess(found.summary.runs, RUNS)
        shape = basin(found, "body_pitch", "d/dt body_pitch", "word", 10)
        whole = basin(biped.sweep(draws, found.summary.runs, seed=3), "body_pitch", "d/dt body_pitch", "word", 10)
        self.assertEqual((whole.labels, whole.shares), (shape.labels, shape.shares))
        np.testing.assert_array_equal(whole.cells, shape.cells)

    @unittest.skipUnless(importlib.util.find_spec("xarray"), "python3-xarray is not installed")
    def test_xarray(self):
        import xarray
        swept = self.sweep(chunk=512, keep=["outcome", "start", "final_state", "words", "margins"], samples=[0.5, 1.2],
                           directions=["+body_pitch"], costs={"low": {"weight": {"body_z": 2}}})
        dataset = swept.to_xarray()
        self.assertEqual(("run", "sample", "state"), dataset["samples"].dims)
        np.testing.assert_array_equal(np.asarray(swept["final_state"])[:, 6],
                                      dataset["final_state"].sel(state="body_pitch").values)
        self.assertEqual([0.5, 1.2], dataset["sample"].values.tolist())
        self.assertEqual(["body_pitch"], dataset["drawn"].values.tolist())
        lazy = xarray.open_zarr(self.folder, consolidated=False)
        np.testing.assert_array_equal(dataset["final_state"].values, lazy["final_state"].values)
        self.assertEqual("state", lazy["final_state"].dims[1])

    def test_without_xarray_it_is_told(self):
        if importlib.util.find_spec("xarray"):
            self.skipTest("it is here")
        with self.assertRaisesRegex(ImportError, "python3-xarray"):
            self.sweep(chunk=512).to_xarray()


if __name__ == "__main__":
    case.main()
