#!/usr/bin/env python3
"""Runs every command that the pages of docs/ and beside README.md show. Their links are the business of docs_links.py.

A page's commands run in the order of the page, in a folder of its own, with the files that the page tells the reader to
write (a block after a line "Write ... `NAME.toml`"). A command must end with exit code 0. What would take too long, needs
hardware or has a placeholder is replaced by what docs_rules.py says; a command that neither runs nor has a rule fails the
test, and so does an option that `--help` does not know. Where a page shows a ranking under a command that was run as it
is, the ranking has to be the page's, but for the times; the description of a picture that a page shows is read too.

usage: docs_commands.py ROOT PROGRAM [--fake-comedi DIR] [--page NAME]
"""
import argparse
import concurrent.futures
import glob
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
import docs_rules  # noqa: E402
from docs_links import pages_below  # noqa: E402

RANKING = re.compile(r"\s*\d+  [a-z]\w+ ")  # a line of one


def block_commands(lines):
    """Shell lines of a block, continued lines joined, comments dropped, as (offset, text)."""
    joined, begin = "", 0
    for offset, line in enumerate(lines):
        begin = begin if joined else offset
        joined += line.strip()
        if joined.endswith("\\"):
            joined = joined[:-1] + " "
            continue
        text = re.sub(r"(^|\s+)#\s.*$", "", joined).strip()
        joined = ""
        if re.match(r"\./solenoid\b|(cmake|apt-get|npm|python3|pip) |[A-Z_]+=\S+ python3 ", text):
            yield begin, text


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return str(free.getsockname()[1])


class Checker:
    def __init__(self, root, program, fake_comedi):
        self.root, self.program, self.fake_comedi = root, program, fake_comedi
        self.problems, self.helps, self.done = [], {}, {}
        self.ran, self.covered = [], []  # lists, which two threads may append to
        self.subcommands = re.findall(r"^  (\w+) {2,}", self.help(()).split("Subcommands:")[1], re.M)

    def problem(self, page, number, text):
        self.problems.append(f"{page.path.relative_to(self.root)}:{number}: {text}")

    def help(self, words):
        if words not in self.helps:
            done = subprocess.run([self.program, *words, "--help"], capture_output=True, text=True)
            self.helps[words] = done.stdout if done.returncode == 0 else ""
        return self.helps[words]

    # ---- options -----------------------------------------------------------------------------------------------------

    def check_options(self, page, number, text):
        """Every subcommand and option in `text` (without ./solenoid) is one that --help knows."""
        for part in text.split("&"):
            words = part.replace("./solenoid", "").split()
            if not words or words[0] not in self.subcommands:
                if words and not re.match(r"COMMAND|-", words[0]) and words[0] not in docs_rules.SCRIPT:
                    self.problem(page, number, f"'{part.strip()}': no such command")
                continue
            command = (words[0],)
            if len(words) > 1 and re.search(rf"^  {re.escape(words[1])} {{2,}}", self.help(command), re.M):
                command = tuple(words[:2])
            known = set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", self.help(command)))
            for option in re.findall(r"(?<![\w=.-])--[a-z][\w-]*", part):
                if option not in known:
                    self.problem(page, number, f"'{part.strip()}': '{' '.join(command)} --help' does not know {option}")

    # ---- running -----------------------------------------------------------------------------------------------------

    def environment(self):
        environment = dict(os.environ)
        if self.fake_comedi:
            environment["LD_LIBRARY_PATH"] = self.fake_comedi + ":" + environment.get("LD_LIBRARY_PATH", "")
        return environment

    def words(self, text, folder):
        """The words of a command as a shell in `folder` would expand them."""
        words = []
        for word in shlex.split(text.replace("./solenoid", "", 1)):
            matches = sorted(glob.glob(word, root_dir=folder)) if "*" in word else []
            words += matches or [word]
        return words

    def start(self, text, folder):
        return subprocess.Popen([self.program, *self.words(text, folder)], cwd=folder, text=True, env=self.environment(),
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                start_new_session=True)

    def execute(self, text, folder, rule):
        """Runs one command; what stands before & in the background, interrupted at the end. Returns code, out, err."""
        *background, text = [part.strip() for part in text.split("&")]
        servers = [self.start(part, folder) for part in background]
        try:
            if servers:
                time.sleep(0.3)
            process = self.start(text, folder)
            if rule and rule.until:
                heard = ""
                for line in process.stderr:
                    heard += line
                    if re.search(rule.until, line):
                        break
                code, out, err = self.end(process)
                return code, out, heard + err
            try:
                out, err = process.communicate(timeout=120)
            except subprocess.TimeoutExpired:
                return self.end(process)
            return process.returncode, out, err
        finally:
            for server in servers:
                self.end(server)

    @staticmethod
    def end(process):
        """Ctrl-C; killed where that is not heard. Returns the exit code and the output."""
        try:
            os.killpg(process.pid, signal.SIGINT)
            out, err = process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return "no end", "", "".join(process.communicate())
        return process.returncode, out, err

    def run_command(self, page, number, command, folder):
        """Returns the output if the command ran as it is, else None."""
        bare = command.replace("./solenoid", "", 1).strip()
        rule = next((rule for rule in docs_rules.RULES if re.fullmatch(rule.command, bare)), None)
        if bare in self.done:
            return self.done[bare]
        if rule is None:
            instead = [command]
        elif rule.board and not self.fake_comedi:
            instead = []
        else:
            instead = [match for match in rule.commands(bare, self.subcommands)]
        if not instead:
            self.covered.append(command)
        output = None
        for text in instead:
            text = text.replace("FREE_PORT", free_port())
            began = time.monotonic()
            for attempt in range(rule.attempts if rule else 1):
                code, out, err = self.execute(text, folder, rule)
                if code in (rule.codes if rule else (0,)):
                    break
            self.ran.append(text)
            if os.environ.get("DOCS_TIMES"):
                print(f"{time.monotonic() - began:7.2f} s  {page.path.name}:{number}: {text}", flush=True)
            if code == 2 and "uPlot, which draws" in err:
                self.covered.append(text)  # built without it: the test of the report says what is missing
            elif code not in (rule.codes if rule else (0,)):
                shown = command if text == command else f"{command}' as '{text}"
                last = (err.strip() or out.strip()).split("\n")[-1]
                self.problem(page, number, f"'{shown}': exit code {code}: {last}")
            elif rule is None:
                output = out
                if not re.search(r"[.*]|--out|--save", bare):  # no file matters: once is enough
                    self.done[bare] = out
        return output

    def run_page(self, page):
        with tempfile.TemporaryDirectory(prefix="docs-") as folder:
            for name, content in docs_rules.FILES.items():
                Path(folder, name).write_text(content)
            if "--rig rig.toml" in page.path.read_text():
                Path(folder, "rig.toml").write_text("")  # every key of it has a default
            for name in {docs_rules.RECORDED, *re.findall(r"experiments/systems/\w+/data/\w+/\w+\.toml", page.path.read_text())}:
                if (self.root / name).is_file():
                    Path(folder, name).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copy(self.root / name, Path(folder, name))
            shown_output = None
            for number, kind, content in self.steps(page):
                if kind == "file":
                    Path(folder, content[0]).write_text(content[1])
                elif kind == "ranking":
                    if shown_output is not None:
                        self.compare_ranking(page, number, content, shown_output)
                else:
                    if not content.startswith("./solenoid"):
                        if not any(re.search(pattern, content) for pattern in docs_rules.ELSEWHERE):
                            self.problem(page, number, f"'{content}': neither run nor listed in docs_rules.ELSEWHERE")
                        continue
                    self.check_options(page, number, content)
                    self.make_log(content, folder)
                    output = self.run_command(page, number, content, folder) or ""
                    shown_output = output if output.startswith("rank ") else shown_output

    def steps(self, page):
        """Files, commands and shown rankings of a page in their order."""
        steps = [(number, "file", file) for number, file in page.files().items()]
        for number, _, lines in page.blocks:
            steps += [(number + at, "command", text) for at, text in block_commands(lines)]
            steps += [(number + at, "ranking", line) for at, line in enumerate(lines) if RANKING.match(line)]
        for number, line in enumerate(page.prose, 1):
            for picture in re.findall(r"!\[[^]]*\]\(([^)\s]+\.svg)\)", line):
                described = (page.path.parent / picture).read_text().partition("<desc>")[2].partition("</desc>")[0]
                steps += [(number, "ranking", row) for row in described.split("\n") if RANKING.match(row)]
        for number, text in page.inline():
            if text.startswith("./solenoid "):
                steps.append((number, "command", text))
            elif text.split(" ")[0] in self.subcommands and " -" in text:
                self.check_options(page, number, text)
        return sorted(steps, key=lambda step: step[0])

    def make_log(self, content, folder):
        """The log of a run, for commands on one that the reader has."""
        if Path(folder, "run.mcap").exists() or not re.search(r"\bLOG\b|run\.mcap|RUN\.mcap", content):
            return
        self.execute("./solenoid run nine_state --duration 1 --quiet --out log_for_docs", folder, None)
        Path(folder, "log_for_docs/cycloidal--nine_state--s1.mcap").rename(Path(folder, "run.mcap"))

    def compare_ranking(self, page, number, shown, output):
        """Rank, variant, errors, switches and air are the same everywhere; times are not."""
        line = " ".join(shown.split()[:6])
        if line not in (" ".join(other.split()[:6]) for other in output.split("\n")):
            self.problem(page, number, f"the command does not print '{line} ...'")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", type=Path)
    parser.add_argument("program")
    parser.add_argument("--fake-comedi", default="")
    parser.add_argument("--page", default="")
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    checker = Checker(root, str(Path(arguments.program).resolve()), arguments.fake_comedi)
    pages = [page for page in pages_below(root) if arguments.page in page.path.name]
    with concurrent.futures.ThreadPoolExecutor(max_workers=2) as two:  # much of it waits: runs are in real time
        list(two.map(checker.run_page, pages))
    print(f"{len(pages)} pages, {len(checker.ran)} commands run, {len(checker.covered)} shown that are tested elsewhere")
    for problem in checker.problems:
        print(problem)
    return 1 if checker.problems or not checker.ran else 0


if __name__ == "__main__":
    sys.exit(main())
