#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Programs are set up without the packages of the tests, and tests later in the same folder.
. "$(dirname "$0")/common.sh"

mkdir -p "$work/home" "$work/tools"
for entry in "$home"/*; do
  case $(basename "$entry") in build | runs | berth) ;; *) ln -s "$entry" "$work/home/" ;; esac
done
cp "$home/berth" "$work/home/"

# A machine where the packages of the lists are there, Catch2 only from `catch2` on, and nothing is compiled.
cmake=$(command -v cmake)
cat >"$work/tools/cmake" <<END
#!/bin/sh
[ -e "$work/catch2" ] || set -- "\$@" -DCMAKE_DISABLE_FIND_PACKAGE_Catch2=ON
exec $cmake -DCMAKE_MAKE_PROGRAM="$(command -v ninja)" -DCMAKE_DISABLE_FIND_PACKAGE_Catch2=OFF "\$@"
END
printf '#!/bin/sh\necho "$@" >>"%s/ninja.txt"\n' "$work" >"$work/tools/ninja"
printf '#!/bin/sh\necho "$@" >>"%s/ctest.txt"\n' "$work" >"$work/tools/ctest"
cat >"$work/tools/dpkg-query" <<'END'
#!/bin/sh
for package; do echo "ii  $package"; done
END
chmod +x "$work"/tools/*
export PATH=$work/tools:$PATH
unset BERTH_HOME

expect 0 "$work/home/berth" setup
grep -q "programs" "$work/ninja.txt" || fail "nothing was built"
grep -q '^BUILD_TESTING:BOOL=OFF' "$work/home/build/release/CMakeCache.txt" || fail "tests are configured"

touch "$work/catch2"
expect 0 "$work/home/berth" test -L unit
grep -q '^BUILD_TESTING:BOOL=ON' "$work/home/build/release/CMakeCache.txt" || fail "tests are not configured"
grep -q -- "-L unit" "$work/ctest.txt" || fail "no test was run"

# Configured with tests, it stays so.
expect 0 "$work/home/berth" setup
grep -q '^BUILD_TESTING:BOOL=ON' "$work/home/build/release/CMakeCache.txt" || fail "tests are gone"
