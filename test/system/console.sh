#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The console of a cell in processes, looked at and driven through its WebSocket.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" up --layout free --detach --out "$work/runs" --lcm-url "$url"
cell=$(only_run "$work/runs")
for _ in $(seq 100); do [ ! -s "$cell/output/console.url" ] || break; sleep 0.2; done
[ -s "$cell/output/console.url" ] || fail "the console does not serve"
PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 test/system/console_control.py "$(sed 's,.*:\([0-9]*\)/,\1,' "$cell/output/console.url")" || {
  tail -n 5 "$cell"/output/console*.txt
  fail "the console"
}
expect 0 "$bin/berth" stop "$cell"
for _ in $(seq 100); do pgrep -f "$work/runs" >/dev/null || break; sleep 0.2; done  # the run judges itself
! pgrep -f "$work/runs" || fail "processes are left behind"
# What was asked, and what was refused, is in the log.
for text in take_control "no fly" "looks, from" "control-taken"; do
  grep -aqF "$text" "$cell/run.lcm" || fail "the log does not tell of: $text"
done
