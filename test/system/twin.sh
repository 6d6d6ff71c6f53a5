#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The twin gives the same log to the bit for one seed and another for another; the stock player
# playing it into an estimator gives the same estimates; compare gives the recorded verdict.
. "$(dirname "$0")/common.sh"

procedure=procedures/track_static.yaml
code=0
"$bin/berth" run --twin --seed 3 --out "$work/a" $procedure >"$work/a.txt" || code=$?
# A verdict, whichever.
[[ $code =~ ^[014]$ ]] || { cat "$work/a.txt"; fail "the twin exited with $code"; }
expect $code "$bin/berth" run --twin --seed 3 --out "$work/b" $procedure
"$bin/berth" run --twin --seed 4 --out "$work/c" $procedure >/dev/null || true
a=$(only_run "$work/a")
cmp "$a/run.lcm" "$(only_run "$work/b")/run.lcm" || fail "one seed, two logs"
cmp "$a/results.json" "$(only_run "$work/b")/results.json" || fail "one seed, two results"
! cmp -s "$a/run.lcm" "$(only_run "$work/c")/run.lcm" || fail "two seeds, one log"
expect $code "$bin/berth" compare "$a"
expect $code "$bin/berth" compare "$a/run.lcm"

. "$home/test/system/replay.sh"
replay "$a"
beside "$a"
