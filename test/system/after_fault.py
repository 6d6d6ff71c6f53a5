#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""after_fault.py RUN UTIME: what a run in processes shows of a fault at UTIME (us).

One line, with tabs between: after how many ms the replica braked for good (slower than nine tenths of its greatest
speed since) and stood, in the simulated world; 'never' when it went on, 'unknown' when the record of the world ends;
and the first warning or error since.
"""
import json
import os
import struct
import sys

def speeds(path):
    """(utime, m/s plus rad/s) of every sample of ground_truth_t in an LCM log."""
    with open(path, "rb") as log:
        data = log.read()
    at = 0
    while at + 28 <= len(data):
        sync, _, _, channel, size = struct.unpack_from(">IqqII", data, at)
        if sync != 0xEDA1DA01:
            break
        body = at + 28 + channel
        at = body + size
        if at > len(data):
            break
        utime = struct.unpack_from(">q", data, body + 8)[0]
        v = struct.unpack_from(">6d", data, body + 8 + 24 + 24 + 32 + 288)
        yield utime, sum(x * x for x in v[:3]) ** 0.5 + sum(x * x for x in v[3:]) ** 0.5

def stopping(samples, fault):
    after = [(t, v) for t, v in samples if t >= fault]
    if not after or after[-1][0] < fault + 2000000:
        return "unknown", "unknown"
    if after[-1][1] > 1e-4:
        return "never", "never"
    greatest = max(v for _, v in after)
    braking = max((t for t, v in after if v >= 0.9 * greatest and greatest > 1e-4), default=fault)
    standing = max((t for t, v in after if v > 1e-4), default=fault)
    return f"{(braking - fault) / 1e3:.0f}", f"{(standing - fault) / 1e3:.0f}"

def first_words(path, fault):
    """The cell's report of it; the reaction of the supervisor and the procedure comes later."""
    if not os.path.exists(path):  # a cell without a procedure
        return ""
    with open(path) as lines:
        events = [json.loads(line) for line in lines]
    bad = [e for e in events if e["utime"] >= fault and e["severity"] in ("WARNING", "ERROR", "FATAL")]
    of_cell = [e for e in bad if e["node"] not in ("supervisor", "procedure")]
    return next((f"`{e['code']}`: {e['text']}" for e in of_cell + bad), "")

def main():
    run, fault = sys.argv[1], int(sys.argv[2])
    braking, standing = stopping(speeds(os.path.join(run, "world_truth.lcm")), fault)
    print(braking, standing, first_words(os.path.join(run, "events.jsonl"), fault), sep="\t")

main()
