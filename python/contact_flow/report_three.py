# SPDX-License-Identifier: BSD-3-Clause
"""three.js, by which a report draws what moves where the browser has WebGL: the file of Debian's libjs-three,
as it is, or that of a wheel, which holds a copy."""
from __future__ import annotations

import os
import re
from typing import Tuple

REVISION = "111"  #: the one that report_three.js is written for
FILE = "three.min.js"
PLACES = (os.path.dirname(__file__), "/usr/share/javascript/three", "/usr/share/nodejs/three/build")
LICENCE = """three.js, https://threejs.org
The MIT License
Copyright © 2010-2019 three.js authors

Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
persons to whom the Software is furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the
Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR
COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR
OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
"""


def library() -> Tuple[str, str]:
    """(text, ""), or ("", why there is none)."""
    reason = "three.js (Debian's libjs-three) was not there when the report was written"
    for folder in PLACES:
        try:
            with open(os.path.join(folder, FILE), encoding="utf-8") as file:
                text = file.read()
        except (OSError, UnicodeDecodeError):
            continue
        found = re.search(r'REVISION\s*=\s*"(\w+)"', text)
        if not found or found.group(1) != REVISION:
            reason = "the three.js that was there is r%s, not r%s" % (found.group(1) if found else "?", REVISION)
        elif "</script" in text.lower() or "<!--" in text:
            reason = "the three.js that was there cannot be a part of a page"
        else:
            return text, ""
    return "", reason
