#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Faults of processes and of the machine, in the cell of processes, while the arms approach: a node killed or stopped,
# the recorder killed, the disk full, the clock stepped, packets lost. Called with the directory of the programs,
# that of the preloaded library, and perhaps a file for the table.
[ -n "${BERTH_MAY_MOUNT:-}" ] || BERTH_MAY_MOUNT=1 exec unshare -Urm "$0" "$@"
. "$(dirname "$0")/common.sh"
machine=$2/libbroken_machine.so
table=${3:-$work/table.md}
failed=()

cat >"$work/under_way.yaml" <<'YAML'
name: under way
description: Both arms move for a while.
layout: range
target: radarsat2
steps:
  - move: {to: [100, -100, 5500, 10, 8, -12], speed: 200 mm/s, turn: 10 deg/s}
  - acquire: {gate: [3 m, 8 m]}
  - track: {settle: 3}
  - approach: {standoff: 3.2 m, speed: 50 mm/s}
criteria:
  - {name: it approached, measurement: relative_speed, statistic: peak, phase: approach, min: 20 mm/s}
YAML

# begin NAME [COMMAND...]: a run of its own, by COMMAND if there is one; returns when both arms are under way.
begin() {
  name=$1
  shift
  port=$((port + 1))
  out=$work/$name
  mkdir -p "$out"
  "$@" "$bin/berth" run --no-check --no-console --out "$out" --lcm-url "udpm://239.255.76.67:$port?ttl=0" \
    "$work/under_way.yaml" >"$work/$name.txt" 2>&1 &
  berth=$!
  for _ in $(seq 600); do
    run=$(only_run "$out" 2>/dev/null) || run=
    [ -n "$run" ] && grep -aq closed-loop "$run/run.lcm" 2>/dev/null && break
    kill -0 $berth 2>/dev/null || { cat "$work/$name.txt"; fail "$name: the run ended before it was under way"; }
    sleep 0.1
  done
  sleep 5
}

now() { echo $(($(date +%s%N) / 1000)); }

# done_with FAULT BOUND TEXT: waits for the end and writes the row. It must have braked within BOUND ms (0: it need
# not), and the events or the program must say TEXT.
done_with() {
  local fault=$1 bound=$2 text=$3 code=0 braking standing words verdict
  wait $berth || code=$?
  IFS=$'\t' read -r braking standing words < <("$home/test/system/after_fault.py" "$run" "$at")
  verdict=$(grep -h '^verdict' "$work/$name.txt" | sed 's/^verdict: //; s/; the recorded.*//')
  printf '| %s | %s | %s | %s | %s |\n' "$fault" "${words:-nothing}" "$braking" "$standing" "$verdict" | tee -a "$table"
  grep -qF -- "$text" "$work/$name.txt" "$run/events.jsonl" || failed+=("$fault: nothing said of: $text")
  [ "$bound" = 0 ] || { [ "$braking" != never ] && [ "$braking" -le "$bound" ]; } ||
    failed+=("$fault: braking after $braking ms, not within $bound")
}

printf '| fault | the operator reads | braking after, ms | standing after, ms | the run |\n|---|---|---|---|---|\n' >"$table"

for node in estimator testbed lidar-driver facility-driver arm-driver; do
  begin "killed_$node"
  pid=$(pgrep -f -- "berth-$node --run ${run%/}" | head -1)
  at=$(now)
  kill -KILL "$pid"
  done_with "$node killed" 300 "$node"
done
for node in estimator testbed; do
  begin "hung_$node"
  pid=$(pgrep -f -- "berth-$node --run ${run%/}" | head -1)
  at=$(now)
  kill -STOP "$pid"
  done_with "$node hung" 300 "$node"
done

begin logger
at=$(now)
kill -KILL "$(pgrep -f -- "lcm-logger.*${run%/}" | head -1)"
done_with "recorder killed" 0 "lcm-logger ended"

printf '\0\0\0\0\0\0\0\0' >"$work/step"
begin clock env LD_PRELOAD="$machine" BERTH_TEST_CLOCK="$work/step"
at=$(now)
python3 -c "import struct, sys; open(sys.argv[1], 'r+b').write(struct.pack('<q', -3600 * 1000000))" "$work/step"
done_with "system clock stepped back by an hour" 0 "verdict: PASS"

mkdir "$work/full"
mount -t tmpfs -o size=100m none "$work/full"
begin full
at=$(now)
dd if=/dev/zero of="$work/full/ballast" bs=1M 2>"$work/dd.txt" || true
done_with "disk full" 0 "nothing is recorded any more"
umount "$work/full"

begin loss env LD_PRELOAD="$machine" BERTH_TEST_PACKET_LOSS=0.2
at=$(now)
done_with "a fifth of all packets lost" 0 "verdict"

[ ${#failed[@]} = 0 ] || { printf '%s\n' "${failed[@]}"; fail "${#failed[@]} of the faults"; }
