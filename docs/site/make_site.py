#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""make_site.py ROOT OUTPUT: the sources that Sphinx reads, and the judge of what doxygen has said.

The README and the pages of docs/ are copied, with links to files of the tree turned into code; each public header (see
public_headers.txt) gets a page. Fails on any warning of doxygen, of which "is not documented" counts in public headers
alone, and is counted in the others.
"""
import pathlib
import re
import shutil
import sys

UNDOCUMENTED = re.compile(r"is not documented\.$")


def public_headers(root):
    path = root / "docs" / "site" / "public_headers.txt"
    return [line for line in path.read_text(encoding="utf-8").split("\n") if line and line[0] != "#"]


def judge(root, output):
    """What is wrong, one line each, of doxygen's warnings."""
    public = {str(root / "include" / "contact_flow" / name) for name in public_headers(root)}
    wrong, others = [], 0
    for line in (output / "doxygen.txt").read_text(encoding="utf-8").split("\n"):
        if not line.strip():
            continue
        if UNDOCUMENTED.search(line) and line.split(":")[0] not in public:
            others += 1
        else:
            wrong.append(line)
    print("%d symbols of headers that are not public have no documentation" % others)
    return wrong


def page(text, folder, root):
    """Links to pages stay, those to other files of the tree become their paths."""
    def link(match):
        name, target = match.group(1), match.group(2)
        if "://" in target or target.startswith("#"):
            return match.group(0)
        path, _, anchor = target.partition("#")
        full = (folder / path).resolve()
        if full.suffix == ".md" and full.parent in (root / "docs", root):
            stem = "index" if full.name == "README.md" else full.stem
            return "[%s](%s.md%s)" % (name, stem, "#" + anchor if anchor else "")
        if full.suffix == ".png":
            return "[%s](%s)" % (name, full.name)
        relative = str(full.relative_to(root))
        return name if name == relative else "%s (`%s`)" % (name, relative)
    text = re.sub(r"^```(console)$", "```none", text, flags=re.M)
    return re.sub(r"\[([^\]]*)\]\(([^)\s]+)\)", link, text)


def api(name):
    """The page of one header."""
    title = "`%s`" % name
    return "# %s\n\n```{eval-rst}\n.. doxygenfile:: contact_flow/%s\n   :sections: briefdescription " \
           "detaileddescription innerclass public-attrib public-func public-static-func " \
           "public-static-attrib public-type enum func typedef var\n```\n" % (title, name)


def main():
    root, output = (pathlib.Path(a).resolve() for a in sys.argv[1:3])
    source = output / "source"
    (source / "api").mkdir(parents=True)
    for image in (root / "docs").glob("*.png"):
        shutil.copy(image, source)
    names = []
    for path in sorted((root / "docs").glob("*.md")):
        text = page(path.read_text(encoding="utf-8"), path.parent, root)
        (source / path.name).write_text(text, encoding="utf-8")
        names.append(path.stem)
    headers = public_headers(root)
    for name in headers:
        (source / "api" / (name.replace("/", "_")[:-2] + ".md")).write_text(api(name), encoding="utf-8")
    tree = "\n\n```{toctree}\n:hidden:\n:caption: %s\n\n%s\n```\n"
    index = page((root / "README.md").read_text(encoding="utf-8"), root, root)
    index += tree % ("Pages", "\n".join(names))
    index += tree % ("Headers", "\n".join("api/" + name.replace("/", "_")[:-2] for name in headers))
    (source / "index.md").write_text(index, encoding="utf-8")
    wrong = judge(root, output)
    for line in wrong:
        print("error: " + line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
