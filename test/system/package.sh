#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Debian package holds all that a run needs: unpacked, for reading alone, it flies a procedure from another folder, as
# another user, to the log of the build that it was made of.   package.sh PROGRAMS
. "$(dirname "$0")/common.sh"
build=$(cd "$bin/.." && pwd)
unset BERTH_HOME

expect 0 cpack --config "$build/CPackConfig.cmake" -G DEB -B "$work/package"
package=$(ls "$work"/package/berth_*.deb)
for wanted in liblcm-bin libjs-three libjs-dygraphs libc6 libembree3; do
  dpkg-deb -f "$package" Depends | grep -q "$wanted" || fail "the package does not depend on $wanted"
done
dpkg-deb -x "$package" "$work/root"
grep -q '^ExecStart=/usr/bin/berth nightly' "$work/root/usr/lib/systemd/system/berth-nightly.service" ||
  fail "the unit does not start the package's program"
[ ! -e "$work/root/etc" ] || fail "something is enabled"
chmod -R a-w "$work/root"

# Root may write what is for reading alone.
mkdir "$work/elsewhere"
chmod 777 "$work/elsewhere"
chmod 755 "$work"
as_user=()
[ "$(id -u)" != 0 ] || as_user=(setpriv --reuid nobody --regid nogroup --clear-groups)
# user CODE ARGUMENTS...: berth of the package, as a user calls it.
user() {
  local wanted=$1
  shift
  (cd "$work/elsewhere" &&
    expect "$wanted" "${as_user[@]}" env HOME="$work/elsewhere" "$work/root/usr/bin/berth" "$@")
}
user 0 --version
user 0 check procedures
user 0 target check radarsat2
user 0 run --twin --seed 1 procedures/track_static.yaml
prints "verdict: PASS; reproduced from the log: identical"
[ -n "$(ls "$work/elsewhere/.cache/berth")" ] || fail "no compiled model is kept"
cat >"$work/plan.yaml" <<END
seeds: {fixed: 1, fresh: 0}
procedures:
  - procedure: $work/root/usr/share/berth/procedures/track_static.yaml
END
user 0 nightly ../plan.yaml
user 2 run --twin procedures/there_is_none.yaml

expect 0 "$bin/berth" run --twin --seed 1 --out "$work/build" procedures/track_static.yaml
expect 0 "$bin/berth" log diff "$(only_run "$work/elsewhere/runs")/run.lcm" "$(only_run "$work/build")/run.lcm"
prints "same"
chmod -R u+w "$work/root"
echo "$(basename "$package") runs as the build that it was made of"
