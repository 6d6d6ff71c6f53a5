#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Targets with docking ports, in the twin: the shipped relay docks at both of its ports; spacecraft that others made, in
# the folder BERTH_TARGETS, are described and docked with where that folder is there.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" run --twin --out "$work/relay" "$home/procedures/library/two_ports.yaml"
run=$(only_run "$work/relay")
[ -f "$run/target/relay/target.yaml" ] || fail "the run keeps no copy of its target"
expect 0 "$bin/berth" compare "$run"

# What a target is, and what its runs tell of it.
expect 0 "$bin/berth" target check relay
prints "port 'grapple'"
prints "joint of 'array'"
expect 0 "$bin/berth" target draw relay --out "$work/relay.svg"
grep -q "from -z" "$work/relay.svg" || fail "the picture lacks a side"
expect 0 "$bin/berth" target new "$home/targets/relay/relay.obj" --name "$work/mine" --length 2
expect 2 "$bin/berth" target new "$home/targets/relay/relay.obj" --name "$work/mine"
prints "is there already"
expect 0 "$bin/berth" target check "$work/mine"
cp -r "$run/target/relay" "$work/measured"
expect 0 "$bin/berth" target measure "$work/measured" "$run" --write
prints "array"
expect 0 "$bin/berth" target check "$work/measured"

# Scans of all sides find what the world lab drew: surfaces as they came out and reflectivities to 25 %, the joint to 1 deg.
expect 0 "$bin/berth" run --twin --world lab --seed 2 --out "$work/sides" "$home/procedures/library/measure_target.yaml"
run=$(only_run "$work/sides")
expect 0 "$bin/berth" target measure relay "$run"
# found PART COLUMN EXPECTED TOLERANCE: of the table, in which each value stands with +- and its sigma.
found() {
  awk -v part="$1" -v column="$2" -v wanted="$3" -v tolerance="$4" \
    '$1 == part { d = $column - wanted; exit !(d < tolerance && -d < tolerance) }' "$work/out.txt" ||
    { cat "$work/out.txt" "$run/world.yaml"; fail "$1, column $2: expected $3 within $4"; }
}
drawn() { sed -n "s/.*name: '$1'.*$2: \([-0-9.]*\) .*/\1/p" "$run/world.yaml"; }
for part in default array dish; do
  rms=$(drawn $part surface_rms)
  found $part 3 "$rms" "$(awk "BEGIN { print 0.25 * $rms }")"
done
found default 9 0.5 0.125
found dish 9 0.7 0.175
found array 12 "$(awk "BEGIN { print 20 + $(drawn array joint) }")" 1

# A port that is not there is refused by name before anything moves.
sed 's/dock: grapple/dock: fore/' "$home/procedures/library/two_ports.yaml" >"$work/fore.yaml"
expect 2 "$bin/berth" check "$work/fore.yaml"
prints "has no docking port 'fore'"

if [ -z "${BERTH_TARGETS:-}" ]; then
  echo "BERTH_TARGETS names no folder: other people's spacecraft are skipped"
  exit 0
fi

# describe NAME FILE LENGTH PORTS: a folder with a copy of the mesh.
describe() {
  mkdir -p "$work/$1"
  cp "$BERTH_TARGETS/$2" "$work/$1/"
  cat >"$work/$1/target.yaml" <<YAML
mesh: $2
length: $3
docking:
$4
default_part: {surface_sigma: 2 mm, correlation_length: 200 mm}
YAML
}
cat >"$work/to_port.yaml" <<'YAML'
name: to_port
description: An approach to one port of a target.
layout: free
parameters:
  start: [80, -60, 6500, 4, -3, 5]
  port: none
steps:
  - move: {to: "${start}", speed: 500 mm/s, turn: 30 deg/s}
  - acquire: {gate: [3 m, 12 m]}
    timeout: 60 s
  - track: {gate: [3 m, 12 m], settle: 5}
  - approach: {standoff: 4 m, speed: 100 mm/s, dock: "${port}"}
    phase: approach
  - hold: 3 s
    phase: docked
criteria:
  - {name: sideways, measurement: docking_offset, statistic: final, phase: docked, max: 20 mm}
  - {name: in range, measurement: docking_range, statistic: final, phase: docked, nominal: 4 m, min: -20 mm, max: 20 mm}
  - {name: off the axis, measurement: docking_angle, statistic: final, phase: docked, max: 15 deg}
YAML
# The shuttle's lies in its open bay, which looks along -z; the orbiter's on the side of its bus that looks along -x.
describe shuttle shuttle_42.ply "2 m" "  bay: {pose: [0, 0, 327, 180, 0, 0], approach_cone: 40 deg}"
describe mgs mgs_shrox.ply "2 m" "  side: {pose: [-396, 0, 0, 0, -90, 0], approach_cone: 40 deg}"
expect 0 "$bin/berth" run --twin --out "$work/run_shuttle" --target "$work/shuttle" --set port=bay "$work/to_port.yaml"
expect 0 "$bin/berth" run --twin --out "$work/run_mgs" --target "$work/mgs" --set port=side \
  --set "start=[80, -60, 6500, 4, -86, 5]" "$work/to_port.yaml"
