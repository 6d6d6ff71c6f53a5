#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A cell that is up takes one procedure after another.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" up --layout free --detach --out "$work/runs" --lcm-url "$url"
says "console http://localhost:"

# A console that dies is started again; the cell does not care.
console() { pgrep -f "berth-console --run $work/runs"; }
first=$(console)
kill -KILL "$first"
for _ in $(seq 100); do
  second=$(console) && [ "$second" != "$first" ] && break
  sleep 0.2
done
[ -n "$second" ] && [ "$second" != "$first" ] || fail "the console is not started again"

for _ in 1 2; do
  expect 0 "$bin/berth" run --out "$work/runs" --lcm-url "$url" procedures/free_pose.yaml \
    --set survey="10 s" --set returns=500
  says "verdict: PASS"
done
expect 0 "$bin/berth" stop
sleep 1
! pgrep -f "$work/runs" || fail "processes are left behind"
