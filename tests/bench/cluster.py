"""What campaigns beyond one machine cost, measured on this one.

    many PROGRAM [--runs 50000] [--shards 8]   short runs through shards: files, bytes, time a run, merge
    nodes PROGRAM [--runs 240] [--nodes 1 2 4] the same campaign on simulated clusters of so many nodes of one core
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cluster"))
import slurm_cluster  # noqa: E402

CAMPAIGN = """\
name = "measured"
variants = ["{variant}"]
[[scenario]]
name = "plants"
trajectory = {{ kind = "{kind}" }}
plant = "{plant}"
noise = true
duration_s = {duration_s}
ensemble = {{ members = {members}, seed = 7, sampling = "sobol", friction = [0.7, 2.0], flow = [0.8, 1.15] }}
"""


def peak_mb(command, cwd, env=None):
    """Runs a command; its seconds, and the largest resident memory of the children so far."""
    begin = time.monotonic()
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return time.monotonic() - begin, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e3


def sizes(folder):
    files = [file for file in folder.rglob("*") if file.is_file()]
    return len(files), sum(file.stat().st_size for file in files)


def many(options):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "c.toml").write_text(
            CAMPAIGN.format(variant="thesis_pd", kind="step", plant="model", duration_s=0.1, members=options.runs))
        begin = time.monotonic()
        for shard in range(1, options.shards + 1):
            peak_mb([options.program, "compare", "c.toml", "--shard", f"{shard}/{options.shards}", "--traces", "none",
                     "--out", "out", "--scratch", "near"], folder)  # yapf: disable
        done_s = time.monotonic() - begin
        files, stored = sizes(folder / "out" / "shards")
        merge_s, _ = peak_mb([options.program, "merge", "out"], folder)
        merge_mb = merged_peak_mb(options.program, folder)
        page = (folder / "out" / "report.html").stat().st_size
        table = (folder / "out" / "runs.csv").stat().st_size
    per_million = 1e6 / options.runs
    print(f"runs of 0.1 s         {options.runs} in {options.shards} shards, {os.cpu_count()} cores")
    print(f"time                  {done_s:.1f} s, {options.runs / done_s:.0f} runs a second")
    print(f"files                 {files}, {stored / 1e6:.1f} MB, {stored / options.runs:.0f} bytes a run")
    print(f"merge with report     {merge_s:.2f} s, {merge_mb:.0f} MB at most")
    print(f"runs.csv, report      {table / 1e6:.1f} MB, {page / 1e6:.2f} MB")
    print(f"of a million that is  {stored * per_million / 1e6:.0f} MB in {files} files, merge {merge_s * per_million:.0f} s")


def merged_peak_mb(program, folder):
    """The largest resident memory of a merge, alone."""
    read, write = os.pipe()
    if os.fork() == 0:
        _, peak = peak_mb([program, "merge", "out"], folder)
        os.write(write, str(peak).encode())
        os._exit(0)
    os.close(write)
    os.wait()
    return float(os.read(read, 100))


def nodes(options):
    print("nodes  tasks  wall s  runs/s  of one node's  controller's processor time s  files  bytes a run")
    first = None
    for count in options.nodes:
        with slurm_cluster.SlurmCluster(nodes=count) as cluster:
            (cluster.folder / "c.toml").write_text(
                CAMPAIGN.format(variant="nine_robust", kind="cycloidal", plant="twin", duration_s=8.0, members=options.runs))
            begin = time.monotonic()
            peak_mb([options.program, "compare", "c.toml", "--slurm", "--nodes", "8", "--out", "out"],
                    cluster.folder, cluster.env())  # yapf: disable
            cluster.wait_idle()
            wall_s = time.monotonic() - begin
            status = json.loads(cluster.run(options.program, "status", "out", "--format", "json"))
            if status["done"] != options.runs:
                sys.exit(f"only {status['done']} of {options.runs} runs were done")
            controller_s = processor_s(cluster.keepers["slurmctld"].pid)
            files, stored = sizes(cluster.folder / "out" / "shards")
        rate = options.runs / wall_s
        first = first or rate
        print(f"{count:5}  {8:5}  {wall_s:6.1f}  {rate:6.2f}  {rate / first:13.2f}  {controller_s:30.2f}  {files:5}  "
              f"{stored / options.runs:11.0f}", flush=True)  # yapf: disable


def processor_s(process):
    """Of a process and what it started."""
    total = 0.0
    for one in [process, *slurm_cluster.keeper.descendants(process)]:
        fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    for name, does, runs in (("many", many, 50000), ("nodes", nodes, 240)):
        command = commands.add_parser(name)
        command.add_argument("program", type=os.path.abspath)
        command.add_argument("--runs", type=int, default=runs)
        command.set_defaults(does=does)
        if name == "many":
            command.add_argument("--shards", type=int, default=8)
        else:
            command.add_argument("--nodes", type=int, nargs="+", default=[1, 2, 4])
    options = parser.parse_args()
    options.does(options)


if __name__ == "__main__":
    main()
