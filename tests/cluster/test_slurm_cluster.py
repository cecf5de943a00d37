"""The simulated cluster does what campaigns are tested on: arrays, tasks that fail, dependent jobs, nodes that die and
come back. Skipped where Slurm is missing, but not under CI."""

import os
import signal
import subprocess
import sys
import textwrap
import time
import unittest
from pathlib import Path

import slurm_cluster
from slurm_cluster import SlurmCluster

NODES = ["node0", "node1"]


def alive(processes):
    return {process for process in processes if Path(f"/proc/{process}").exists()}


def script(body):
    return "#!/bin/bash\n" + textwrap.dedent(body)


class OneCluster(unittest.TestCase):
    """Tests that share a cluster, whose nodes are all up and without jobs before each."""

    @classmethod
    def setUpClass(cls):
        cls.cluster = SlurmCluster(nodes=len(NODES), max_array_size=11)
        cls.cluster.start()
        cls.addClassCleanup(cls.cluster.stop)

    def run(self, result=None):
        """Prints the daemons' logs behind a failure."""
        result = result or self.defaultTestResult()
        wrong_before = len(result.failures + result.errors)
        super().run(result)
        if len(result.failures + result.errors) > wrong_before:
            self.cluster.print_logs()
        return result

    def wait_running(self, job, count):
        """Waits until so many tasks run and each has written its line of `lines`; returns the tasks' {node: Job}."""
        def running():
            return [task for task in self.cluster.jobs(job).values() if task.state == "RUNNING"]
        self.cluster.wait(lambda: len(running()) == count and len(self.lines(job)) == count, f"{count} tasks to run")
        return {task.nodes: task for task in running()}

    def lines(self, job):
        file = self.cluster.folder / f"lines.{job}"
        return file.read_text().splitlines() if file.exists() else []

    def test_each_task_of_an_array_runs_once_and_every_node_takes_some(self):
        job = self.cluster.submit(script("""
            echo $SLURM_ARRAY_TASK_ID of $SLURM_ARRAY_TASK_COUNT >> lines.$SLURM_ARRAY_JOB_ID
            sleep 0.2
        """), "--array=1-5")
        tasks = self.cluster.wait_finished(job)
        self.assertEqual({f"{job}_{task}" for task in range(1, 6)}, set(tasks))
        self.assertEqual({("COMPLETED", 0, 0, 0)},
                         {(task.state, task.exit_code, task.signal, task.restarts) for task in tasks.values()})
        self.assertEqual([f"{task} of 5" for task in range(1, 6)], sorted(self.lines(job)))
        self.assertEqual(NODES, sorted({task.nodes for task in tasks.values()}))

    def test_an_array_is_as_long_as_it_was_told(self):
        self.assertIn("MaxArraySize = 11",
                      [" ".join(line.split()) for line in self.cluster.run("scontrol", "show", "config").splitlines()])
        with self.assertRaisesRegex(RuntimeError, "Invalid job array specification"):
            self.cluster.submit(script("true"), "--array=0-11")
        tasks = self.cluster.wait_finished(self.cluster.submit(script("true"), "--array=10"))
        self.assertEqual(["COMPLETED"], [task.state for task in tasks.values()])

    def test_failed_and_cancelled_tasks_are_told_apart_and_a_dependent_job_runs_after_them(self):
        job = self.cluster.submit(script("""
            [ $SLURM_ARRAY_TASK_ID = 0 ] && exit 3
            [ $SLURM_ARRAY_TASK_ID = 1 ] && kill -KILL $$
            [ $SLURM_ARRAY_TASK_ID = 2 ] || exit 0
            echo 2 >> lines.$SLURM_ARRAY_JOB_ID
            sleep 1000
        """), "--array=0-3")
        after = self.cluster.submit(script("squeue -h -r -j $JOB -t PD,CF,R | wc -l > unfinished"),
                                    f"--dependency=afterany:{job}", f"--export=ALL,JOB={job}")
        never = self.cluster.submit(script("true"), f"--dependency=afterok:{job}", "--kill-on-invalid-dep=yes")
        self.wait_running(job, 1)
        waiting = self.cluster.jobs(after)[after]
        self.assertEqual(("PENDING", "Dependency"), (waiting.state, waiting.reason))
        self.cluster.run("scancel", f"{job}_2")
        self.cluster.wait_idle()
        ended = [self.cluster.jobs(job)[f"{job}_{task}"] for task in range(4)]
        self.assertEqual(["FAILED", "FAILED", "CANCELLED", "COMPLETED"], [task.state for task in ended])
        self.assertEqual([3, 0, 0, 0], [task.exit_code for task in ended])
        self.assertEqual([0, signal.SIGKILL, signal.SIGTERM, 0], [task.signal for task in ended])
        self.assertEqual("COMPLETED", self.cluster.jobs(after)[after].state)
        self.assertEqual("0", (self.cluster.folder / "unfinished").read_text().strip())
        self.assertEqual("CANCELLED", self.cluster.jobs(never)[never].state)

    def test_a_task_of_a_node_that_dies_is_run_again_by_another(self):
        job = self.cluster.submit(script("""
            echo $SLURM_ARRAY_TASK_ID ${SLURM_RESTART_COUNT:-0} $SLURMD_NODENAME >> lines.$SLURM_ARRAY_JOB_ID
            [ -z "$SLURM_RESTART_COUNT" ] || exit 0
            setsid sleep 1000 &
            until [ -e go ]; do sleep 0.1; done
        """), "--array=0-1")
        after = self.cluster.submit(script("cp lines.$JOB seen"), f"--dependency=afterany:{job}",
                                    f"--export=ALL,JOB={job}")
        lost = self.wait_running(job, 2)["node1"]
        killed = self.cluster.processes("node1")
        self.assertTrue({"slurmd", "slurmstepd", "sleep"} <= {command_name(process) for process in killed})
        self.cluster.kill_node("node1")
        self.assertEqual(set(), alive(killed))
        (self.cluster.folder / "go").touch()
        self.cluster.wait_node("node1", "down")
        tasks = self.cluster.wait_finished(job)
        self.assertEqual(["COMPLETED"] * 2, [task.state for task in tasks.values()])
        self.assertEqual("node0", tasks[lost.id].nodes)
        self.assertEqual(1, tasks[lost.id].restarts)
        self.assertIn(f"{lost.id.partition('_')[2]} 1 node0", self.lines(job))
        self.cluster.wait_finished(after)
        self.assertEqual(self.lines(job), (self.cluster.folder / "seen").read_text().splitlines())

        self.cluster.start_node("node1")
        self.cluster.wait_node("node1", "idle")
        again = self.cluster.submit(script("true"), "--nodelist=node1")
        self.assertEqual("COMPLETED", self.cluster.wait_finished(again)[again].state)


class NothingIsLeft(unittest.TestCase):
    SLEEPS = script("""
        setsid sleep 1000 &
        sleep 1000
    """)

    def test_after_stop(self):
        with SlurmCluster(nodes=1) as cluster:
            folder = cluster.folder
            cluster.submit(self.SLEEPS)
            cluster.wait(lambda: "sleep" in map(command_name, cluster.processes("node0")), "the job to sleep")
            keepers = {keeper.pid for keeper in cluster.keepers.values()}
            processes = cluster.processes() | keepers
            self.assertEqual(processes, alive(processes))
        self.assertEqual(set(), alive(processes))
        self.assertFalse(folder.exists())

    def test_after_the_death_of_the_process_that_started_it(self):
        starts = """if True:
            import os, signal, slurm_cluster
            cluster = slurm_cluster.SlurmCluster(nodes=1)
            cluster.start()
            keepers = [keeper.pid for keeper in cluster.keepers.values()]
            print(cluster.folder, *cluster.processes(), *keepers, flush=True)
            os.kill(os.getpid(), signal.SIGKILL)
        """
        died = subprocess.run([sys.executable, "-c", starts], capture_output=True, text=True, cwd=Path(__file__).parent)
        self.assertEqual(-signal.SIGKILL, died.returncode, died.stderr)
        folder, *processes = died.stdout.split()
        self.addCleanup(slurm_cluster.shutil.rmtree, folder)
        self.assertGreaterEqual(len(processes), 6)  # three daemons and their keepers
        end = time.monotonic() + slurm_cluster.LIMIT_S
        while alive(processes) and time.monotonic() < end:
            time.sleep(slurm_cluster.PAUSE_S)
        self.assertEqual(set(), alive(processes))


def command_name(process):
    try:
        return Path(f"/proc/{process}/comm").read_text().strip()
    except OSError:  # it ended meanwhile
        return ""


if __name__ == "__main__":
    if packages := slurm_cluster.missing():
        print(f"Slurm is not installed: apt-get install {' '.join(packages)}", file=sys.stderr)
        sys.exit(1 if os.environ.get("CI") else 77)
    unittest.main(verbosity=2)
