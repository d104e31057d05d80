# SPDX-License-Identifier: BSD-3-Clause
"""Sphinx: the pages of docs/ and the public headers, by breathe. Run by scripts/docs."""
import os
import re

ROOT = os.path.abspath(os.environ["CONTACT_FLOW_ROOT"])
with open(os.path.join(ROOT, "package.xml"), encoding="utf-8") as file:
    release = re.search(r"<version>(.*?)</version>", file.read()).group(1)
project = "contact_flow"
copyright = "the contact_flow maintainers"  # noqa: A001
extensions = ["breathe", "myst_parser"]
html_theme = "furo"
html_title = "contact_flow " + release
breathe_projects = {"contact_flow": os.path.join(ROOT, "build", "docs", "xml")}
breathe_default_project = "contact_flow"
breathe_default_members = ("members",)
myst_heading_anchors = 4
# C++ that Sphinx cannot resolve is none of ours: types of Eigen and of the standard library.
nitpicky = False
pygments_style = "default"
