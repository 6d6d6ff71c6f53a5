#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What ten viewers at 20 frames a second cost the control loops: an approach in the cell of processes without the
# console and with it, the arms' read cycles of both side by side; and a viewer that reads too slowly gets fewer frames.
#   test/system/console_load.sh BIN VIEWERS-PROGRAM [PROCEDURE [TABLE]]: TABLE is that of test/benchmarks/runs.md
. "$(dirname "$0")/common.sh"
viewers=$2
procedure=${3:-procedures/approach.yaml}
table=${4:-$work/table.md}
slow_bytes_per_s=20000

# Seconds of processor time that a process has had.
cpu_of() { awk -v hz="$(getconf CLK_TCK)" '{sub(/.*\) /, ""); print ($12 + $13) / hz}' "/proc/$1/stat"; }

# cycles RUN ARM LABEL: what the arm's driver measured between its reads, ms; a row of the table.
cycles() {
  rm -rf "$work/csv"
  "$bin/berth" log export "$1" --csv "$work/csv" --channels "ARM_STATE_$2" >/dev/null
  awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) { if ($i ~ /^cycle_s/) cycle = i; if ($i ~ /^reads_missed/) missed = i } next }
    $cycle > 0 { print 1e3 * $cycle; lost = $missed } END { print "missed", lost > "/dev/stderr" }' \
    "$work/csv/ARM_STATE_$2.csv" 2>"$work/missed" | sort -g >"$work/cycles"
  awk -v missed="$(cut -d" " -f2 "$work/missed")" -v label="$3" -v table="$table" '{ v[NR] = $1; sum += $1; square += $1 * $1 } END { mean = sum / NR
    sigma = sqrt(square / NR - mean * mean)
    printf "%6d reads  mean %6.3f  sigma %6.3f  50 %% %6.3f  99 %% %6.3f  99.9 %% %6.3f  max %7.3f ms  missed %d\n", NR, mean,
      sigma, v[int(NR * .5) + 1], v[int(NR * .99) + 1], v[int(NR * .999) + 1], v[NR], missed
    printf "| %s | %d | %.3f ms | %.2f ms | %.2f ms | %.1f ms | %d |\n", label, NR, sigma, v[int(NR * .99) + 1],
      v[int(NR * .999) + 1], v[NR], missed >>table }' "$work/cycles"
}

# one_run NAME OPTION...: to its verdict, whatever it is; a busy machine may make it fail.
one_run() {
  local name=$1
  shift
  "$bin/berth" run --out "$work/$name" --lcm-url "$url" "$procedure" "$@" >"$work/$name.txt" 2>&1
}

ended() { [ "$1" = 0 ] || echo "$2: exit code $1: $(grep -v "^ *$" "$work/$2.txt" | tail -3 | tr "\n" "|")"; }

code=0
one_run without --no-console || code=$?
ended $code without

one_run with &
runner=$!
for _ in $(seq 300); do
  address=$(cat "$work"/with/*/output/console.url 2>/dev/null) && [ -n "$address" ] && break
  sleep 0.1
done
[ -n "${address:-}" ] || { cat "$work/with.txt"; fail "no console came up"; }
console=$(pgrep -f "berth-console --run $work/with")
sleep 10 # until the devices are up and something moves
seconds=60
before=$(cpu_of "$console")
"$viewers" "$(sed 's|.*:\([0-9]*\)/|\1|' <<<"$address")" 10 $seconds $slow_bytes_per_s >"$work/viewers.txt" ||
  fail "the viewers were not served"
after=$(cpu_of "$console")
code=0
wait $runner || code=$?
ended $code with

printf '| | reads | sigma | 99 %% | 99.9 %% | longest | missed |\n|---|---|---|---|---|---|---|\n' >"$table"
for arm in REPLICA SENSOR; do
  for name in without with; do
    label="${arm,,} arm, $([ $name = with ] && echo ten viewers || echo without)"
    printf '%-8s %-8s %s\n' "$name" "$arm" "$(cycles "$(only_run "$work/$name")" $arm "$label")"
  done
done
cat "$work/viewers.txt"
awk -v a="$before" -v b="$after" -v s=$seconds 'BEGIN { printf "berth-console: %.1f %% of one core while they look\n", 100 * (b - a) / s }'
# Ten are served at about 20 a second, the slow one less, and the busiest machine serves some.
awk '$1 == "viewer" { n++; sum += $2 } $1 == "slow" { slow = $3 }
  END { if (n != 10 || sum / n < 5 || slow >= sum / n / 2) { print "FAILED: frames"; exit 1 } }' "$work/viewers.txt"
