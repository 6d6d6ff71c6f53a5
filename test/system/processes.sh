#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A run in the cell of processes: verdict, complete run directory, a recorder that lost nothing,
# replay and comparison from its log, and no process left behind.
. "$(dirname "$0")/common.sh"

code=0
"$bin/berth" run --out "$work/runs" --lcm-url "$url" procedures/track_static.yaml --set survey="8 s" || code=$?
# In real time no two runs are the same: one estimate may come too near to a limit for truth to tell.
[[ $code =~ ^[04]$ ]] || fail "exit code $code"
run=$(only_run "$work/runs")
for file in run.yaml procedure.yaml manifest.json types/pose_estimate_t.lcm run.lcm world_truth.lcm \
            verdict.txt results.json results.xml events.jsonl report.html; do
  [ -s "$run/$file" ] || fail "$file is missing"
done
(cd "$run" && sha256sum --quiet -c SHA256SUMS) || fail "SHA256SUMS is wrong"
expect 0 "$bin/berth" runs --verify "$work/runs"
! pgrep -f "$work" || fail "processes are left behind"
expect $code "$bin/berth" compare "$run"

. "$home/test/system/replay.sh"
replay "$run"
