#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# berth log on the log of a run: sound as recorded; damaged, mended, cut, filtered, exported, compared.
. "$(dirname "$0")/common.sh"

"$bin/berth" run --twin --world exact --seed 3 --out "$work/a" procedures/track_static.yaml >/dev/null || true
"$bin/berth" run --twin --world exact --seed 4 --out "$work/b" procedures/track_static.yaml >/dev/null || true
a=$(only_run "$work/a")
b=$(only_run "$work/b")

expect 0 "$bin/berth" log check "$a"
prints "ok"
expect 0 "$bin/berth" log info "$a"
prints "ground_truth_t"
expect 0 "$bin/berth" log info --json "$a"
prints '"sound": true'

# Damage in the middle and a tail cut off.
size=$(stat -c %s "$a/run.lcm")
head -c $((size - 7)) "$a/run.lcm" >"$work/bad.lcm"
printf 'rubbish rubbish rubbish' | dd of="$work/bad.lcm" bs=1 seek=$((size / 2)) conv=notrunc status=none
expect 1 "$bin/berth" log check "$work/bad.lcm"
prints "byte"
expect 0 "$bin/berth" log repair "$work/bad.lcm" "$work/mended.lcm"
prints "left out"
expect 0 "$bin/berth" log check --ignore-gaps "$work/mended.lcm"
expect 2 "$bin/berth" log repair "$work/bad.lcm" "$work/mended.lcm"

expect 0 "$bin/berth" log cut "$a" --from 5 --to "10 s" --out "$work/cut.lcm"
expect 0 "$bin/berth" log check "$work/cut.lcm"
expect 0 "$bin/berth" log cut "$a" --from run --to run --keep 'RUN_INFO|PROCEDURE_STATE' --out "$work/phase.lcm"
expect 2 "$bin/berth" log cut "$a" --from nowhere --out "$work/none.lcm"
prints "acquire"
expect 0 "$bin/berth" log filter "$a" --exclude 'ARM_.*|HEARTBEAT' --out "$work/filtered.lcm"
expect 0 "$bin/berth" log check "$work/filtered.lcm"
expect 1 "$bin/berth" log diff "$a" "$work/filtered.lcm"
expect 0 "$bin/berth" log diff "$a" "$work/filtered.lcm" --channels 'GROUND_TRUTH|POSE_ESTIMATE'
expect 0 "$bin/berth" log diff "$a" "$a"
expect 1 "$bin/berth" log diff "$a" "$b" --ignore-times
prints "DIFFERENT"

expect 0 "$bin/berth" log export "$a" --csv "$work/csv" --clouds "$work/clouds" --mcap "$work/run.mcap"
head -1 "$work/csv/GROUND_TRUTH.csv" | grep -qF 'position_m[0] [m]' || fail "no units in the header"
[ "$(head -c 5 "$work/run.mcap" | tail -c 4)" = MCAP ] || fail "no MCAP"
expect 2 "$bin/berth" log export "$a" --csv "$work/csv"
cloud=$(ls "$work"/clouds/*.pcd | tail -1)
expect 0 "$bin/berth" log export "$a" --clouds "$work/ply" --format ply
[ "$(ls "$work"/ply/*.ply | wc -l)" = "$(ls "$work"/clouds/*.pcd | wc -l)" ] || fail "PLY and PCD differ in number"
export XDG_CACHE_HOME=$work/cache
"$bin/berth" estimate --target radarsat2 "$cloud" >"$work/out.txt" 2>/dev/null || true
grep -q '"points":1000,"returns":1000' "$work/out.txt" || { cat "$work/out.txt"; fail "berth estimate does not read the cloud"; }

echo "not a log" >"$work/text.lcm"
expect 1 "$bin/berth" log check "$work/text.lcm"
expect 2 "$bin/berth" log check "$work/nowhere.lcm"
printf 'struct t {\n int8_t a\n}' >"$work/bad_type.lcm"
expect 2 "$bin/berth" log info "$a" --types "$work/bad_type.lcm"
prints "bad_type.lcm:3"

# A run's own types are used, and the shipped ones where they cannot be.
printf 'struct t {\n int8_t a\n}' >"$a/types/bad.lcm"
expect 0 "$bin/berth" log info "$a"
prints "types/bad.lcm:3"
