"""What docs_commands.py does in place of a command that it does not run as it is, and why."""
import re
from dataclasses import dataclass
from typing import Callable, Optional, Union

RECORDED = "experiments/systems/actuator/data/instances/closed_loops.instances"

# Commands of the script, which the program does not know.
SCRIPT = ("test", "coverage", "fuzz", "docs", "package")

# What the reader is taken to have: a campaign, and a small one to tune on.
FILES = {
    "campaign.toml": """
variants = ["thesis_pd", "nine_state"]
[[scenario]]
name       = "cycloidal_fast"
trajectory = { kind = "cycloidal", move_s = 0.5, dwell_s = 0.25 }
""",
    "plants.toml": """
variants = ["thesis_pd", "nine_pd"]
[[scenario]]
name       = "plants"
trajectory = { kind = "step" }
plant      = "twin"
noise      = true
duration_s = 0.3
ensemble   = { members = 20, sampling = "sobol", friction = [0.7, 2.0] }
""",
    "mine.toml": """
[motor]
price = 200.0
""",
    "task.toml": """
name = "crane"
[arm]
payload_kg = 1.5
[motion]
kind   = "quintic"
move_s = 1.0
""",
    "small_tuning.toml": """
variants = ["thesis_pd"]
[[scenario]]
name       = "training"
trajectory = { kind = "cycloidal", move_s = 0.5, dwell_s = 0.25 }
[[scenario]]
name       = "held_out"
trajectory = { kind = "cycloidal", move_s = 0.6, dwell_s = 0.25 }
""",
    "small_study.toml": """
variants = ["thesis_pd"]
[[scenario]]
name       = "rest"
trajectory = { kind = "cycloidal", move_s = 0.5, dwell_s = 0.25 }
[study]
sweep = { key = "integral.gain", values = [0.001, 0.005] }
[[study.table]]
name      = "rest"
scenarios = ["rest"]
figures   = ["ssa_mm"]
[[study.panel]]
table = "rest"
y     = "ssa_mm"
""",
}


@dataclass
class Rule:
    command: str  # a regular expression that the whole command matches, without ./solenoid
    reason: str
    instead: Union[str, Callable, None] = None  # a command, a function of (match, subcommands) to commands, None: not run
    codes: tuple = (0,)
    attempts: int = 1
    until: Optional[str] = None  # interrupted once this is on standard error
    board: bool = False  # only where there is a substitute for a board

    def commands(self, command, subcommands):
        if self.instead is None:
            return []
        made = self.instead
        if callable(made):
            made = made(re.fullmatch(self.command, command), subcommands)
        else:
            made = re.fullmatch(self.command, command).expand(made)
        return [made] if isinstance(made, str) else made


# A machine that stands still for 20 ms ends a real-time run in SAFE, with exit code 1: tried again.
BUSY = 4

RULES = [
    # compare
    Rule(r"compare \| python3 docs/images/ranked_table\.py .*", "a pipe; README.md's picture is compared with what compare prints"),
    Rule(r"compare robustness(?: --live)", "the page is served until Ctrl-C", r"compare rig --scenario cycloidal --variant thesis_pd --live",
         codes=(0, 130), until=r"page stays"),
    Rule(r"compare robustness(?: \[.*)?", "200 plants, minutes", r"compare rig --scenario cycloidal --variant thesis_pd,nine_robust"),
    Rule(r"compare robustness (--against \S+)", "200 plants, minutes",
         r"compare rig --scenario cycloidal --variant thesis_pd,nine_robust \1"),
    Rule(r"compare robustness (--variant \S+)", "200 plants, minutes", r"compare rig --scenario cycloidal \1"),
    Rule(r"compare (thrusters_plants|inverter_plants)(?: --against \S+)?", "27 scenarios of nine variants", r"check \1"),
    Rule(r"compare learning .*", "48 plants", r"compare learning --scenario held_out_kicked-m001 --variant nine_policy,nine_learned_tail"),
    Rule(r"compare hard\.toml.*", "100 plants and more", r"compare hard.toml --scenario training_sine"),
    Rule(r"compare (--variant \S*cia\S*)", "eight scenario seconds of slow solvers", r"compare campaign.toml \1"),
    Rule(r"compare --out (\S+)", "README.md runs all variants", r"compare --variant thesis_pd,nine_state --scenario sine_0 --out \1"),
    Rule(r"compare experiments/systems/actuator/data/tried/(\S+).*", "minutes; the file is read", r"check experiments/systems/actuator/data/tried/\1"),
    Rule(r"compare rig", "all shipped variants on the twin", r"compare rig --variant thesis_pd"),
    Rule(r"compare --variant a,b", "placeholders", "compare campaign.toml --variant thesis_pd,nine_state"),
    Rule(r"compare NAME", "a placeholder", "compare profile --variant thesis_pd"),
    Rule(r"compare DIR/resolved\.toml", "a placeholder",
         lambda *_: ["compare campaign.toml --out first", "compare first/resolved.toml"]),
    Rule(r"compare baselines_training", "16 scenarios of every baseline", r"compare baselines_training --variant thesis_pd"),
    Rule(r"compare --model (?:FILE_OR_SET|results/found/parameters\.toml)", "all variants; the file is an earlier command's",
         "compare campaign.toml --model inferred"),
    Rule(r"compare experiments/systems/actuator/data/tried/identified\.toml --out (\S+)(?: --model \S+)?", "12 runs on the twin",
         r"compare experiments/systems/actuator/data/tried/identified.toml --scenario cycloidal --variant thesis_pd --model inferred --out \1"),
    # cluster
    Rule(r"compare plants\.toml --slurm --dry-run", "the scripts", r"compare plants.toml --slurm --dry-run --nodes 2"),
    Rule(r"compare plants\.toml --slurm ((?!--dry-run).*)", "no cluster: cluster.campaigns has one", r"compare plants.toml --slurm --dry-run \1"),
    Rule(r"merge results/plants", "one shard of forty is done", r"merge results/plants", codes=(1,)),
    # identify
    Rule(r"identify", "350 s of experiments", "identify --only charge"),
    Rule(r"identify --mismatch (\S+) --out (\S+)", "350 s of experiments", r"identify --only charge --mismatch \1 --out \2"),
    Rule(r"identify --log run\.mcap", "its log is a second of a slide that hardly moves: nothing found is 1", r"identify --log run.mcap",
         codes=(0, 1)),
    Rule(r"identify --plant emulator.*", "minutes in real time, and an emulator to run on", "identify --help"),
    # commission
    Rule(r"commission", "a folder by a name, again and again", "commission --from link --out commissioned"),
    Rule(r"commission (--fault \S+)", "what it finds is 1", r"commission \1 --from link --out wrong", codes=(1,)),
    Rule(r"commission --plant emulator.*", "half a minute, and an emulator to run on",
         "emulator --campaign identify --port FREE_PORT & commission --plant emulator --node 127.0.0.1:FREE_PORT --yes --step link",
         attempts=BUSY),
    Rule(r"emulator --campaign identify", "waits for a controller until Ctrl-C", "emulator --campaign identify --port FREE_PORT",
         until=r"127\.0\.0\.1"),
    Rule(r"emulator (--campaign \S+ --scenario \S+)", "waits for a controller until Ctrl-C", r"emulator \1 --port FREE_PORT",
         until=r"127\.0\.0\.1"),
    Rule(r"identify --log bench\.(?:csv|mcap) .*", "a log of the reader's", "identify --help"),
    Rule(r"identify residual learned/.*", "the logs are of runs that are cut short here", "identify residual --help"),
    Rule(r"study residual", "24 plants", "study residual --plants 1"),
    Rule(r"study identification.*", "minutes: test_experiments has six seeds", "study identification --help"),
    Rule(r"study valve-health.*", "thousands of runs",
         "study valve-health --plants 1 --healthy-hours 0.001 --valves health_two_way"),
    Rule(r"report DIR", "a placeholder", lambda *_: ["compare campaign.toml --out shown", "report shown"]),
    # list, check, COMMAND
    Rule(r"COMMAND --help", "each command", lambda match, subcommands: [f"{name} --help" for name in subcommands]),
    Rule(r"check (?:\[campaign\.toml\]|FILE\.\.\.)", "a placeholder", "check campaign.toml"),
    Rule(r"test\b.*", "this is one of its tests"),
    Rule(r"(?:coverage|fuzz|docs|package)\b.*", "the script's: minutes of building"),
    # the thesis, studies
    Rule(r"reproduce.*", "620 runs", "reproduce table-6-1 --format csv"),
    Rule(r"plot \[.*", "a synopsis", "plot campaign.toml --variant thesis_pd --scenario cycloidal_fast --svg plot.svg --seed 2"),
    Rule(r"study sweep FILE.*", "placeholders", "study sweep small_study.toml --svg study.svg"),
    Rule(r"study (?:horizon|valves|forgetting|inverter_horizon)(.*)", "hundreds of runs", r"study sweep small_study.toml\1"),
    Rule(r"study fishing(.*)", "grids of up to 1536 intervals", r"study fishing\1 --intervals 12,24"),
    Rule(r"study force-ratio((?: --(?:assumptions|out|svg) \S+)*)", "1000 runs",
         r"study force-ratio\1 --quick --shares 0,1 --evaluations 1 --plants 1 --judged 1"),
    Rule(r"study force-ratio --quick (.*)", "eight ratios", r"study force-ratio --quick --shares 0.104 \1"),
    Rule(r"ledger", "200 states with Bonmin", "ledger --states 2 --bonmin 0"),
    Rule(r"ledger --variant nine_state --states 50 (.*)", "50 states", r"ledger --variant nine_state --states 2 \1"),
    Rule(r"scaling.*", "200 instances", "scaling --instances 1 --format csv"),
    Rule(r"tune", "the command's name", "tune --help"),
    Rule(r"tune VARIANT .*", "placeholders",
         "tune thesis_pd --free cost.switching=1e-9..1e-6:log --campaign small_tuning.toml --evaluations 1"),
    Rule(r"tune nine_robust (.*) --evaluations 40 (.*)", "2900 runs",
         r"tune nine_robust \1 --evaluations 1 \2 --campaign small_tuning.toml"),
    Rule(r"tune (thesis_pd --free .*) --evaluations 20 (.*)", "480 runs", r"tune \1 --evaluations 1 \2 --campaign small_tuning.toml"),
    Rule(r"tune (\S+ --campaign experiments/systems/actuator/data/tried/\S+ .*) --evaluations \d+ (.*)", "hundreds of runs", r"tune \1 --evaluations 1 \2"),
    Rule(r"tune (.*) --evaluations 40 (.*)", "80 runs", r"tune \1 --evaluations 1 \2"),
    # learn
    Rule(r"learn (policy|cost) --out (\S+)( .*)?", "half a minute", r"learn \1 --out \2 --states 400 --epochs 2 --campaign small_tuning.toml"),
    Rule(r"learn evaluate(.*)", "20000 problems", r"learn evaluate\1 --states 200 --passes 1 --campaign small_tuning.toml"),
    # profile
    Rule(r"profile", "measures until it is quiet", "profile --variant thesis_pd --passes 1"),
    Rule(r"profile run\.mcap", "measures until it is quiet", "profile run.mcap --passes 1"),
    Rule(r"profile RUN\.mcap --record FILE", "placeholders", "profile run.mcap --passes 1 --record own.instances"),
    Rule(r"profile CAMPAIGN --record FILE", "placeholders",
         "profile campaign.toml --passes 1 --per-variant 20 --record own.instances"),
    Rule(r"profile --record (\S+)", "700 problems a variant",
         r"profile --variant thesis_pd --passes 1 --per-variant 20 --record \1"),
    Rule(r"profile --instances FILE", "a placeholder", f"profile --instances {RECORDED} --variant thesis_pd --passes 1"),
    Rule(r"profile --budget \S+ (.*)", "closed loops of every variant", r"profile --variant thesis_pd --passes 1 --budget 0.25,5 \1"),
    Rule(r"profile --against (\S+)", "times of a busy machine: only read", r"profile --variant thesis_pd --passes 1 --against \1 --threshold 100"),
    Rule(r"profile (--save .*)", "measures until it is quiet", r"profile --variant thesis_pd --passes 1 \1"),
    Rule(r"profile (.*\.toml.*)", "measures until it is quiet", r"profile \1 --passes 1"),
    # certify
    Rule(r"certify mine --campaign campaign\.toml", "a placeholder", "certify thesis_pd --campaign campaign.toml --states 100"),
    Rule(r"certify (\S+)( --deadline-ms \S+)?(?: --states \d+)?( --jobs \d+)?", "up to a million problems", r"certify \1 --states 200\2\3"),
    # real time
    Rule(r"(emulator|run nine_state --plant emulator) --key node\.key", "a key that the line above makes; test_rig uses one", lambda match, _: match[1].split()[0] + " --help"),
    Rule(r"run VARIANT --plant sim\|emulator\|comedi", "placeholders", "run nine_state --plant sim --duration 0.3 --quiet",
         attempts=BUSY),
    Rule(r"emulator & (?:\./solenoid )?run nine_state --plant emulator", "8 s",
         "emulator --port FREE_PORT & run nine_state --plant emulator --node 127.0.0.1:FREE_PORT --duration 0.3 --quiet",
         attempts=BUSY),
    Rule(r"(run \S+ --plant emulator)(?: --duration .*)?", "8 s or more, and an emulator to run on",
         r"emulator --port FREE_PORT & \1 --node 127.0.0.1:FREE_PORT --duration 0.3 --quiet", attempts=BUSY),
    Rule(r"emulator --image", "waits for a controller until Ctrl-C, and needs QEMU: test_rig boots it", "emulator --help"),
    Rule(r"check --plant emulator --node ADDRESS:PORT", "a placeholder: a node of the reader's", "check --help"),
    Rule(r"check --plant emulator", "an emulator to look at",
         "emulator --port FREE_PORT & check --plant emulator --node 127.0.0.1:FREE_PORT", attempts=BUSY),
    Rule(r"emulator", "waits for a controller until Ctrl-C", "emulator --port FREE_PORT", until=r"127\.0\.0\.1"),
    Rule(r"(check|run thesis_pd) --plant comedi --rig rig\.toml.*", "a board: its substitute",
         lambda match, _: match[1] + " --plant comedi --rig rig.toml" + (" --duration 0.3 --quiet" if match[1] != "check" else ""),
         codes=(0, 1), board=True),
    Rule(r"run (\S+) --live", "the page is served until Ctrl-C", r"run \1 --live --duration 0.3 --quiet", codes=(0, 130), until=r"page stays"),
    Rule(r"run ((?:(?!--duration).)*)", "8 s", r"run \1 --duration 0.3 --quiet", attempts=BUSY),
    Rule(r"run (.*) --duration \S+(.*)", "seconds to minutes", r"run \1 --duration 0.3\2 --quiet", attempts=BUSY),
    Rule(r"replay LOG", "a placeholder", "replay run.mcap"),
    Rule(r"replay LOG --variant V", "placeholders", "replay run.mcap --variant thesis_pd"),
    Rule(r"export LOG", "a placeholder", "export run.mcap"),
    Rule(r"chaos --duration \d+", "twenty minutes", "chaos --duration 3"),
    Rule(r"soak --duration (?:\d+|S)(?: --load N)?", "half an hour", "soak --duration 6", attempts=BUSY),
    Rule(r"faults --attacks-only", "a minute; test_rig asserts its rows at 20,000 packets a second", "faults --help"),
    Rule(r"faults --image", "minutes, and needs QEMU: test_rig drives the image", "faults --help"),
    Rule(r"faults", "every fault takes minutes; test_rig asserts the table's rows", "faults --help"),
]

# Commands of other programs, and where they are tested.
ELSEWHERE = [
    r"^cmake ",  # packaging.outside_project builds, installs and uses the library
    r"^apt-get ",  # packaging.bootstrap_script
    r"^npm ",  # the script's
    r"experiments/python/example\.py",  # python.package
]
