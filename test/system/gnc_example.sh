#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The example of an outside GNC steers a cell of processes some way over real UDP; outside_gnc.sh flies all of it.
. "$(dirname "$0")/common.sh"

sed '/brought to rest/d; /- move:/d; /start:/d; s/settle: 5/settle: 2/; s/for 3 s/for 1 s/; s/hold: 5 s/hold: 1 s/' \
  procedures/outside_gnc.yaml >"$work/begun.yaml"
"$bin/../examples/outside_gnc" --lcm-url "$url" >"$work/gnc.txt" 2>&1 &
gnc=$!
expect 0 "$bin/berth" run --no-console --out "$work/runs" --lcm-url "$url" --set reached="5.47 m" "$work/begun.yaml"
kill $gnc
prints "verdict: PASS"
grep -q '^target at' "$work/gnc.txt" || fail "the GNC received no estimate: $(cat "$work/gnc.txt")"
"$bin/berth" log export --csv "$work/csv" --channels GUIDANCE_SETPOINT "$(only_run "$work/runs")" >/dev/null
[ "$(wc -l <"$work/csv/GUIDANCE_SETPOINT.csv")" -gt 10 ] || fail "its set-points are not in the log"
