#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A lost terminal only detaches; Ctrl-C aborts (exit code 3) and leaves no process; berth stop likewise.
. "$(dirname "$0")/common.sh"

wait_until() {  # SECONDS COMMAND...
  local tries=$(($1 * 5))
  shift
  for _ in $(seq $tries); do "$@" && return 0; sleep 0.2; done
  return 1
}
running() { pgrep -f "berth-procedure.*$work" >/dev/null; }
nothing_left() { ! pgrep -f "$work/runs" >/dev/null; }

# The terminal goes away: the run goes on, and stop aborts it.
"$bin/berth" run --out "$work/runs" --lcm-url "$url" procedures/approach.yaml >"$work/run.txt" 2>&1 &
terminal=$!
wait_until 30 running || fail "the procedure does not start"
kill -HUP $terminal
wait $terminal || true
sleep 1
running || fail "the run died with its terminal"
run=$(only_run "$work/runs")
expect 0 "$bin/berth" stop
wait_until 20 nothing_left || fail "processes are left behind"
grep -q ABORTED "$run/verdict.txt" || fail "the verdict is not ABORTED"

# Ctrl-C.
setsid "$bin/berth" run --out "$work/runs2" --lcm-url "$url" procedures/approach.yaml >"$work/run.txt" 2>&1 &
terminal=$!
running2() { pgrep -f "berth-procedure.*$work/runs2" >/dev/null; }
wait_until 30 running2 || fail "the procedure does not start"
sleep 2
kill -INT $terminal
code=0
wait $terminal || code=$?
[ $code = 3 ] || { cat "$work/run.txt"; fail "Ctrl-C gave exit code $code"; }
! pgrep -f "$work/runs2" >/dev/null || fail "processes are left behind"
