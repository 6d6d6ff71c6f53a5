#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Simulated cells 5 mm, 0.5 degrees and 20 ms wrong (config/worlds) are calibrated; then truth is compared with the world
# on poses that were not fitted. Usage: calibrate.sh BIN; SEEDS="1 2 ..." chooses the worlds.
set -euo pipefail
bin=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# world, basis, options of the calibration, median mm and degrees and ms that truth must keep within
part() {
  local world=$1 basis=$2 most_mm=$3 most_deg=$4 most_ms=$5
  local options=("--world" "$world")
  shift 5
  for seed in ${SEEDS:-1 2 3 4 5}; do
    local at=$work/$world-$basis-$seed
    "$bin/berth" calibrate --twin --seed "$seed" "${options[@]}" --out "$at" --to "$at.yaml" "$@" >"$work/log" ||
      { tail -20 "$work/log"; return 1; }
    "$bin/berth" run procedures/library/truth_check.yaml --twin --seed "$seed" "${options[@]}" \
      --calibration "$at.yaml" --out "$at-check" >"$work/log" || { tail -20 "$work/log"; return 1; }
    "$bin/berth" calibrate --check "$at-check"/* | tail -1 |
      awk -v world="$world" -v seed="$seed" -v basis="$basis" -v mm="$most_mm" -v deg="$most_deg" -v ms="$most_ms" '
        { good = $4 <= mm && $6 <= deg && $8 <= ms && -$8 <= ms && $2 == basis
          printf "%-7s seed %2d  %-7s  median %6.3f mm (95 %% %6.3f)  %7.4f deg (%7.4f)  %6.2f ms  %s\n",
                 world, seed, $2, $4, $5, $6, $7, $8, good ? "good" : "TOO FAR"; exit !good }' || return 1
    rm -rf "$at" "$at-check"
  done
}

part wrong scans 0.5 0.03 2
part biased tracker 0.5 0.03 2 --with-tracker
