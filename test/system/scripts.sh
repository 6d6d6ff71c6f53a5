#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every script that ships passes in the twin, and fails where it must. SEEDS: how many seeds each ("1" standard).
. "$(dirname "$0")/common.sh"
seeds=${SEEDS:-1}
failed=()

# try CODE SEED PROCEDURE OPTIONS...: one run; what it said is shown when it ends otherwise.
try() {
  local wanted=$1 seed=$2 procedure=$3 code=0
  shift 3
  "$bin/berth" run --twin --seed "$seed" --out "$work/runs" "$procedure" "$@" >"$work/out.txt" 2>&1 || code=$?
  rm -rf "$work/runs"
  [ "$code" = "$wanted" ] && return 0
  tail -30 "$work/out.txt"
  echo "FAILED: $procedure $* with seed $seed: exit code $code, expected $wanted"
  failed+=("$procedure/$seed")
}

# Shorter than as they ship, where that says as much.
declare -A shorter=(
  [paper/5_2_acquisition]="--set about_x=[10] --set about_y=[-20,20] --set about_z=[-60,0,60] --set enough=5"
  [paper/5_3_2_static]="--set steps=8 --set enough=15"
)
# What each cannot pass with: a limit that is too hard, or a fault of the instrument.
declare -A impossible=(
  [library/calibration_check]="--set offset=0.1mm"
)

for script in procedures/library/*.yaml procedures/paper/5_*.yaml; do
  name=${script#procedures/}
  name=${name%.yaml}
  for seed in $(seq "$seeds"); do
    options=()
    [ "$seeds" = 1 ] && read -ra options <<<"${shorter[$name]:-}"
    try 0 "$seed" "$script" ${options[@]+"${options[@]}"}
  done
done
[ ${#failed[@]} = 0 ] || fail "${failed[*]}"
