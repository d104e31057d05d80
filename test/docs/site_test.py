#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""site_test.py: builds the site by scripts/docs, and opens its start page and its search in a headless Chromium.

Ends with 77, and says so, where the tools are not installed: scripts/docs and `apt install chromium` install them.
"""
import functools
import http.server
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading

ROOT = pathlib.Path(__file__).resolve().parents[2]
SKIPPED = 77


def skip(reason):
    print("SKIPPED: " + reason)
    sys.exit(SKIPPED)


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    """The port at which this folder is served, to this machine alone."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server.server_port


def dom(browser, url):
    """What a page is when its scripts have run."""
    with tempfile.TemporaryDirectory() as profile:
        done = subprocess.run(
            [browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
             "--user-data-dir=" + profile, "--virtual-time-budget=20000", "--dump-dom", url],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120)
    return done.stdout.decode(errors="replace")


def check(condition, what):
    print(("ok      " if condition else "FAILED  ") + what)
    if not condition:
        sys.exit(1)


def main():
    missing = [m for m in ("sphinx", "breathe", "furo", "myst_parser") if not importlib.util.find_spec(m)]
    if missing or not shutil.which("doxygen"):
        skip("no " + ", ".join(missing + ([] if shutil.which("doxygen") else ["doxygen"])))
    done = subprocess.run([str(ROOT / "scripts" / "docs"), "--no-install"], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=550)
    print(done.stdout.decode(errors="replace"))
    check(done.returncode == 0, "scripts/docs builds the site without a warning")
    html = pathlib.Path(os.environ.get("BUILD_DIR", ROOT / "build")) / "docs" / "html"
    for page in html.rglob("*.html"):
        for link in re.findall(r'(?:src|href)="(https?://[^"]*\.(?:js|css|woff2?))"', page.read_text(errors="replace")):
            check(False, "%s needs the network: %s" % (page, link))
    browser = shutil.which("chromium")
    if not browser:
        skip("no chromium: the site is built, but was not opened")
    address = "http://127.0.0.1:%d/" % serve(html)
    start = dom(browser, address + "index.html")
    check("What it does not do" in start and 'href="robot.html"' in start, "the start page, with a link to your robot")
    found = dom(browser, address + "search.html?q=modularity")
    check(re.search(r'<li[^>]*>\s*<a href="theory.html', found) is not None, "search finds 'modularity' in the theory")
    found = dom(browser, address + "search.html?q=DifferentiateOutcome")
    check("derivative_b_derivative.html" in found, "search finds a function of the library")


if __name__ == "__main__":
    main()
