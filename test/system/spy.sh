#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# berth spy hears a bus that the stock player plays on, and says nothing itself; it reads a log too.
. "$(dirname "$0")/common.sh"

"$bin/berth" run --twin --seed 3 --out "$work/a" procedures/track_static.yaml >/dev/null || true
log=$(only_run "$work/a")/run.lcm

expect 0 "$bin/berth" spy "$log"
says "ground_truth_t"
expect 0 "$bin/berth" spy "$log" RUN_INFO
says "procedure = 'track_static'"

expect 1 "$bin/berth" spy --once 0.5 --lcm-url "$url"
says "nothing was heard"
lcm-logplayer --lcm-url="$url" --speed=4 "$log" >/dev/null &
player=$!
expect 0 "$bin/berth" spy --once 4 --lcm-url "$url" 'GROUND_TRUTH|ARM_STATE_.*'
kill $player || true
says "arm_state_t"
says "position_m = "
! grep -q HEARTBEAT "$work/out.txt" || fail "shows channels that were not asked for"
expect 2 "$bin/berth" spy --once 1 --lcm-url nonsense
