#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Arms that move as a loop on a position register does: an approach ends with a verdict, and ground truth, which interpolates their
# reports, is no farther from the world than its covariance states.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" run --twin --world uneven --seed 7 --out "$work/uneven" procedures/approach.yaml
prints "verdict: PASS"
expect 0 "$bin/berth" run --twin --world exact --seed 7 --out "$work/exact" procedures/approach.yaml
python3 - "$bin/berth" "$(only_run "$work/uneven")" "$(only_run "$work/exact")" <<'PYTHON' || fail "ground truth"
import math, pathlib, sys
sys.path.insert(0, "test/system")
sys.dont_write_bytecode = True
from truth_nees import error_of, nees, rows
berth, *runs = sys.argv[1:]
found = []
for run in map(pathlib.Path, runs):
    truth = rows(berth, run / "run.lcm", "GROUND_TRUTH", run / "csv")
    world = rows(berth, run / "world_truth.lcm", "WORLD_TRUTH", run / "csv")
    times = sorted(set(truth) & set(world))[::5]
    errors = [math.hypot(*error_of(truth[t], world[t])[:3]) for t in times]
    found.append((math.sqrt(sum(e * e for e in errors) / len(errors)), max(nees(truth[t], world[t]) for t in times)))
(uneven, worst), (exact, _) = found
print(f"rms {1e3 * uneven:.4f} mm, exact {1e3 * exact:.4f} mm, squared error over covariance at most {worst:.3f}")
# 99.8 % of chi squared of 6 are below 20.8.
sys.exit(0 if uneven > 2 * exact and worst < 20.8 else 1)
PYTHON
