#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps in a Zarr store, killed and resumed, and by Dask's workers, which are killed, too."""
import errno
import importlib.util
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import unittest.mock
from concurrent.futures import CancelledError

import numpy as np

import case
import contact_flow as cf

try:
    import zarr
except ImportError:
    zarr = None
try:
    import distributed
except ImportError:
    distributed = None

PITCH = {"body_pitch": cf.Uniform(-0.3, 0.3)}
RUNS = 5000
PROGRAM = ("import contact_flow as cf; cf.Model('soft_biped').sweep({'body_pitch': cf.Uniform(-0.3, 0.3)}, %d, "
           "seed=3, directory=%r, chunk=256, threads=1, resume=%r)")


def undisturbed():
    return cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3)


class Folder(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = os.path.join(temporary.name, "store")

    def same(self, ensemble):
        whole = undisturbed()
        self.assertEqual(whole.tally.to_bytes(), ensemble.tally.to_bytes())
        for name, column in whole.columns.items():
            self.assertEqual(column.tobytes(), np.asarray(ensemble[name][:]).tobytes(), name)


@unittest.skipUnless(zarr, "python3-zarr is not installed")
class Stores(Folder):
    def sweep(self, **more):
        return cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, directory=self.folder, chunk=512, **more)

    def test_holds_the_same_bits(self):
        self.same(self.sweep())
        self.same(cf.open_sweep(self.folder))
        group = zarr.open_group(self.folder, mode="r")
        self.assertEqual(list(cf.Model("soft_biped").state_names), group.attrs["names"]["final_state"])
        self.assertEqual("soft_biped", group.attrs["system"]["model"])
        self.assertEqual(3, group.attrs["seed"])
        self.assertEqual(0, len(cf.ensemble_store.Store.open(self.folder).verify()))

    def test_killed_and_resumed(self):
        child = subprocess.Popen([sys.executable, "-c", PROGRAM % (RUNS, self.folder, False)])
        tally = pathlib.Path(self.folder, "tally")
        while not tally.is_dir() or len(list(tally.iterdir())) < 6:
            time.sleep(0.01)
        child.send_signal(signal.SIGKILL)
        child.wait()
        left = cf.ensemble_store.Store.open(self.folder).missing()
        self.assertGreater(len(left), 0)
        self.assertLess(len(left), 20)
        done = subprocess.run([sys.executable, "-m", "contact_flow", "sweep", "--resume", self.folder, "--json",
                               "--quiet"], check=True, text=True, stdout=subprocess.PIPE)
        self.assertEqual(RUNS, json.loads(done.stdout)["runs"])
        self.same(cf.open_sweep(self.folder))

    def test_another_sweep_is_refused(self):
        self.sweep()
        with self.assertRaisesRegex(OSError, "not empty"):
            self.sweep()
        with self.assertRaisesRegex(ValueError, "request differs"):
            cf.Model("soft_biped").sweep(PITCH, RUNS, seed=4, directory=self.folder, resume=True)
        with self.assertRaisesRegex(ValueError, "system differs"):
            cf.Model("soft_biped", stiffness=30).sweep(PITCH, RUNS, seed=3, directory=self.folder, resume=True)
        os.rename(self.folder, self.folder + "2")
        with self.assertRaisesRegex(ValueError, "holds no sweep"):
            self.sweep(resume=True)

    def test_damage_is_noticed(self):
        self.sweep()
        store = cf.ensemble_store.Store.open(self.folder)
        path = pathlib.Path(self.folder, "final_state", "2.0")
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(bytes(data))
        self.assertEqual([2], store.verify())
        path = pathlib.Path(self.folder, "tally", "1")
        path.write_bytes(path.read_bytes()[:-3] + b"abc")
        with self.assertRaises(Exception):
            store.tally()

    def test_a_disk_that_fills_keeps_the_chunks(self):
        store = cf.ensemble_store.Store
        write, count = store.write, [0]

        def full(self, *arguments):
            count[0] += 1
            if count[0] > 3:
                raise OSError(errno.ENOSPC, "No space left on device")
            write(self, *arguments)
        store.write = full
        try:
            with self.assertRaisesRegex(OSError, "No space"):
                self.sweep()
        finally:
            store.write = write
        self.assertEqual(7, len(store.open(self.folder).missing()))
        self.same(self.sweep(resume=True))

    def test_refused_before_the_start(self):
        with self.assertRaisesRegex(OSError, "GB are free"):
            cf.Model("soft_biped").sweep(PITCH, 10 ** 13, directory=self.folder)
        with self.assertRaises(OSError):
            cf.Model("soft_biped").sweep(PITCH, 10, directory="/proc/contact_flow")
        with self.assertRaisesRegex(ValueError, "multiple of 256"):
            cf.Model("soft_biped").sweep(PITCH, 10, directory=self.folder, chunk=100)


@unittest.skipUnless(importlib.util.find_spec("yaml"), "python3-yaml is not installed")
class Command(Folder):
    def test_a_file(self):
        path = self.folder + ".yaml"
        pathlib.Path(path).write_text(
            "model: soft_biped\nruns: 300\nseed: 1\nduration: 1.2\noptions: {relative_tolerance: 1e-8}\n"
            "draws:\n  body_pitch: {normal: [0, 1e-2]}\n  stiffness: {linspace: [25, 30, 3]}\n"
            "histograms: {body_pitch: [-1, 1, 10]}\n")
        call = [sys.executable, "-m", "contact_flow", "sweep"]
        done = subprocess.run(call + [path], check=True, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertIn("soft_biped: 300 runs\n  ok             300", done.stdout)
        self.assertIn("300 of 300 runs (100 %)", done.stderr)
        answer = json.loads(subprocess.run(call + [path, "--json", "--quiet", "--runs", "30"], check=True, text=True,
                                           stdout=subprocess.PIPE).stdout)
        same = cf.Model("soft_biped").sweep({"body_pitch": cf.Normal(0, 1e-2), "stiffness": [25, 27.5, 30]}, 30,
                                            seed=1, duration=1.2, relative_tolerance=1e-8)
        self.assertEqual(same.mean.tolist(), answer["mean"])
        text = pathlib.Path(path).read_text().replace("runs: 300", "runs: 3e2").replace("seed: 1", "seed: 18446744073709551615")
        pathlib.Path(path).write_text(text)
        answer = json.loads(subprocess.run(call + [path, "--json", "--quiet"], check=True, text=True,
                                           stdout=subprocess.PIPE).stdout)
        self.assertEqual(300, answer["runs"])
        for text, message in (("model: soft_biped\nrns: 3\n", "unknown key 'rns'"), ("runs: 3\n", "one of 'model'"),
                              ("model: soft_biped\ndraws: {body_pitch: {uniform: [1]}}\n", "2 numbers"),
                              ("model: soft_biped\nruns: 1.5\n", "runs is 1.5"),
                              ("model: soft_biped\nhistograms: {body_z: [0, 1, 2.5]}\n", "2.5, expected a whole number"),
                              ("model: [\n", "line 2")):
            pathlib.Path(path).write_text(text)
            bad = subprocess.run(call + [path], text=True, stderr=subprocess.PIPE)
            self.assertEqual(2, bad.returncode)
            self.assertIn(message, bad.stderr)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@unittest.skipUnless(distributed and zarr, "python3-distributed or python3-zarr is not installed")
class Workers(Folder):
    """A scheduler and two workers, as processes that are killed."""

    def start(self, *words):
        environment = dict(os.environ, DASK_DISTRIBUTED__WORKER__DAEMON="False")
        child = subprocess.Popen([sys.executable, "-m", "distributed.cli." + words[0], *words[1:]], env=environment,
                                 cwd=os.path.dirname(self.folder), stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        self.addCleanup(child.wait)
        self.addCleanup(child.kill)
        return child

    def cluster(self):
        address = "tcp://127.0.0.1:%d" % free_port()
        scheduler = self.start("dask_scheduler", "--host", "127.0.0.1", "--port", address.rsplit(":", 1)[1],
                               "--no-dashboard")
        workers = [self.worker(address) for _ in range(2)]
        import dask
        dask.config.set({"distributed.comm.timeouts.connect": "8s"})   # until the scheduler is given up
        client = distributed.Client(address, timeout=120)
        self.addCleanup(client.close)
        client.wait_for_workers(2, timeout=120)
        return address, scheduler, workers, client

    def worker(self, address):
        return self.start("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                          "--death-timeout", "60")

    def test_workers_are_killed(self):
        address, _, workers, client = self.cluster()
        killed = []

        def kill(done, total, *_):
            if not killed and done > total // 4:
                killed.append(workers[0].kill())
                self.worker(address)
        swept = cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client, chunk=256, progress=kill, every=0)
        self.assertEqual(1, len(killed))
        self.same(swept)

    def test_chunks_are_cancelled(self):
        _, _, _, client = self.cluster()
        cancelled = []

        def cancel(done, total, *_):
            if not cancelled and done > total // 4:
                cancelled.extend(client.futures)
                client.cancel([distributed.Future(key, client) for key in cancelled])
        swept = cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client, chunk=256, progress=cancel, every=0)
        self.assertTrue(cancelled)
        self.same(swept)

    def test_chunks_are_cancelled_when_they_are_finished(self):
        _, _, _, client = self.cluster()
        result, cancelled = distributed.Future.result, []

        def cancel(future, *arguments):
            if len(cancelled) < 3 and future.key not in cancelled:
                cancelled.append(future.key)
                raise CancelledError(future.key)
            return result(future, *arguments)
        with unittest.mock.patch.object(distributed.Future, "result", cancel):
            swept = cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client, chunk=256)
        self.assertEqual(3, len(cancelled))
        self.same(swept)

    def test_the_scheduler_is_killed(self):
        _, scheduler, _, client = self.cluster()
        client.set_metadata("alive", True)

        def kill(done, total, *_):
            if total // 4 < done and scheduler.poll() is None:
                scheduler.kill()
        with self.assertRaises(OSError):   # ConnectionError
            cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client, chunk=256, progress=kill, every=0,
                                         directory=self.folder)
        left = cf.ensemble_store.Store.open(self.folder).missing()
        self.assertTrue(0 < len(left) < 20, len(left))
        self.same(cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, directory=self.folder, resume=True))

    def test_a_worker_stands_still_for_a_while(self):
        _, _, workers, client = self.cluster()
        waking = threading.Timer(3, lambda: workers[0].send_signal(signal.SIGCONT))
        self.addCleanup(waking.cancel)
        stopped = []

        def stop(done, total, *_):
            if not stopped and done > total // 4:
                stopped.append(workers[0].send_signal(signal.SIGSTOP))
                waking.start()
        swept = cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client, chunk=256, progress=stop, every=0)
        self.assertEqual(1, len(stopped))
        self.same(swept)

    def test_time_ends_on_workers_too(self):
        _, _, _, client = self.cluster()
        ended = cf.Model("soft_biped").sweep(PITCH, 10 ** 7, seed=3, client=client, chunk=256, directory=self.folder,
                                             max_seconds_total=2)
        self.assertEqual("budget exceeded", ended.status.outcome)
        self.assertLess(ended.summary.runs, 10 ** 7)
        left = sum(count for _, _, count in cf.ensemble_store.Store.open(self.folder).missing())
        self.assertEqual(10 ** 7, ended.summary.runs + left)

    def test_time_ends_though_answers_wait(self):
        _, _, _, client = self.cluster()
        # What is told of each takes longer than the workers need for the next ones.
        ended = cf.Model("soft_biped").sweep(PITCH, 10 ** 7, seed=3, client=client, chunk=256, max_seconds_total=1,
                                             progress=lambda *_: time.sleep(0.2), every=0, directory=self.folder)
        self.assertEqual("budget exceeded", ended.status.outcome)
        self.assertLess(ended.summary.runs, 10 ** 6)

    def test_other_bits_are_refused(self):
        _, _, _, client = self.cluster()

        def disguise():
            from contact_flow import ensemble_chunks
            once = ensemble_chunks.run_once
            # The same run without draws, and other drawn ones: a terrain that only they reach.
            ensemble_chunks.run_once = lambda system, request, first, count, threads: once(
                system, dict(request, seed=request["seed"] + (count > 0)), first, count, threads)
        client.run(disguise)
        with self.assertRaisesRegex(RuntimeError, "other bits"):
            cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client)

    def test_other_versions_are_refused(self):
        _, _, _, client = self.cluster()

        def disguise():
            from contact_flow import _core
            _core.__version__ = "0.0.9"
        client.run(disguise)
        with self.assertRaisesRegex(RuntimeError, "0.0.9"):
            cf.Model("soft_biped").sweep(PITCH, RUNS, seed=3, client=client)


if __name__ == "__main__":
    case.main()
