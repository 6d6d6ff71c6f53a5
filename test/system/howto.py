#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""howto.py [PAGE...]: follows the pages of docs/howto to the letter, in a copy of this clone and its build.

A block before a page's first '## ' belongs to the file in bold before it:
    **`FILE`**, new              is the whole file
    **`FILE`**, before `TEXT`    goes before the first line that holds TEXT; or 'after `TEXT`', 'at the end'
    **`FILE`**                   a block ```diff: lines that are replaced
Commands must have the effect in the comment before them (documented_commands.py), also those of 'howto:'.
All pages are followed in one copy, one after another, so that little is compiled twice. The copy is
mounted over this folder, in a namespace of its own: the build's absolute paths stay right."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
import documented_commands as documents  # noqa: E402

PAGES = [f"docs/howto/add_a_{name}.md" for name in ("target", "verb", "criterion", "driver", "message")]
FILE = re.compile(r"\*\*(?:\d+\. )?`([^`]+)`\*\*(?:, (new|at the end|(before|after) `([^`]+)`))?")
# In place of ./berth: it builds what is called, not all.
CALLED = "build/howto_berth"
BERTH = """#!/bin/bash
export BERTH_HOME=$PWD
[ "$1" = test ] || { ninja -j "$(nproc)" -C build/release berth >build/out || { cat build/out; exit 1; }; exec build/release/bin/berth "$@"; }
shift
tests=$(ctest --test-dir build/release -N "$@" | sed -n 's/^ *Test *#[0-9]*: \\(test_.*\\)/\\1/p')
ninja -j "$(nproc)" -C build/release ${tests:-berth} >build/out || { tail -100 build/out; exit 1; }
exec ctest --test-dir build/release --output-on-failure "$@"
"""


class Clone:
    """What documented_commands.judge runs in."""

    def call(self, home, command):
        return subprocess.run(command, cwd=home, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)


def line_with(lines, text, path):
    for number, line in enumerate(lines):
        if text in line:
            return number
    sys.exit(f"{path}: no line holds '{text}'")


def replace(lines, block, path):
    """Runs of removed lines, each followed by what comes there."""
    for hunk in re.findall(r"((?:^-.*\n)+)((?:^\+.*\n)*)", block, re.M):
        old, new = ([line[1:] for line in part.splitlines(True)] for part in hunk)
        at = [n for n in range(len(lines)) if lines[n:n + len(old)] == old]
        if len(at) != 1:
            sys.exit(f"{path}: {len(at)} places that read\n{''.join(old)}")
        lines[at[0]:at[0] + len(old)] = new


def edit(language, block, path, place, side, text):
    if place == "new":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block)
        return
    lines = path.read_text().splitlines(True)
    if place == "at the end":
        lines.append(block)
    elif side:
        lines.insert(line_with(lines, text, path) + (side == "after"), block)
    elif language == "diff":
        replace(lines, block, path)
    else:
        sys.exit(f"{path}: neither new, before, after, at the end, nor a diff")
    path.write_text("".join(lines))


def follow(page):
    """Applies and runs a page. Returns the number of its faults."""
    steps = Path(page).read_text().split("\n## ")[0]
    marked = {}
    for place, command, expectation in documents.blocks(page):
        marked.setdefault(place, []).append((command, expectation.removeprefix("howto: ")))
    end, faults, begun = 0, 0, False
    for block in documents.BLOCK.finditer(steps):
        place = f"{page}:{steps.count(chr(10), 0, block.start()) + 1}"
        heading = FILE.findall(re.sub(r"\s+", " ", steps[end:block.start()]))
        end = block.end()
        if block[2] in documents.SHELL:
            for command, expectation in marked[place]:
                if expectation.startswith("not run:"):
                    continue
                start = time.monotonic()
                fault = documents.judge(Clone(), Path.cwd(), command.replace("./berth ", f"{CALLED} "), expectation)
                faults += bool(fault)
                print(f"{'FAILED' if fault else 'ok'} {time.monotonic() - start:.0f} s: {place}: {command}")
                print(f"  {fault}\n" if fault else "", end="", flush=True)
        elif heading:
            begun = True
            name, *where = heading[-1]
            edit(block[2], block[3], Path(name), *where)
            print(f"ok: {place}: {name}", flush=True)
        elif begun:
            sys.exit(f"{place}: for which file is this block?")
    return faults


def main():
    if sys.argv[1:2] == ["--here"]:
        sys.exit(1 if sum([follow(page) for page in sys.argv[2:]]) else 0)
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / "berth"
        shutil.copytree(here, copy, symlinks=True, ignore=lambda folder, names: [
            name for name in names if Path(folder) == here / "build" and name != "release" or
            Path(folder) == here and name in ("runs", "nightly", "campaign-runs")])
        (copy / CALLED).write_text(BERTH)
        (copy / CALLED).chmod(0o755)
        mount = 'mount --make-rprivate / && mount --bind "$1" "$2" && cd "$2" && exec "${@:3}"'
        call = ["unshare", "-m" if os.geteuid() == 0 else "-rm", "bash", "-c", mount, "-", copy, here,
                sys.executable, "test/system/howto.py", "--here", *(sys.argv[1:] or PAGES)]
        sys.exit(subprocess.run(call).returncode)


main()
