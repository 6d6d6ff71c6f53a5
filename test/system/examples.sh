#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The examples, as their texts say they are run, in the twin; the estimates' subscriber reads a log through LCM.
. "$(dirname "$0")/common.sh"

# 4_procedure: checked, then flown.
expect 0 "$bin/berth" check examples/4_procedure/survey.yaml
prints "ready: 7 steps"
expect 0 "$bin/berth" run --twin --out "$work/survey" examples/4_procedure/survey.yaml
run=$(only_run "$work/survey")
said=$(sed -n 's/^ *PASS  *position in the whole run  *\([0-9.]*\) .*/\1/p' "$work/out.txt")

# 1_estimates: each estimate of the log once, good ones with a pose.
expect 0 "$bin/../examples/estimates" --lcm-url "file://${run}run.lcm?speed=0"
prints "sigma"
printed=$(wc -l <"$work/out.txt")
recorded=$("$bin/berth" log estimates "$run" | wc -l)
[ "$printed" = "$recorded" ] || fail "$printed estimates printed, expected the $recorded of the log"
expect 2 "$bin/../examples/estimates" --url
prints "usage"

# 5_log: the rms that the verdict has, but for the target's turning between two samples of truth and for phases.
expect 0 "$bin/berth" log export "$run" --csv "$work/tables" --channels 'POSE_ESTIMATE|GROUND_TRUTH'
expect 0 examples/5_log/position_error.py "$work/tables"
found=$(sed -n 's/.* estimates, rms \(.*\) mm/\1/p' "$work/out.txt")
awk "BEGIN { d = $found - $said; exit !(d < 0.05 && -d < 0.05) }" || fail "rms $found mm, expected $said mm"

# 6_target: described, drawn, docked with.
target=examples/6_target/servicer
expect 0 "$bin/berth" target check $target
prints "port 'port'"
! grep -q '^note' "$work/out.txt" || fail "the mesh is not clean: $(cat "$work/out.txt")"
expect 0 "$bin/berth" target draw $target --out "$work/servicer.svg"
expect 0 "$bin/berth" run --twin --out "$work/dock" examples/6_target/dock.yaml --target $target
