"""A header with its doc comments as Doxygen has to read them, line for line.

tables      lines of a comment that are indented or begin with a label and a gap ("shapes   x: n") keep their lines
citations   "eq. 3" does not end the first sentence; a page of docs that is named becomes a link into the site
"""
import re

TABLE = re.compile(r"`?\w+(?: \w+)?`?:? {2,}\S| {2,}\S")
# What Doxygen would take for a command, a link or a dash.
COMMANDS = re.compile(r"[\\@#%]|--+")
ENTITIES = {"&": "&amp;", "<": "&lt;", ">": "&gt;"}


class Filter:
    def __init__(self, pages):
        """pages: {name of a page of docs: its address in the site}."""
        self.pages = pages
        self.named = re.compile(r"(?<![\w/.`-])(%s)(?![\w/`-])" % "|".join(map(re.escape, sorted(self.pages))))

    def linked(self, text):
        return self.named.sub(lambda found: f'<a href="../{self.pages[found[1]]}">{found[1]}</a>', text)

    def table(self, text):
        text = re.sub("[&<>]", lambda found: ENTITIES[found[0]], text)
        return self.linked(COMMANDS.sub(lambda found: "\\" + found[0], text))

    def prose(self, text):
        text = re.sub(r"\b(eqs?|sects?|e\.g|i\.e)\. (?=\S)", r"\1.&nbsp;", text)
        return self.linked(text)

    def comment(self, lines):
        """The lines of one comment, each (what stands before the text, the text)."""
        is_table = [bool(TABLE.match(text)) for _, text in lines]
        for i in range(1, len(lines) - 1):  # an empty line within a table is the table's
            if not lines[i][1].strip() and is_table[i - 1] and any(is_table[i + 1:i + 2]):
                is_table[i] = True
        shown = []
        for i, (head, text) in enumerate(lines):
            if not is_table[i]:
                shown.append(f"{head} {self.prose(text)}".rstrip())
                continue
            first = i == 0 or not is_table[i - 1]
            last = i + 1 == len(lines) or not is_table[i + 1]
            shown.append(f"{head} {'<pre>' if first else ''}{self.table(text)}{'</pre>' if last else ''}")
        return shown

    def header(self, text):
        shown, block = [], []
        for line in text.split("\n"):
            found = re.match(r"(\s*///)(?!<)(?: (.*))?$", line)
            if found:
                block.append((found[1], found[2] or ""))
                continue
            shown += self.comment(block)
            block = []
            head, mark, tail = line.partition("///<")
            shown.append(head + mark + self.prose(tail) if mark else line)
        return "\n".join(shown + self.comment(block))

