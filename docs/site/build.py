#!/usr/bin/env python3
"""Builds the documentation as one site for a browser, offline: the pages of docs/ by Sphinx, the headers' by Doxygen.

The pages are those that a code host shows, copied (see staging.py); the API reference is of the headers that another project
sees. What has not changed since the last build is not built again. A warning is an error.

usage: build.py [--out DIR]      leaves DIR/site/index.html, DIR being build/docs, and prints its path
exit codes: 0, 1 a fault in the documentation, 2 a tool is missing
"""
import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import comment_filter  # noqa: E402
import mending  # noqa: E402
import staging  # noqa: E402
from api_names import ApiNames  # noqa: E402

SITE = Path(__file__).resolve().parent
ROOT = SITE.parents[1]
# The classes that a reader of the reference begins with.
MAIN = ("ModeSet", "DelayLines", "SwitchTiming", "Horizon", "Cost", "Bounds", "Problem", "Plan", "SolveReport", "Solver",
        "RelaxedSolver", "DeferredSolver", "Deadline", "Plant", "Controller", "ControlLoop", "CommandLimits", "Estimator",
        "Trajectory", "SolverRow", "LawRow", "EstimatorRow", "VariantConfig")
PACKAGES = "doxygen python3-sphinx python3-myst-parser furo"


class Fault(Exception):
    """What is wrong, as a reader is told it, and the exit code."""

    def __init__(self, text, code=1):
        super().__init__(text)
        self.code = code


def digest(*parts):
    """A hash of files' content and names, or of strings."""
    found = hashlib.sha256()
    for part in parts:
        found.update(str(part).encode() + b"\0")
        if isinstance(part, Path):
            found.update(part.read_bytes())
    return found.hexdigest()


def files_below(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)


def version():
    """The project's, of the top CMakeLists.txt."""
    return re.search(r"project\(\w+ VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def tool(name):
    # Debian's Sphinx first: another one in the path may lack the packages that Debian's has.
    found = shutil.which(name, path="/usr/bin") or shutil.which(name)
    if not found:
        raise missing(name)
    return found


def missing(name):
    return Fault(f"{name} is missing: apt-get install --no-install-recommends {PACKAGES}", 2)


def run(command, name, **more):
    done = subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    if done.returncode != 0:
        raise Fault(f"{done.stdout.strip()}\n{name} found the faults above")
    return done.stdout


class Build:
    def __init__(self, out):
        self.out, self.site, self.api = out, out / "site", out / "site" / "api"
        self.tools = {name: tool(name) for name in ("doxygen", "sphinx-build")}
        with open(self.tools["sphinx-build"], encoding="utf-8") as script:
            interpreter = script.readline().removeprefix("#!").split()
        if subprocess.run([*interpreter, "-c", "import myst_parser, furo"], capture_output=True).returncode != 0:
            raise missing("the Markdown reader or the theme of Sphinx")

    def unless_done(self, name, inputs, action):
        """Runs `action` unless its inputs are those of its last success."""
        stamp, wanted = self.out / f"{name}.done", digest(version(), *inputs)
        if stamp.is_file() and stamp.read_text() == wanted:
            return
        stamp.unlink(missing_ok=True)
        action()
        stamp.write_text(wanted)

    def stage_headers(self):
        """The headers as other projects see them, and beside them the same with their comments as Doxygen reads them."""
        run(["cmake", f"-DROOT={ROOT}", f"-DTO={self.out}/headers/solenoid", "-P", ROOT / "cmake" / "PublicHeaders.cmake"], "cmake")
        headers = files_below(self.out / "headers" / "solenoid")
        shutil.copyfile(SITE / "api.dox", self.out / "headers" / "api.dox")
        shutil.rmtree(self.out / "comments", ignore_errors=True)
        reader = comment_filter.Filter(staging.page_addresses(ROOT))
        for header in headers:
            to = self.out / "comments" / header.relative_to(self.out / "headers")
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_text(reader.header(header.read_text()))
        return headers

    def build_api(self):
        shutil.rmtree(self.api, ignore_errors=True)
        self.api.mkdir(parents=True)
        layout = self.out / "layout.xml"
        run([self.tools["doxygen"], "-l", layout], "doxygen")
        first = '<tab type="mainpage"'
        layout.write_text(layout.read_text().replace(
            first, f'<tab type="user" visible="yes" url="../index.html" title="Documentation"/>\n    {first}', 1))
        settings = (f'@INCLUDE = "{SITE}/Doxyfile"\nPROJECT_NUMBER = {version()}\nOUTPUT_DIRECTORY = "{self.api}"\n'
                    f'GENERATE_TAGFILE = "{self.out}/api.tag"\nLAYOUT_FILE = "{layout}"\n'
                    f'HTML_EXTRA_STYLESHEET = "{SITE}/api.css"\n')
        self.doxygen(settings)
        mending.mend(self.api)
        self.check_documented(settings)

    def doxygen(self, settings):
        """Runs Doxygen and returns what it says, with the headers' names as they are in the repository."""
        try:
            said = run([self.tools["doxygen"], "-"], "doxygen", input=settings, cwd=self.out / "headers")
        except Fault as fault:
            raise Fault(str(fault).replace(f"{self.out}/headers/solenoid/", "")) from None
        return said.replace(f"{self.out}/headers/solenoid/", "")

    def check_documented(self, settings):
        """Every class, everything in a namespace and every function of the MAIN classes has a comment."""
        said = self.doxygen(settings + "GENERATE_HTML = NO\nGENERATE_TAGFILE =\nEXTRACT_ALL = NO\n"
                            "WARN_IF_UNDOCUMENTED = YES\nWARN_AS_ERROR = NO\n")
        asked = re.compile(rf"(Compound|Member .* of namespace|Member .* \(function\) of (class|struct) solenoid::({'|'.join(MAIN)})) ")
        bare = [line for line in said.split("\n") if line.endswith("is not documented.") and asked.search(line) and "operator" not in line]
        if bare:
            raise Fault("\n".join(sorted(set(bare))))

    def build_pages(self, pages):
        for path in self.site.iterdir():
            if path != self.api:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        try:
            run([self.tools["sphinx-build"], "-q", "-W", "--keep-going", "-E", "-b", "html", "-c", SITE, "-d", self.out / "doctrees",
                 pages, self.site], "sphinx-build",
                env={**os.environ, "SOLENOID_VERSION": version(), "SOLENOID_API_TAGS": str(self.out / "api.tag"),
                     "PYTHONDONTWRITEBYTECODE": "1"})
        except Fault as fault:
            raise Fault(str(fault).replace(f"{pages}/", "")) from None

        self.inline_imports()

    def inline_imports(self):
        """Debian's themes import style sheets from where a web server has them: their text takes the import's place."""
        for sheet in (self.site / "_static").rglob("*.css"):
            text = sheet.read_text()
            found = re.sub(r"@import url\((/javascript/[^)]+)\);?", lambda name: Path("/usr/share" + name[1]).read_text(), text)
            if found != text:
                sheet.write_text(found)

    def all(self):
        self.out.mkdir(parents=True, exist_ok=True)
        own = files_below(SITE)
        self.unless_done("api", [*self.stage_headers(), *files_below(self.out / "comments"), *own], self.build_api)
        pages = staging.stage(ROOT, self.out / "pages", ApiNames(self.out / "api.tag").headers)
        self.unless_done("pages", [*files_below(pages), self.out / "api.tag", *own], lambda: self.build_pages(pages))
        return self.site / "index.html"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "docs", help="where to build; default: build/docs")
    try:
        print(Build(parser.parse_args().out.resolve()).all())
    except Fault as fault:
        print(f"docs: {fault}", file=sys.stderr)
        return fault.code
    return 0


if __name__ == "__main__":
    sys.exit(main())
