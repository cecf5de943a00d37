"""The Python package against the command line: SOLENOID_PROGRAM names the program, PYTHONPATH the package."""

import gc
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import solenoid

TIMED = ("solve_us", "deadline_misses")


def untimed(record):
    return {key: value for key, value in record.items() if not key.startswith(TIMED)}


def command_line(*arguments):
    with tempfile.TemporaryDirectory() as folder:
        return subprocess.run([os.environ["SOLENOID_PROGRAM"], *arguments, "--out", folder + "/out"], check=True,
                              capture_output=True, text=True).stdout


def short(**keys):
    return solenoid.scenario("short", trajectory="sine", plant="twin", noise=True, duration_s=1.5, **keys)


class Runs(unittest.TestCase):
    def test_a_run_has_the_numbers_of_the_command_line_to_the_last_digit(self):
        said = json.loads(command_line("compare", "default", "--variant", "thesis_pd", "--scenario", "sine_0", "--format",
                                       "json"))["runs"]
        ours = solenoid.run_campaign("default", variants=["thesis_pd"], scenarios=["sine_0"])
        self.assertEqual([untimed(r) for r in ours], [untimed(r) for r in said])
        run = solenoid.simulate(solenoid.variant("thesis_pd"), solenoid.scenario("sine_0", trajectory="sine"))
        for key in ("rmse_mm", "mae_mm", "coil_switches", "air_g", "motor_rms_n"):
            self.assertEqual(getattr(run.metrics, key), said[0][key], key)

    def test_arrays_are_views_that_cannot_be_written_and_outlive_the_run(self):
        run = solenoid.simulate(solenoid.variant("thesis_pd"), short())
        self.assertEqual(len(run), 1500)
        truth, time_s = run.truth, run.time_s
        self.assertEqual(truth.shape, (1500, 4))
        self.assertTrue(np.shares_memory(truth, run.truth))
        self.assertIs(truth.base, run)
        with self.assertRaises(ValueError):
            truth[0, 0] = 1.0
        before = truth.copy()
        del run
        gc.collect()
        np.testing.assert_array_equal(truth, before)
        np.testing.assert_allclose(time_s, np.arange(1500) * 1e-3, atol=1e-12)
        self.assertEqual(truth.strides[0], time_s.strides[0])  # one tick record apart: nothing was copied

    def test_arrays_say_what_the_metrics_say(self):
        run = solenoid.simulate(solenoid.variant("nine_robust"), short(payload_kg=0.1))
        error_mm = 1e3 * (run.reference_m - run.truth[:, 0])
        self.assertAlmostEqual(float(np.sqrt(np.mean(error_mm**2))), run.metrics.rmse_mm, places=9)
        self.assertAlmostEqual(float(np.abs(error_mm).max()), run.metrics.mae_mm, places=9)
        self.assertEqual(int(run.solved.sum()), 300)
        self.assertTrue((run.nodes[run.solved] > 0).all())
        self.assertLess(abs(run.payload_kg[-1] - 0.1), 0.02)

    def test_coils_are_patterns_of_the_variants_valves(self):
        run = solenoid.simulate(solenoid.variant("thesis_pd"), short())
        self.assertEqual(run.coils.dtype.kind, "u")
        self.assertEqual(set(np.unique(run.coils)) - {0, 1, 2, 3}, set())


class Systems(unittest.TestCase):
    TASKS = {"flyer_single": {"system": "thrusters", "trajectory": {"x": {"kind": "step", "height_m": 0.1}}, "duration_s": 2.0},
             "inverter_n3": {"system": "inverter", "trajectory": {"kind": "rotating", "duration_s": 0.005}}}

    def test_any_system_runs_under_its_own_names(self):
        for name, keys in self.TASKS.items():
            variant, task = solenoid.variant(name), solenoid.scenario(**keys)
            self.assertEqual((variant.system, task.system), (keys["system"], keys["system"]))
            run = solenoid.simulate(variant, task)
            self.assertEqual(run.system, keys["system"])
            names = dir(run)
            first = next(n for n in names if n.startswith("reference_"))
            self.assertEqual(getattr(run, first).shape, run.time_s.shape)
            self.assertTrue(any(n.startswith("measured_") for n in names))
            with self.assertRaises(AttributeError):
                run.measured_position_m

    def test_a_variant_of_another_system_is_refused(self):
        for name, keys in self.TASKS.items():
            task = solenoid.scenario(**keys)
            for other in {"thesis_pd", *self.TASKS} - {name}:
                for refusing in (solenoid.simulate, solenoid.Controller, solenoid.Plant):
                    with self.assertRaisesRegex(solenoid.ConfigError, "allowed: scenarios and variants of one system"):
                        refusing(solenoid.variant(other), task)

    def test_the_loop_by_hand_is_the_loop_of_simulate(self):
        for name, keys in self.TASKS.items():
            variant, task = solenoid.variant(name), solenoid.scenario(**keys)
            run = solenoid.simulate(variant, task, seed=2)
            controller, plant = solenoid.Controller(variant, task), solenoid.Plant(variant, task, seed=2)
            for k in range(len(run)):
                sensors = plant.read(run.time_s[k])
                self.assertEqual(sensors.truth, list(run.truth[k]), k)
                decision = controller.step(sensors)
                self.assertEqual(decision.command.switches, run.switches[k], k)
                plant.write(decision.command)


class Stepping(unittest.TestCase):
    def test_the_loop_by_hand_is_the_loop_of_simulate(self):
        variant, task = solenoid.variant("thesis_pd_ekf"), short(payload_kg=0.1)
        run = solenoid.simulate(variant, task, seed=3)
        controller, plant = solenoid.Controller(variant, task), solenoid.Plant(variant, task, seed=3)
        for k in range(len(run)):
            sensors = plant.read(k * 1e-3)
            self.assertEqual(sensors.truth[0], run.truth[k, 0], k)
            decision = controller.step(sensors)
            self.assertEqual(decision.command.coils, run.coils[k], k)
            plant.write(decision.command)

    def test_a_controller_of_python(self):
        task = short()
        plant = solenoid.Plant(solenoid.variant("thesis_pd"), task)
        for k in range(300):
            sensors = plant.read(k * 1e-3)
            plant.write(solenoid.Command(0b01, 8.0))
        self.assertGreater(plant.read(0.3).truth[0], sensors.truth[0] - 1e-12)
        self.assertGreater(plant.air_used_kg, 0.0)


class Configuration(unittest.TestCase):
    def test_changes_are_merged_key_by_key(self):
        mine = solenoid.variant("mine", base="nine_robust", cost={"switching": 1e-6})
        self.assertEqual((mine.name, mine.valves), ("mine", "two_way"))
        few = solenoid.simulate(mine, short()).metrics.coil_switches
        many = solenoid.simulate(solenoid.variant("nine_robust"), short()).metrics.coil_switches
        self.assertLess(few, many)
        own = solenoid.variant("own", valves="two_way", solver="branch_and_bound", horizon={"steps": 40, "blocks": [2, 6]})
        self.assertEqual(own.solver, "branch_and_bound")

    def test_what_the_files_refuse_is_refused_here(self):
        for bad in (lambda: solenoid.variant("nobody"), lambda: solenoid.variant("thesis_pd", colour="red"),
                    lambda: solenoid.scenario(plant="hydraulic"), lambda: solenoid.scenario(trajectory="zigzag"),
                    lambda: solenoid.run_campaign("no_such_campaign"),
                    lambda: solenoid.variant("mine", base="thesis_pd", cost={"position": "dear"})):
            with self.assertRaisesRegex(solenoid.ConfigError, "allowed"):
                bad()

    def test_a_campaign_becomes_a_table(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "c.toml")
            path.write_text('variants = ["mine", "thesis_pd"]\nseeds = [1, 2]\n[variant.mine]\nvalves = "two_way"\n'
                            'solver = "exhaustive"\n[[scenario]]\nname = "short"\nnoise = true\n'
                            'trajectory = { kind = "sine" }\nduration_s = 0.5\n')
            rows = solenoid.table(solenoid.run_campaign(path, jobs=2))
            self.assertEqual(len(rows), 4)
            self.assertEqual(set(rows["variant"]), {"mine", "thesis_pd"})
            self.assertTrue((rows["rmse_mm"] > 0).all())
            task = solenoid.scenario("short", trajectory="sine", noise=True, duration_s=0.5)
            run = solenoid.simulate(solenoid.variant("mine", campaign=path), task, seed=2)
            self.assertIn(run.metrics.rmse_mm, rows["rmse_mm"])

    def test_the_version_is_the_program_s(self):
        said = subprocess.run([os.environ["SOLENOID_PROGRAM"], "--version"], check=True, capture_output=True, text=True).stdout
        self.assertEqual(said.split()[:2], ["solenoid", solenoid.__version__])

    def test_shipped_names_are_known(self):
        self.assertIn("nine_robust", solenoid.variants())
        self.assertIn("default", solenoid.campaigns())
        self.assertEqual(solenoid.scenario(trajectory="sine").reference(0.0)[1], 0.0)


class Example(unittest.TestCase):
    def test_runs_and_draws(self):
        script = pathlib.Path(os.environ["SOLENOID_SOURCE_DIR"], "experiments/python/example.py")
        with tempfile.TemporaryDirectory() as folder:
            figure = pathlib.Path(folder, "figure.png")
            out = subprocess.run([sys.executable, script, figure], check=True, capture_output=True, text=True,
                                 env={**os.environ, "MPLCONFIGDIR": folder}).stdout
            self.assertTrue(figure.read_bytes().startswith(b"\x89PNG"))
        lines = dict(line.split(":", 1) for line in out.splitlines() if ":" in line)
        self.assertEqual(lines["mine"].split()[1], lines["by hand"].split()[1])


if __name__ == "__main__":
    unittest.main()
