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

# What was flown is flown again from its run directory, within half a millimetre, and can be judged when that is gone.
cat >"$work/fly.yaml" <<'YAML'
name: fly
description: A way to be flown again.
layout: range
target: radarsat2
steps:
  - move: {to: [0, 0, 5200, 0, 0, 0], speed: 300 mm/s, turn: 20 deg/s}
  - trajectory: {spiral: {radius: 150 mm, turns: 1, speed: 80 mm/s}}
    phase: spiral
YAML
expect 0 "$bin/berth" run --twin --out "$work/flown" "$work/fly.yaml"
flown=$(only_run "$work/flown")
cat >"$work/again.yaml" <<YAML
name: again
description: The same way.
layout: range
target: radarsat2
steps:
  - trajectory: {log: {run: flown/$(basename "$flown"), phase: spiral, of: commanded, spacing: 100 ms, speed: 200 mm/s}}
    phase: spiral
criteria:
  - {name: it followed, measurement: achieved_position_error, statistic: peak, phase: spiral, max: 10 mm}
YAML
expect 0 "$bin/berth" check "$work/again.yaml"
expect 0 "$bin/berth" run --twin --out "$work/flown_again" "$work/again.yaml"
again=$(only_run "$work/flown_again")
for run in "$flown" "$again"; do
  "$bin/berth" log export --csv "$work/$(basename "$run")" --channels GROUND_TRUTH "$run" >/dev/null
done
# The record's middle: how far each of its places is from the nearest place of the second flight.
awk -F, 'FNR == 1 { ++file; for (i = 1; i <= NF; ++i) at[$i] = i; next }
  { x = $at["position_m[0] [m]"]; y = $at["position_m[1] [m]"]; z = $at["position_m[2] [m]"] }
  file == 1 && z < 5.2005 && z > 5.1995 && FNR % 25 == 0 { ++n; a[n] = x; b[n] = y; c[n] = z; least[n] = 1 }
  file == 2 { for (k = 1; k <= n; ++k) {
    d = sqrt((x - a[k]) ^ 2 + (y - b[k]) ^ 2 + (z - c[k]) ^ 2); if (d < least[k]) least[k] = d } }
  END { for (k = 1; k <= n; ++k) if (least[k] > most) most = least[k]
    printf "%d places flown again, at most %.2f mm beside\n", n, 1e3 * most; exit !(n > 10 && most < 5e-4) }' \
  "$work/$(basename "$flown")/GROUND_TRUTH.csv" "$work/$(basename "$again")/GROUND_TRUTH.csv" || fail "it was flown elsewhere"
rm -r "$flown"
expect 0 "$bin/berth" compare "$again"
