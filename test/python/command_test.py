#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The command on a terminal: progress, completion; what its exit status says."""
import io
import os
import pathlib
import pty
import subprocess
import sys
import tempfile
import unittest

import case
from command import command
from contact_flow import cli
from contact_flow.progress import Progress, line

LONG = ["simulate", "soft_biped", "-t", "1e5", "-o", "max_step=1e-4", "-o", "max_steps=1000000000", "-o", "max_seconds=2",
        "-o", "dense=false"]
COMPLETION = case.ROOT / "python" / "bin" / "contact_flow.completion"


class OnATerminal(unittest.TestCase):
    def on(self, words):
        """(exit status, what it prints, what its terminal shows)."""
        shown, terminal = pty.openpty()
        done = subprocess.run([sys.executable, "-m", "contact_flow", *words], stdout=subprocess.PIPE, stderr=terminal,
                              text=True)
        os.close(terminal)
        found = b""
        try:
            while True:
                part = os.read(shown, 65536)
                if not part:
                    break
                found += part
        except OSError:   # the other end is closed
            pass
        os.close(shown)
        return done.returncode, done.stdout, found.decode()

    def test_progress(self):
        code, out, shown = self.on(LONG)
        self.assertEqual(1, code)   # its budget is exceeded
        self.assertIn("budget", out)
        self.assertIn("\rthe run, 1 s\x1b[K", shown)
        self.assertTrue(shown.endswith("\r\x1b[K"), shown[-40:])
        code, _, shown = self.on(["models"])
        self.assertEqual((0, ""), (code, shown))   # quick work is not told of

    def test_none_in_a_file(self):
        done = subprocess.run([sys.executable, "-m", "contact_flow", *LONG], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
        self.assertEqual("", done.stderr)

    def test_lines(self):
        self.assertEqual("[........................] a, 0 of 3, 0 s", line("a", 0, 3, 0.9))
        self.assertEqual("[########################] a, 3 of 3, 4 s", line("a", 3, 3, 4.0))
        with Progress(io.StringIO()) as progress:   # no terminal
            progress.tell("x")
        self.assertIsNone(progress.thread)


class Status(unittest.TestCase):
    def test_reasons_are_1_and_misuse_2(self):
        for code, words in ((0, ("models",)), (1, ("simulate", "soft_biped", "-o", "max_steps=3")),
                            (1, ("derive", "rigid_biped")), (1, ("compare", "rigid_biped", "-w", "+body_pitch")),
                            (1, ("stabilize", "rigid_biped", "--apex", "body_z")),
                            (2, ("stabilize", "hopping_trot", "--apex", "body_z")),
                            (2, ("simulate", "soft_biped", "-o", "max_step=x")), (2, ("simulate", "nothing")),
                            (2, ("report", "no_such.bag"))):
            found, _, error = command(*words)
            self.assertEqual(code, found, (words, error))

    def test_a_budget_that_ends_is_a_reason(self):
        class Ended:
            @staticmethod
            def run(arguments, load):
                raise cli.BudgetExceeded("more than 1 s")
        parser, cli.parser = cli.parser, lambda: type("P", (), {"parse_args": lambda self, words: Ended})()
        try:
            self.assertEqual((1, "", "contact_flow: more than 1 s\n"), command())
        finally:
            cli.parser = parser


class Completion(unittest.TestCase):
    def complete(self, *words):
        with tempfile.TemporaryDirectory() as folder:
            script = pathlib.Path(folder) / "contact_flow"
            script.write_text("#!/bin/sh\nexec %s -m contact_flow \"$@\"\n" % sys.executable)
            script.chmod(0o755)
            program = ("source %s; COMP_WORDS=(contact_flow %s); COMP_CWORD=%d; _contact_flow; printf '%%s\\n' "
                       "\"${COMPREPLY[@]}\"" % (COMPLETION, " ".join("'%s'" % w for w in words), len(words)))
            done = subprocess.run(["bash", "-c", program], stdout=subprocess.PIPE, text=True, check=True, cwd=folder,
                                  env=dict(os.environ, PATH=folder + os.pathsep + os.environ["PATH"]))
        return set(done.stdout.split())

    def test_commands_options_and_models(self):
        commands = {action.dest: action for action in cli.parser()._actions}["command"].choices
        self.assertEqual(set(commands) | {"--help"}, self.complete(""))
        self.assertEqual({"stabilize"}, self.complete("st"))
        self.assertEqual({"soft_biped"}, self.complete("simulate", "soft_b"))
        options = self.complete("orbit", "--")
        self.assertTrue({"--apex", "--json", "--translation", "--parameter"} <= options, options)


if __name__ == "__main__":
    case.main()
