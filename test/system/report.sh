#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every run leaves a report; compare lays runs side by side as text, JSON and HTML.
. "$(dirname "$0")/common.sh"

for seed in 3 4; do
  "$bin/berth" run --twin --seed $seed --out "$work/$seed" procedures/track_static.yaml >"$work/$seed.txt" || true
done
a=$(only_run "$work/3")
b=$(only_run "$work/4")
holds() { grep -qF -- "$2" "$1" || fail "$1 does not hold: $2"; }

page=$a/report.html
[ "$(stat -c %s "$page")" -lt 1500000 ] || fail "the report of a short run is larger than 1.5 MB"
for id in criteria poses errors scans returns timing steps nodes measurements files; do
  holds "$page" "<section id=\"$id\""
done
holds "$page" 'href="./run.lcm"'
! grep -qE '(src|href)="(https?:)?//' "$page" || fail "the report fetches something"

# From the log alone, wherever it is.
cp "$a/run.lcm" "$work/alone.lcm"
code=0
"$bin/berth" compare "$a" >"$work/compare.txt" || code=$?
expect $code "$bin/berth" report "$work/alone.lcm" --html "$work/alone.html"
holds "$work/alone.html" '<section id="scans"'

"$bin/berth" compare "$a" "$b" --html "$work/both.html" >"$work/both.txt" || true
holds "$work/both.txt" "run 2: "
holds "$work/both.txt" "rms position_error"
holds "$work/both.html" '<section id="measurements"'
"$bin/berth" compare --json "$a" "$b" >"$work/both.json" || true
holds "$work/both.json" '"paired_with_first"'
[ "$(grep -c '"recorded_outcome"' "$work/both.json")" = 2 ] || fail "not two runs in the JSON"
expect 2 "$bin/berth" report "$a" --html "$work/no/such/directory.html"
prints "cannot be written"
