"""A Slurm cluster on one machine, for tests: munged, slurmctld and any number of slurmd, each a simulated node.

It needs no systemd, no configured host and no network but loopback, listens on free ports, and keeps all its files
(key, sockets, states, logs) in one temporary folder. Nothing of the machine's own Slurm or MUNGE is read or changed.
Any user may run it. Each daemon is run by `keeper.py`, so that nothing outlives the cluster, nor the process that made
it.

    with SlurmCluster(nodes=2) as cluster:
        job = cluster.submit("#!/bin/sh\\nhostname\\n", "--array=0-9")
        cluster.wait_finished(job)
"""
import atexit
import dataclasses
import os
import pwd
import random
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import keeper

# What has to be there: the program, and the Debian package that brings it.
PACKAGES = {
    "munged": "munge",
    "slurmctld": "slurmctld",
    "slurmd": "slurmd",
    "sbatch": "slurm-client",
    "squeue": "slurm-client",
    "scontrol": "slurm-client",
}
MUNGE_FILES = {
    "key-file": "munge.key",
    "socket": "munge.socket",
    "pid-file": "munged.pid",
    "seed-file": "munged.seed",
    "log-file": "munged.log",
}
PATH = os.pathsep.join([os.environ.get("PATH", os.defpath), "/usr/local/sbin", "/usr/sbin", "/sbin"])
# Prefixes of variables by which client commands take options.
OPTIONS = ("SLURM", "SBATCH", "SCANCEL", "SCONTROL", "SINFO", "SQUEUE", "SRUN")
# A state that has not come by then never will. Nothing else depends on time.
LIMIT_S = 240
PAUSE_S = 0.1

FINISHED = ("BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED",
            "TIMEOUT")

CONFIGURATION = """\
ClusterName=simulated
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
CredType=cred/munge
# A job that is requeued waits for the end of its old credential, which is of two minutes unless it is said here.
AuthInfo=socket={folder}/munge.socket,cred_expire={requeue_delay_s}

StateSaveLocation={folder}/controller
SlurmctldPidFile={folder}/slurmctld.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdSpoolDir={folder}/%n
SlurmdPidFile={folder}/%n.pid
SlurmdLogFile={folder}/%n.log
TmpFS={folder}
SlurmctldDebug=verbose
SlurmdDebug=verbose

MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc={folder}/completed.txt

# Nodes claim the processors below, whether the machine has them or not.
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
MaxArraySize={max_array_size}
MaxJobCount={max_jobs}

# How soon a node that dies is down: each attempt to reach it lasts MessageTimeout, and it may be silent for
# SlurmdTimeout. A node that comes back is used again as soon as it registers.
MessageTimeout={message_timeout_s}
SlurmdTimeout={node_timeout_s}
ReturnToService=2
JobRequeue=1
KillWait={kill_wait_s}
MinJobAge={remembered_s}

{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """Debian packages that a cluster needs and that are not installed."""
    return sorted({package for program, package in PACKAGES.items() if not shutil.which(program, path=PATH)})


@dataclasses.dataclass(frozen=True)
class Job:
    """A job, or one task of an array, as squeue tells it."""
    id: str  # 7, or 7_3 for a task of an array
    state: str  # PENDING, RUNNING, COMPLETED, FAILED, CANCELLED, NODE_FAIL, ...
    nodes: str
    exit_code: int
    signal: int  # that ended it, or 0
    restarts: int
    reason: str

    @property
    def finished(self):
        return self.state in FINISHED


class SlurmCluster:
    """Nodes node0, node1, ... of `cpus` claimed processors each, in one partition. A node that dies is down after about
    three times `message_timeout_s`; its jobs start elsewhere `requeue_delay_s` later. Finished jobs are listed for
    `remembered_s`."""

    def __init__(self,
                 nodes=2,
                 cpus=1,
                 max_array_size=1001,
                 *,
                 node_timeout_s=6,
                 message_timeout_s=5,
                 requeue_delay_s=5,
                 kill_wait_s=2,
                 remembered_s=3600):
        self.names = [f"node{number}" for number in range(nodes)]
        self.settings = {
            "cpus": cpus,
            "max_array_size": max_array_size,
            "max_jobs": max(10000, 2 * max_array_size),
            "node_timeout_s": node_timeout_s,
            "message_timeout_s": message_timeout_s,
            "requeue_delay_s": requeue_delay_s,
            "kill_wait_s": kill_wait_s,
            "remembered_s": remembered_s,
        }
        self.folder = None
        self.keepers = {}

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, kind, *_):
        if kind:
            self.print_logs()
        self.stop()

    def start(self):
        """Returns when every node is idle."""
        # Not in $TMPDIR: the paths of sockets have to be short.
        self.folder = Path(tempfile.mkdtemp(prefix="slurm-", dir="/tmp"))
        atexit.register(self.stop)
        # munged wants a folder that its clients may enter.
        self.folder.chmod(0o755)
        try:
            self._configure()
            self._start_daemons()
        except BaseException:
            self.print_logs()
            self.stop()
            raise

    def stop(self):
        """Ends every process that came of this cluster, then removes its files."""
        atexit.unregister(self.stop)
        self._end(*self.keepers)
        if self.folder:
            shutil.rmtree(self.folder)
            self.folder = None

    def env(self):
        """The environment in which Slurm's client commands speak to this cluster, and to no other."""
        own = {name: value for name, value in os.environ.items() if not name.startswith(OPTIONS)}
        return {**own, "PATH": PATH, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def run(self, *command, text=None):
        """What a command prints that is run in the cluster's folder; an error where it fails."""
        done = subprocess.run(command, input=text, capture_output=True, text=True, env=self.env(), cwd=self.folder)
        if done.returncode != 0:
            said = done.stdout + done.stderr
            raise RuntimeError(f"{' '.join(map(str, command))}: exit code {done.returncode}: {said}")
        return done.stdout

    def submit(self, script, *options):
        """The id of a job whose script is given as text."""
        return self.run("sbatch", "--parsable", *options, text=script).strip()

    def jobs(self, job=None):
        """{id: Job} of all that is pending, running or finished; of one job or array, where one is named."""
        fields = ("JobArrayID", "State", "NodeList", "exit_code", "RestartCnt", "Reason")
        form = ",".join(f"{field}:|" for field in fields)
        chosen = ("--jobs", job) if job else ()
        listed = self.run("squeue", "--noheader", "--array", "--states=all", *chosen, "--Format", form)
        found = {}
        for line in listed.splitlines():
            name, state, nodes, status, restarts, reason = line.split("|")[:len(fields)]
            # The status is that of wait(2).
            found[name] = Job(name, state, nodes, int(status) >> 8, int(status) & 0x7f, int(restarts), reason)
        return found

    def node_states(self):
        """{name: state} in sinfo's words: idle, allocated, mixed, down, ...; * behind one that does not answer."""
        return dict(line.split() for line in self.run("sinfo", "--noheader", "--Node", "--format=%N %T").splitlines())

    def processes(self, *names):
        """Ids of the processes of all that runs, or of the nodes named: slurmd, steps, jobs and what these started."""
        return {process for name in names or self.keepers for process in keeper.descendants(self.keepers[name].pid)}

    def kill_node(self, name):
        """Ends a node as a loss of power would: slurmd, steps and jobs at once, with no word to the controller."""
        self._end(name)

    def start_node(self, name):
        """Starts a node that is not running; `wait_node(name, "idle")` returns when it is of use."""
        self._start(name, "slurmd", "-D", "-N", name, "-f", self.folder / "slurm.conf")

    def wait_node(self, name, *states):
        """Waits until a node is in one of some states, whether it answers or not."""
        self.wait(lambda: self.node_states()[name].rstrip("*") in states, f"{name} to be {' or '.join(states)}")

    def wait_idle(self):
        """Waits until no job is pending, running or ending."""
        self.wait(lambda: all(job.finished for job in self.jobs().values()), "every job to finish")

    def wait_finished(self, job):
        """Waits for one job, or every task of an array; returns {id: Job}."""
        self.wait(lambda: all(task.finished for task in self.jobs(job).values()), f"job {job} to finish")
        return self.jobs(job)

    def wait(self, condition, what):
        """Polls until a condition holds; an error where it does not in a time that even a busy machine keeps to."""
        end = time.monotonic() + LIMIT_S
        while not condition():
            for name, kept in self.keepers.items():
                if kept.poll() is not None:
                    raise RuntimeError(f"{name} ended with exit code {kept.returncode}")
            if time.monotonic() > end:
                raise TimeoutError(f"waited {LIMIT_S} s for {what}")
            time.sleep(PAUSE_S)

    def print_logs(self, file=None):
        """Prints jobs and what the daemons wrote, for whoever has to find out why a test failed."""
        file = file or sys.stderr
        if "slurmctld" in self.keepers:
            subprocess.run(["squeue", "--array", "--states=all"], stdout=file, stderr=file, env=self.env())
        for printed in sorted(self.folder.glob("*.printed")) if self.folder else ():
            # The same stands in the daemon's own log, where it came to open one.
            own = printed.with_suffix(".log")
            log = own if own.exists() else printed
            print(f"==== {log.name}", log.read_text(errors="replace"), sep="\n", file=file, flush=True)

    def _configure(self):
        ports = _free_ports(1 + len(self.names))
        cpus = self.settings["cpus"]
        nodes = [f"NodeName={name} NodeHostname=localhost NodeAddr=127.0.0.1 Port={port} CPUs={cpus}"
                 for name, port in zip(self.names, ports[1:])]  # yapf: disable
        (self.folder / "slurm.conf").write_text(
            CONFIGURATION.format(host=socket.gethostname().partition(".")[0],
                                 controller_port=ports[0],
                                 user=pwd.getpwuid(os.geteuid()).pw_name,
                                 folder=self.folder,
                                 nodes="\n".join(nodes),
                                 **self.settings))
        key = self.folder / "munge.key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(128))

    def _start_daemons(self):
        munge_files = [f"--{option}={self.folder}/{file}" for option, file in MUNGE_FILES.items()]
        self._start("munged", "munged", "--foreground", *munge_files)
        self.wait((self.folder / MUNGE_FILES["socket"]).exists, "munged's socket")
        self._start("slurmctld", "slurmctld", "-D", "-f", self.folder / "slurm.conf")
        for name in self.names:
            self.start_node(name)
        self.wait(self._answers, "slurmctld to answer")
        for name in self.names:
            self.wait_node(name, "idle")

    def _answers(self):
        return subprocess.run(["scontrol", "ping"], capture_output=True, env=self.env()).returncode == 0

    def _start(self, name, *command):
        with open(self.folder / f"{name}.printed", "ab") as printed:
            # A session of its own: Control-C in a terminal is for the test alone, which then stops the cluster.
            self.keepers[name] = subprocess.Popen([sys.executable, "-I", "-S", keeper.__file__, *command],
                                                  stdin=subprocess.PIPE,
                                                  stdout=printed,
                                                  stderr=printed,
                                                  env=self.env(),
                                                  cwd=self.folder,
                                                  start_new_session=True)

    def _end(self, *names):
        ending = [self.keepers.pop(name) for name in names]
        for kept in ending:
            kept.terminate()
        for kept in ending:
            kept.wait(LIMIT_S)
            kept.stdin.close()


def _free_ports(count):
    """Ports that nobody listens on. They are below those that the kernel gives to outgoing connections, one of which
    could take the port of a node that is down."""
    try:
        end = int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    except OSError:
        end = 32768
    candidates = list(range(10000, end) if end > 11000 else range(10000, 65536))
    random.shuffle(candidates)
    ports = []
    while len(ports) < count:
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", candidates[-1]))
                ports.append(candidates[-1])
            except OSError:
                pass
            candidates.pop()
    return ports
