#!/usr/bin/env python3
"""Checks that the project's version is decided in CMakeLists.txt alone.

citation, changelog   CITATION.cff's version, and the newest version with a heading in CHANGELOG.md, are the project's
npm                   package.json and package-lock.json give the project none
elsewhere             no other file of the repository names a version of the project: none that CHANGELOG.md has, nor any
                      three numbers behind the project's name or `__version__ =`
program               what it calls itself, where it is given

The checks are then made on a repository with each of these mistakes, and have to find it.

usage: version.py ROOT VERSION [PROGRAM]
"""
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

DECIDES = "CMakeLists.txt"
NAMES_IT = {DECIDES, "CITATION.cff", "CHANGELOG.md"}
NPM = ("package.json", "package-lock.json")  # other projects' versions stand in the second
NUMBERS = r"(?<![\w.])%s(?![\w.]*\d)"


def texts_below(root):
    """(name, text) of each file that git tracks or would; in a folder without git, of each file."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            capture_output=True) if (root / ".git").exists() else None
    if listed and listed.returncode == 0:
        names = listed.stdout.decode().split("\0")[:-1]
    else:
        left_out = re.compile(r"(\.git|build[^/]*|results|node_modules|\.cache)/")
        names = [str(path.relative_to(root)) for path in root.rglob("*")]
        names = [name for name in names if not left_out.match(name)]
    for name in sorted(names):
        if (root / name).is_file() and b"\0" not in (content := (root / name).read_bytes()):
            yield name, content.decode(errors="replace")


def problems_of(root, version):
    problems = []

    def expect_version(name, pattern):
        found = re.search(pattern, (root / name).read_text(), re.M)
        if found is None or found[1] != version:
            problems.append(f"{name}: {found[1] if found else 'no version'}, {DECIDES} has {version}")

    expect_version("CITATION.cff", r"^version: *[\"']?([^\s\"']+)")
    expect_version("CHANGELOG.md", r"^## \[(?!Unreleased\])([^]]*)\]")
    for name in NPM:
        package = json.loads((root / name).read_text())
        for place, what in (("", package), (" packages['']", package.get("packages", {}).get("", {}))):
            if "version" in what:
                problems.append(f"{name}{place}: has a version of its own, {what['version']}")

    known = re.findall(r"^## \[(\d[^]]*)\]", (root / "CHANGELOG.md").read_text(), re.M)
    named = re.compile("|".join([NUMBERS % re.escape(number) for number in {version, *known}] +
                                [r"\bsolenoid[ -]v?\d+\.\d+\.\d+", r"__version__ *= *[\"']\d"]), re.I)
    read = 0
    for name, text in texts_below(root):
        read += 1
        if name in NAMES_IT or name in NPM:
            continue
        for number, line in enumerate(text.split("\n"), 1):
            if found := named.search(line):
                problems.append(f"{name}:{number}: '{found[0]}' is a version of the project: {DECIDES} decides it")
    if read < len(NAMES_IT) + len(NPM):
        problems.append(f"only {read} files read: the test looks in the wrong place")
    return problems


def overlooked():
    """The mistakes that the checks do not find, each made in a repository that is right but for it."""
    right = {DECIDES: "project(p VERSION 3.1.4)\n", "CITATION.cff": "version: 3.1.4\n", "package.json": '{"name": "p"}',
             "CHANGELOG.md": "# Changelog\n## [Unreleased]\n## [3.1.4] - 2026-01-02\n## [3.1.3] - 2026-01-01\n",
             "package-lock.json": '{"packages": {"": {}, "node_modules/q": {"version": "3.1.4"}}}',
             "page.txt": "Version 13.1.4 of a library, 3.1.40 of another.\n"}
    other = "2.7.1"
    mistakes = [{"CITATION.cff": "version: 3.1.3\n"}, {"CITATION.cff": "title: p\n"},
                {"CHANGELOG.md": right["CHANGELOG.md"].replace("[3.1.4]", "[3.1.5]")},
                {"package.json": '{"version": "3.1.4"}'}, {"package-lock.json": '{"packages": {"": {"version": "1.0.0"}}}'},
                {"page.txt": "As of 3.1.4.\n"}, {"page.txt": "New in 3.1.3: much.\n"}, {"tool": f"say 'solenoid {other}'\n"},
                {"folder/__init__.py": f"__version__ = '{other}'\n"}]
    missed = []
    for mistake in [{}, *mistakes]:
        with tempfile.TemporaryDirectory(prefix="version-") as folder:
            for name, text in {**right, **mistake}.items():
                Path(folder, name).parent.mkdir(exist_ok=True)
                Path(folder, name).write_text(text)
            found = problems_of(Path(folder), "3.1.4")
        if bool(found) != bool(mistake):
            missed.append(f"{mistake or 'a repository without a mistake'}: {found or 'nothing found'}")
    return missed


def main(root, version, program=None):
    problems = problems_of(root, version)
    if program:
        said = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.split()
        if said[:2] != ["solenoid", version]:
            problems.append(f"the program calls itself '{' '.join(said)}', {DECIDES} has {version}")
    problems += [f"a mistake that is not found: {missed}" for missed in overlooked()]
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), *sys.argv[2:]))
