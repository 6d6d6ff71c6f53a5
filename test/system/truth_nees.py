#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""truth_nees.py BERTH [SEEDS]: is ground truth as wrong as it says, against the simulated world itself?

Flies procedures/library/fast_trajectory.yaml in the twin, in cells whose mounts, joint zeros and reports are wrong by
what config/calibration.yaml claims of a nominal cell (and whose controllers' clocks are off and drift), and divides the
squared error of GROUND_TRUTH against world_truth.lcm by truth's covariance: chi squared of six degrees of freedom. One
sample at rest and one in motion from each world. Exit code 1 where a mean is outside the 99.8 % bounds.
"""
import csv
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
from fast_trajectory import fly

SPEEDS = (20, 50, 220)  # mm/s
EXACT = {"base_position": "0.0001 mm", "base_rotation": "0.000001 deg", "length": "0.0001 mm", "tilt": "0.000001 deg"}
WORLD = """base_position: 0 mm
base_rotation: 0 deg
tool_position: {mount_position}
tool_rotation: {mount_rotation}
rotary_zero: {zero}
linear_zero: 0 mm
link_position: 0 mm
link_rotation: 0 deg
controller_clock: 20 ms
controller_drift: 2e-5
report_lag: {arm_time}
lidar_clock: 20 ms
lidar_range: 0 mm
"""


def claimed_config(work):
    """A configuration whose world is drawn from what its calibration claims."""
    config = work / "config"
    shutil.copytree("config", config)
    file = config / "calibration.yaml"
    head, rest = file.read_text().split("search:", 1)
    for key, value in EXACT.items():
        head, count = re.subn(rf"(?m)^  {key}: [^#\n]*", f"  {key}: {value}  ", head)
        assert count == 1, key
    file.write_text(head + "search:" + rest)
    claims = dict(re.findall(r"(?m)^  (\w+): ([^#\n]*?) *(?:#|$)", head))
    (config / "worlds" / "claimed.yaml").write_text(WORLD.format(**claims))
    simulation = config / "simulation.yaml"
    text, count = re.subn(r"(?m)^world: \w+", "world: claimed", simulation.read_text())
    assert count == 1, "world"
    simulation.write_text(text)
    return config


def rows(berth, log, channel, directory):
    subprocess.run([berth, "log", "export", log, "--csv", directory, "--channels", channel], check=True,
                   stdout=subprocess.DEVNULL)
    with open(directory / f"{channel}.csv", newline="") as file:
        return {int(row["utime [us]"]): row for row in csv.DictReader(file)}


def numbers(row, name, count):
    found = [float(v) for k, v in row.items() if k.split("[")[0] == name]
    assert len(found) == count, name
    return found


def rotation_between(a, b):
    """Rotation vector that turns the unit quaternion a into b, in the outer frame: log(b a^-1)."""
    aw, ax, ay, az = a[0], -a[1], -a[2], -a[3]
    bw, bx, by, bz = b
    w = bw * aw - bx * ax - by * ay - bz * az
    v = [bw * ax + bx * aw + by * az - bz * ay, bw * ay - bx * az + by * aw + bz * ax,
         bw * az + bx * ay - by * ax + bz * aw]
    sign = -1 if w < 0 else 1
    return [2 * sign * x for x in v]  # small


def squared_over(covariance, error):
    """error^T covariance^-1 error, by Cholesky."""
    n = len(error)
    low = [[0.0] * n for _ in range(n)]
    y = [0.0] * n
    for i in range(n):
        for j in range(i + 1):
            s = covariance[n * i + j] - sum(low[i][k] * low[j][k] for k in range(j))
            low[i][j] = math.sqrt(s) if i == j else s / low[j][j]
        y[i] = (error[i] - sum(low[i][k] * y[k] for k in range(i))) / low[i][i]
    return sum(x * x for x in y)


def nees(truth, world):
    error = [a - b for a, b in zip(numbers(truth, "position_m", 3), numbers(world, "position_m", 3))]
    error += rotation_between(numbers(world, "q_wxyz", 4), numbers(truth, "q_wxyz", 4))
    return squared_over(numbers(truth, "covariance", 36), error)


def speed_of(row):
    return math.hypot(*numbers(row, "linear_velocity_m_s", 3))


def samples(berth, work, config, speed, seed):
    """NEES at rest and in motion."""
    run = fly(berth, work, config, speed, seed, 1)
    truth = rows(berth, run / "run.lcm", "GROUND_TRUTH", work / "run" / "truth")
    world = rows(berth, run / "world_truth.lcm", "WORLD_TRUTH", work / "run" / "world")
    common = sorted(set(truth) & set(world))
    at_rest = [t for t in common if speed_of(world[t]) < 1e-6 and speed_of(truth[t]) < 1e-4]
    moving = [t for t in common if speed_of(world[t]) > 0.9e-3 * speed]
    middle = [times[len(times) // 2] for times in (at_rest, moving)]
    return [nees(truth[t], world[t]) for t in middle]


def main():
    berth, seeds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 30
    # Wilson and Hilferty's approximation of chi squared's quantiles
    degrees = 6 * seeds
    bounds = [6 * (1 - 2 / (9 * degrees) + z * math.sqrt(2 / (9 * degrees))) ** 3 for z in (-3.09, 3.09)]
    print(f"mean NEES over {seeds} worlds, 6 when consistent, {bounds[0]:.2f} to {bounds[1]:.2f} allowed")
    failed = False
    with tempfile.TemporaryDirectory() as directory:
        work = pathlib.Path(directory)
        config = claimed_config(work)
        for speed in SPEEDS:
            found = [samples(berth, work, config, speed, 1000 * speed + seed) for seed in range(seeds)]
            means = [sum(column) / seeds for column in zip(*found)]
            print(f"{speed:>4} mm/s: at rest {means[0]:5.2f}, in motion {means[1]:5.2f}", flush=True)
            failed = failed or not all(bounds[0] <= mean <= bounds[1] for mean in means)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
