#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sources and tests are compiled in units, several files of a folder as one: what one of them defines for itself has a
name that no other of the folder has, also those that happen to be in another unit today.

Each check takes the root of a tree and yields one line per violation; the checks are tested on planted ones."""
import pathlib
import re
import tempfile
import unittest

import include_direction_test as layout

ALONE = ["fuzz", "consumer", "python"]  # of several executables, or of none
NAMESPACE = re.compile(r"(?:inline )?namespace\b\s*([\w:]*)\s*\{")
TYPE = re.compile(r"(?:struct|class|union|enum class|enum)\s+(\w+)\b(?!::)[^;]*\{")
ALIAS = re.compile(r"using\s+(\w+)\s*=")
OTHER = re.compile(r"(?!using\b|return\b)\w[\w:<>,&*\s]*[\s&*>](\w+)(?:\(|\[|\s*=|\s*\{|;)")  # a function or a constant
NEXT = re.compile(r",\s*(k[A-Z]\w*)\s*(?:=|\[|\{)")
INCLUDE = re.compile(r'#include "(test/[^"]+)"')


MAINS = ["src/nodes", "src/tools"]  # of an executable each


def groups(root):
    """(name, its sources) of what may be one unit."""
    for folder in sorted({path.parent for path in layout.files(root, ["src", "python/src"], [".cc"])}):
        name = str(folder.relative_to(root))
        if name not in MAINS:
            yield name, sorted(folder.glob("*.cc"))
    folders = sorted(path for path in (root / "test").iterdir() if path.is_dir() and path.name not in ALONE)
    for folder in folders + [root / "test/ros/bags"]:
        files = layout.files(folder, ["."], [".cc"])
        if folder.name == "ros":  # one executable of what needs no master
            files = [path for path in files if path.parent == folder and not path.with_name(
                path.name.replace("_test.cc", ".test")).exists()]
        if folder.name == "adversary":
            files = [path for path in files if path.parent == folder]
        if folder.name == "friction":
            files.append(root / "test/adversary/rescaled_system.cc")
        yield str(folder.relative_to(root)), files


def definitions(path):
    """(line, name, whether it is of an unnamed namespace, whole line) of what a file defines at namespace scope."""
    opened = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        space = NAMESPACE.match(line)
        if space:
            opened.append(space.group(1))
        elif line.startswith("}  // namespace") and opened:
            opened.pop()
        elif opened and (line[:1].isalpha() or line.startswith("[[")) and not line.startswith(("template", "friend", "TEST", "TYPED", "INSTANT")):
            code = line.split("//")[0].replace("[[noreturn]] ", "")
            found = TYPE.match(code) or ALIAS.match(code) or OTHER.match(code)
            for name in ([found.group(1)] + NEXT.findall(code) if found else []):
                yield number, name, "" in opened, line.strip()


def headers(root, path):
    """Those beside a source; those of test/ that a test includes, and that these include."""
    if root / "test" not in path.parents:
        return set(path.parent.glob("*.h"))
    found, left = set(), [path]
    while left:
        for name in INCLUDE.findall(left.pop().read_text(encoding="utf-8")):
            if (root / name).is_file() and root / name not in found:
                found.add(root / name)
                left.append(root / name)
    return found


def two_names(root):
    """Two files of a group that define one name; an alias may be of the same type in each."""
    for _, files in groups(root):
        first = {}
        shared = sorted(set().union(*(headers(root, path) for path in files))) if files else []
        for path in shared + [path for path in files]:
            for number, name, unnamed, line in definitions(path):
                place = "%s:%d" % (path.relative_to(root), number)
                other = first.setdefault(name, (path, place, unnamed, line))
                if other[0] == path or not (unnamed or other[2]) or (line.startswith("using") and line == other[3]):
                    continue
                yield "%s defines %s, as does %s" % (place, name, other[1])


def left_behind(root):
    """What a file of a group leaves to the next of its unit: a macro, or all names of a namespace."""
    for _, files in groups(root):
        for path in files:
            text = path.read_text(encoding="utf-8")
            for name in sorted(set(re.findall(r"^\s*#\s*define (\w+)", text, re.M))):
                if not re.search(r"^\s*#\s*undef %s\b" % name, text, re.M):
                    yield "%s leaves the macro %s" % (path.relative_to(root), name)
            for name in re.findall(r"^using namespace ([\w:]+)", text, re.M):
                yield "%s opens namespace %s" % (path.relative_to(root), name)


CHECKS = [two_names, left_behind]


class ThisTree(unittest.TestCase):
    """The checks, on the tree that holds this file."""

    def check(self, violations):
        violations = sorted(set(violations))
        self.assertFalse(violations, "\n" + "\n".join(violations))

    def test_definitions_are_found(self):
        names = [name for _, files in groups(layout.ROOT) for path in files
                 for _, name, unnamed, _ in definitions(path) if unnamed]
        self.assertGreater(len(names), 1500)

    def test_two_names(self):
        self.check(two_names(layout.ROOT))

    def test_left_behind(self):
        self.check(left_behind(layout.ROOT))


class PlantedViolations(unittest.TestCase):
    """The checks, on small trees."""

    def violations(self, **texts):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            (root / "test/flow").mkdir(parents=True)
            for stem, text in texts.items():
                path = root / "test/flow" / (stem + (".h" if stem == "header" else "_test.cc"))
                path.write_text(text, encoding="utf-8")
            return [v for check in CHECKS for v in check(root)]

    @staticmethod
    def hidden(text):
        return "namespace n {\nnamespace {\n" + text + "\n}  // namespace\n}  // namespace n\n"

    def test_two_names(self):
        for text, name in (("struct A {\n};", "A"), ("void A() {\n}", "A"), ("const Matrix& A(int i) {\n}", "A"),
                           ("std::vector<int> A(int i,\n  int k) {\n}", "A"), ("using A = int;", "A"),
                           ("constexpr double kB = 1, kA = 2;", "kA"), ("const char kA[] = {};", "kA"),
                           ("constexpr Case kA{1};", "kA"), ("int A(double) { return 1; }", "A"), ("[[noreturn]] void A() {\n}", "A")):
            other = "int kA = 3;" if name == "kA" else "double A(double x) {\n}"
            line = 3
            self.assertEqual(self.violations(a=self.hidden(other), b=self.hidden(text)),
                             ["test/flow/b_test.cc:%d defines %s, as does test/flow/a_test.cc:%d" % (line, name, line)],
                             text)

    def test_two_names_of_a_header(self):
        header = "namespace n {\nnamespace test {\ninline void A() {\n}\n}  // namespace test\n}  // namespace n\n"
        include = '#include "test/flow/header.h"\n'
        self.assertEqual(self.violations(header=header, a=include + self.hidden("struct A {\n};")),
                         ["test/flow/a_test.cc:4 defines A, as does test/flow/header.h:3"])
        self.assertEqual(self.violations(header=header, a=self.hidden("struct A {\n};")), [])
        self.assertEqual(self.violations(header=header, a=include + self.hidden("using test::A;")), [])

    def test_names_that_differ(self):
        self.assertEqual(self.violations(a=self.hidden("struct A {\n  int x;\n};"), b=self.hidden("int x = A();")), [])
        self.assertEqual(self.violations(a=self.hidden("using A = int;"), b=self.hidden("using A = int;")), [])
        self.assertEqual(self.violations(a=self.hidden("TEST(A, B) {\n}"), b=self.hidden("TEST(A, C) {\n}")), [])

    def test_left_behind(self):
        self.assertEqual(self.violations(a="#define A 1\n"), ["test/flow/a_test.cc leaves the macro A"])
        self.assertEqual(self.violations(a="#define A 1\n#undef A\n"), [])
        self.assertEqual(self.violations(a=self.hidden("using namespace test;")),
                         ["test/flow/a_test.cc opens namespace test"])


if __name__ == "__main__":
    layout.main([ThisTree, PlantedViolations], __doc__)
