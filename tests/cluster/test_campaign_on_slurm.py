"""Campaigns, searches and studies on a simulated Slurm cluster of two nodes: what comes of them is what one machine
makes. The program is the first argument. Skipped where Slurm is missing, but not under CI."""

import csv
import json
import os
import signal
import subprocess
import sys
import unittest
from pathlib import Path

import slurm_cluster
from slurm_cluster import SlurmCluster
from test_slurm_cluster import command_name

PROGRAM = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else "solenoid"

SCENARIO = """\
[[scenario]]
name = "{name}"
trajectory = {{ kind = "step" }}
plant = "twin"
noise = true
duration_s = {duration_s}
ensemble = {{ members = {members}, seed = 5, sampling = "sobol", friction = [0.7, 2.0], flow = [0.8, 1.15] }}
"""
STUDY = """\
[study]
sweep = { key = "integral.gain", values = [0.001, 0.002, 0.005] }
[[study.table]]
name = "plants"
scenarios = ["plants"]
figures = ["ssa_mm"]
"""
CLOCK_SAYS = ("solve_us_", "deadline_misses")


def campaign(members, duration_s, variants=("thesis_pd", "nine_pd")):
    names = ", ".join(f'"{variant}"' for variant in variants)
    return f"name = \"pilot\"\nvariants = [{names}]\n" + SCENARIO.format(
        name="plants", members=members, duration_s=duration_s)


def table(folder):
    """Rows of runs.csv without what a clock decides."""
    with open(folder / "runs.csv", newline="") as file:
        return [{key: cell for key, cell in row.items() if not key.startswith(CLOCK_SAYS)}
                for row in csv.DictReader(file)]  # yapf: disable


def rankings(folder):
    """Those of the report, without what a clock decides."""
    page = (folder / "report.html").read_text()
    data = json.loads(page.partition('type="application/json" id="data">')[2].partition("</script>")[0])
    return [[{key: value for key, value in variant.items() if not key.startswith("solve")}
             for variant in ranking["variants"]] for ranking in data["rankings"]]  # yapf: disable


class OnSlurm(unittest.TestCase):

    def setUp(self):
        self.cluster = SlurmCluster(nodes=2, max_array_size=6)
        self.cluster.start()
        self.addCleanup(self.cluster.stop)

    def solenoid(self, *arguments, exit_code=0):
        done = subprocess.run([PROGRAM, *map(str, arguments)],
                              capture_output=True,
                              text=True,
                              env=self.cluster.env(),
                              cwd=self.cluster.folder)
        said = done.stdout + done.stderr
        self.assertEqual(exit_code, done.returncode, said)
        return said

    def file(self, name, text=None):
        path = self.cluster.folder / name
        if text is not None:
            path.write_text(text)
        return path

    def status(self, folder):
        return json.loads(self.solenoid("status", folder, "--format", "json"))

    def logs(self, folder):
        return "".join(f"==== {log.name}\n{log.read_text()}" for log in sorted(self.file(folder).glob("slurm/*.log")))

    def test_a_node_and_a_task_die_and_the_result_is_that_of_one_machine(self):
        self.file("c.toml", campaign(members=100, duration_s=16.0))
        self.solenoid("compare", "c.toml", "--out", "alone")
        on_cluster = ("compare", "c.toml", "--slurm", "--nodes", 8, "--time", "10:00", "--out", "shared")
        said = self.solenoid(*on_cluster)
        self.assertIn("200 of 200 runs are missing; 8 of 8 shards to submit, 0 at work", said)
        self.assertEqual(2, len(json.loads(self.file("shared/slurm/jobs.json").read_text())["arrays"]),
                         "arrays have five tasks here")

        def running():
            return {job.nodes: job for job in self.cluster.jobs().values() if job.state == "RUNNING"}

        def working(node):
            return [process for process in self.cluster.processes(node) if command_name(process) == "solenoid"]

        self.cluster.wait(lambda: len(running()) == 2 and len(working("node0")) > 1 and len(working("node1")) > 1,
                          "both nodes to be at work")
        self.assertEqual(200, sum(self.status("shared")[key] for key in ("done", "left")))
        shells = [p for p in self.cluster.processes("node0") if command_name(p) == "slurm_script"]
        self.assertEqual(1, len(shells))
        self.cluster.kill_node("node1")
        for process in shells + working("node0"):
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass  # a run that ended meanwhile
        self.cluster.wait_node("node1", "down")
        self.cluster.start_node("node1")
        self.cluster.wait_idle()

        before = self.status("shared")
        self.assertGreater(before["left"], 0, self.logs("shared"))
        self.assertLess(before["left"], 200, self.logs("shared"))
        said = self.solenoid(*on_cluster)
        self.assertIn(f"{before['left']} of 200 runs are missing; 1 of 8 shards to submit, 0 at work", said)
        self.cluster.wait_idle()

        after = self.status("shared")
        self.assertEqual((200, 0, 0), (after["done"], after["failed"], after["left"]), self.logs("shared"))
        self.assertEqual([], after["shards"])
        alone, shared = self.file("alone"), self.file("shared")
        self.assertEqual(200, len(table(alone)))
        self.assertEqual(table(alone), table(shared))
        self.assertIn("200 of 200 runs: 200 ok", self.file("shared/slurm/result.txt").read_text())
        self.solenoid("report", "alone")
        self.assertEqual(rankings(alone), rankings(shared))
        self.assertEqual(8, len(list(shared.glob("shards/*"))), "no traces, and nothing temporary")
        self.assertIn("nothing to submit", self.solenoid(*on_cluster))

    def test_a_task_whose_time_is_over_goes_on_where_it_was(self):
        self.file("c.toml", campaign(members=40, duration_s=30.0, variants=("nine_pd",)))
        self.solenoid("compare", "c.toml", "--slurm", "--nodes", 1, "--out", "shared")
        self.cluster.wait(lambda: self.status("shared")["shards"][0]["begun"] > 0, "its first runs")
        job = json.loads(self.file("shared/slurm/jobs.json").read_text())["arrays"][0]["id"]
        self.cluster.run("scancel", "--batch", "--signal=USR1", f"{job}_1")  # what --signal=B:USR1@60 does
        self.cluster.wait_idle()
        task = self.cluster.jobs(str(job))[f"{job}_1"]
        self.assertEqual(("COMPLETED", 1), (task.state, task.restarts), self.logs("shared"))
        self.assertEqual(40, len(table(self.file("shared"))))
        self.assertRegex(self.logs("shared"), r"interrupted(.|\n)* of 40 runs are there already")

    def test_a_search_has_its_evaluations_done_as_arrays(self):
        held_out = SCENARIO.format(name="held_out", members=2, duration_s=0.3)
        self.file("c.toml", campaign(2, 0.3, ("nine_pd",)) + held_out)
        tune = ("tune", "nine_pd", "--campaign", "c.toml", "--free", "cost.switching=1e-9..1e-6:log", "--evaluations", 2)
        self.solenoid(*tune, "--out", "alone")
        self.solenoid(*tune, "--out", "shared", "--slurm", "--nodes", 2)
        self.assertEqual(self.file("alone/history.csv").read_text(), self.file("shared/history.csv").read_text())
        self.assertEqual([], list(self.file("shared/evaluations").glob("*")))
        self.assertGreaterEqual(len(self.cluster.jobs()), 6)  # two tasks for each of three evaluations

    def test_a_study_has_its_runs_done_as_an_array_and_its_tables_after_them(self):
        self.file("study.toml", campaign(2, 0.3, ("thesis_pd",)) + STUDY)
        self.solenoid("study", "sweep", "study.toml", "--slurm", "--nodes", 3, "--out", "shared")
        self.cluster.wait_idle()
        self.assertEqual(0, self.status("shared")["left"], self.logs("shared"))
        alone = self.solenoid("study", "sweep", "study.toml", "--out", "alone", "--format", "csv")
        shared = self.solenoid("study", "sweep", "study.toml", "--out", "shared", "--format", "csv")
        self.assertIn("6 of 6 runs are there already", shared)
        self.assertEqual(*([line for line in said.splitlines() if line.startswith("plants,")] for said in (alone, shared)))
        self.assertIn("ssa", self.file("shared/slurm/result.txt").read_text())


if __name__ == "__main__":
    if packages := slurm_cluster.missing():
        print(f"Slurm is not installed: apt-get install {' '.join(packages)}", file=sys.stderr)
        sys.exit(1 if os.environ.get("CI") else 77)
    unittest.main(verbosity=2)
