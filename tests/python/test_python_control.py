"""Controllers and solvers in Python, and solenoid.compare. SOLENOID_PROGRAM names the program."""

import math
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
import solenoid
from control_support import SHORT, Exhaustive, Lines, exactly, flight, lines, numbers, untimed


class Pulses:
    """On-times of one valve: controllers/systems/actuator/laws/pulse_width_pid.hpp in Python."""

    def __init__(self, period, rise, fall):
        self.period, self.rise, self.fall, self.left_over = period, rise, fall, 0.0

    def in_effect(self, ticks, on):
        if ticks == self.period:
            return self.period if on else max(0, self.period - self.rise)
        if on:
            return ticks + self.fall
        return 0 if ticks == 0 else max(0, ticks - self.rise + self.fall)

    def worth(self, ticks, on):
        return self.period if ticks == self.period else self.in_effect(ticks, on)

    def plan(self, duty, on):
        wanted, best = min(max(duty, 0.0), 1.0) * self.period + self.left_over, 0
        for ticks in range(1, self.period + 1):
            if self.in_effect(ticks, on) == 0:
                continue
            miss, least = abs(wanted - self.worth(ticks, on)), abs(wanted - self.worth(best, on))
            if miss < least or (miss == least and ticks == self.period):
                best = ticks
        self.left_over = min(max(wanted - self.in_effect(best, on), -0.5 * self.period), 0.5 * self.period)
        return best


class VanVarseveldBone:
    """The shipped variant's law in Python."""

    def __init__(self, variant, scenario):
        assert scenario.system == variant.system == "actuator"
        self.tick_s, self.period = 1e-3, 8
        self.a, self.b = Pulses(self.period, 4, 1), Pulses(self.period, 4, 1)
        self.integral, self.begin, self.on, self.last = 0.0, -1, (0, 0), (False, False)

    def duty(self, m):
        desired, rate = m.reference[0], m.reference_rate[0]
        error = desired - m.estimate[0]
        self.integral = min(max(self.integral + 4800.0 * error * self.period * self.tick_s, -0.5), 0.5)
        coming = m.reference_at(m.time_s + 0.15)[0, 0] - desired
        if abs(rate) > 1e-4:
            friction = math.copysign(0.004, rate)
        else:
            friction = math.copysign(0.004, error) if abs(error) > 1.25e-4 else 0.0
        u = 320.0 * error + 24.0 * (rate - m.estimate[1]) + self.integral + 19.0 * coming + friction
        return min(max(u, -1.0), 1.0)

    def step(self, measurement):
        if self.begin < 0 or measurement.tick - self.begin >= self.period:
            self.begin = measurement.tick
            u = self.duty(measurement)
            self.on = (self.a.plan(0.4 + 0.5 * u, self.last[0]), self.b.plan(0.4 - 0.5 * u, self.last[1]))
        at = measurement.tick - self.begin
        self.last = (at < self.on[0], at < self.on[1])
        return self.last[0] + 2 * self.last[1]


class Laws(unittest.TestCase):

    def test_a_shipped_law_written_again_has_its_numbers_to_the_last_digit(self):
        shipped = solenoid.configuration("default", ["van_varseveld_bone"])["variant"]["van_varseveld_bone"]
        again = solenoid.PythonController("again",
                                          VanVarseveldBone,
                                          valves="three_way",
                                          model=shipped["model"],
                                          estimator=shipped["estimator"])
        tasks = [
            solenoid.scenario("sine", trajectory="sine", plant="twin", noise=True, duration_s=1.0),
            solenoid.scenario("loaded",
                              trajectory="cycloidal",
                              plant="twin",
                              noise=True,
                              duration_s=0.5,
                              payload_kg=0.1)
        ]
        found = solenoid.compare(["van_varseveld_bone", again], tasks, seeds=2, jobs=2)
        self.assertEqual(found.failed, [])
        self.assertEqual(len(found.runs), 8)
        by_variant = {
            name: [numbers(run) for run in found.runs if run["variant"] == name]
            for name in ("van_varseveld_bone", "again")
        }
        self.assertEqual(by_variant["again"], by_variant["van_varseveld_bone"])
        self.assertGreater(min(run["coil_switches"] for run in found.runs), 10)

    def test_a_command_has_four_forms_of_one_meaning(self):
        forms = {
            "name": lambda mode, pattern: mode,
            "pattern": lambda mode, pattern: pattern,
            "numpy": lambda mode, pattern: np.uint32(pattern),
            "command": lambda mode, pattern: solenoid.Command(pattern),
            "pair": lambda mode, pattern: (mode, []),
            "list": lambda mode, pattern: [pattern, np.zeros(0)]
        }

        def law(form):

            class Law(Lines):

                def step(self, measurement):
                    mode = super().step(measurement)
                    return form(mode, self.patterns[mode])

                def __init__(self):
                    self.patterns = patterns

            return Law

        patterns = {}
        run = solenoid.simulate(lines("names"), flight())
        for mode in ("coast", "+x", "-x"):
            once = solenoid.simulate(exactly("once", lambda m, mode=mode: mode), flight(duration_s=0.1))
            patterns[mode] = int(once.switches[0])
        self.assertEqual(patterns["coast"], 0)
        self.assertEqual(len(set(patterns.values())), 3)
        for name, form in forms.items():
            again = solenoid.simulate(lines(name, law(form)), flight())
            np.testing.assert_array_equal(again.switches, run.switches, name)
        self.assertGreater(len(set(run.switches)), 1)

    def test_continuous_inputs_are_written_within_their_limits(self):

        def law(answer):
            return solenoid.PythonController("pusher",
                                             type("Law", (), {
                                                 "step": lambda self, m: answer
                                             }),
                                             valves="two_way",
                                             motor="pd")

        task = solenoid.scenario("short", trajectory="sine", plant="twin", duration_s=0.05)
        for answer in ((0, 3.0), (0, [3.0]), (0, np.array([3.0])), solenoid.Command(0, 3.0)):
            run = solenoid.simulate(law(answer), task)
            np.testing.assert_array_equal(run.motor_n, np.full(len(run), 3.0))
        self.assertLess(solenoid.simulate(law((0, 1e6)), task).motor_n.max(), 1e3)

    def test_a_measurement_has_what_is_measured_estimated_and_desired(self):
        seen = []

        def look(m):
            seen.append((m, m.reference_at(m.time_s + 0.01)))
            return 0

        run = solenoid.simulate(exactly("looker", look), flight())
        self.assertEqual(len(seen), len(run))
        for k, (m, ahead) in enumerate(seen):
            self.assertEqual((m.tick, m.time_s, m.commanded), (k, run.time_s[k], 0))
            np.testing.assert_array_equal(m.estimate, run.estimate[k])
            self.assertEqual((m.value.shape, m.estimate.shape, m.reference.shape, ahead.shape),
                             ((3, ), (6, ), (3, ), (3, 3)))
            self.assertEqual(m.reference_x_m, m.reference[0])
            self.assertEqual(m.estimate_x_m, m.estimate[0])
            self.assertEqual(m.reference_x_m, run.reference_x_m[k])
        channel = next(name for name in dir(run) if name.startswith("measured_"))
        np.testing.assert_array_equal([getattr(m, channel.removeprefix("measured_")) for m, _ in seen],
                                      getattr(run, channel))
        np.testing.assert_array_equal(seen[0][1][:, 0], seen[1][0].reference)
        self.assertIn("estimate_x_m", dir(seen[0][0]))
        with self.assertRaisesRegex(AttributeError, "it has .*estimate_x_m"):
            seen[0][0].colour
        with self.assertRaisesRegex(ValueError, "over"):
            seen[0][0].reference_at(0.0)

    def test_an_object_is_made_for_each_run_and_reset_before_it(self):

        class Counting(Lines):
            made = 0

            def __init__(self, variant, scenario):
                type(self).made += 1
                self.known = (variant.name, scenario.name, scenario.duration_s)
                self.resets = 0

            def reset(self):
                self.resets += 1

            def step(self, measurement):
                assert self.resets == 1 and self.known == ("counting", "flight", 0.1), self.known
                return super().step(measurement)

        counting = lines("counting", Counting)
        for _ in range(3):
            solenoid.simulate(counting, flight(duration_s=0.1))
        self.assertEqual(Counting.made, 3)
        self.assertEqual(solenoid.compare(counting, flight(duration_s=0.1), seeds=3, jobs=1).failed, [])
        self.assertEqual(Counting.made, 3)  # those were in processes of their own

    def test_the_loop_by_hand_has_laws_in_python(self):
        law, task = lines(), flight(duration_s=0.5)
        run = solenoid.simulate(law, task, seed=2)
        controller, plant = solenoid.Controller(law.variant, task), solenoid.Plant(law.variant, task, seed=2)
        for k in range(len(run)):
            decision = controller.step(plant.read(run.time_s[k]))
            self.assertEqual(decision.command.switches, run.switches[k], k)
            plant.write(decision.command)
        wrong = exactly("wrong", lambda m: 1 // 0)
        with self.assertRaises(ZeroDivisionError):
            solenoid.Controller(wrong.variant, task).step(plant.read(1.0))


class Solvers(unittest.TestCase):

    def test_a_search_written_again_has_the_costs_of_the_shipped_one(self):
        shipped = solenoid.variant("shipped", solver="exhaustive", **SHORT)
        mine = solenoid.PythonSolver("mine", Exhaustive, **SHORT)
        first, second = solenoid.simulate(shipped, flight()), solenoid.simulate(mine, flight())
        self.assertGreater(int(second.solved.sum()), 5)
        np.testing.assert_array_equal(first.cost[first.solved], second.cost[second.solved])
        np.testing.assert_array_equal(first.switches, second.switches)
        self.assertEqual(set(second.nodes[second.solved]), {81})
        self.assertGreater(second.solve_us[second.solved].min(), 0.0)
        found = solenoid.compare([shipped, mine], flight())
        self.assertEqual(numbers(found.runs[0]).keys(), numbers(found.runs[1]).keys())
        self.assertEqual(found.runs[0]["rmse_mm"], found.runs[1]["rmse_mm"])

    def test_a_problem_has_shapes_and_costs(self):
        seen = []

        class Looking:

            def solve(self, problem):
                plan = problem.warm_start
                names = [problem.modes[mode] for mode in plan]
                assert problem.cost(plan) == problem.cost(names) == problem.cost(list(plan))
                several = problem.cost(np.stack([plan, plan]))
                assert several.shape == (2, ) and several[0] == several[1] == problem.cost(plan, np.zeros((2, 0)))
                seen.append((problem, problem.initial, problem.reference, problem.points, problem.blocks, problem.dt_s,
                             problem.patterns, problem.input_lower, problem.warm_inputs, problem.seconds_left,
                             problem.commanded))
                return names

        solenoid.simulate(solenoid.PythonSolver("looking", Looking, **SHORT), flight(duration_s=0.2))
        problem, initial, reference, points, blocks, dt_s, patterns, lower, inputs, left, commanded = seen[0]
        steps = int(blocks.sum())
        self.assertEqual((initial.shape, reference.shape, points.shape[0]), ((6, ), (steps, 6), 9))
        self.assertEqual((patterns.shape, lower.shape, inputs.shape), ((9, ), (0, ), (2, 0)))
        self.assertEqual(commanded, 0)
        self.assertGreater(dt_s, 0.0)
        self.assertEqual(left, math.inf)
        with self.assertRaisesRegex(ValueError, "solve"):
            problem.cost([0, 0])

    def test_no_plan_leaves_the_last_one(self):

        class Silent:

            def solve(self, problem):
                return None

        run = solenoid.simulate(solenoid.PythonSolver("silent", Silent, **SHORT), flight(duration_s=0.3))
        self.assertEqual(set(run.switches), {0})
        self.assertTrue(np.isinf(run.cost[run.solved]).all())

    def test_continuous_inputs_are_chosen_and_cut_at_their_bounds(self):

        class Pushing:

            def solve(self, problem):
                few = problem.cost(problem.warm_start, np.zeros((len(problem.blocks), 1)))
                assert few != problem.cost(problem.warm_start, [[1.0]] * len(problem.blocks))
                return problem.warm_start, np.full((len(problem.blocks), 1), 1e6)

        mine = solenoid.PythonSolver("pushing", Pushing, valves="two_way", motor="joint")
        task = solenoid.scenario("short", trajectory="sine", plant="twin", duration_s=0.05)
        run = solenoid.simulate(mine, task)
        self.assertLess(run.motor_n.max(), 1e3)
        self.assertGreater(run.motor_n.max(), 1.0)


class Comparing(unittest.TestCase):

    def test_a_law_ranks_beside_shipped_solvers(self):
        own = {"system": "thrusters", "thrusters": "pairs", "horizon": {"steps": 60, "blocks": [2, 4]}}
        shipped = [
            solenoid.variant(solver + "_2", solver=solver, **own)
            for solver in ("exhaustive", "branch_and_bound", "sum_up_rounding")
        ]
        found = solenoid.compare([*shipped, "flyer_single", lines()],
                                 flight(duration_s=2.0),
                                 seeds=2,
                                 baseline="exhaustive_2")
        self.assertEqual(found.failed, [])
        text = str(found)
        for name in ("exhaustive_2", "branch_and_bound_2", "sum_up_rounding_2", "flyer_single", "lines"):
            self.assertEqual(len([run for run in found.runs if run["variant"] == name]), 2)
            self.assertIn(name, text)
            self.assertIn(name, found._repr_html_())
        self.assertIn("Not real time, in simulation only: lines.", text)
        self.assertIn("divided by that of exhaustive_2", text)
        against = next(line for line in text.splitlines()
                       if line.startswith("branch_and_bound_2 ") and "1.0000" in line)
        # Ties are halves; two seeds are too few for an interval and a verdict.
        self.assertEqual(against.split(), ["branch_and_bound_2", "1.0000", "-", "-", "50.0", "2", "0", "0", "-"])
        paired = found.paired or {}
        self.assertEqual(paired["baseline"], "exhaustive_2")
        turned = [
            row["ratio"] for row in paired["matrix"]
            if row["variant"] == "exhaustive_2" and row["baseline"] == "branch_and_bound_2"
        ]
        self.assertEqual(turned, [1.0])
        rows = found.table()
        self.assertEqual(rows.shape, (10, ))
        self.assertTrue(np.isfinite(rows["rmse_mm"]).all())
        same = rows["rmse_mm"][rows["variant"] == "exhaustive_2"] == rows["rmse_mm"][rows["variant"] ==
                                                                                     "branch_and_bound_2"]
        self.assertTrue(same.all())

    def test_variants_say_what_they_are(self):
        self.assertFalse(lines().variant.real_time)
        self.assertFalse(solenoid.PythonSolver("mine", Exhaustive, **SHORT).variant.real_time)
        self.assertTrue(solenoid.variant("flyer_single").real_time)
        self.assertIn("not real time", repr(lines()))
        self.assertIn("not real time", repr(lines().variant))
        self.assertEqual(lines().variant.summary, "Fires against the error of x where it is beyond a switching line.")
        self.assertEqual(lines("näher", summary="größer \N{SNOWMAN}").variant.summary, "größer \N{SNOWMAN}")

    def test_shipped_scenarios_go_by_their_names(self):
        names = {run["scenario"] for run in solenoid.compare("thesis_pd", "sine_0").runs}
        self.assertEqual(names, {"sine_0"})
        both = solenoid.compare("flyer_pairs", [flight("short", 0.2), "station"]).runs
        self.assertEqual([run["scenario"] for run in both], ["short", "station"])
        self.assertEqual({run["system"] for run in both}, {"thrusters"})

    def test_one_name_is_the_object_that_was_given(self):
        task = flight(duration_s=0.3)
        first, second = exactly("same", lambda m: "coast"), exactly("same", lambda m: "+x")
        self.assertEqual(set(solenoid.simulate(first, task).switches), {0})
        self.assertNotIn(0, set(solenoid.simulate(second, task).switches))
        self.assertEqual(set(solenoid.simulate(first, task).switches), {0})

    def test_a_results_folder_is_that_of_the_command_line(self):
        program = os.environ["SOLENOID_PROGRAM"]
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder, "out")
            wrong = exactly("wrong", lambda m: {}["nothing"])
            found = solenoid.compare([lines(), "flyer_pairs", wrong], flight(duration_s=0.5), seeds=2, out=out)
            self.assertEqual(found.folder, str(out))
            self.assertEqual(len(found.failed), 2)
            again = solenoid.compare([lines(), "flyer_pairs", wrong], flight(duration_s=0.5), seeds=2, out=out)
            self.assertEqual([untimed(run) for run in again.runs], [untimed(run) for run in found.runs])
            for file in ("resolved.toml", "manifest.json", "runs.csv", "shards/all.runs", "shards/all.traces"):
                self.assertTrue((out / file).exists(), file)
            self.assertIn(b"failed: KeyError", (out / "shards/all.runs").read_bytes())
            for command in (["report", str(out), "--out", folder + "/report.html"
                             ], ["report",
                                 str(out), "--figure", "flight--lines--s1", "--svg", folder + "/run.svg"],
                            ["report", str(out), "--figure", "pareto", "--svg", folder + "/pareto.svg"]):
                done = subprocess.run([program, *command], capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
            page = pathlib.Path(folder, "report.html").read_text()
            self.assertIn("lines", page)
            rerun = subprocess.run(
                [program, "compare",
                 str(out / "resolved.toml"), "--variant", "lines", "--out", folder + "/rerun"],
                capture_output=True,
                text=True)
            self.assertEqual(rerun.returncode, 1, rerun.stdout + rerun.stderr)
            self.assertIn("a law in Python", rerun.stderr)
            refused = subprocess.run(
                [program, "run", "lines", "--campaign",
                 str(out / "resolved.toml"), "--plant", "sim"],
                capture_output=True,
                text=True)
            self.assertNotEqual(refused.returncode, 0)
            self.assertIn("a law in Python", refused.stderr)


class Page(unittest.TestCase):

    def test_what_the_page_shows_runs(self):
        page = pathlib.Path(os.environ["SOLENOID_SOURCE_DIR"], "docs/how-to/python-controllers.md").read_text()
        code = "\n".join(line[4:] for line in page.splitlines() if line.startswith("    ") or not line)
        names = {"print": lambda text: None}
        exec(compile(code, "python-controllers.md", "exec"), names)
        self.assertEqual(names["found"].failed, [])
        self.assertEqual(len(names["found"].runs), 30)
        run = solenoid.simulate(names["search"], flight())
        self.assertGreater(int(run.solved.sum()), 5)


if __name__ == "__main__":
    unittest.main()
