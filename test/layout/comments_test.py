#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a formatter, or a hurry, does to sources: paragraphs of comments that end in one word pushed out of its
line, lines that are too long, and two types of one name, of which a linker takes either.

Each check takes the root of a tree and yields one line per violation; the checks are tested on planted ones."""
import pathlib
import re
import tempfile
import unicodedata
import unittest

import include_direction_test as layout

FOLDERS = ["include", "src", "python", "test", "benchmark", "examples"]
MAX_COLUMNS = 100
LONG = 78  # a line that was filled: the one below it was pushed out of it
COMMENT = re.compile(r"(\s*)(///?<?)\s?(\s*)(\S.*)$")
TYPE = re.compile(r"(?:struct|class|union|enum class|enum)\s+(\w+)\b(?!::)(?:\s+final)?(?:\s*:[^;()]*)?\s*\{")
NAMESPACE = re.compile(r"(?:inline )?namespace\b\s*([\w:]*)\s*\{")


def sources(root):
    for path in layout.files(root, FOLDERS, [".h", ".cc"]):
        yield path, path.read_text(encoding="utf-8").splitlines()


def orphans(root):
    """A paragraph of a comment whose last line is one short word under a full line."""
    for path, lines in sources(root):
        for number in range(1, len(lines)):
            above, line = COMMENT.match(lines[number - 1]), COMMENT.match(lines[number])
            if not above or not line or above.group(1, 2) != line.group(1, 2):
                continue
            word = line.group(4).strip()
            if len(lines[number - 1]) >= LONG and " " not in word and len(word) <= 14:
                yield "%s:%d is one word: '%s'" % (path.relative_to(root), number + 1, word)


def long_lines(root):
    """A line of more than MAX_COLUMNS."""
    for path, lines in sources(root):
        for number, line in enumerate(lines, 1):
            columns = sum(not unicodedata.combining(letter) for letter in line)
            if columns > MAX_COLUMNS:
                yield "%s:%d has %d columns" % (path.relative_to(root), number, columns)


def types(lines):
    """(number, namespace::name) of the types that a file defines at namespace scope, those of an unnamed one not."""
    opened = []  # namespaces, as found
    for number, line in enumerate(lines, 1):
        space = NAMESPACE.match(line)
        if space:
            opened.append(space.group(1))
        elif line.startswith("}  // namespace") and opened:
            opened.pop()
        found = TYPE.match(line)
        if found and "" not in opened:
            yield number, "::".join(opened + [found.group(1)])


def two_definitions(root):
    """Two types of one name in include/ and src/, whatever they hold."""
    first = {}
    for path in layout.files(root, ["include", "src", "python"], [".h", ".cc"]):
        lines = path.read_text(encoding="utf-8").splitlines()
        for number, name in types(lines):
            place = "%s:%d" % (path.relative_to(root), number)
            # A specialization has the name of its template.
            if number > 1 and lines[number - 2].startswith("template <>"):
                continue
            if name in first:
                yield "%s defines %s, as does %s" % (place, name, first[name])
            first.setdefault(name, place)


CHECKS = [orphans, long_lines, two_definitions]


class ThisTree(unittest.TestCase):
    """The checks, on the tree that holds this file."""

    def check(self, violations):
        violations = list(violations)
        self.assertFalse(violations, "\n" + "\n".join(violations))

    def test_types_are_found(self):
        names = [name for path, lines in sources(layout.ROOT) for _, name in types(lines)]
        self.assertGreater(len(names), 100)
        self.assertIn("contact_flow::Trajectory", names)

    def test_orphans(self):
        self.check(orphans(layout.ROOT))

    def test_long_lines(self):
        self.check(long_lines(layout.ROOT))

    def test_two_definitions(self):
        self.check(two_definitions(layout.ROOT))


class PlantedViolations(unittest.TestCase):
    """The checks, on small trees."""

    def violations(self, **texts):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            (root / "src").mkdir()
            for stem, text in texts.items():
                (root / "src" / (stem + ".h")).write_text(text, encoding="utf-8")
            return [v for check in CHECKS for v in check(root)]

    def test_orphan(self):
        full = "/// " + "word " * 17
        self.assertEqual(self.violations(a=full + "\n/// alone.\n"), ["src/a.h:2 is one word: 'alone.'"])
        self.assertEqual(self.violations(a=full + "\n/// not alone.\n"), [])
        self.assertEqual(self.violations(a="/// short\n/// line.\n"), [])

    def test_long_line(self):
        self.assertEqual(self.violations(a="x" * 101 + "\n" + "ä" * 100 + "\n"), ["src/a.h:1 has 101 columns"])

    def test_two_definitions(self):
        one = "namespace n {\nstruct A {\n};\n}  // namespace n\n"
        self.assertEqual(self.violations(a=one, b=one), ["src/b.h:2 defines n::A, as does src/a.h:2"])
        hidden = "namespace n {\nnamespace {\nstruct A {\n};\n}  // namespace\n}  // namespace n\n"
        self.assertEqual(self.violations(a=one, b=hidden), [])
        self.assertEqual(self.violations(a=one, b="namespace n {\nstruct A;\n}  // namespace n\n"), [])


if __name__ == "__main__":
    layout.main([ThisTree, PlantedViolations], __doc__)
