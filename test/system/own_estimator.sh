#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# An estimator that is no part of Berth flies the twin and the cell of processes; the log names the estimator.
# Called with the directory of the programs, the example's library and program, a library of another version, and one
# that is no estimator.
. "$(dirname "$0")/common.sh"
library=$2 program=$3 old=$4 none=$5

cat >"$work/look.yaml" <<'END'
name: look
description: Found and tracked while the chaser flies around it.
layout: range
target: radarsat2
steps:
  - move: {to: [0, 0, 4500, 0, -10, 0], speed: 500 mm/s, turn: 20 deg/s}
  - acquire: {gate: [3 m, 6 m]}
    timeout: 60 s
  - track: {settle: 3}
  - trajectory:
      fly_around: {angle: 20 deg, axis: [0, 1, 0], speed: 4 deg/s}
    phase: fly-around
  - hold: 3 s
    phase: hold
criteria:
  - {name: position, measurement: position_error, statistic: rms, phase: hold, max: 30 mm, samples: 3}
END

# by METHOD RUN: all of the run's estimates are of that method, and there are some.
by() {
  "$bin/berth" log estimates "$2" >"$work/estimates.txt"
  [ "$(grep -c "\"method\":\"$1\"" "$work/estimates.txt")" -ge 10 ] || fail "few estimates by $1 in $2"
  [ "$(grep -vc "\"method\":\"$1\"" "$work/estimates.txt")" = 0 ] || fail "estimates of others in $2"
}

expect 0 "$bin/berth" run --twin --estimator "$library" --out "$work/twin" "$work/look.yaml"
run=$(only_run "$work/twin")
by closest_points "$run"
grep -q "closest_points.so" "$run/manifest.json" || fail "the manifest does not name the estimator"
grep -q "<dt>estimator</dt><dd>closest_points.so" "$run/report.html" || fail "the report does not name the estimator"
expect 0 "$bin/berth" run --twin --estimator "$library" --out "$work/again" "$work/look.yaml"
cmp "$run/run.lcm" "$(only_run "$work/again")/run.lcm" || fail "one seed, two logs"
# Berth's own estimator over its scans: comparable, and named no more.
expect 0 "$bin/berth" reestimate "$run" --out "$work/ours"
prints "position_error rms"
expect 0 "$bin/berth" report "$(only_run "$work/ours")" --html "$work/ours.html"
! grep -q "<dt>estimator</dt>" "$work/ours.html" || fail "re-estimated, and the report names another"

# Its scans in the model's frame, by truth and by estimate: both hold the same surface.
for source in truth estimate; do
  expect 0 "$bin/berth" log export "$run" --clouds "$work/$source" --frame model --by $source --merge --format ply
  [ "$(ls "$work/$source")" = session_1_merged.ply ] || fail "by $source: $(ls "$work/$source")"
done
expect 2 "$bin/berth" log export "$run" --clouds "$work/bad" --merge
prints "expected --frame model"
expect 2 "$bin/berth" log export "$run" --clouds "$work/bad" --frame model
prints "belong together"

# What cannot be flown by.
expect 2 "$bin/berth" run --twin --estimator "$work/nowhere.so" --out "$work/bad" "$work/look.yaml"
prints "nowhere.so: no such file; expected a shared library"
expect 2 "$bin/berth" run --twin --estimator "$program" --out "$work/bad" "$work/look.yaml"
prints "not a shared library"
expect 2 "$bin/berth" run --twin --estimator "$none" --out "$work/bad" "$work/look.yaml"
prints "exports no function 'berth_estimator_plugin'"
expect 2 "$bin/berth" run --twin --estimator "$old" --out "$work/bad" "$work/look.yaml"
prints "is of interface version 2, expected 1"
expect 2 "$bin/berth" run --twin --estimator outside --out "$work/bad" "$work/look.yaml"
prints "the twin is one process"
expect 2 "$bin/berth" run --estimator "$library" --lcm-url "$url" --out "$work/bad" "$work/look.yaml"
prints "a shared library, which is for --twin"
[ ! -e "$work/bad" ] || fail "something was started"

# As a process that the run starts, and as one that somebody else does when asked for it.
expect 0 "$bin/berth" run --no-console --estimator "$program" --lcm-url "$url" --out "$work/process" "$work/look.yaml"
by closest_points "$(only_run "$work/process")"
"$bin/berth" run --no-console --estimator outside --lcm-url "$url" --out "$work/outside" "$work/look.yaml" \
  >"$work/outside.txt" 2>&1 &
berth=$!
for ((i = 0; i < 100; ++i)); do grep -q "^the estimator is run by somebody else" "$work/outside.txt" && break; sleep 0.1; done
run=$(only_run "$work/outside")
"$program" --run "$run" --lcm-url "$url" &
estimator=$!
code=0
wait $berth || code=$?
kill $estimator
[ $code = 0 ] || { cat "$work/outside.txt"; fail "outside: exit code $code"; }
by closest_points "$run"
