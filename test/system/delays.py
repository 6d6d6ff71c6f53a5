#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""delays.py BERTH [SEEDS]: are delays between LIDAR and arms found, and do their 95 % intervals hold them?

Runs procedures/library/fast_trajectory.yaml in the twin at two speeds, in cells whose arms report older joints
than their drivers think (controller.report_lag of config/simulation.yaml), over SEEDS seeds each, and prints a
table of coverage and width. Exit code 1 where fewer than 85 % of a row's intervals hold the delay, or where one
millisecond more does not show at 200 mm/s.
"""
import json
import pathlib
import shutil
import statistics
import sys
import tempfile

sys.dont_write_bytecode = True
from fast_trajectory import fly

BELIEVED_MS = 2.0  # report_lag in config/devices.yaml
LAGS_MS = (2.0, 3.0, 12.0)
SPEEDS = (50, 220)  # mm/s
NAMES = {"scans": "LIDAR behind arms, single scans", "filtered": "estimates behind arms, filtered"}


def changed_config(work, lag_ms):
    config = work / f"config-{lag_ms}"
    shutil.copytree("config", config)
    file = config / "simulation.yaml"
    text = file.read_text()
    before = f"report_lag: {BELIEVED_MS:g} ms"
    assert text.count(before) == 1, f"{file}: '{before}' expected once"
    file.write_text(text.replace(before, f"report_lag: {lag_ms:g} ms"))
    return config


def measured(berth, work, config, speed, seed):
    results = json.loads((fly(berth, work, config, speed, seed, 2) / "results.json").read_text())
    return {row["name"]: row for row in results["latencies"]}


def main():
    berth, seeds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20
    failed = False
    print(f"{'delay':>7} {'speed':>9}  {'of':<9} {'inside':>8} {'mean':>8} {'half width':>10}   (ms, {seeds} seeds)")
    means = {}
    with tempfile.TemporaryDirectory() as directory:
        work = pathlib.Path(directory)
        for lag in LAGS_MS:
            config = changed_config(work, lag)
            # the arms' truth is so much later than its stamps, and the LIDAR so much earlier than that
            delay = BELIEVED_MS - lag
            for speed in SPEEDS:
                runs = [measured(berth, work, config, speed, seed) for seed in range(1, seeds + 1)]
                for what, name in NAMES.items():
                    rows = [run[name] for run in runs if run[name]["value_s"] is not None]
                    inside = sum(r["low_s"] <= 1e-3 * delay <= r["high_s"] for r in rows)
                    mean = 1e3 * statistics.fmean(r["value_s"] for r in rows)
                    half = 1e3 * statistics.fmean((r["high_s"] - r["low_s"]) / 2 for r in rows)
                    means[lag, speed, what] = mean
                    print(f"{delay:>7.1f} {speed:>4} mm/s  {what:<9} {inside:>3} of {len(rows):<3}"
                          f" {mean:>7.2f} {half:>10.2f}", flush=True)
                    if what == "scans" and inside < 0.85 * seeds:
                        failed = True
    shift = means[3.0, 220, "scans"] - means[2.0, 220, "scans"]
    print(f"one millisecond more at 220 mm/s shows as {shift:+.2f} ms")
    return 1 if failed or abs(shift + 1) > 0.3 else 0


if __name__ == "__main__":
    sys.exit(main())
