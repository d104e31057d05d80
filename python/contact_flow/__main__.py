# SPDX-License-Identifier: BSD-3-Clause
"""python3 -m contact_flow: the command of cli.py."""
import sys

from .cli import main

sys.exit(main())
