#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs that an earlier version recorded, with keys that have other names now, are judged, replayed and estimated again;
# a site's folder with such keys is refused by name and rewritten.
# recorded/0.1.0.tar.xz: `lab` and `exact`, 19 s each in the twin, without the channels of arms, facility and heartbeats.
. "$(dirname "$0")/common.sh"
tar -xJf "$(dirname "$0")/recorded/0.1.0.tar.xz" -C "$work"

for run in lab exact; do
  grep -q "least_margin" "$work/$run/config/estimator.yaml" || fail "$run has no key of before"
  expect 0 "$bin/berth" compare "$work/$run"
  prints "verdict: PASS; reproduced from the log: identical"
  expect 0 "$bin/berth" report "$work/$run"
  expect 0 "$bin/berth" reestimate "$work/$run" --out "$work/again"
  prints "9 estimates recorded, 9 again"
  grep -q "min_margin" "$work/again/$run/config/estimator.yaml" || fail "$run was estimated with keys of before"
done
expect 0 "$bin/berth" replay "$work/lab" --lcm-url "$url" --rate 64 --estimate
prints "9"

# The same configuration as a site would have it.
site=$work/lab/config
expect 2 "$bin/berth" reestimate "$work/exact" --config "$site" --out "$work/refused"
prints "now: rename it, or 'berth config migrate'"
expect 0 "$bin/berth" config migrate --dry-run "$site"
prints "estimator.yaml"
prints "scan_planner.least_margin -> scan_planner.min_margin"
expect 0 "$bin/berth" config migrate "$site"
prints "safety.least_clearance -> safety.min_clearance"
expect 0 "$bin/berth" config migrate "$site"
prints "0 keys renamed"
expect 0 "$bin/berth" reestimate "$work/exact" --config "$site" --out "$work/taken"
printf 'a: [\n' >"$site/spoilt.yaml"
expect 2 "$bin/berth" config migrate "$site"
prints "spoilt.yaml:"
