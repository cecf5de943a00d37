"""Controllers and solvers in Python that fail, and the processes they run in."""

import ctypes
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import solenoid
from control_support import SHORT, Exhaustive, Lines, exactly, flight, lines, untimed


class Failures(unittest.TestCase):

    def failing(self, *laws, **keys):
        """What compare says of these laws beside a good one, whose run has to be as ever."""
        found = solenoid.compare([*laws, lines("good")], flight(duration_s=0.3), jobs=2, **keys)
        failed = {run["variant"]: run["message"] for run in found.failed}
        self.assertEqual(set(failed), {law.name for law in laws}, failed)
        alone = solenoid.compare(lines("good"), flight(duration_s=0.3))
        self.assertEqual(untimed(found.runs[-1]), untimed(alone.runs[0]))
        return failed

    def test_an_exception_fails_its_run_with_the_traceback(self):

        def late(m):
            if m.time_s > 0.1:
                deep({})
            return 0

        def deep(table):
            return table["nothing"]

        class Unmade(Lines):

            def __init__(self):
                raise OSError("no such device")

        class Planless:

            def solve(self, problem):
                raise RuntimeError("no idea")

        solver = solenoid.PythonSolver("planless", Planless, **SHORT)
        failed = self.failing(exactly("late", late), lines("unmade", Unmade), solver,
                              exactly("leaves", lambda m: sys.exit(3)),
                              exactly("interrupted", lambda m: deep(KeyboardInterrupt())))
        self.assertTrue(failed["late"].startswith("KeyError: 'nothing'\nTraceback (most recent call last):"),
                        failed["late"])
        for part in ("in late", "in deep", 'table["nothing"]', os.path.basename(__file__), "in step of 'late' at 0.1"):
            self.assertIn(part, failed["late"])
        self.assertTrue(failed["unmade"].startswith("OSError: no such device\n"), failed["unmade"])
        self.assertIn("construction of 'unmade'", failed["unmade"])
        self.assertTrue(failed["planless"].startswith("RuntimeError: no idea\n"), failed["planless"])
        self.assertTrue(failed["leaves"].startswith("SystemExit: 3\n"), failed["leaves"])
        self.assertIn("not subscriptable", failed["interrupted"])

    def test_in_this_process_the_exception_is_raised(self):
        with self.assertRaises(KeyError) as caught:
            solenoid.simulate(exactly("raiser", lambda m: {}["nothing"]), flight())
        self.assertIn("in step of 'raiser' at 0 s", caught.exception.__notes__)
        with self.assertRaises(KeyboardInterrupt):
            solenoid.simulate(exactly("raiser", lambda m: signal.raise_signal(signal.SIGINT)), flight())
        self.assertEqual(len(solenoid.simulate(lines(), flight(duration_s=0.1)).time_s), 10)

    def test_what_is_no_command_is_said(self):
        answers = {
            "nothing": (None, r"step returned None \(allowed: a Command"),
            "text": ("sideways", r"the mode 'sideways' \(allowed: 0 'coast'"),
            "no mode": (3, r"the pattern 3 \(allowed: 0 'coast'"),
            "float": (1.0, r"step returned 1.0 \(allowed"),
            "three": ((1, 2, 3), r"step returned \(1, 2, 3\)"),
            "negative": (-1, r"the pattern -1"),
            "huge": (2**70, r"the pattern 1180591620717411303424"),
            "inputs": ((0, [1.0]), r"1 continuous inputs \(allowed: 0\)"),
            "words": ((0, "much"), r"step returned \(0, 'much'\)"),
            "command": (solenoid.Command(77), r"the pattern 77"),
            "array": (np.array([0]), r"step returned array\(\[0\]\)")
        }
        laws = [
            exactly(name.replace(" ", "_"), lambda m, answer=answer: answer) for name, (answer, _) in answers.items()
        ]
        failed = self.failing(*laws)
        for name, (_, words) in answers.items():
            self.assertRegex(failed[name.replace(" ", "_")], words)
        with self.assertRaisesRegex(solenoid.ConfigError, "finite"):
            solenoid.simulate(
                solenoid.PythonController("nan",
                                          type("Law", (), {
                                              "step": lambda self, m: (0, math.nan)
                                          }),
                                          valves="two_way",
                                          motor="pd"), solenoid.scenario(trajectory="sine", duration_s=0.05))

    def test_what_is_no_plan_is_said(self):
        answers = {
            "few": ([0], r"modes \[0\] \(allowed: 2 modes"),
            "beyond": ([0, 9], r"the mode 9 \(allowed: 0 to 8\)"),
            "name": (["coast", "up"], r"the mode 'up' \(allowed: coast"),
            "half": ([0.5, 0.5], r"modes \[0.5"),
            "matrix": ([[0, 0], [0, 0]], r"modes \[\["),
            "inputs": (([0, 0], [[1.0], [1.0]]), r"of shape \(2, 0\)"),
            "number": (7, r"modes 7")
        }
        solvers = [
            solenoid.PythonSolver(name, type("Solver", (), {
                "solve": lambda self, problem, answer=answer: answer
            }), **SHORT) for name, (answer, _) in answers.items()
        ]
        failed = self.failing(*solvers)
        for name, (_, words) in answers.items():
            self.assertRegex(failed[name], words)
            self.assertIn(f"variant '{name}': solve returned", failed[name])

    def test_what_cannot_be_a_variant_is_refused(self):
        with self.assertRaisesRegex(solenoid.ConfigError, "makes nothing"):
            solenoid.PythonController("mine", 7)
        with self.assertRaisesRegex(solenoid.ConfigError, "colour"):
            lines("mine", colour="red")
        with self.assertRaisesRegex(solenoid.ConfigError, "no_such_system"):
            solenoid.PythonController("mine", Lines, system="no_such_system")
        self.assertIn("no method 'step'", self.failing(lines("stepless", dict))["stepless"])
        for wrong in (lambda: solenoid.compare([]), lambda: solenoid.compare([7], flight()),
                      lambda: solenoid.compare([lines(), lines()], flight()),
                      lambda: solenoid.compare(lines(), "no_such_scenario"),
                      lambda: solenoid.compare(lines(), flight(), seeds=0),
                      lambda: solenoid.compare(lines(), flight(), baseline="nobody"),
                      lambda: solenoid.compare(["thesis_pd", lines()], flight()),
                      lambda: solenoid.compare("nobody", flight())):
            with self.assertRaisesRegex(solenoid.ConfigError, "allowed"):
                wrong()

    def test_an_unknown_baseline_is_refused_before_anything_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "r")
            with self.assertRaisesRegex(solenoid.ConfigError, "baseline: 'nobody' is not compared .allowed: mine, good"):
                solenoid.compare([lines("mine"), lines("good")], flight(), baseline="nobody", out=out)
            self.assertFalse(os.path.exists(out))
        with self.assertRaisesRegex(solenoid.ConfigError, "baseline: one variant alone"):
            solenoid.compare(lines("mine"), flight(), baseline="mine")

    def test_a_process_that_ends_ends_its_run(self):
        failed = self.failing(exactly("quits", lambda m: os._exit(5)), exactly("quiet", lambda m: os._exit(0)),
                              exactly("crashes", lambda m: ctypes.string_at(0)),
                              exactly("killed", lambda m: os.kill(os.getpid(), signal.SIGKILL)))
        self.assertEqual(failed["quits"], "worker ended with exit code 5")
        self.assertEqual(failed["quiet"], "worker ended without a result")
        self.assertRegex(failed["crashes"], "signal 11|exit code 1$")  # the address sanitizer's
        self.assertIn("signal 9", failed["killed"])

    def test_a_law_that_hangs_is_stuck(self):
        began = time.monotonic()
        failed = self.failing(exactly("hangs", lambda m: time.sleep(60)), tick_limit_s=1.0)
        self.assertIn("stuck", failed["hangs"])
        self.assertLess(time.monotonic() - began, 30)


class Processes(unittest.TestCase):

    def test_the_numbers_are_the_same_whatever_the_jobs(self):
        variants = [lines("a"), lines("b"), solenoid.PythonSolver("c", Exhaustive, **SHORT)]
        results = [[
            untimed(run)
            for run in solenoid.compare(variants, [flight(), flight("other", 0.5)], seeds=[3, 5], jobs=jobs).runs
        ] for jobs in (1, 2, 8)]
        self.assertEqual(len(results[0]), 12)
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], results[2])

    def test_other_threads_run_meanwhile_and_break_nothing(self):
        stop, counted, lock = threading.Event(), [0, 0], threading.Lock()

        def work(index):
            while not stop.is_set():
                with lock:  # held at the moment of many a fork
                    counted[index] += sum(range(50))
                np.ones(100).sum()

        class Threaded(Lines):
            """With a thread of its own in the worker."""

            def __init__(self):
                self.beats = 0
                self.thread = threading.Thread(target=self.beat, daemon=True)
                self.thread.start()

            def beat(self):
                while True:
                    self.beats += 1
                    time.sleep(1e-4)

            def step(self, measurement):
                if measurement.tick == 20:
                    deadline = time.monotonic() + 20
                    before = self.beats
                    while self.beats == before:
                        assert time.monotonic() < deadline, "the thread stands still"
                        time.sleep(1e-3)
                return super().step(measurement)

        threads = [threading.Thread(target=work, args=(index, )) for index in range(2)]
        for thread in threads:
            thread.start()
        try:
            before = list(counted)
            found = solenoid.compare([lines(), lines("threaded", Threaded)], flight(duration_s=0.3), seeds=20, jobs=4)
            during = [after - b for after, b in zip(counted, before)]
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        self.assertEqual(found.failed, [])
        self.assertTrue(all(work > 1e5 for work in during), during)
        quiet = solenoid.compare([lines()], flight(duration_s=0.3), seeds=20)
        self.assertEqual([untimed(run) for run in found.runs if run["variant"] == "lines"],
                         [untimed(run) for run in quiet.runs])

    def test_a_comparison_from_another_thread(self):
        found = []
        thread = threading.Thread(
            target=lambda: found.append(solenoid.compare([lines()], flight(duration_s=0.2), seeds=2)))
        thread.start()
        thread.join()
        self.assertEqual([run["status"] for run in found[0].runs], ["ok", "ok"])

    def test_what_a_law_prints_is_printed_once(self):
        script = ("import solenoid, sys\n"
                  "class Law:\n"
                  "    def step(self, m):\n"
                  "        if m.tick == 1: sys.stdout.write('tick one\\n')\n"
                  "        return 0\n"
                  "print('before')\n"
                  "solenoid.compare(solenoid.PythonController('law', Law, system='thrusters'),\n"
                  "                 solenoid.scenario(system='thrusters', trajectory={}, duration_s=0.1), seeds=2)\n"
                  "print('after')\n")
        said = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout
        self.assertEqual(said.split("\n"), ["before", "tick one", "tick one", "after", ""])

    def test_an_interrupt_ends_all(self):

        class Slow:

            def step(self, measurement):
                time.sleep(0.05)
                return 0

        timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
        began = time.monotonic()
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            solenoid.compare(lines("slow", Slow), flight(duration_s=20.0), seeds=4, jobs=2)
        self.assertLess(time.monotonic() - began, 20)
        timer.join()
        self.assertEqual(solenoid.compare(lines(), flight(duration_s=0.1)).failed, [])


if __name__ == "__main__":
    unittest.main()
