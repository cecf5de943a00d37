#!/bin/bash
# Fuzzes what reads files and packets.
#
#   tests/fuzz/run.sh PROGRAMS [SECONDS [TARGET...]]
#
# PROGRAMS: the folder of the program and of the fuzz_* programs. Each target gets so many seconds (default 30), FUZZ_JOBS
# of them at once (default: the processors). It starts from the project's own files, what the program writes, and what
# earlier runs kept in build/fuzz-corpus; a finding is left in build/fuzz-findings, and becomes a file of
# tests/data/fuzz/TARGET once it is mended. Exit code 1 for a finding.
set -eu
programs=$(realpath "${1:?usage: $0 PROGRAMS [SECONDS [TARGET...]]}")
seconds=${2:-30}
shift $(($# < 2 ? $# : 2))
cd "$(dirname "$0")/../.."
corpus=$PWD/build/fuzz-corpus findings=$PWD/build/fuzz-findings
mkdir -p "$corpus" "$findings"
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT

# Copies files as seeds of a target, each with the bytes before it that choose what reads it.
seed() { # TARGET PREFIX FILE...
  local target=$1 prefix=$2 file
  shift 2
  mkdir -p "$corpus/$target"
  for file; do
    [ -f "$file" ] || continue
    { printf '%b' "$prefix"; cat "$file"; } >"$corpus/$target/seed-$(printf '%s%s' "$prefix" "$file" | cksum | cut -d' ' -f1)"
  done
}

# Clang 14's sanitizers do not start where memory is laid out at random over more than 28 bits.
still=()
if [ "$(cat /proc/sys/vm/mmap_rnd_bits 2>/dev/null || echo 0)" -gt 28 ] && setarch -R true 2>/dev/null; then still=(setarch -R); fi

# What only the program writes: a short run's log, results, traces.
made=$logs/made
mkdir "$made"
if [ -x "$programs/solenoid" ] && [ ! -f "$corpus/made" ]; then
  printf '%s\n' 'variants = ["thesis_pd"]' '[[scenario]]' 'name = "s"' 'trajectory = { kind = "cycloidal", move_s = 0.05, dwell_s = 0.05 }' >"$made/c.toml"
  {
    "$programs/solenoid" run nine_state --duration 0.05 --quiet --out "$made/run" || true
    "$programs/solenoid" compare "$made/c.toml" --out "$made/compare"
    "$programs/solenoid" profile "$made/c.toml" --passes 1 --per-variant 5 --save "$made/profile.json" --record "$made/own.instances" || true
    # Each trace by itself: a frame's payload, behind 4 bytes of mark, 4 of its length and 4 of its checksum.
    python3 -c '
import pathlib, struct, sys
bytes, at = pathlib.Path(sys.argv[1], "compare/shards/all.traces").read_bytes(), 0
while at < len(bytes):
    length, = struct.unpack_from("<I", bytes, at + 4)
    pathlib.Path(sys.argv[1], f"{at}.trace").write_bytes(bytes[at + 12:at + 12 + length])
    at += 12 + length' "$made"
  } >"$logs/made.log" 2>&1
  touch "$corpus/made"
fi

seed campaign '' experiments/systems/*/data/scenarios/*.toml tests/data/hostile/*.toml
for which in '\0' '\1' '\2' '\3'; do
  seed parameters "$which" experiments/systems/*/data/{tried,tasks}/*.toml
done
for which in '\0' '\1' '\2'; do seed rig "$which" tests/fuzz/seeds/rig*.toml; done
for which in '\0' '\1'; do seed csv "$which" tests/fuzz/seeds/*.csv tests/data/hostile/*.csv; done
seed mcap '' "$made"/run/*.mcap
seed instances '' "$made"/*.instances
seed shard '' "$made"/compare/shards/*.runs
seed trace '' "$made"/*.trace
seed results '' tests/fuzz/seeds/run.json "$made"/profile.json
mkdir -p "$corpus/node" "$corpus/http" "$corpus/plugin"
printf 'SOLENOID PLUG-IN\nname=mine\nabi=1 0123456789abcdef, gcc 12, alignment 16\n\n' >"$corpus/plugin/seed-1"
printf '\4\11\0\5\11\0\0\0\100\102\17\0\5\1\0\4\0\1\0\0\6\1\0\10' >"$corpus/node/seed-1"
printf 'GET /runs.json?after=3 HTTP/1.1\r\nHost: {HOST}\r\nRange: bytes=0-3\r\n\r\n' >"$corpus/http/seed-1"

fuzz_one() { # TARGET
  local target=$1 known=()
  mkdir -p "$corpus/$target" "$findings/$target"
  [ -d "tests/data/fuzz/$target" ] && known=("tests/data/fuzz/$target")
  "${still[@]}" "$programs/fuzz_$target" "$corpus/$target" "${known[@]}" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1000 \
    -max_len=65536 -print_final_stats=1 -artifact_prefix="$findings/$target/" >"$logs/$target" 2>&1 || echo failed >"$logs/$target.failed"
}

if [ $# -eq 0 ]; then
  for program in "$programs"/fuzz_*; do set -- "$@" "${program##*/fuzz_}"; done
fi
for target; do
  while [ "$(jobs -rp | wc -l)" -ge "${FUZZ_JOBS:-$(nproc)}" ]; do wait -n || true; done
  fuzz_one "$target" &
done
wait

found=0
printf '%-12s %12s %10s %10s %8s  %s\n' target executions 'a second' 'edges' corpus finding
for target; do
  log=$logs/$target
  number() { sed -n "s/^stat::$1: *//p" "$log" | tail -1; }
  edges=$(grep -o 'cov: [0-9]*' "$log" | tail -1 | cut -d' ' -f2)
  finding=-
  if [ -f "$log.failed" ]; then
    found=1
    finding=$(grep -m1 -E 'FOUND|ERROR: |SUMMARY|runtime error' "$log" || tail -1 "$log")
    cp "$log" "$findings/$target.txt"
  fi
  printf '%-12s %12s %10s %10s %8s  %s\n' "$target" "$(number number_of_executed_units)" "$(number average_exec_per_sec)" \
    "${edges:--}" "$(find "$corpus/$target" -type f | wc -l)" "$finding"
done
exit $found
