#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# berth spy listens to a bus that the stock player plays on, and publishes nothing itself; it reads a log too.
. "$(dirname "$0")/common.sh"

"$bin/berth" run --twin --seed 3 --out "$work/a" procedures/track_static.yaml >/dev/null || true
log=$(only_run "$work/a")/run.lcm

expect 0 "$bin/berth" spy "$log"
prints "ground_truth_t"
expect 0 "$bin/berth" spy "$log" RUN_INFO
prints "procedure = 'track_static'"

expect 1 "$bin/berth" spy --once 0.5 --lcm-url "$url"
prints "no message was received"
lcm-logplayer --lcm-url="$url" --speed=4 "$log" >/dev/null &
player=$!
expect 0 "$bin/berth" spy --once 4 --lcm-url "$url" 'GROUND_TRUTH|ARM_STATE_.*'
kill $player || true
prints "arm_state_t"
prints "position_m = "
! grep -q HEARTBEAT "$work/out.txt" || fail "shows channels that were not asked for"
expect 2 "$bin/berth" spy --once 1 --lcm-url nonsense
