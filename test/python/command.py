# SPDX-License-Identifier: BSD-3-Clause
"""The command in this process."""
import contextlib
import io

from contact_flow import cli


def command(*words):
    """(exit status, what it prints, what it says of errors)."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main(list(words))
    return code, out.getvalue(), err.getvalue()
