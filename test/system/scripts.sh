#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The procedures of the library and of the paper: each passes its check and passes in the twin, and fails when
# the instrument is at fault. Without arguments one seed each, the long ones shortened; SEEDS="1 2 3" takes
# these seeds and everything as it ships, the two surveys over attitude, too.
. "$(dirname "$0")/common.sh"
failed=()

# try CODE SEED PROCEDURE OPTIONS...: a run in the twin; what it said is shown when it ends otherwise.
try() {
  local wanted=$1 seed=$2 procedure=$3 code=0
  shift 3
  "$bin/berth" run --twin --seed "$seed" --out "$work/runs" "$procedure" "$@" >"$work/out.txt" 2>&1 || code=$?
  rm -rf "$work/runs"
  [ "$code" = "$wanted" ] && return
  tail -25 "$work/out.txt"
  echo "$procedure $*, seed $seed: exit code $code, expected $wanted"
  failed+=("$procedure")
}

# options NAME: what makes it short.
options() {
  case $1 in
    5_2_returns) echo "--set attitudes=2 --set enough=2" ;;
    5_3_2_static) echo "--set steps=8 --set enough=12" ;;
    fast_trajectory) echo "--set passes=1 --set enough=20" ;;
    tracking_survey) echo "--set survey=6s --set enough=50" ;;
  esac
}

# shortened SCRIPT: itself, or a copy with fewer values in its lists, whose length no --set changes.
shortened() {
  case $(basename "$1") in
    5_2_returns.yaml)
      sed 's/^  about_y: .*/  about_y: [15]/; s/^  about_z: .*/  about_z: [-25, 20]/' "$1" >"$work/5_2_returns.yaml"
      echo "$work/5_2_returns.yaml" ;;
    *) echo "$1" ;;
  esac
}

for script in procedures/library/*.yaml procedures/safety/*.yaml procedures/paper/5_*.yaml; do
  name=$(basename "$script" .yaml)
  "$bin/berth" check "$script" >"$work/out.txt" 2>&1 || { cat "$work/out.txt"; failed+=("check $script"); }
  case ${SEEDS:+all}$name in 5_2_acquisition | acquisition_survey) continue ;; esac
  for seed in ${SEEDS:-1}; do
    short=()
    flown=$script
    if [ -z "${SEEDS:-}" ]; then
      read -ra short <<<"$(options "$name")"
      flown=$(shortened "$script")
    fi
    wanted=0
    [ "$name" != emergency_stop ] || wanted=2  # an emergency stop ends a run in ERROR
    try $wanted "$seed" "$flown" ${short[@]+"${short[@]}"}
  done
done

# With the fault in its first step, a procedure must fail (1), not pass and not stop for another reason.
spoilt() {
  local name=$1 fault=$2 value=$3
  sed "0,/^steps:/s//steps:\n  - inject: {device: lidar, fault: $fault, value: $value}/" "$name" >"$(dirname "$name")/spoilt.yaml"
  try 1 1 "$(dirname "$name")/spoilt.yaml"
  rm "$(dirname "$name")/spoilt.yaml"
}
cp -r procedures "$work/procedures"
for name in fly_around health_check station_keeping; do
  spoilt "$work/procedures/library/$name.yaml" range_bias "60 mm"
done
spoilt "$work/procedures/paper/5_3_2_static.yaml" range_bias "60 mm"

[ ${#failed[@]} = 0 ] || fail "${failed[*]}"
