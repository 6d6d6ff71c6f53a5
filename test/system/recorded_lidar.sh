#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Recorded scans in the LIDAR's place, in the twin: a run's log played into its own procedure gives
# its own estimates again; the same scans as a directory of clouds are tracked as well.
. "$(dirname "$0")/common.sh"

procedure=procedures/track_static.yaml
expect 0 "$bin/berth" run --twin --seed 3 --out "$work/live" $procedure
live=$(only_run "$work/live")

expect 0 "$bin/berth" run --twin --seed 3 --out "$work/log" --lidar "$live" $procedure
expect 0 "$bin/berth" log diff --ignore-times --channels POSE_ESTIMATE "$live" "$(only_run "$work/log")"

expect 0 "$bin/berth" log export --clouds "$work/clouds" "$live"
expect 0 "$bin/berth" run --twin --seed 3 --out "$work/files" --lidar "$work/clouds" $procedure

expect 2 "$bin/berth" run --twin --lidar "$work/nothing" $procedure
prints "$work/nothing: no such file or directory"
