#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# berth estimate: poses of the replica from files, one JSON object each, errors by name.
. "$(dirname "$0")/common.sh"
make_cloud=$2
export XDG_CACHE_HOME=$work/cache

# field NAME: of each line of the last standard output.
field() { sed -n "s/.*\"$1\":\"\\([^\"]*\\)\".*/\\1/p" "$work/json" | xargs; }
# estimate CODE OPTIONS...: objects into $work/json, the rest into $work/out.txt.
estimate() {
  local wanted=$1 code=0
  shift
  "$bin/berth" estimate "$@" >"$work/json" 2>"$work/out.txt" || code=$?
  [ "$code" = "$wanted" ] || { cat "$work/json" "$work/out.txt"; fail "exit code $code, expected $wanted: $*"; }
}
is() { [ "$1" = "$2" ] || { cat "$work/json"; fail "found '$1', expected '$2'"; }; }

pose="100 -230 6000 25 20 -30"
"$make_cloud" $pose "$work/a.ptx" "$work/b.xyz" "$work/c d.xyz"
echo "1 2 three" >"$work/bad.xyz"
printf '%s\n' 'nan nan nan' '0 0 0' '1 2 9' >"$work/few.xyz"

estimate 0 --target radarsat2 "$work/a.ptx" "$work/b.xyz" "$work/c d.xyz"
prints "compiling radarsat2"
is "$(field status)" "ok ok ok"
is "$(wc -l <"$work/json")" 3
# x within 20 mm of the truth, in all
sed 's/.*"xyzwpr":\[\([^]]*\)\].*/\1/' "$work/json" |
  awk -F, '{d = $1 - 100; if (d * d > 400) exit 1; d = $4 - 25; if (d * d > 1) exit 1}' || { cat "$work/json"; fail "wrong pose"; }

# A bad file is told on stderr and by an object of its own; the others go on. The model is compiled once.
estimate 2 --target radarsat2 "$work/bad.xyz" "$work/few.xyz" "$work/nowhere.pcd" "$work/a.ptx"
prints "bad.xyz:1: found 'three' for z, expected a number"
prints "nowhere.pcd: no such file"
! grep -q compiling "$work/out.txt" || fail "compiled again"
is "$(field status)" "error lost error ok"
grep -q '"not_finite":1,"at_sensor":1' "$work/json" || fail "dropped points are not counted"

estimate 1 --target radarsat2 "$work/few.xyz"
printf 'nan nan nan\n0 0 0\n0 0 0\n' >"$work/none.xyz"
estimate 1 --target radarsat2 "$work/none.xyz"
is "$(field reason)" "every point dropped: 1 of 3 have a coordinate that is missing or no number, 2 are at the sensor (0 0 0)"

# Files as other programs write them; none of them stops the batch.
awk '{printf "%d,%.1f,%.1f,%.1f,50\n", NR - 1, 1e3 * $1, 1e3 * $2, 1e3 * $3}' "$work/b.xyz" >"$work/rows"
{ printf '\357\273\277,"X (mm)","Y (mm)","Z (mm)",intensity\r\n'; sed 's/$/\r/' "$work/rows"; } >"$work/mm.csv"
{ echo 'sep=;' && cut -d, -f2-4 "$work/rows" | sed 's/,/;/g; s/\./,/g; 1i x_mm;y_mm;z_mm'; } >"$work/comma.csv"
cut -d, -f2-4 "$work/rows" | tr ',' ' ' >"$work/no_unit.xyz"
awk '{print; print}' "$work/b.xyz" >"$work/twice.xyz"
printf 'ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n1\n' >"$work/bad.ply"
estimate 2 --target radarsat2 --noise '5 mm,0.1 mrad' "$work/b.xyz" "$work/mm.csv" "$work/bad.ply" "$work/comma.csv" "$work/no_unit.xyz" "$work/twice.xyz"
is "$(field status)" "ok ok error ok lost ok"
sed -n 5p "$work/json" | grep -q 'are its coordinates in mm?' || { cat "$work/json"; fail "no hint"; }
! grep -q 'noise is taken to be' "$work/json" || fail "a note of a noise that was given"
pose_and_covariance() { sed -n "$1p" "$work/json" | sed 's/.*\("T_sensor_model".*\),"hypotheses".*/\1/'; }
is "$(pose_and_covariance 6)" "$(pose_and_covariance 1)"
estimate 0 --target radarsat2 --initial 90,-220,6010,25,21,-30 "$work/b.xyz" "$work/c d.xyz"
is "$(field status)" "ok ok"
grep -q 'noise is taken to be that of ilris_3d' "$work/json" || fail "no note of the noise"
estimate 0 --target radarsat2 --initial 90,-220,6010,25,21,-30 --json-indent 1 "$work/b.xyz"
grep -q '"acquisition": null' "$work/json" || fail "acquired although a pose was given"
estimate 0 --target radarsat2 --initial -900,-220,9010,-25,21,150 "$work/b.xyz"
grep -q 'lost when tracked from the initial pose' "$work/json" || { cat "$work/json"; fail "no note"; }

estimate 2 --target radarsat2
estimate 2 "$work/a.ptx"
estimate 2 --target nothing.stl "$work/a.ptx"
prints "nothing.stl"
printf 'v 0 0 0\nv 3 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n' >"$work/half.obj"
estimate 2 --target "$work/half.obj" "$work/a.ptx"
prints "half.obj:5: vertex 4 does not exist"
estimate 2 --target radarsat2 --initial 1,2,3 "$work/a.ptx"
estimate 2 --target radarsat2 --length -3 "$work/a.ptx"
estimate 2 --target radarsat2 --noise '5 kg' "$work/a.ptx"
prints "--noise: found '5 kg', expected a length"
estimate 2 --target radarsat2 --gate 5,4 "$work/a.ptx"
prints "--gate"
estimate 2 --target radarsat2 --config nowhere "$work/a.ptx"
