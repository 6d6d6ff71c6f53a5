#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A closed loop in the cell of processes, built for the thread sanitizer: loops, receiving threads and workers share
# nothing unguarded. Called with the directory of such programs. The verdict is none of its business: all is slow.
. "$(dirname "$0")/common.sh"

# These libraries are not built for the sanitizer: it does not see how their threads wait for each other.
printf 'called_from_lib:%s\n' libembree3.so libtbb.so liblcm.so libglib-2.0.so >"$work/suppressions"
printf 'race:%s\n' libglib-2.0.so liblcm.so >>"$work/suppressions"
export TSAN_OPTIONS="suppressions=$work/suppressions log_path=$work/race"
"$bin/berth" run --no-check --no-console --out "$work/runs" --lcm-url "$url" \
  --set standoff="5 m" test/system/under_way.yaml || true
run=$(only_run "$work/runs")
grep -q motion-begins "$run/events.jsonl" || fail "no motion was planned"
grep -aq POSE_ESTIMATE "$run/run.lcm" || fail "nothing was estimated"
reports=$(find "$work" -name "race.*")
[ -z "$reports" ] || { cat $reports; fail "the thread sanitizer has something to tell"; }
