#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A small campaign through one worker, two workers and a Slurm cluster of this machine: the same bytes. A task that is
# killed is told of and only its trials are submitted again; jobs can be left, found again and cancelled.
. "$(dirname "$0")/../system/common.sh"

cluster=$(dirname "$0")/cluster.sh
trap 'status=$?; "$cluster" down "$work/cluster"; [ $status = 0 ] && rm -rf "$work" || echo "left in $work"' EXIT
up=$("$cluster" up "$work/cluster")
eval "$up"

cat >"$work/acquisition.yaml" <<'END'
name: cluster test
experiment: acquisition
target: radarsat2
seed: 7
trials: 100
block: 20
grid: {returns: [50, 500, 3000]}
draw: {attitude: any attitude}
measurements: [position_error, attitude_error]
END
cat >"$work/track.yaml" <<END
name: tracked from
procedure: $home/procedures/track_static.yaml
seed: 7
trials: 2
block: 1
draw:
  simulation_lidar.yaml:noise_scale: {uniform: [1, 2]}
measurements: [position_error]
END
campaign() { local file=$1; shift; "$bin/berth" campaign "$work/$file.yaml" "$@"; }
same() { cmp "$work/$1/trials.jsonl" "$work/$2/trials.jsonl" || fail "$1 and $2 differ"; }

for name in acquisition track; do
  expect 0 campaign $name --jobs 1 --out "$work/$name-1"
  expect 0 campaign $name --jobs 2 --out "$work/$name-2"
  expect 0 campaign $name --engine slurm --block 2 --out "$work/$name-slurm"
  prints "tasks of about"
  same $name-1 $name-2
  same $name-1 $name-slurm
done
grep -q '"present": 300' "$work/acquisition-slurm/summary.json" || fail "the job that merges left no summary"

# One task is killed in the middle: it is named, with its log, and the same command runs its trials alone.
"$bin/berth" campaign "$work/acquisition.yaml" --engine slurm --block 400 --trials 400 --out "$work/killed" \
  >"$work/killed.txt" 2>&1 &
waiting=$!
first=$work/killed/slurm/1
until_there() {  # PATTERN
  local left=1200
  until compgen -G "$1" >/dev/null; do left=$((left - 1)); [ $left -gt 0 ] || fail "no $1"; sleep 0.1; done
}
until_there "$first/jobs.json"
job=$(sed 's/.*"array":"\([0-9]*\)".*/\1/' "$first/jobs.json")
until_there "$first/task-1.log"
until_there "$work/killed/blocks/*.started"
until squeue --noheader --array --states=all --jobs="$job" --format='%i %T' | grep -qE "^${job}_1 (FAILED|CANCELLED|COMPLETED)"; do
  scancel --signal=KILL --full "${job}_1" 2>/dev/null || true
  sleep 0.1
done
code=0; wait $waiting || code=$?
cat "$work/killed.txt" >"$work/out.txt"
[ $code = 2 ] || { cat "$work/out.txt"; fail "exit code $code of a campaign with a killed task"; }
prints "task 1 left trials undone"
prints "task-1.log"
prints "missing:"
before=$(ls "$work/killed/blocks" | grep -c jsonl)
expect 0 campaign acquisition --engine slurm --block 400 --trials 400 --out "$work/killed"
submitted=$(awk '{n += $2} END {print n}' "$work/killed/slurm/2/tasks.txt")
[ "$submitted" = $((60 - before)) ] || fail "$submitted blocks were submitted again, $((60 - before)) were missing"
expect 0 campaign acquisition --jobs 2 --trials 400 --out "$work/whole"
same whole killed

# Left, found again, cancelled.
expect 0 campaign acquisition --engine slurm --block 100 --trials 2000 --out "$work/left" --detach
prints "berth campaign cancel"
expect 0 campaign acquisition --engine slurm --block 100 --trials 2000 --out "$work/left" --detach
prints "is at work already"
expect 0 "$bin/berth" campaign cancel "$work/left"
prints "is cancelled"
until ! squeue --noheader | grep -q .; do sleep 0.1; done
expect 0 "$bin/berth" campaign cancel "$work/left"
prints "no job of this campaign is at work"

# What a user gets wrong.
printf 'partition: nowhere\n' >"$work/slurm.yaml"
expect 2 campaign acquisition --engine slurm --slurm "$work/slurm.yaml" --block 100 --out "$work/refused"
prints "sbatch refused the jobs"
prints "nowhere"
printf 'queue: main\n' >"$work/slurm.yaml"
expect 2 campaign acquisition --engine slurm --slurm "$work/slurm.yaml" --out "$work/refused"
prints "slurm.yaml:1: key 'queue'"
expect 2 env PATH=/nowhere "$bin/berth" campaign "$work/acquisition.yaml" --engine slurm --block 100 --out "$work/refused"
prints "slurm-client"
echo "campaigns are the same locally and on a cluster"
