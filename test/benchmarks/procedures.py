#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""procedures.py BERTH TABLE [PROCEDURE...]: runs each procedure in the twin, in the worlds exact and lab, with seed 7.

Writes the table 'procedures' of runs.md: the cell's time and processor time of a whole run, verdict and
report included. Without names all that ship, but outside_gnc, which waits for another program."""
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

HEAD = ["procedure", "cell's time", "`exact`", "`lab`", "times real time", "verdict in `lab`"]


def cost(berth, procedure, world):
    """Simulated s, processor s, verdict."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run([berth, "run", "--twin", "--seed", "7", "--world", world, "--out", out, procedure],
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    verdict = re.search(r"^verdict: (\w+)", done.stdout, re.M)
    simulated = re.search(r"^simulated ([\d.]+) s", done.stdout, re.M)
    if not verdict or not simulated:
        sys.exit(f"{procedure} in {world}: no verdict\n{done.stdout}")
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return float(simulated[1]), spent, verdict[1]


def main():
    berth, table, *names = sys.argv[1:]
    procedures = Path("procedures")
    shipped = [path for folder in (".", "library", "paper", "safety") for path in (procedures / folder).glob("*.yaml")]
    rows = [HEAD, ["---"] * len(HEAD)]
    for name in names or sorted(str(path.relative_to(procedures).with_suffix("")) for path in shipped):
        if name == "outside_gnc":
            continue
        exact, lab = (cost(berth, procedures / f"{name}.yaml", world) for world in ("exact", "lab"))
        faster = ", ".join(f"{simulated / spent:.0f}" for simulated, spent, _ in (exact, lab))
        rows.append([f"`{name}`", f"{exact[0]:.0f} s", f"{exact[1]:.1f} s", f"{lab[1]:.1f} s", faster, lab[2]])
        print(*rows[-1], flush=True)
    Path(table).write_text("".join(f"| {' | '.join(row)} |\n" for row in rows))


main()
