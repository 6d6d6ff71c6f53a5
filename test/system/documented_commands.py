#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""documented_commands.py BIN MAKE_CLOUD [PAGE...]: runs the documented commands and checks their effects

Of each block ```sh or ```console of README.md, CONTRIBUTING.md, examples/README.md, the pages in the
order of docs/README.md and those of docs/howto. A comment before the block has a line for each of its commands:
    CODE prints TEXT   exit code (or several: 0|1), and what its output must contain
    CODE file PATTERN  exit code, and a file that it must make
    howto: CODE ...    what the nightly test howto.py does
    not run: REASON    needs hardware, real time, another machine
or one line for the whole block. Each page has a home of its own: a copy of what Berth ships, run
directories `RUN`, `A`, `B`, `C`, clouds, meshes and configurations under the names that the pages use."""
import glob
import os
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HOME = Path.cwd()
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^ *```$", re.S | re.M)
MARK = re.compile(r"<!-- (?:commands\n)?((?:(?!-->).)*?)\s*-->\s*\Z", re.S)
LINE = re.compile(r"(howto: )?\d(\|\d)* (prints .+|file \S+)|not run: .+")
SHELL = ("sh", "console")


def pages():
    index = (HOME / "docs/README.md").read_text()
    listed = list(dict.fromkeys(re.findall(r"\]\(([a-z_]+\.md)\)", index)))
    unlisted = {path.name for path in HOME.glob("docs/*.md")} - {"README.md", *listed}
    if unlisted:
        sys.exit(f"docs/README.md: does not name {', '.join(sorted(unlisted))}")
    return ["README.md", "CONTRIBUTING.md", "examples/README.md", *("docs/" + name for name in listed), *sorted(
        str(path.relative_to(HOME)) for path in HOME.glob("docs/howto/*.md"))]


def commands(text, console):
    """Those of a block, each with the lines that continue it."""
    if console:
        text = "".join(line[2:] for line in text.splitlines(True) if line.startswith("$ "))
    return re.findall(r"\S(?:.*\\\n)*.*", text)


def blocks(page):
    """(place, command, expectation) of a page; exits where a block is not marked."""
    text = (HOME / page).read_text()
    for block in BLOCK.finditer(text):
        place = f"{page}:{text.count(chr(10), 0, block.start()) + 1}"
        if block[2] not in SHELL:
            if not block[2] and re.match(r"\s*(\$ |(\./)?berth |ssh |build/)", block[3]):
                sys.exit(f"{place}: these are commands: ```sh")
            continue
        mark = MARK.search(text[:block.start()])
        lines = [line.strip() for line in mark[1].splitlines()] if mark else []
        found = commands(block[3], block[2] == "console")
        if len(lines) == 1 and lines[0].startswith("not run:"):
            lines *= len(found)
        if len(lines) != len(found) or not all(LINE.fullmatch(line) for line in lines):
            sys.exit(f"{place}: {len(found)} commands, and {len(lines)} lines of what each must do before them")
        yield from ((place, *both) for both in zip(found, lines))


def write_stl(path, ply):
    """A binary STL of a binary PLY of doubles."""
    head, data = ply.read_bytes().split(b"end_header\n", 1)
    vertices, faces = (int(re.search(rb"element %s (\d+)" % name, head)[1]) for name in (b"vertex", b"face"))
    points = list(struct.iter_unpack("<3d", data[:24 * vertices]))
    triangles = [face[1:] for face in struct.iter_unpack("<B3i", data[24 * vertices:24 * vertices + 13 * faces])]
    with open(path, "wb") as file:
        file.write(bytes(80) + struct.pack("<I", faces))
        for triangle in triangles:
            file.write(struct.pack("<3f", 0, 0, 0) + b"".join(struct.pack("<3f", *points[i]) for i in triangle) + bytes(2))


class Homes:
    """A home for each page."""

    def __init__(self, root, binaries, make_cloud):
        self.root, self.bin = root, binaries
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(root / "cache"),
                                XDG_RUNTIME_DIR=str(root / "runtime"), BERTH_WRITE_DOCS="",
                                LCM_DEFAULT_URL=f"udpm://239.255.76.67:{30000 + os.getpid() % 5000}?ttl=0",
                                PATH=f"{binaries}:{os.environ['PATH']}")
        (root / "runtime").mkdir()
        self.first = root / "first"
        self.ship(self.first)
        self.make(self.first, make_cloud)

    def ship(self, home):
        home.mkdir()
        for name in ("config", "examples", "procedures", "targets"):
            shutil.copytree(HOME / name, home / name)
        for name in ("app", "lcmtypes"):
            (home / name).symlink_to(HOME / name)
        (home / "berth").symlink_to(self.bin / "berth")
        (home / "build").mkdir()
        (home / "build/release").symlink_to(self.bin.parent)

    def call(self, home, command):
        environment = dict(self.environment, BERTH_HOME=str(home), HOME=str(home))
        return subprocess.run(command, cwd=home, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=180)

    def make(self, home, make_cloud):
        def must(*command):
            done = self.call(home, command)
            if done.returncode != 0:
                sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}")
        must("berth", "run", "--twin", "--world", "exact", "procedures/library/health_check.yaml")
        (run,) = (home / "runs").iterdir()
        run.rename(home / "runs/RUN")
        shutil.copy(home / "runs/RUN/run.lcm", home / "bad.lcm")
        devices = home / "config/devices.yaml"  # at ports below 1024, where nothing listens
        devices.write_text(devices.read_text().replace("127.0.0.1:150", "127.0.0.1:1"))
        shutil.copytree(home / "config", home / "my_config")
        shutil.copy(home / "config/layouts/range.yaml", home / "my_config/layouts/my_layout.yaml")
        shutil.copy(home / "config/estimator.yaml", home / "my_estimator.yaml")
        must(make_cloud, "0", "0", "6000", "0", "20", "90", "scan.ptx", "scan.xyz")
        points = [line for line in (home / "scan.xyz").read_text().splitlines() if line[:1] in "-0123456789"]
        rows = "\n".join(" ".join(re.split(r"[ ,;]+", line)[:3]) for line in points) + "\n"
        (home / "scan3.csv").write_text(rows)
        (home / "scan.pcd").write_text("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
                                       f"WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n{rows}")
        (home / "scan2.ply").write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\n"
                                        f"property float y\nproperty float z\nend_header\n{rows}")
        shutil.copy(home / "scan.pcd", home / "scan1.pcd")
        (home / "my_scans").mkdir()
        for number in range(9):
            shutil.copy(home / "scan.pcd", home / f"my_scans/{number}.pcd")
        for name in ("your_mesh.stl", "my_satellite.stl"):
            write_stl(home / name, home / "targets/radarsat2/target.ply")
        shutil.copy(home / "targets/relay/relay.obj", home / "my_satellite.obj")
        (home / "plan.yaml").write_text("name: small\nseeds: {fixed: 1, fresh: 0}\nprocedures:\n"
                                        "  - {procedure: procedures/library/health_check.yaml, name: approach, worlds: [exact]}\n")
        must("berth", "nightly", "plan.yaml", "--out", "nightly")
        history = sqlite3.connect(home / "nightly/history.sqlite")
        history.execute("UPDATE night SET name = '2026-11-21'")
        history.commit()
        history.close()

    def of(self, page, listed):
        home = self.root / page.replace("/", "_")
        shutil.copytree(self.first, home, symlinks=True, copy_function=os.link)
        shutil.rmtree(home / "config")  # what a command may write into
        shutil.copytree(self.first / "config", home / "config")
        for name in "ABC":
            if any(re.search(rf"\b{name}\b", command) for _, command, _ in listed):
                shutil.copytree(home / "runs/RUN", home / "runs" / name, symlinks=True, copy_function=os.link)
        return home


def judge(homes, home, command, expectation):
    """What is wrong, or nothing."""
    code, kind, expected = expectation.split(" ", 2)
    before = {}
    if kind == "file":
        before = {path: os.stat(path).st_mtime_ns for path in glob.glob(str(home / expected))}
    try:
        done = homes.call(home, ["bash", "-c", command])
    except subprocess.TimeoutExpired:
        return "more than 180 s"
    output = done.stdout
    if str(done.returncode) not in code.split("|"):
        return f"exit code {done.returncode}, expected {code}\n{output[-2000:]}"
    if kind == "prints" and expected not in output:
        return f"its output does not contain '{expected}'\n{output[-2000:]}"
    written = glob.glob(str(home / expected)) if kind == "file" else []
    if kind == "file" and all(before.get(path) == os.stat(path).st_mtime_ns for path in written):
        return f"makes no file {expected}\n{output[-2000:]}"
    return ""


def act(homes, page, listed):
    """Prints what a page's commands do. Returns how many ran, failed and were left out."""
    home, ran, faults, text = None, 0, 0, ""
    for place, command, expectation in listed:
        if expectation.startswith(("not run:", "howto:")):
            text += f"{expectation}: {place}: {command}\n"
            continue
        home = home or homes.of(page, listed)
        begun = time.monotonic()
        fault = judge(homes, home, command, expectation)
        text += f"{'FAILED' if fault else 'ok'} {time.monotonic() - begun:.1f} s: {place}: {command}\n"
        text += f"  {fault}\n" if fault else ""
        ran, faults = ran + 1, faults + bool(fault)
    print(text, end="", flush=True)
    return ran, faults, len(listed) - ran


def main():
    binaries, make_cloud = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    every = [(page, list(blocks(page))) for page in sys.argv[3:] or pages()]
    root = Path(tempfile.mkdtemp())
    try:
        homes = Homes(root, binaries, make_cloud)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            counts = list(pool.map(lambda page: act(homes, *page), every))
    finally:
        shutil.rmtree(root)
    ran, faults, left = map(sum, zip(*counts))
    print(f"{ran} commands run, {faults} failed, {left} not run")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
