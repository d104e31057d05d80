#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The notebooks run: every code cell, in turn, in one namespace, with the assertions that are in them."""
import json
import os
import unittest

import case

os.environ.setdefault("MPLBACKEND", "Agg")
NOTEBOOKS = sorted((case.ROOT / "examples" / "notebooks").glob("*.ipynb"))


class Notebooks(unittest.TestCase):
    def test_run(self):
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("matplotlib is not installed")
        self.assertGreaterEqual(len(NOTEBOOKS), 5)
        cells = 0
        for path in NOTEBOOKS:
            with self.subTest(path.name):
                notebook = json.loads(path.read_text(encoding="utf-8"))
                self.assertEqual(4, notebook["nbformat"])
                scope = {"__name__": "__main__"}
                for number, cell in enumerate(notebook["cells"]):
                    if cell["cell_type"] != "code":
                        continue
                    self.assertEqual([], cell["outputs"], "kept without outputs")
                    exec(compile("".join(cell["source"]), "%s, cell %d" % (path.name, number), "exec"), scope)
                    cells += 1
        print("%d notebooks, %d cells" % (len(NOTEBOOKS), cells))


if __name__ == "__main__":
    case.main()
