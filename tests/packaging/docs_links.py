#!/usr/bin/env python3
"""Checks that what the pages of docs/ and beside README.md, and the sources, point to is there.

pages      links and their headings; files named in inline code; in docs/theory numbered references, each cited and listed;
           one line a page in docs/README.md
listings   a block below a file's name alone is that file
sources    every page of docs named in a comment or text, with or without its folder, exists; a cited equation, section or
           erratum ("eq. 3 to 6", "section 4", "sect. 4", "E13" after the page's name) is one of that page, and so is an
           erratum named alone, of the page of the actuator's model

usage: docs_links.py ROOT
"""
import re
import sys
from pathlib import Path

FOLDERS = ("core", "solvers", "controllers", "experiments", "tests", "cmake", "docs")
SOURCES = (".hpp", ".cpp", ".ipp", ".toml", ".py", ".cmake", ".js", ".html", ".md")
ERRATA = "model.md"  # the page whose errata may be named alone


class Page:
    """A page's blocks of code, with the prose line before each, and its prose without them."""

    def __init__(self, path):
        self.path = path
        self.blocks = []  # (line number, prose line before, lines)
        prose, block, fence, indented_may_begin = [], None, False, True
        for number, line in enumerate(path.read_text().split("\n"), 1):
            if line.strip().startswith("```"):
                if not fence:
                    block = (number + 1, self._last(prose), [])
                    self.blocks.append(block)
                fence = not fence
                prose.append("")
                indented_may_begin = False
            elif fence:
                block[2].append(line)
                prose.append("")
            elif line.startswith("    ") and (indented_may_begin or not prose[-1:]):
                if block is None or block[0] + len(block[2]) != number:
                    block = (number, self._last(prose), [])
                    self.blocks.append(block)
                block[2].append(line[4:])
                prose.append("")
            elif not line.strip() and block is not None and block[0] + len(block[2]) == number:
                block[2].append("")  # a blank line may be inside an indented block
                prose.append("")
                indented_may_begin = True
            else:
                prose.append(line)
                indented_may_begin = not line.strip()
        self.prose = prose

    @staticmethod
    def _last(prose):
        return next((line for line in reversed(prose) if line.strip()), "")

    def files(self):
        """What the reader is told to write: {block's line: (name, content)}."""
        found = {}
        for number, before, lines in self.blocks:
            name = re.search(r"\b[Ww]rite\b.*`([\w.-]+\.(?:toml|csv))`[^`]*$", before)
            if name:
                found[number] = (name[1], "\n".join(lines).strip() + "\n")
        return found

    def inline(self):
        """Inline code as (line number, text); a line break inside is a space."""
        text = "\n".join(self.prose)
        for match in re.finditer(r"`([^`]+)`", text):
            if "\n\n" not in match[1]:
                yield text.count("\n", 0, match.start()) + 1, " ".join(match[1].split())


def pages_below(root):
    return [Page(path) for path in (*sorted(root.glob("*.md")), *sorted((root / "docs").rglob("*.md")))]


def sources_below(root):
    files = [path for folder in FOLDERS for path in (root / folder).rglob("*")]
    files += root.iterdir()
    return sorted(path for path in files if path.is_file() and (path.suffix in SOURCES or path.name == "CMakeLists.txt"))


class Contents:
    """What of a page can be cited by number."""

    def __init__(self, page):
        code = [line for _, _, lines in page.blocks for line in lines]
        self.equations = [int(found[1]) for line in code if (found := re.search(r"\((?:eq\. )?(\d+)\)\.?\s*$", line))]
        text = "\n".join(page.prose)
        self.sections = [int(n) for n in re.findall(r"^## (\d+)\. ", text, re.M)]
        self.errata = [int(n) for n in re.findall(r"^\| E(\d+) \|", text, re.M)]

    def of(self, kind):
        return self.equations if kind.startswith("eq") else self.errata if kind == "E" else self.sections


class Checker:
    CITED = re.compile(r"(?<![\w.-])([a-z][\w-]*)(\.md)?(?:\]\([^)]*\))?, (eq\. |sect(?:ion|\.) |E)(\d+)(?:(?: to |, | and )(\d+)\b(?!\.))?")

    def __init__(self, root):
        self.root, self.problems = root, []
        self.pages = pages_below(root)
        self.of_docs = [page for page in self.pages if root / "docs" in page.path.parents]
        self.links = self.citations = 0
        self.contents = {page.path.name: None for page in self.pages if page not in self.of_docs}
        for page in self.of_docs:
            if self.contents.get(page.path.name):
                self.problem(page.path, 1, "another page has this name: sources cite pages by name")
            self.contents[page.path.name] = Contents(page)

    def problem(self, path, number, text):
        self.problems.append(f"{path.relative_to(self.root)}:{number}: {text}")

    # ---- pages -------------------------------------------------------------------------------------------------------

    def anchors(self, path):
        headings = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
        return {re.sub(r"[^\w\- ]", "", h.replace("`", "").lower()).strip().replace(" ", "-") for h in headings}

    def check_links(self, page):
        for number, line in enumerate(page.prose, 1):
            for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line)):
                if re.match(r"\w+://", target):
                    continue
                self.links += 1
                name, _, anchor = target.partition("#")
                path = (page.path.parent / name).resolve() if name else page.path
                if not path.exists():
                    self.problem(page.path, number, f"link to '{target}': no such file")
                elif anchor and path.suffix == ".md" and anchor not in self.anchors(path):
                    self.problem(page.path, number, f"link to '{target}': no such heading")
        for number, text in page.inline():
            named = re.fullmatch(r"((?:core|solvers|controllers|experiments|tests|docs)/[\w./-]+\.\w+)", text)
            if named and not (self.root / named[1]).exists():
                self.problem(page.path, number, f"'{text}': no such file")

    def check_listings(self, page):
        """A block below a line that is a file's name alone, `folder/name.cpp`:, shows that file as it is."""
        for number, before, lines in page.blocks:
            named = re.fullmatch(r"`([\w./-]+\.(?:cpp|hpp))`:", before.strip())
            if named and (self.root / named[1]).is_file() and "\n".join(lines).strip() != (self.root / named[1]).read_text().strip():
                self.problem(page.path, number, f"does not show {named[1]} as it is")

    def check_references(self, page):
        text = re.sub(r"`[^`]*`", "", "\n".join(page.prose))
        body, _, references = text.partition("\n## References\n")
        listed = [int(n) for n in re.findall(r"^(\d+)\. ", references, re.M)]
        wanted = page.path.parent.name == "theory"
        if wanted and not listed:
            self.problem(page.path, 1, "a page of theory without numbered references")
        if not listed:
            return
        if listed != list(range(1, len(listed) + 1)):
            self.problem(page.path, 1, f"references are numbered {listed}")
        cited = {int(n) for group in re.findall(r"\[([1-9]\d*(?:, \d+)*)\]", body) for n in group.split(", ")}
        for n in sorted(cited ^ set(listed)):
            self.problem(page.path, 1, f"reference [{n}] is {'not listed' if n in cited else 'never cited'}")

    def check_numbers(self, page):
        contents = self.contents[page.path.name]
        for what in ("equations", "sections") + (("errata",) if page.path.name == ERRATA else ()):
            numbers = getattr(contents, what)
            if numbers != list(range(1, len(numbers) + 1)):
                self.problem(page.path, 1, f"{what} are numbered {numbers}")

    def check_index(self):
        index = self.root / "docs" / "README.md"
        listed = re.findall(r"^- \[[^]]*\]\(([^)]+)\): ", index.read_text(), re.M)
        there = {str(page.path.relative_to(index.parent)) for page in self.of_docs} - {"README.md"}
        for name in sorted(there ^ set(listed)):
            self.problem(index, 1, f"{name} is {'not there' if name in listed else 'not listed'}")
        for name in {name for name in listed if listed.count(name) > 1}:
            self.problem(index, 1, f"{name} is listed twice")

    # ---- sources and pages -------------------------------------------------------------------------------------------

    def check_citations(self, path):
        for number, line in enumerate(path.read_text(errors="replace").split("\n"), 1):
            for named in re.findall(r"(?<![\w/.-])docs/[\w./-]+\.[a-z]+\b", line):
                self.citations += 1
                if not (self.root / named).exists():
                    self.problem(path, number, f"'{named}': no such file")
            for named in re.findall(r"(?<![\w/.-])[a-z][\w-]*\.md\b", line):
                self.citations += 1
                if named not in self.contents:
                    self.problem(path, number, f"'{named}': no page of docs has this name")
            for stem, suffix, kind, first, last in self.CITED.findall(line):
                self.check_cited(path, number, stem + ".md", suffix, kind.strip(), range(int(first), int(last or first) + 1))
            for erratum in re.findall(r"\bE([1-9]\d?)\b", line):
                self.citations += 1
                if int(erratum) not in self.contents[ERRATA].errata:
                    self.problem(path, number, f"'E{erratum}': {ERRATA} has no such erratum")

    def check_cited(self, path, number, page, suffix, kind, wanted):
        if not self.contents.get(page):
            return
        self.citations += 1
        if not suffix:
            self.problem(path, number, f"cites a page by half of its name: write {page}")
        for n in wanted:
            if n not in self.contents[page].of(kind):
                self.problem(path, number, f"'{page}, {kind}{'' if kind == 'E' else ' '}{n}': the page has none of this number")

    def check(self):
        for page in self.pages:
            self.check_links(page)
            self.check_listings(page)
            self.check_references(page)
        for page in self.of_docs:
            self.check_numbers(page)
        self.check_index()
        sources = sources_below(self.root)
        for path in sources:
            self.check_citations(path)
        print(f"{len(self.pages)} pages, {self.links} links, {self.citations} citations in {len(sources)} files")
        for problem in self.problems:
            print(problem)
        return 1 if self.problems or not self.citations else 0


if __name__ == "__main__":
    sys.exit(Checker(Path(sys.argv[1]).resolve()).check())
