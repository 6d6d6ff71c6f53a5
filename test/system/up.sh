#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A cell that is up takes one procedure after another.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" up --layout free --detach --out "$work/runs" --lcm-url "$url"
prints "console http://127.0.0.1:"

# A console that dies is started again; the cell does not care.
console() { pgrep -f "berth-console --run $work/runs"; }
first=$(console)
kill -KILL "$first"
for _ in $(seq 100); do
  second=$(console) && [ "$second" != "$first" ] && break
  sleep 0.2
done
[ -n "$second" ] && [ "$second" != "$first" ] || fail "the console is not started again"

# Another procedure, by another criterion.
sed 's/^name: free_pose/name: second/; s/name: position$/name: place/' procedures/free_pose.yaml >"$work/second.yaml"
for procedure in procedures/free_pose.yaml "$work/second.yaml"; do
  expect 0 "$bin/berth" run --out "$work/runs" --lcm-url "$url" "$procedure" --set survey="10 s" --set returns=500
  prints "verdict: PASS"
done
expect 0 "$bin/berth" stop
# The cell's own log holds both, each judged by its own criteria.
expect 0 "$bin/berth" compare "$work/runs"/*_cell
prints "place  "
[ "$(grep -c "^verdict: PASS; reproduced from the log: identical" "$work/out.txt")" = 2 ] || fail "not two verdicts"
sleep 1
! pgrep -f "$work/runs" || fail "processes are left behind"
