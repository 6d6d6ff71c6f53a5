#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A run outlives the terminal that started it; any other terminal or script commands it; keys work,
# and the terminal is left as it was found; Ctrl-C aborts (exit code 3) and leaves no process.
. "$(dirname "$0")/common.sh"

wait_until() {  # SECONDS COMMAND...
  local tries=$(($1 * 5))
  shift
  for _ in $(seq $tries); do "$@" && return 0; sleep 0.2; done
  return 1
}
procedure_of() { pgrep -f "berth-procedure.*$1" >/dev/null; }
nothing_left_of() { ! pgrep -f "berth-.*$1" >/dev/null; }
shows() { grep -qsaF -- "$1" "$2"; }

# in_terminal TYPESCRIPT COMMAND: on a terminal of its own, keys from the pipe $work/keys.
export NO_COLOR=1
rm -f "$work/keys"; mkfifo "$work/keys"
in_terminal() {
  script -qefc "stty cols 100 rows 30; stty -g >$work/before; $2; code=\$?; stty -g >$work/after; exit \$code" \
    "$1" <"$work/keys" >/dev/null 2>&1 &
  terminal=$!
  exec 7>"$work/keys"
}

# The terminal goes away, as when a connection breaks.
in_terminal "$work/one.txt" "$bin/berth run --out $work/runs --lcm-url '$url' procedures/approach.yaml"
wait_until 30 shows RUNNING "$work/one.txt" || { cat "$work/one.txt"; fail "the procedure does not start"; }
kill -KILL $terminal
exec 7>&-
wait $terminal || true
sleep 1
procedure_of "$work/runs" || fail "the run died with its terminal"
run=$(only_run "$work/runs")

# A script commands it; what cannot be is refused with the reason.
expect 2 "$bin/berth" command hodl
prints "expected one of: abort, answer, hold"
expect 2 "$bin/berth" command skip
expect 2 "$bin/berth" command answer clear yes
prints "no prompt is open"
expect 0 "$bin/berth" command "$run" hold
# not before the arms have come to rest
wait_until 20 "$bin/berth" command "$run" resume 2>"$work/out.txt" || { cat "$work/out.txt"; fail "no resume"; }
expect 2 "$bin/berth" command resume
prints "nothing is held"

# Another terminal: an observer sends nothing, an operator holds, leaves, comes back and aborts.
in_terminal "$work/two.txt" "$bin/berth attach --observe"
wait_until 10 shows "q leave" "$work/two.txt" || fail "the observer sees nothing"
printf 'ha' >&7
wait_until 10 shows "only observing" "$work/two.txt" || fail "the observer's keys are not refused"
printf 'q' >&7
wait $terminal || fail "leaving gave exit code $?"
exec 7>&-
in_terminal "$work/three.txt" "$bin/berth attach"
wait_until 10 shows "h hold" "$work/three.txt" || fail "no keys are shown"
printf 'h' >&7
wait_until 10 shows "HELD" "$work/three.txt" || { cat "$work/three.txt"; fail "the key h does not hold"; }
printf 'q' >&7
wait $terminal || fail "leaving gave exit code $?"
cmp "$work/before" "$work/after" || fail "the terminal is not left as it was found"
procedure_of "$work/runs" || fail "the run died when its operator left"
exec 7>&-
in_terminal "$work/four.txt" "$bin/berth attach"
wait_until 10 shows "h hold" "$work/four.txt" || fail "no keys are shown"
printf '\003' >&7
code=0
wait $terminal || code=$?
[ $code = 3 ] || { cat "$work/four.txt"; fail "Ctrl-C gave exit code $code"; }
cmp "$work/before" "$work/after" || fail "the terminal is not left as it was found"
exec 7>&-
grep -q ABORTED "$run/verdict.txt" || fail "the verdict is not ABORTED"
wait_until 20 nothing_left_of "$work/runs" || fail "processes are left behind"

# Without a terminal: no keys, no colours, and SIGINT aborts.
setsid "$bin/berth" run --out "$work/runs2" --lcm-url "$url" procedures/approach.yaml >"$work/run.txt" 2>&1 &
terminal=$!
wait_until 30 procedure_of "$work/runs2" || fail "the procedure does not start"
expect 0 "$bin/berth" command abort
code=0
wait $terminal || code=$?
[ $code = 3 ] || { cat "$work/run.txt"; fail "abort gave exit code $code"; }
! grep -q $'\033' "$work/run.txt" || fail "escape sequences where there is no terminal"
wait_until 20 nothing_left_of "$work/runs2" || fail "processes are left behind"
