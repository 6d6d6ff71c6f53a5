#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Position error of each estimate of a run against ground truth, and its rms, from CSV tables.

    ./berth log export last --csv tables/ --channels 'POSE_ESTIMATE|GROUND_TRUTH'
    examples/5_log/position_error.py tables/

Needs Python's standard library alone. Columns carry their units: "position_m[0] [m]".
"""
import bisect
import csv
import math
import pathlib
import sys

OK = 2  # pose_estimate_t::OK, lcmtypes/pose_estimate_t.lcm
MAX_GAP = 100_000  # us: truth is not interpolated over longer ones


def rows(path):
    """(utime in us, position in m, row) of each message, by when its content was true."""
    with open(path, newline="") as table:
        messages = [
            (int(row["utime [us]"]), [float(row[f"position_m[{i}] [m]"]) for i in range(3)], row)
            for row in csv.DictReader(table)
        ]
    return sorted(messages, key=lambda message: message[0])


def interpolated(truth, times, utime):
    """True position at utime, m; None where truth does not bracket it."""
    after = bisect.bisect_left(times, utime)
    if after == 0 or after == len(times) or times[after] - times[after - 1] > MAX_GAP:
        return None
    share = (utime - times[after - 1]) / (times[after] - times[after - 1])
    a, b = truth[after - 1][1], truth[after][1]
    return [x + share * (y - x) for x, y in zip(a, b)]


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: position_error.py DIRECTORY_OF_TABLES")
    tables = pathlib.Path(sys.argv[1])
    truth = rows(tables / "GROUND_TRUTH.csv")
    times = [utime for utime, _, _ in truth]
    errors = []
    for utime, position, row in rows(tables / "POSE_ESTIMATE.csv"):
        true_position = interpolated(truth, times, utime)
        if int(row["status"]) != OK or true_position is None:
            continue
        errors.append(1e3 * math.dist(position, true_position))
        print(f"{1e-6 * (utime - times[0]):8.3f} s  {errors[-1]:7.3f} mm")
    if not errors:
        sys.exit("position_error.py: no good estimate with ground truth on either side")
    rms = math.sqrt(sum(e * e for e in errors) / len(errors))
    print(f"{len(errors)} estimates, rms {rms:.3f} mm")


if __name__ == "__main__":
    main()
