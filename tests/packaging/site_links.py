#!/usr/bin/env python3
"""Builds the documentation's site afresh, warnings being errors, and checks that it holds together without a network.

links     every href and src of every page, of its style sheets and of the reference's own index scripts: the file is there,
          and so is the anchor; a link to the web may be followed by a reader, but nothing is loaded from there
search    the pages' index knows each page and finds words where they are; the reference's knows the main classes

usage: site_links.py ROOT WORK      exit codes: 0, 1 a fault, 77 the tools are missing (under CI that is a fault, too)
"""
import json
import os
import re
import shutil
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

# What a reader may look for (as the index stems it), and a page that has to be among the answers.
SEARCHES = {"dwell": ["theory/theory-rounding", "how-to/how-to-add-a-system"], "modeset": ["architecture", "library"],
            "branchandbound": ["library"], "payload": ["reference/configuration"], "emul": ["reference/rig"],
            "kalman": ["theory/estimators"], "numpi": ["start/python"]}
CLASSES = ("HybridModel", "ModeSet", "Problem", "Plan", "SolveReport", "Solver", "Status", "Deadline", "SolverRow", "Controller",
           "Estimator", "CommandLimits")
LOADED = {"script", "img", "iframe", "source", "link", "use", "image", "embed", "object", "video", "audio"}


class Page(HTMLParser):
    """A page's anchors and what it points to: [(element, address)]."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.targets = set(), []
        self.feed(path.read_text(errors="replace"))

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id" or (name == "name" and tag == "a"):
                self.anchors.add(value)
            elif name in ("href", "src", "data", "xlink:href") and value is not None:
                self.targets.append((tag, value))
            elif name == "srcset" and value:
                self.targets += [(tag, part.split()[0]) for part in value.split(",")]


class Checker:
    def __init__(self, root, site):
        self.root, self.site = root, site
        self.problems, self.web, self.links = [], {}, 0
        self.pages = {path: Page(path) for path in sorted(site.rglob("*.html"))}

    def problem(self, path, text):
        self.problems.append(f"{path.relative_to(self.site)}: {text}")

    def check_target(self, path, element, target):
        """One address in the file `path`."""
        self.links += 1
        if re.match(r"(https?:)?//", target):
            if element != "a":
                self.problem(path, f"<{element}> loads {target}")
            self.web.setdefault(target, path)
            return
        if re.match(r"(data|mailto|javascript):", target):
            return
        name, _, anchor = target.partition("#")
        name, anchor = unquote(name.partition("?")[0]), unquote(anchor)
        there = (path.parent / name) if name else path
        there = Path(os.path.normpath(there))
        if name.startswith("/") or self.site not in (there, *there.parents):
            self.problem(path, f"'{target}' leaves the site")
        elif not there.is_file():
            self.problem(path, f"'{target}': no such file")
        elif anchor and there in self.pages and anchor not in self.pages[there].anchors:
            self.problem(path, f"'{target}': no such anchor")

    def check_links(self):
        for path, page in self.pages.items():
            for element, target in page.targets:
                if not (element == "link" and target == ""):
                    self.check_target(path, "a" if element not in LOADED else element, target)
        for path in sorted(self.site.rglob("*.css")):
            text = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
            for target in re.findall(r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)", text):
                self.check_target(path, "style", target[0] or target[1])
        # The reference's tree, menus and search are scripts with the pages' names in them.
        for path in sorted((self.site / "api").rglob("*.js")):
            if path.name.startswith("navtreeindex"):
                continue  # no links: where in the tree a page is
            for target in re.findall(r"['\"]((?:\.\./)?[\w.-]+\.html(?:#\w+)?)['\"]", path.read_text()):
                self.check_target(path, "a", target)

    def check_search(self):
        text = (self.site / "searchindex.js").read_text()
        index = json.loads(re.fullmatch(r"Search\.setIndex\((.*)\)\s*", text, re.S)[1])
        names, terms, titles = index["docnames"], index["terms"], index["titleterms"]
        for word, pages in SEARCHES.items():
            found = {names[n] for hits in (terms.get(word, []), titles.get(word, []))
                     for n in (hits if isinstance(hits, list) else [hits])}
            for page in pages:
                if page not in found:
                    self.problem(self.site / "searchindex.js", f"'{word}' does not find {page}, but {sorted(found)}")
        for path in sorted((self.root / "docs").rglob("*.md")):
            page = str(path.relative_to(self.root / "docs"))[:-3]
            if page != "README" and page not in names:
                self.problem(self.site / "searchindex.js", f"does not know {page}")
        known = "".join(path.read_text() for path in (self.site / "api" / "search").glob("all_*.js"))
        for name in CLASSES:
            if f"['{name}'," not in known:
                self.problem(self.site / "api" / "search", f"does not know {name}")
        return len(names), len(terms)

    def check(self):
        self.check_links()
        documents, terms = self.check_search()
        api = sum(self.site / "api" in path.parents for path in self.pages)
        print(f"{len(self.pages) - api} pages, {api} of the API reference, {self.links} links; {documents} documents and {terms} terms "
              "in the search index")
        print("to the web, not followed:", *sorted(self.web), sep="\n  ")
        for problem in self.problems:
            print(problem)
        return 1 if self.problems or not api or not self.links else 0


def main():
    root, work = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    shutil.rmtree(work, ignore_errors=True)
    began = time.monotonic()
    built = subprocess.run([sys.executable, root / "docs" / "site" / "build.py", "--out", work])
    if built.returncode == 2 and not os.environ.get("CI"):
        return 77
    if built.returncode != 0:
        return 1
    print(f"built in {time.monotonic() - began:.1f} s")
    return Checker(root, work / "site").check()


if __name__ == "__main__":
    sys.exit(main())
