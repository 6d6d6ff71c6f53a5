# SPDX-License-Identifier: BSD-3-Clause
# For the system tests: sourced with the directory of the programs as $1.
set -euo pipefail
bin=$1
home=$PWD
export BERTH_HOME=$home
work=$(mktemp -d)
export XDG_RUNTIME_DIR=$work/runtime
mkdir -p "$XDG_RUNTIME_DIR"
# Ports of this test process alone.
port=$((20000 + $$ % 10000))
url="udpm://239.255.76.67:$port?ttl=0"
trap 'status=$?; pkill -KILL -f "$work" || true; [ $status = 0 ] && rm -rf "$work" || echo "left in $work"' EXIT

fail() { echo "FAILED: $*"; exit 1; }

# expect CODE COMMAND...: runs it, and fails unless it exits so.
expect() {
  local wanted=$1 code=0
  shift
  "$@" >"$work/out.txt" 2>&1 || code=$?
  [ "$code" = "$wanted" ] || { cat "$work/out.txt"; fail "exit code $code, expected $wanted: $*"; }
}

# prints TEXT: the last output must contain it.
prints() { grep -qF -- "$1" "$work/out.txt" || { cat "$work/out.txt"; fail "not in the output: $1"; }; }

only_run() { ls -d "$1"/*/ | head -1; }

now() { echo $(($(date +%s%N) / 1000)); }

# watch_machine: from now on it is noted when this machine lets a process sleep 20 ms longer than requested.
watch_machine() {
  python3 - "$work/late.txt" <<'PYTHON' &
import sys, time
with open(sys.argv[1], "w", buffering=1) as late:
    while True:
        before = time.monotonic()
        time.sleep(0.01)
        beyond = 1e3 * (time.monotonic() - before) - 10
        if beyond > 20:
            print(int(time.time() * 1e6), f"{beyond:.0f}", file=late)
PYTHON
  disown
}

# was_late SINCE: how often since that utime, and by how much; nothing where it was not. Real time cannot be judged then.
was_late() {
  awk -v since="$1" '$1 >= since { ++n; if ($2 > most) most = $2 }
    END { if (n) printf "%d times late by up to %d ms", n, most }' "$work/late.txt"
}
