# SPDX-License-Identifier: BSD-3-Clause
"""One run of procedures/library/fast_trajectory.yaml in the twin, for the measurements of truth and of delays."""
import shutil
import subprocess


def fly(berth, work, config, speed, seed, passes, start=None):
    """Flies to and fro at so many mm/s, whatever the verdict. The run before is gone. start: x y z w p r in mm and
    degrees, instead of the procedure's. Returns the run directory."""
    out = work / "run"
    shutil.rmtree(out, ignore_errors=True)
    # not checked: its own criterion wants it fast
    command = [berth, "run", "--twin", "--no-check", "procedures/library/fast_trajectory.yaml", "--config", config,
               "--out", out, "--seed", str(seed), "--set", f"speed={speed} mm/s", "--set", "ramp=2 s", "--set", f"passes={passes}"]
    if start is not None:
        command += ["--set", f"start={[round(x, 4) for x in start]}"]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    return next(out.glob("*/run.lcm")).parent
