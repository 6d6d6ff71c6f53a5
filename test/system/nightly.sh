#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A night runs, is the same again on the same seeds, sees a regression, outlives crashing builds and
# its own death.
. "$(dirname "$0")/common.sh"

cat >"$work/look.yaml" <<'END'
name: look
description: Found and tracked for a moment.
layout: range
target: radarsat2
parameters:
  hold: 3 s
steps:
  - move: {to: [0, 0, 4500, 5, 5, -10], speed: 500 mm/s, turn: 20 deg/s}
  - acquire: {gate: [3 m, 8 m]}
    timeout: 60 s
  - track: {settle: 3}
  - hold: ${hold}
criteria:
  - name: position
    measurement: position_error
    statistic: rms
    phase: hold
    max: 50 mm
END
cat >"$work/plan.yaml" <<'END'
name: system test
jobs: 2
keep: 3
family_wise_alpha: 5 %
seeds: {fixed: 8, fresh: 1}
notify: cat >"$BERTH_NIGHT_DIRECTORY/notified.txt"
procedures:
  - procedure: look.yaml
END
out=$work/nightly
nightly() { "$bin/berth" nightly "$work/plan.yaml" --out "$out" "$@"; }

expect 0 nightly --night first
prints "CLEAN"
grep -q '"verdict": "clean"' "$out/first/summary.json" || fail "no verdict in summary.json"
grep -q '<testsuite ' "$out/first/results.xml" || fail "no JUnit"
grep -q CLEAN "$out/first/notified.txt" || fail "nobody was notified"
[ "$(ls "$out/first/runs" | wc -l)" = 3 ] || fail "kept other than three runs"

# Killed in the middle, the same command goes on; what had finished is not run again.
mkfifo "$work/progress"
"$bin/berth" nightly "$work/plan.yaml" --out "$out" --night second >"$work/progress" 2>&1 &
night=$!
while read -r line; do
  case $line in "4 of 9 runs"*) kill -KILL $night; break ;; esac
done <"$work/progress"
wait $night 2>/dev/null || true
expect 0 nightly
prints "night second was interrupted: resumed"
grep -q "^night second: [1-5] runs" "$work/out.txt" || fail "finished runs were run again"
prints "9 of 9 runs"
[ "$(grep -c '"case": "look"' "$out/second/summary.json")" = 10 ] || fail "not nine runs in the summary"

# The same build on the same seeds differs in nothing; a baseline that crashes is told, and ends nothing.
printf '#!/bin/sh\n[ "$1" = --version ] && echo broken && exit 0\nkill -SEGV $$\n' >"$work/broken"
chmod +x "$work/broken"
expect 0 nightly --night third --baseline "$work/broken"
prints "ERROR look seed 1 (baseline)"
prints ", 0 changes"

# A slower estimator is a regression, and is until it is accepted.
cp -r config "$work/slow"
sed -i 's/estimator: 30 ms/estimator: 60 ms/' "$work/slow/twin.yaml"
expect 1 nightly --night fourth --config "$work/slow"
prints "REGRESSION"
grep -q '<failure' "$out/fourth/results.xml" || fail "no failure in the JUnit report"
expect 0 "$bin/berth" nightly --out "$out" --accept fourth
expect 0 nightly --night fifth --config "$work/slow"

# Recorded runs are estimated again: as recorded, or nearer to the truth, or not at all.
mkdir "$work/archive"
cp -r $(ls -d "$out"/*/runs/*/ | grep -v baseline | head -2) "$work/archive"
sed 's/seeds: .*/seeds: {fixed: 1}\narchive: {runs: archive}/' "$work/plan.yaml" >"$work/archived.yaml"
expect 0 "$bin/berth" nightly "$work/archived.yaml" --out "$work/archived" --night again
prints "archive, estimated again: 2 runs, 0 changes"
prints "no difference"
sed -i 's/archive}/archive, config: published.yaml}/' "$work/archived.yaml"
cp config/estimator_paper.yaml "$work/published.yaml"
expect 0 "$bin/berth" nightly "$work/archived.yaml" --out "$work/archived" --night published
prints "archive, estimated again: 2 runs"
grep -q '"estimates_same": 0' "$work/archived/published/summary.json" || fail "the archive's configuration was not used"
echo nothing >"$(ls -d "$work"/archive/*/run.lcm* | head -1)"
expect 2 "$bin/berth" nightly "$work/archived.yaml" --out "$work/archived" --night spoilt
prints "it holds no scans to estimate from"
mkdir "$work/archive/empty"
expect 2 "$bin/berth" nightly "$work/archived.yaml" --out "$work/archived" --night none
prints "ERROR: berth reestimate"

expect 2 "$bin/berth" nightly "$work/none.yaml" --out "$out"
expect 2 nightly --night fifth
prints "there is one of that name"
