#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""truth_nees.py BERTH [SEEDS]: is ground truth's covariance consistent with the simulated world?

Flies procedures/library/fast_trajectory.yaml in the twin and divides the squared error of GROUND_TRUTH against
world_truth.lcm by truth's covariance: chi squared, 6 per sample. In cells of three kinds:
- lab: the world that users are in, geometry and clocks both, with truth as it is configured.
- claimed: mounts, joint zeros and reports wrong by what config/calibration.yaml claims of a nominal cell, and
  controllers whose clocks are off and drift. The mounts outweigh the rest.
- motion: the geometry is exact, in truth's model too. What is left are the encoders, as coarse as config/devices.yaml
  claims, the clocks and the arms' reports: the time terms, not hidden by the mounts'.
One sample of each world at rest, one at speed, one where the speed changes most; of the two last also the error along
the motion alone, where a time error is (chi squared of one, 1 per sample). Exit code 1 where a mean is outside the
99.8 % bounds of as many worlds.
"""
import csv
import math
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
from fast_trajectory import fly

SPEEDS = (20, 50, 220)  # mm/s
EXACT = {"base_position": "0.0001 mm", "base_rotation": "0.000001 deg", "length": "0.0001 mm", "tilt": "0.000001 deg"}
EXACT_TOO = {"mount_position": "0.0001 mm", "mount_rotation": "0.000001 deg", "zero": "0.000001 deg"}
WORLD = """geometry:
  tool_position: {mount_position}
  tool_rotation: {mount_rotation}
  rotary_zero: {zero}
clocks:
  controller: 20 ms
  controller_drift: 2e-5
  report_lag: {arm_time}
  lidar: 20 ms
"""


def replaced(file, key, value):
    text, count = re.subn(rf"(?m)^(\s*){key}: [^#\n]*", rf"\g<1>{key}: {value}  ", file.read_text())
    assert count > 0, f"{file}: {key}"
    file.write_text(text)


def claim(file, key):
    return re.search(rf"(?m)^\s*{key}: ([0-9.]+) (\w+)", file.read_text()).groups()


def changed_config(work, name, exact):
    """A configuration whose world is drawn from what its calibration claims."""
    config = work / name
    shutil.copytree("config", config)
    file = config / "calibration.yaml"
    head, rest = file.read_text().split("search:", 1)
    file.write_text(head)
    for key, value in exact.items():
        replaced(file, key, value)
    head = file.read_text()
    file.write_text(head + "search:" + rest)
    claims = dict(re.findall(r"(?m)^  (\w+): ([^#\n]*?) *(?:#|$)", head))
    (config / "worlds" / "claimed.yaml").write_text(WORLD.format(**claims))
    replaced(config / "simulation.yaml", "world", "claimed")
    return config


def lab_config(work):
    config = work / "lab"
    shutil.copytree("config", config)
    replaced(config / "simulation.yaml", "world", "lab")
    return config


def configs(work):
    motion = changed_config(work, "motion", EXACT | EXACT_TOO)
    for sigma, quantum in (("rotary_sigma", "rotary_quantum"), ("linear_sigma", "linear_quantum")):
        value, unit = claim(motion / "devices.yaml", sigma)
        replaced(motion / "simulation.yaml", quantum, f"{math.sqrt(12) * float(value):.6f} {unit}")
    return {"lab": lab_config(work), "claimed": changed_config(work, "claimed", EXACT), "motion": motion}


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


def error_of(truth, world):
    error = [a - b for a, b in zip(numbers(truth, "position_m", 3), numbers(world, "position_m", 3))]
    return error + rotation_between(numbers(world, "q_wxyz", 4), numbers(truth, "q_wxyz", 4))


def nees(truth, world):
    return squared_over(numbers(truth, "covariance", 36), error_of(truth, world))


def nees_along(truth, world):
    """Of the position error along the velocity."""
    velocity = numbers(world, "linear_velocity_m_s", 3)
    covariance = numbers(truth, "covariance", 36)
    error = sum(v * e for v, e in zip(velocity, error_of(truth, world)))
    variance = sum(velocity[i] * covariance[6 * i + j] * velocity[j] for i in range(3) for j in range(3))
    return error * error / variance


def speed_of(row):
    return math.hypot(*numbers(row, "linear_velocity_m_s", 3))


def middle(times):
    return times[len(times) // 2]


def samples(berth, work, config, speed, seed):
    """Chi squared at rest, at speed, where the speed changes; and along the motion of the last two."""
    # from another place in each world, so that encoders are wrong otherwise
    draw = random.Random(seed)
    start = [x + draw.uniform(-by, by) for x, by in zip((-400, 0, 5600, 0, 12, 0), (20, 20, 20, 1, 1, 1))]
    run = fly(berth, work, config, speed, seed, 1, start)
    truth = rows(berth, run / "run.lcm", "GROUND_TRUTH", work / "run" / "truth")
    world = rows(berth, run / "world_truth.lcm", "WORLD_TRUTH", work / "run" / "world")
    common = sorted(set(truth) & set(world))
    speeds = {t: speed_of(world[t]) for t in common}
    arms_off = next(t for t in common if speeds[t] > 0.05)  # to the start
    at_rest = next(t for t in common if t > arms_off and speeds[t] < 1e-6 and speed_of(truth[t]) < 1e-4)
    common = [t for t in common if t > at_rest]
    at_speed = middle([t for t in common if speeds[t] > 0.9e-3 * speed])
    pairs = [(abs(speeds[b] - speeds[a]) / (b - a), a) for a, b in zip(common, common[1:])
             if 0.2e-3 * speed < speeds[a] < 0.8e-3 * speed]
    changing = max(pairs)[1]
    values = [nees(truth[t], world[t]) for t in (at_rest, at_speed, changing)]
    return values + [nees_along(truth[t], world[t]) for t in (at_speed, changing)]


def bounds(degrees):
    """Of the mean per sample, by Wilson and Hilferty's approximation of chi squared's quantiles."""
    return [(1 - 2 / (9 * degrees) + z * math.sqrt(2 / (9 * degrees))) ** 3 for z in (-3.09, 3.09)]


def main():
    berth, seeds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 30
    freedom = (6, 6, 6, 1, 1)
    allowed = [[d * b for b in bounds(d * seeds)] for d in freedom]
    print(f"means over {seeds} worlds; allowed {allowed[0][0]:.2f} to {allowed[0][1]:.2f} of 6 and"
          f" {allowed[-1][0]:.2f} to {allowed[-1][1]:.2f} of 1")
    print(f"{'cells':<8} {'speed':>9} {'at rest':>9} {'at speed':>9} {'changing':>9} {'along':>9} {'changing':>9}")
    failed = False
    with tempfile.TemporaryDirectory() as directory:
        work = pathlib.Path(directory)
        for name, config in configs(work).items():
            for speed in SPEEDS:
                found = [samples(berth, work, config, speed, 1000 * speed + seed) for seed in range(seeds)]
                means = [sum(column) / seeds for column in zip(*found)]
                # Truth takes neighbours' encoders to be wrong alike; here they are not while the arms move, and
                # interpolating averages them: (s^2 + (1 - s)^2) of the variance, 2/3 in the mean.
                minima = (1, *4 * (2 / 3,)) if name == "motion" else 5 * (1,)
                wrong = [not share * low <= mean <= high for mean, share, (low, high) in zip(means, minima, allowed)]
                print(f"{name:<8} {speed:>4} mm/s" + "".join(f" {mean:>8.2f}{'!' if bad else ' '}" for mean, bad in
                                                           zip(means, wrong)), flush=True)
                failed = failed or any(wrong)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
