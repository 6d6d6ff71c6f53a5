#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# All processes of a run die at once, as in a power cut: what was recorded is judged, listed, and what is missing is reported.
. "$(dirname "$0")/common.sh"

"$bin/berth" run --detach --no-check --out "$work/runs" --lcm-url "$url" procedures/track_static.yaml >"$work/run.txt" 2>&1
run=$(only_run "$work/runs")
# Until some estimates are recorded.
for _ in $(seq 300); do
  [ "$(grep -ac POSE_ESTIMATE "$run/run.lcm" 2>/dev/null)" -ge 3 ] && break
  sleep 0.2
done
expect 0 "$bin/berth" runs "$work/runs"
prints "RUNNING"
pkill -KILL -f "$work/runs"
for file in run.yaml procedure.yaml manifest.json types/pose_estimate_t.lcm config/testbed.yaml; do
  [ -s "$run/$file" ] || fail "$file is missing"
done
expect 2 "$bin/berth" compare --measurements "$run"
prints "the log ends before the procedure did"
prints "position_error"
expect 0 "$bin/berth" runs "$work/runs"
prints "UNFINISHED"
prints "ended without a verdict"
expect 2 "$bin/berth" runs --verify "$work/runs"

# The twin, too, leaves what it had recorded.
"$bin/berth" run --twin --no-check --out "$work/twin" procedures/approach.yaml >"$work/run.txt" 2>&1 &
twin=$!
for _ in $(seq 300); do
  [ "$(cat "$work"/twin/*/run.lcm 2>/dev/null | wc -c)" -gt 1000000 ] && break
  sleep 0.02
done
kill -KILL $twin
expect 2 "$bin/berth" compare "$(only_run "$work/twin")"
prints "the log ends before the procedure did"
