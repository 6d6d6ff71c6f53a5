#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# prove.sh [BERTH] [OUT]: clean nights raise no alarm, changes that change nothing raise none, deliberate regressions are
# caught. BERTH: the program, default build/release/bin/berth. OUT keeps the nights and their index.html.
# BERTH_MUTANT: a build with the sign of one angular velocity flipped; built here when not given.
set -euo pipefail
cd "$(dirname "$0")/../../../../.."
berth=${1:-build/release/bin/berth}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
out=${2:-$work/nights}
clean_nights=${CLEAN_NIGHTS:-20}
failed=0

# night CODE NAME PLAN [OPTIONS...]: a night that must end so.
night() {
  local wanted=$1 name=$2 plan=$3 code=0
  shift 3
  "${program:-$berth}" nightly "test/app/batch/nights/regressions/$plan.yaml" --out "$out" --night "$name" "$@" >"$work/said" 2>&1 || code=$?
  printf '%-24s exit %s (%s wanted)  %s\n' "$name" $code "$wanted" "$(grep -E '^[0-9]+ comparisons' "$work/said")"
  # Exit code 1 for any other reason is no proof.
  [ "$wanted" = 0 ] || grep -q ': REGRESSION$' "$work/said" || code=none
  if [ "$wanted" = 1 ]; then grep -E '^  (worse|changed) ' "$work/said" | head -4 || true; fi
  [ $code = "$wanted" ] || { cat "$work/said"; failed=1; }
}

# changed FILE EXPRESSION: the name of a configuration with this sed expression applied to one file.
changed() {
  local copy
  copy=$(mktemp -d "$work/config-XXXX")
  cp -r config/. "$copy"
  sed -i "$2" "$copy/$1"
  ! cmp -s "config/$1" "$copy/$1" || { echo "nothing changed in $1: $2" >&2; exit 2; }
  echo "$copy"
}

# The estimator's message says the opposite of what it means about one axis.
mutant() {
  [ -z "${BERTH_MUTANT:-}" ] || { echo "$BERTH_MUTANT"; return; }
  git archive --prefix=mutant/ HEAD | tar x -C "$work"
  sed -i 's/= tracker.velocity().angular\[i\];/= (i == 2 ? -1 : 1) * tracker.velocity().angular[i];/' \
    "$work/mutant/estimator/node/estimator_estimates.cpp"
  ! cmp -s estimator/node/estimator_estimates.cpp "$work/mutant/estimator/node/estimator_estimates.cpp" || exit 2
  (cd "$work/mutant" && CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 cmake --preset release -DBUILD_TESTING=OFF \
    ${CMAKE_CXX_COMPILER_LAUNCHER:+-DCMAKE_CXX_COMPILER_LAUNCHER=$CMAKE_CXX_COMPILER_LAUNCHER} &&
    CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 ninja -C build/release berth) >"$work/mutant.txt" 2>&1 ||
    { tail -20 "$work/mutant.txt" >&2; exit 2; }
  echo "$work/mutant/build/release/bin/berth"
}

echo "== clean nights with fresh seeds"
for i in $(seq "$clean_nights"); do night 0 "clean-$i" clean; done
night 0 reference regressions

echo "== other bits, the same estimator"
for ms in 4.99 5.01 5.02; do  # each beam 0.01 ms sooner or later: every number differs, none matters
  night 0 "start-delay-$ms" regressions --config "$(changed simulation_lidar.yaml "s/^start_delay: 5 ms/start_delay: $ms ms/")"
done

echo "== regressions"
night 1 noise-10-percent regressions --config "$(changed simulation_lidar.yaml 's/^noise_scale: 1 /noise_scale: 1.1 /')"
night 1 time-stamp-1-ms regressions --config "$(changed simulation.yaml 's/report_lag: 2 ms/report_lag: 3 ms/')"
built=$(mutant)
program=$built night 1 flipped-angular-velocity regressions
[ $failed = 0 ] && echo "proved"
exit $failed
