#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What a user gets wrong is said clearly, with exit code 2.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" --help
says "run"
for command in run up attach stop check compare estimate log spy doctor; do expect 0 "$bin/berth" $command --help; done
for program in arm-driver lidar-driver facility-driver estimator testbed simulated-cell procedure; do
  expect 0 "$bin/berth-$program" --help
  expect 2 "$bin/berth-$program" --run /nonexistent
done
expect 2 "$bin/berth"
expect 2 "$bin/berth" fly
expect 2 "$bin/berth" run nowhere.yaml --twin --out "$work"
says "nowhere.yaml"
expect 2 "$bin/berth" run procedures/approach.yaml --twin --out "$work" --target nothing.ply
says "nothing.ply"
expect 2 "$bin/berth" run procedures/approach.yaml --twin --out "$work" --set nonsense=1
says "nonsense"
expect 2 "$bin/berth" run procedures/approach.yaml --out "$work" --lcm-url tcpq://localhost:7700
says "tcpq"
expect 0 "$bin/berth" check procedures/*.yaml
printf 'name: x\nsteps:\n  - moove: {to: [0, 0, 1, 0, 0, 0]}\n' >"$work/bad.yaml"
expect 2 "$bin/berth" check "$work/bad.yaml"
says "bad.yaml:3"
expect 2 "$bin/berth" attach
says "nothing is running"
expect 2 "$bin/berth" compare "$work"
echo "not a log" >"$work/bad.lcm"
expect 2 "$bin/berth" compare "$work/bad.lcm"
