"""The pages of the site: copies of the Markdown that a code host shows, arranged for Sphinx.

README.md becomes the front page, the pages of docs/ keep their places, and what stands beside README.md is the group
"Project". The navigation's groups and their order are those of docs/README.md. A link to a source file or a folder leads to
a page that shows it.
"""
import os
import re
import shutil
from pathlib import Path

FRONT, CONTENTS, LIBRARY = (name + ".md" for name in ("index", "contents", "library"))
STUB = "experiments/python/package/__init__.pyi"
FOLDERS = ("core", "solvers", "controllers", "experiments")
IMAGES = (".svg", ".png", ".jpg", ".gif")
LANGUAGES = {".py": "python", ".pyi": "python", ".cpp": "cpp", ".hpp": "cpp", ".ipp": "cpp", ".toml": "toml", ".js": "javascript", ".css": "css",
             ".html": "html", ".json": "json", ".cmake": "cmake", ".sh": "bash", ".md": "markdown"}
# Markdown's two kinds of target, and those of HTML in it.
TARGET = re.compile(r"(?P<before>\]\(|^\[[^]]+\]: +|\b(?:src|href|srcset)=\")(?P<target>[^)\s\"#]+)(?P<anchor>#[^)\s\"]*)?", re.M)


def page_of(path):
    """Where a Markdown file of the repository is in the site, both relative: docs/theory/theory.md -> theory/theory.md."""
    special = {"README.md": FRONT, "docs/README.md": CONTENTS}
    return special.get(path, re.sub(r"^docs/", "", path) if path.startswith("docs/") else f"project/{path.lower()}")


def markdown_files(root):
    """Those of the site, relative to the repository."""
    files = [*root.glob("*.md"), *(root / "docs").rglob("*.md")]
    return sorted(str(path.relative_to(root)) for path in files)


def page_addresses(root):
    """{name of a page below docs: its address in the site}."""
    return {os.path.basename(path): page_of(path)[:-3] + ".html" for path in markdown_files(root)
            if path.startswith("docs/") and path != "docs/README.md"}


class Staging:
    def __init__(self, root):
        self.root = root
        self.pages = {path: page_of(path) for path in markdown_files(root)}
        self.files = {}  # what the site has besides: {path in the site: bytes}
        self.shown = set()  # source files and folders that have a page

    def place_of(self, path):
        """Where the site has this file or folder of the repository; None where it is none of ours."""
        there = self.root / path
        if path in self.pages:
            return self.pages[path]
        if not there.exists() or path.startswith(".."):
            return None
        if there.suffix in IMAGES:
            place = re.sub(r"^docs/", "", path)
            self.files[place] = there.read_bytes()
            return place
        self.show(path)
        return f"source/{path}.md"

    def show(self, path):
        """A page with a source file's text, or a folder's files."""
        if path in self.shown:
            return
        self.shown.add(path)
        there, place = self.root / path, f"source/{path}.md"
        if there.is_dir():
            names = sorted(item.name for item in there.iterdir() if item.name[0] not in "._" or item.name == "__init__.py")
            lines = [f"- [{name}]({os.path.relpath(self.place_of(f'{path}/{name}'), os.path.dirname(place))})" for name in names]
            text = "\n".join(lines)
        else:
            code = there.read_text(errors="replace")
            fence = "`" * (max(map(len, re.findall("`{3,}", code)), default=2) + 1)
            text = f"{fence}{LANGUAGES.get(there.suffix, 'text')}\n{code.rstrip()}\n{fence}"
        head = "orphan: true\n" if path in ("LICENSE", STUB) else "orphan: true\nnosearch: true\n"
        self.files[place] = f"---\n{head}---\n\n# {path}\n\n{text}\n".encode()

    def rewritten(self, path):
        """The text of a page with its links as they are in the site."""
        def replace(found):
            if re.match(r"\w+:", found["target"]):
                return found[0]
            place = self.place_of(os.path.normpath(os.path.join(os.path.dirname(path), found["target"])))
            if place is None:
                return found[0]
            return found["before"] + os.path.relpath(place, os.path.dirname(self.pages[path]) or ".") + (found["anchor"] or "")
        return TARGET.sub(replace, (self.root / path).read_text())

    def groups(self):
        """The navigation: [(group, [page])], the groups of docs/README.md and what stands beside README.md."""
        found = []
        for line in (self.root / "docs/README.md").read_text().split("\n"):
            if line.startswith("## "):
                found.append((line[3:], []))
            elif found and (link := re.match(r"- \[[^]]*\]\(([^)]+)\)", line)):
                found[-1][1].append(self.pages[os.path.normpath("docs/" + link[1])])
        beside = [page for path, page in self.pages.items() if page.startswith("project/")]
        if (self.root / "LICENSE").is_file():
            self.show("LICENSE")
            beside.append("source/LICENSE.md")
        return [*found, ("Library", [LIBRARY]), ("Project", [CONTENTS, *beside])]

    @staticmethod
    def order(header):
        return FOLDERS.index(header.split("/")[0]), os.path.split(header)

    def library(self, headers):
        """The page that leads to the API reference: each folder's headers with their classes."""
        self.show(STUB)
        lines = ["# API reference", "", "Every public header, as `#include <solenoid/...>` finds it, is in the",
                 '<a href="api/index.html">C++ reference</a>; its own search knows members, too. The Python package has its types and',
                 f"functions in [one file](source/{STUB}.md). What each header has:"]
        folder = None
        for header, classes in sorted(headers.items(), key=lambda item: self.order(item[0])):
            if os.path.dirname(header) != folder:
                folder = os.path.dirname(header)
                lines += ["", f"## {folder}", "", "| header | classes |", "|---|---|"]
            lines.append(f"| `{header}` | {', '.join(f'`{name}`' for name in classes)} |")
        return "\n".join(lines) + "\n"

    def all(self, headers):
        """{path in the site: bytes}."""
        self.files[LIBRARY] = self.library(headers).encode()
        for path, page in self.pages.items():
            self.files[page] = self.rewritten(path).encode()
        trees = [f"```{{toctree}}\n:hidden:\n:caption: {name}\n\n" + "\n".join(pages) + "\n```" for name, pages in self.groups()]
        self.files[FRONT] += ("\n" + "\n\n".join(trees) + "\n").encode()
        return self.files


def stage(root, to, headers):
    """Writes the pages below `to`, which it returns: what is the same is left alone, what is no page any more goes.

    headers: {header: [class]} of the API reference
    """
    files = Staging(root).all(headers)
    for path in sorted(to.rglob("*")):
        if path.is_file() and str(path.relative_to(to)) not in files:
            path.unlink()
    for name, content in files.items():
        path = to / name
        if not path.is_file() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    return to
