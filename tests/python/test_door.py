"""What the commands do to data, from Python: against the command line, which SOLENOID_PROGRAM names."""

import itertools
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import tomllib
import unittest

import numpy as np
import solenoid

SHIPPED = "experiments/systems/actuator/data/instances/closed_loops.instances"
TUNING = """
name = "small"
variants = ["nine_pd"]
[[scenario]]
name = "training"
trajectory = { kind = "sine", lead_s = 0.2, periods = 0.5 }
noise = true
duration_s = 0.4
[[scenario]]
name = "held_out"
trajectory = { kind = "cycloidal" }
duration_s = 0.4
"""


def command_line(*arguments):
    """What the program prints as JSON."""
    done = subprocess.run([os.environ["SOLENOID_PROGRAM"], *map(str, arguments), "--format", "json"],
                          capture_output=True,
                          text=True)
    if done.returncode != 0:
        raise AssertionError(f"exit code {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def untimed(value):
    """The same without what the clock says."""
    timed = ("solve_us", "deadline_misses", "us_", "time_us")
    if isinstance(value, dict):
        return {key: untimed(inner) for key, inner in value.items() if not key.startswith(timed)}
    return [untimed(inner) for inner in value] if isinstance(value, list) else value


def configured(path):
    """A campaign's text, but for the line that says whether solvers in Python were known when it was written."""
    return [line for line in path.read_text().splitlines() if not line.startswith("plugins")]


def short(name="short", **keys):
    return solenoid.scenario(name, trajectory="sine", noise=True, duration_s=0.5, **keys)


class InAFolder(unittest.TestCase):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def refused(self, pattern, call, *arguments, **keys):
        with self.assertRaisesRegex(solenoid.ConfigError, pattern) as refusal:
            call(*arguments, **keys)
        self.assertIn("allowed", str(refusal.exception))
        self.assertNotIn("\n", str(refusal.exception))


class Campaigns(InAFolder):
    CHOICE = {"variants": ["thesis_pd", "nine_pd"], "scenarios": ["sine_0"]}

    def test_a_folder_is_what_the_command_line_writes(self):
        theirs, ours = self.folder / "theirs", self.folder / "ours"
        said = command_line("compare", "default", "--variant", "thesis_pd,nine_pd", "--scenario", "sine_0", "--out",
                            theirs)
        records = solenoid.run_campaign("default", **self.CHOICE, out=ours)
        self.assertEqual(records.folder, str(ours))
        self.assertEqual(untimed(list(records)), untimed(said["runs"]))
        names = [sorted(str(path.relative_to(one)) for path in one.rglob("*")) for one in (theirs, ours)]
        self.assertEqual(*names)
        self.assertEqual(*[configured(one / "resolved.toml") for one in (theirs, ours)])
        again = solenoid.run_campaign("default", **self.CHOICE, out=ours)  # resumes: nothing runs twice
        self.assertEqual(list(again), list(records))
        self.assertIsNone(solenoid.run_campaign("default", **self.CHOICE).folder)

    def test_a_folder_is_read_back(self):
        records = solenoid.run_campaign("default", **self.CHOICE, out=self.folder / "out")
        results = solenoid.read_results(self.folder / "out")
        self.assertEqual(list(results.records), list(records))
        np.testing.assert_array_equal(results.table, records.table)
        self.assertEqual(results.table.dtype["rmse_mm"], np.float64)
        self.assertEqual(results.manifest["status"], "finished")
        self.assertEqual(results.configuration["variants"], ["thesis_pd", "nine_pd"])
        self.assertEqual(results.ids, ["sine_0--thesis_pd--s1", "sine_0--nine_pd--s1"])
        curves = results.curves(results.ids[0])
        run = solenoid.simulate(solenoid.variant("thesis_pd"), solenoid.scenario("sine_0", trajectory="sine"))
        self.assertEqual(len(curves), len(run))
        np.testing.assert_allclose(curves["time_s"], run.time_s, atol=1e-9)
        self.assertEqual(set(results.units(results.ids[0])), set(curves.dtype.names) - {"time_s"})
        self.refused("no run 'nobody'", results.curves, "nobody")

    def test_damaged_runs_are_left_out_with_a_warning(self):
        solenoid.run_campaign("default", **self.CHOICE, out=self.folder / "out")
        damaged = self.folder / "out/shards/all.runs"
        damaged.write_bytes(damaged.read_bytes().replace(b"nine", b"nein"))
        with self.assertWarnsRegex(UserWarning, "sine_0--nine_pd--s1"):
            results = solenoid.read_results(self.folder / "out")
        self.assertEqual([record["variant"] for record in results.records], ["thesis_pd"])
        self.refused("nowhere", solenoid.read_results, self.folder / "nowhere")

    def test_a_report_is_the_command_lines(self):
        solenoid.run_campaign("default", **self.CHOICE, out=self.folder / "out")
        try:
            path = solenoid.report(self.folder / "out")
        except solenoid.ConfigError as error:
            if "uPlot" in str(error) and not os.environ.get("CI"):
                self.skipTest(str(error))
            raise
        self.assertEqual(path, str(self.folder / "out/report.html"))
        ours = pathlib.Path(path).read_bytes()
        program = os.environ["SOLENOID_PROGRAM"]
        subprocess.run([program, "report", self.folder / "out", "--out", self.folder / "theirs.html"],
                       check=True,
                       capture_output=True)
        self.assertEqual(ours, (self.folder / "theirs.html").read_bytes())
        small = solenoid.report(self.folder / "out", self.folder / "small.html", overview_only=True)
        self.assertLess(os.path.getsize(small), len(ours))
        self.refused("nowhere", solenoid.report, self.folder / "nowhere")

    def test_variants_and_scenarios_may_be_objects(self):
        mine = solenoid.variant("mine", base="nine_pd", cost={"switching": 1e-7})
        records = solenoid.run_campaign(variants=[mine, "thesis_pd"],
                                        scenarios=[short(), short("payload", payload_kg=0.1)],
                                        seeds=[1, 2],
                                        jobs=2)
        self.assertEqual(len(records), 8)
        run = solenoid.simulate(mine, short("payload", payload_kg=0.1), seed=2)
        record = next(r for r in records if (r["variant"], r["scenario"], r["seed"]) == ("mine", "payload", 2))
        self.assertEqual(record["rmse_mm"], run.metrics.rmse_mm)
        known = solenoid.run_campaign(variants=mine, scenarios="sine_0")  # beside the campaign's own scenarios
        self.assertEqual([(r["variant"], r["scenario"]) for r in known], [("mine", "sine_0")])

    def test_what_is_refused(self):
        self.refused("'nobody' is not known", solenoid.run_campaign, variants=["nobody"])
        self.refused("'nowhere' is not known", solenoid.run_campaign, scenarios=["nowhere"])
        self.refused("no_such", solenoid.run_campaign, "no_such")
        self.refused("jobs: -1", solenoid.run_campaign, jobs=-1)
        flyer = solenoid.variant("flyer_single")
        self.refused("one system", solenoid.run_campaign, variants=[flyer], scenarios=[short()])


class Profiles(InAFolder):

    def test_everything_but_the_clock_is_the_command_lines(self):
        said = command_line("profile", "--variant", "thesis_pd,nine_state", "--passes", 1)
        found = solenoid.profile(["thesis_pd", "nine_state"], passes=1)
        counted = ("name", "instances", "instances_fingerprint", "plans_as_recorded", "proven_optimal_fraction",
                   "nodes_p50", "nodes_max", "passes", "has_phases")
        self.assertEqual([{key: one[key]
                           for key in counted} for one in found.json["variants"]], [{key: one[key]
                                                                                     for key in counted}
                                                                                    for one in said["variants"]])
        self.assertEqual(list(found.variants["name"]), ["thesis_pd", "nine_state"])
        self.assertEqual(found.variants["passes"].dtype, np.int64)
        solves = found.solves
        self.assertEqual(len(solves), found.variants["instances"].sum())
        nine = solves[solves["variant"] == "nine_state"]
        np.testing.assert_array_equal(nine["record"], np.arange(len(nine)))
        self.assertEqual(nine["time_us"].max(), found.variants["max_us"][1])
        self.assertEqual(nine["nodes"].max(), found.variants["nodes_max"][1])
        self.assertAlmostEqual(nine["rollout_us"].mean(), found.variants["rollout_us"][1], places=9)
        parts = sum(nine[key] for key in ("rollout_us", "derivatives_us", "factorisation_us", "bound_us", "other_us"))
        np.testing.assert_allclose(parts, nine["timed_us"])

    def test_closed_loops_of_objects_are_recorded(self):
        mine = solenoid.variant("mine", base="nine_pd")
        found = solenoid.profile(mine,
                                 short(),
                                 per_variant=20,
                                 passes=1,
                                 record=self.folder / "kept.instances",
                                 save=self.folder / "then.json")
        self.assertEqual((list(found.variants["name"]), len(found.solves)), (["mine"], 20))
        kept = solenoid.read_instances(self.folder / "kept.instances")
        self.assertEqual((list(kept), len(kept)), (["mine"], 1))
        again = solenoid.record_instances(mine, short(), per_variant=20)
        np.testing.assert_array_equal(again.states, kept.states)
        later = solenoid.profile(instances=again, passes=1, against=self.folder / "then.json", threshold=1000.0)
        self.assertEqual(later.against["slower"], False)
        self.assertEqual(later.variants["plans_as_recorded"], 20)

    def test_solves_cut_at_budgets(self):
        found = solenoid.profile(solenoid.variant("nine_pd"), short(), per_variant=5, passes=1, budgets_ms=[0.001, 5.0])
        self.assertEqual(list(found.quality["budget_ms"]), [0.001, 5.0])
        self.assertIn("rmse_mm", found.quality.dtype.names)

    def test_what_is_refused(self):
        self.refused("'nobody' has no instances", solenoid.profile, "nobody")
        self.refused("passes: 0", solenoid.profile, passes=0)
        self.refused("instances: beside", solenoid.profile, solenoid.variant("nine_pd"), instances=self.folder / "x")
        self.refused("cannot be read", solenoid.profile, instances=self.folder / "nothing.instances")
        self.refused("no instances", solenoid.profile, instances=5)
        self.refused("cannot be read", solenoid.profile, against=self.folder / "nothing.json")


class Tuning(InAFolder):
    FREE = {"cost.switching": (1e-9, 1e-6, "log"), "horizon.steps": (20, 100, "whole")}

    def test_steps_are_the_command_lines(self):
        path = self.write("small.toml", TUNING)
        free = ["--free", "cost.switching=1e-9..1e-6:log", "--free", "horizon.steps=20..100:whole"]
        said = command_line("tune", "nine_pd", *free, "--campaign", path, "--evaluations", 4, "--out",
                            self.folder / "theirs")
        lines = []
        found = solenoid.tune("nine_pd",
                              self.FREE,
                              campaign=path,
                              evaluations=4,
                              out=self.folder / "ours",
                              progress=lines.append)
        self.assertEqual(found.json, said)
        self.assertEqual(len(lines), len(found.trials))
        self.assertEqual(*[configured(self.folder / one / "tuned.toml") for one in ("theirs", "ours")])
        steps = [(self.folder / one / "history.csv").read_text().split("\n", 1) for one in ("theirs", "ours")]
        self.assertEqual(steps[0][1], steps[1][1])
        self.assertNotEqual(steps[0][0], steps[1][0])  # other programs do not resume each other's
        self.assertEqual(found.best, said["steps"][said["chosen"]]["values"])
        self.assertEqual(list(found.trials["cost.switching"]),
                         [step["values"]["cost.switching"] for step in said["steps"]])
        self.assertEqual(list(found.trials["objective"]), [step["training"]["objective"] for step in said["steps"]])
        self.assertTrue(np.isfinite(found.trials["held_out_objective"][found.chosen]))
        tuned = found.tuned()
        self.assertEqual(tuned.settings["horizon.steps"], found.best["horizon.steps"])

    def test_objects_are_tuned(self):
        mine = solenoid.variant("mine", base="nine_pd")
        found = solenoid.tune(mine, {"cost.switching": (1e-9, 1e-6, "log")},
                              scenarios=[short("training"), short("held_out")],
                              evaluations=2,
                              out=self.folder / "out",
                              limits={"switches_per_s": 30.0})
        self.assertEqual((found.variant, found.limits["switches_per_s"]), ("mine", 30.0))
        self.assertEqual(found.trials.dtype["held_out_rmse_mm"], np.float64)

    def test_what_progress_raises_ends_it(self):

        def stop(line):
            raise RuntimeError("enough")

        with self.assertRaisesRegex(RuntimeError, "enough"):
            solenoid.tune("nine_pd",
                          self.FREE,
                          campaign=self.write("small.toml", TUNING),
                          out=self.folder / "out",
                          progress=stop)

    def test_what_is_refused(self):
        path, out = self.write("small.toml", TUNING), self.folder / "out"
        for pattern, keys in ((r"limits: air_g = -1", {
                "limits": {
                    "air_g": -1
                }
        }), ("'speed' is no effort", {
                "limits": {
                    "speed": 1
                }
        }), ("'fast' is not known", {
                "algorithm": "fast"
        }), ("objective: 'looks'", {
                "objective": "looks"
        }), ("evaluations: 0", {
                "evaluations": 0
        })):
            self.refused(pattern, solenoid.tune, "nine_pd", self.FREE, campaign=path, out=out, **keys)
        self.refused("nobody", solenoid.tune, "nobody", self.FREE, campaign=path, out=out)
        self.refused("free: cost.switching", solenoid.tune, "nine_pd", {"cost.switching": 3}, campaign=path, out=out)
        self.refused("colour", solenoid.tune, "nine_pd", {"colour": (0, 1)}, campaign=path, out=out)


def without_samplers(ledger):
    """What depends on no clock: samplers draw as long as they have time."""

    def kept(name):
        return not name.startswith(("cross_entropy", "mppi"))

    for variant in ledger["variants"]:
        variant["methods"] = [row for row in variant["methods"] if kept(row["name"])]
        for state in variant["instances"]:
            state["cost"] = {name: cost for name, cost in state["cost"].items() if kept(name)}
    return ledger


class Ledgers(InAFolder):

    def test_costs_are_the_command_lines(self):
        said = command_line("ledger", "--variant", "nine_state", "--states", 4, "--bonmin", 0)
        found = solenoid.ledger("nine_state", states=4, bonmin=0)
        self.assertEqual(without_samplers(untimed(found.json)), without_samplers(untimed(said)))
        self.assertEqual(found.violations, [])
        entries = found.entries
        self.assertEqual(len(entries), 4 * 14)
        exact = entries[entries["method"] == "branch_and_bound"]
        self.assertEqual(list(exact["cost"]),
                         [one["cost"]["branch_and_bound"] for one in said["variants"][0]["instances"]])
        np.testing.assert_array_equal(exact["cost"], entries[entries["method"] == "exhaustive"]["cost"])
        self.assertTrue((entries[entries["method"] == "relaxed"]["gap"] <= 1e-12).all())
        self.assertEqual(set(found.methods["variant"]), {"nine_state"})
        recorded = solenoid.read_instances()["nine_state"]
        np.testing.assert_array_equal(exact["cost"], recorded.plan_costs[exact["record"]])
        ours = solenoid.ledger((), instances=recorded[::175], states=4, bonmin=0)
        self.assertEqual(len(ours.entries), 4 * 14)

    def test_what_is_refused(self):
        self.refused("'nobody' has no instances", solenoid.ledger, "nobody")
        self.refused("states: 0", solenoid.ledger, states=0)
        self.refused("5 has no name", solenoid.ledger, 5)


class Instances(InAFolder):

    @classmethod
    def setUpClass(cls):
        cls.path = pathlib.Path(os.environ["SOLENOID_SOURCE_DIR"], SHIPPED)

    def test_a_file_is_read_and_written_to_the_same_bytes(self):
        recorded = solenoid.read_instances(self.path)
        again = self.folder / "again.instances"
        solenoid.write_instances(again, recorded)  # in this version's format, which the shipped file is older than
        for name, block in solenoid.read_instances(again).items():
            np.testing.assert_array_equal(block.references, recorded[name].references)
            np.testing.assert_array_equal(block.plan_costs, recorded[name].plan_costs)
            self.assertFalse(block.own_rows.any())
        theirs = self.folder / "theirs.instances"
        command_line("profile", "--record", theirs, "--variant", "nine_pd,nine_robust", "--scenario", "noisy,kicked",
                     "--per-variant", 10, "--passes", 1)
        solenoid.write_instances(again, solenoid.read_instances(theirs))
        self.assertEqual(again.read_bytes(), theirs.read_bytes())
        ours = solenoid.record_instances(["nine_pd", "nine_robust"], ["noisy", "kicked"], per_variant=10)
        solenoid.write_instances(again, ours)
        self.assertEqual(again.read_bytes(), theirs.read_bytes())
        self.assertEqual(list(solenoid.read_instances()), list(recorded))
        self.assertEqual([motion.name for motion in recorded.motions],
                         ["nominal", "mismatched", "noisy", "saturated", "kicked"])
        path = self.folder / "mine.instances"  # of another system, and with loads and relaxations
        made = solenoid.record_instances(["flyer_single"], campaign="thrusters", per_variant=8)
        solenoid.write_instances(path, made)
        first = path.read_bytes()
        solenoid.write_instances(path, solenoid.read_instances(path))
        self.assertEqual(path.read_bytes(), first)
        self.assertEqual((made.system, made.states.shape[1]), ("thrusters", 6))

    def test_shapes(self):
        nine = solenoid.read_instances(self.path)["nine_state"]
        n, steps, blocks = len(nine), int(nine.blocks.sum()), len(nine.blocks)
        self.assertEqual((nine.system, nine.variant().solver), ("actuator", nine.variant().solver))
        self.assertEqual(nine.states.shape, (n, 4))
        self.assertEqual(nine.references.shape, (n, steps, 2))
        self.assertEqual(nine.warm_modes.shape, (n, blocks))
        self.assertEqual(nine.plan_inputs.shape, (n, blocks, 1))
        self.assertEqual(nine.plan_costs.shape, (n, ))
        self.assertEqual(set(nine.plan_statuses), {"optimal"})
        self.assertEqual(len(nine.mode_names), 9)
        first, motion = nine[0], nine.motions[nine.motion[0]]
        rows = motion.rows[nine.start[0]:nine.start[0] + steps] + nine.offsets[0]
        np.testing.assert_array_equal(first.references[0], rows)
        self.assertEqual(len(nine[nine.plan_costs > np.median(nine.plan_costs)]), n // 2)
        with self.assertRaisesRegex(AttributeError, "several variants"):
            solenoid.read_instances(self.path).states

    def test_solving_repeats_the_recorded_plans(self):
        for name in ("thesis_pd", "nine_state", "nine_robust"):
            recorded = solenoid.read_instances(self.path)[name][::10]
            found = recorded.solve()
            np.testing.assert_array_equal(found.modes, recorded.plan_modes)
            np.testing.assert_array_equal(found.costs, recorded.plan_costs)
            np.testing.assert_array_equal(found.inputs, recorded.plan_inputs)
            np.testing.assert_array_equal(found.statuses, recorded.plan_statuses)
            self.assertTrue((found.times_us > 0).all() and (found.nodes > 0).all())
            self.assertTrue((found.bounds <= found.costs).all())

    def test_changed_states_are_other_problems(self):
        recorded = solenoid.read_instances(self.path)["nine_state"][:40]
        before = recorded.plan_costs.copy()
        recorded.states[:, 0] += 0.002
        found = recorded.solve()
        self.assertTrue((found.costs != before).all())
        recorded.keep(found)
        path = self.folder / "changed.instances"
        solenoid.write_instances(path, recorded)
        said = command_line("profile", "--instances", path, "--passes", 1)["variants"][0]
        self.assertEqual((said["instances"], said["plans_as_recorded"]), (40, 40))
        back = solenoid.read_instances(path)
        np.testing.assert_array_equal(back.states, recorded.states)
        np.testing.assert_array_equal(back.plan_costs, found.costs)

    def test_changed_references_are_kept_row_by_row(self):
        recorded = solenoid.read_instances(self.path)["nine_state"][:6]
        recorded.references = recorded.references + np.array([0.001, 0.0])
        recorded.references[0] -= np.array([0.001, 0.0])
        recorded.keep(recorded.solve())
        path = self.folder / "changed.instances"
        solenoid.write_instances(path, recorded)
        back = solenoid.read_instances(path)
        np.testing.assert_array_equal(back.references, recorded.references)
        self.assertTrue(back.own_rows[1:].all())
        np.testing.assert_array_equal(back.solve().costs, recorded.plan_costs)
        self.refused(
            "rows of a reference", back.solve,
            solenoid.variant("long",
                             base="nine_state",
                             horizon={
                                 "steps": 2 * int(recorded.blocks.sum()),
                                 "blocks": [1, 2 * int(recorded.blocks.sum()) // 5 - 1]
                             }))

    def test_other_variants_solve_them(self):
        recorded = solenoid.read_instances(self.path)["nine_state"][:30]
        search = solenoid.variant("search", base="nine_state", solver="branch_and_bound")
        np.testing.assert_array_equal(recorded.solve(search).costs, recorded.plan_costs)
        rounded = recorded.solve(solenoid.variant("rounded", base="nine_state", solver="sum_up_rounding"))
        self.assertTrue((rounded.costs >= recorded.plan_costs * (1 - 1e-12)).all())
        other = recorded.solve("nine_robust")  # other blocks: other plans, of the same states
        self.assertEqual(other.modes.shape[1], len(solenoid.read_instances(self.path)["nine_robust"].blocks))
        self.assertTrue(np.isfinite(other.costs).all())
        cut = recorded.solve(search, deadline_ms=1e-6)
        self.assertIn("deadline_reached", set(cut.statuses))

    def test_solvers_in_python_solve_them(self):

        class Exhaustive:

            def solve(self, problem):
                plans = np.array(list(itertools.product(range(len(problem.modes)), repeat=len(problem.blocks))))
                return plans[np.argmin(problem.cost(plans))]

        class Broken:

            def solve(self, problem):
                raise ArithmeticError("broken here")

        recorded = solenoid.read_instances(self.path)["nine_state"][::100]
        keys = {key: value for key, value in tomllib.loads(recorded.toml).items() if key not in ("solver", "summary")}
        found = recorded.solve(solenoid.PythonSolver("exhaustive_in_python", Exhaustive, **keys))
        np.testing.assert_array_equal(found.costs, recorded.plan_costs)
        with self.assertRaisesRegex(ArithmeticError, "broken here"):
            recorded.solve(solenoid.PythonSolver("broken_in_python", Broken, **keys))

    def test_a_variant_by_other_instances_is_its_own_closed_loop(self):
        """A horizon that is longer goes on along the motion: what the longer variant's own problem would have had."""
        long = solenoid.variant("long",
                                base="nine_pd",
                                integral={"gain": 0.0},
                                horizon={
                                    "steps": 60,
                                    "blocks": [2, 4, 6]
                                })
        brief = solenoid.variant("brief",
                                 base="nine_pd",
                                 integral={"gain": 0.0},
                                 horizon={
                                     "steps": 20,
                                     "blocks": [1, 1, 2]
                                 })
        both = solenoid.record_instances([long, brief], short(), per_variant=10)
        alike = both["long"]
        brief_ones = both["brief"]
        brief_ones.states = alike.states
        for key in ("commanded", "lines", "ages"):
            setattr(brief_ones, key, getattr(alike, key))
        same = alike.start == brief_ones.start
        self.assertTrue(same.any())
        np.testing.assert_array_equal(brief_ones.solve(long).costs[same], alike.plan_costs[same])

    def test_damaged_files_are_refused(self):
        whole = self.path.read_bytes()
        for damaged in (whole[:1000], whole[:500] + b"x" + whole[501:], b"", b"SOLINST\n" + bytes(40)):
            path = self.folder / "damaged.instances"
            path.write_bytes(damaged)
            self.refused("damaged.instances: byte", solenoid.read_instances, path)
        self.refused("cannot be read", solenoid.read_instances, self.folder / "nothing")

    def test_wrong_arrays_are_refused(self):

        def changed(key, value):
            block = solenoid.read_instances(self.path)["nine_state"][:5]
            setattr(block, key, value(getattr(block, key)))
            return block

        def put(index, number):

            def apply(array):
                array[index] = number
                return array

            return apply

        path = self.folder / "wrong.instances"
        for pattern, block in (
            (r"states: shape \(5, 3\) \(allowed: \(5, 4\)\)", changed("states", lambda a: a[:, :3])),
            (r"references: shape \(5, 3, 2\)", changed("references", lambda a: a[:, :3])),
            (r"plan_costs: shape \(4,\) \(allowed: \(5,\)\)", changed("plan_costs", lambda a: a[:4])),
            ("states: nan in instance 2", changed("states", put((2, 1), np.nan))),
            ("loads: nan in instance 1",
             changed("loads", lambda a: np.where(np.arange(a.size).reshape(a.shape) == 2, np.nan, 0.0))),
            (r"warm_modes: 9 in instance 3 \(allowed: 0 to 8\)", changed("warm_modes", put((3, 0), 9))),
            ("plan_modes: float64", changed("plan_modes", lambda a: a + 0.5)),
            ("states: <U", changed("states", lambda a: a.astype(str))),
            ("ages: -1", changed("ages", put((0, 0), -1))),
            ("commanded: 99", changed("commanded", put(0, 99))),
            ("plan_statuses: 'infeasible'", changed("plan_statuses", put(0, "infeasible"))),
        ):
            self.refused(f"instances of 'nine_state': {pattern}", solenoid.write_instances, path, block)
        self.assertFalse(path.exists())
        self.refused("states: shape", changed("states", lambda a: a[:, :3]).solve)
        block = solenoid.read_instances(self.path)["nine_state"]
        with self.assertRaisesRegex(AttributeError, "cannot be set"):
            block.start = block.start + 1
        with self.assertRaises(ValueError):
            block.start[0] = 7
        self.refused("no instances", solenoid.write_instances, path, [1, 2])

    def test_unknown_names_are_refused(self):
        recorded = solenoid.read_instances(self.path)
        self.refused("no instances of 'nobody'", recorded.__getitem__, "nobody")
        few = recorded["nine_state"][:2]
        self.refused("nobody", few.solve, "nobody")
        self.refused("variant 'flyer_single': system thrusters", few.solve, "flyer_single")
        self.refused("is a law", few.solve, solenoid.variant("law", valves="three_mode", solver="three_mode_sliding"))
        self.refused("deadline_ms", few.solve, deadline_ms=-1)
        self.refused("blocks|plans of shape", few.keep, few.solve("nine_robust"))


class Interruption(InAFolder):
    LONG = {
        "run_campaign": 'solenoid.run_campaign("robustness", out="out", jobs=1)',
        "tune": 'solenoid.tune("nine_robust", {"cost.switching": (1e-9, 1e-6, "log")}, out="out", jobs=1)',
        "profile": "solenoid.profile()",
        "ledger": "solenoid.ledger(bonmin=0, states=100000)",
        "record_instances": "solenoid.record_instances()",
        "solve": 'recorded[numpy.tile(numpy.arange(len(recorded)), 300)].solve()',
    }

    def test_ctrl_c_is_keyboard_interrupt(self):
        for name, call in self.LONG.items():
            with self.subTest(name), tempfile.TemporaryDirectory(dir=self.folder) as folder:
                script = textwrap.dedent(f"""
                    import numpy, solenoid
                    recorded = solenoid.read_instances()["nine_state_4"]
                    print("go", flush=True)
                    try:
                        {call}
                    except KeyboardInterrupt:
                        print("interrupted", flush=True)
                """)
                child = subprocess.Popen([sys.executable, "-c", script],
                                         cwd=folder,
                                         stdout=subprocess.PIPE,
                                         stderr=subprocess.PIPE,
                                         text=True)
                self.assertEqual(child.stdout.readline(), "go\n")
                time.sleep(1.0)
                child.send_signal(signal.SIGINT)
                begin = time.monotonic()
                out, err = child.communicate(timeout=120)
                self.assertEqual((out, child.returncode), ("interrupted\n", 0), err)
                self.assertLess(time.monotonic() - begin, 60)

    def test_other_threads_go_on(self):
        recorded = solenoid.read_instances()["nine_state_4"]
        ended, counted = threading.Event(), 0

        def count():
            nonlocal counted
            while not ended.wait(0.001):
                counted += 1

        thread = threading.Thread(target=count)
        thread.start()
        begin = time.monotonic()
        recorded.solve()
        recorded.solve()
        seconds = time.monotonic() - begin
        during = counted
        ended.set()
        thread.join()
        self.assertGreater(during, 10 * seconds)


if __name__ == "__main__":
    unittest.main()
