"""Runs a daemon such that it and everything that came of it can be ended at once.

usage: keeper.py COMMAND ...

Daemons of a cluster put their children beyond the reach of whoever started them: `slurmd` forks twice, its
`slurmstepd` starts sessions of its own. The keeper makes the kernel hand such orphans to it, so that all of them stay
its descendants. On SIGTERM it kills them all with SIGKILL, as a loss of power would. It does the same when its standard
input ends, as it does when the process that started it dies in any way, and when the command ends by itself, whose exit
code it returns.
"""
import ctypes
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

PR_SET_CHILD_SUBREAPER = 36  # <linux/prctl.h>
PAUSE_S = 0.01


def descendants(ancestor):
    """Process ids of everything alive below a process."""
    children = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            # The name in the second field may hold spaces and brackets, but nothing behind its last bracket does.
            state, parent = stat.read_text(errors="replace").rpartition(")")[2].split()[:2]
        except OSError:  # it ended meanwhile
            continue
        children.setdefault(int(parent), []).append((int(stat.parent.name), state))
    found, unvisited = [], [ancestor]
    while unvisited:
        for process, state in children.get(unvisited.pop(), []):
            unvisited.append(process)
            if state not in "ZX":
                found.append(process)
    return found


def reap():
    """Takes note of children that ended, {process id: exit code}."""
    ended = {}
    try:
        while (waited := os.waitpid(-1, os.WNOHANG))[0]:
            ended[waited[0]] = os.waitstatus_to_exitcode(waited[1])
    except ChildProcessError:
        pass
    return ended


def kill_all():
    """Kills until nothing is left: a process may fork while others are being killed."""
    while alive := descendants(os.getpid()):
        for process in alive:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass
        time.sleep(PAUSE_S)
        reap()


def main():
    if ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        sys.exit(f"prctl: {os.strerror(ctypes.get_errno())}")
    woken, waker = os.pipe()
    os.set_blocking(waker, False)
    signal.set_wakeup_fd(waker)
    for woken_by in (signal.SIGCHLD, signal.SIGTERM):
        signal.signal(woken_by, lambda *_: None)
    command = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
    code = None
    while code is None:
        readable, _, _ = select.select([sys.stdin, woken], [], [])
        # Each byte is the number of a signal.
        told = sys.stdin in readable or signal.SIGTERM in os.read(woken, 4096)
        code = 0 if told else reap().get(command.pid)
    kill_all()
    # A command that a signal ended has a negative code.
    sys.exit(code if code >= 0 else 128 - code)


if __name__ == "__main__":
    main()
