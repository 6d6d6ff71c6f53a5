#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A GNC that is no part of Berth steers the cell of processes over real UDP; without one the chaser stays, and the run
# reports it. Called with the directory of the programs and the example.
. "$(dirname "$0")/common.sh"
gnc=$2

"$gnc" --lcm-url "$url" >"$work/gnc.txt" 2>&1 &
outside=$!
expect 0 "$bin/berth" run --no-console --out "$work/steered" --lcm-url "$url" procedures/outside_gnc.yaml
prints "verdict: PASS"
kill $outside
[ "$(grep -c '^target at' "$work/gnc.txt")" -ge 5 ] || fail "the GNC saw nothing: $(cat "$work/gnc.txt")"
head -1 "$work/gnc.txt"
tail -1 "$work/gnc.txt"
# What it said is in the log, under its name.
"$bin/berth" log export --csv "$work/csv" --channels GUIDANCE_SETPOINT "$(only_run "$work/steered")" >/dev/null
[ "$(wc -l <"$work/csv/GUIDANCE_SETPOINT.csv")" -gt 50 ] || fail "its set-points are not in the log"
grep '^verdict' "$work/out.txt"

# Nobody steers.
port=$((port + 1))
expect 2 "$bin/berth" run --no-console --out "$work/alone" --lcm-url "udpm://239.255.76.67:$port?ttl=0" \
  --set longest="8 s" procedures/outside_gnc.yaml
grep -q "no set-point of 'my-gnc'" "$(only_run "$work/alone")/events.jsonl" || fail "nobody was missed"
