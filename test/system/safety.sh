#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Faults of processes and of the machine, in the cell of processes, while the arms approach: a node killed or stopped,
# the recorder killed, the disk full, the clock stepped, packets lost, yesterday's log played. Called with the directory
# of the programs, that of the preloaded library, and perhaps a file for the table and the cases wanted (all).
[ -n "${BERTH_MAY_MOUNT:-}" ] || BERTH_MAY_MOUNT=1 exec unshare -Urm "$0" "$@"
. "$(dirname "$0")/common.sh"
machine=$2/libbroken_machine.so
table=${3:-$work/table.md}
wanted=${*:4}
failed=()
attempts=3

watch_machine
trap 'status=$?; umount "$work"/full* 2>/dev/null || true; pkill -KILL -f "$work" || true; [ $status = 0 ] && rm -rf "$work" || echo "left in $work"' EXIT

# begin NAME [COMMAND...]: a run of its own, by COMMAND if there is one; returns when both arms are under way, or says
# why they are not.
begin() {
  name=$1
  shift
  port=$((port + 1))
  url="udpm://239.255.76.67:$port?ttl=0"
  out=$work/$name
  begun=$(now)
  at=$begun
  mkdir -p "$out"
  "$@" "$bin/berth" run --no-check --no-console --out "$out" --lcm-url "$url" test/system/under_way.yaml \
    >"$work/$name.txt" 2>&1 &
  berth=$!
  for _ in $(seq 600); do
    run=$(only_run "$out" 2>/dev/null) || run=
    [ -n "$run" ] && grep -aq closed-loop "$run/run.lcm" 2>/dev/null && break
    kill -0 $berth 2>/dev/null || break
    sleep 0.1
  done
  sleep 5
  kill -0 $berth 2>/dev/null && return
  wait $berth || true
  why="the run ended before it was under way: $(grep -h '^verdict' "$work/$name.txt" || tail -1 "$work/$name.txt")"
  return 1
}

# judge FAULT BOUND TEXT: waits for the end. It must have braked within BOUND ms ('-': it need not), and the events or
# the program must say TEXT. Says why it is not so; else it writes the row.
judge() {
  local fault=$1 bound=$2 text=$3 braking standing words verdict
  wait $berth || true
  words=
  # Where the fault shows only later, times count from its first sign.
  [ -z "${sign:-}" ] || at=$(grep -F -m1 -- "$sign" "$run/events.jsonl" | grep -o '"utime": *[0-9]*' | grep -o '[0-9]*$') || at=$begun
  IFS=$'\t' read -r braking standing words < <("$home/test/system/after_fault.py" "$run" "$at") || true
  verdict=$(grep -h "^verdict" "$work/$name.txt" | sed "s/^verdict: //; s/; the .*//; s/; reproduced.*//; s/; DIFFERS.*//")
  # The record may have ended with what was done to it.
  : "${words:=$(grep -hF -m1 -- "$text" "$work/$name.txt" | grep -v '^verdict' | sed 's/^ *[0-9.]* s *[A-Z]* *//' || true)}"
  if ! grep -qF -- "$text" "$work/$name.txt" "$run/events.jsonl"; then
    why="nothing said of: $text ($verdict)"
  elif [ "$bound" != - ] && { [[ $braking =~ [a-z] ]] || [ "$braking" -gt "$bound" ]; }; then
    why="braking after $braking ms, not within $bound"
  else
    [ "$verdict" != PASS ] || { braking="goes on" && standing="goes on"; }
    printf '| %s | %s | %s | %s | %s |\n' "$fault" "${words:-nothing}" "$braking" "$standing" "$verdict" | tee -a "$table"
    return 0
  fi
  return 1
}

# inject NAME FAULT BOUND TEXT HOW [COMMAND...]: HOW, called when both arms are under way. What fails while this
# machine leaves processes waiting is tried again.
inject() {
  local case=$1 fault=$2 bound=$3 text=$4 how=$5 attempt late
  shift 5
  [[ -z $wanted || " $wanted " == *" $case "* ]] || return 0
  for attempt in $(seq $attempts); do
    why="it could not be injected"
    begin "$case$attempt" "$@" && at=$(now) && $how && judge "$fault" "$bound" "$text" && return
    late=$(was_late "$begun")
    echo "$fault: $why${late:+ (this machine was $late)}"
    [ -n "$late" ] || break
  done
  failed+=("$fault: $why")
}

pid_of() { pgrep -f -- "berth-$1 --run ${run%/}" | head -1; }
kill_node() { kill -KILL "$(pid_of "$node")"; }
stop_node() { kill -STOP "$(pid_of "$node")"; }
# A thread of the node, its loop's or its worker's, in an endless loop from now on.
loop_in() {
  local pid thread
  pid=$(pid_of "$node")
  thread=$(grep -lx "$1" /proc/"$pid"/task/*/comm | head -1 | cut -d/ -f5)
  at=$(python3 -c "import ctypes, signal, time
print(time.time_ns() // 1000)
raise SystemExit(ctypes.CDLL(None).syscall(234, $pid, $thread, signal.SIGUSR2))  # tgkill")
}
loop_in_handler() { loop_in "$(cut -c1-15 <<<"berth-$node")"; }
loop_in_worker() { loop_in worker; }
kill_recorder() { kill -KILL "$(pgrep -f -- "lcm-logger.*${run%/}" | head -1)"; }
fill_disk() {
  dd if=/dev/zero of="$out/ballast" bs=1M 2>"$work/dd.txt" || true
  at=$(now)
}
step_clock() {
  python3 -c "import struct, sys; open(sys.argv[1], 'r+b').write(struct.pack('<q', -3600 * 1000000))" "$work/step"
}
play_yesterday() { lcm-logplayer --lcm-url="$url" "$yesterday/run.lcm" >"$work/player.txt" 2>&1 & }

# Before a program's name: on a machine that is so. A run wants 2 GB to begin.
on_small_disk() { mount -t tmpfs -o size=2200m none "$out" && "$@"; }
with_own_clock() {
  printf '\0\0\0\0\0\0\0\0' >"$work/step"
  LD_PRELOAD=$machine BERTH_TEST_CLOCK=$work/step "$@"
}
that_may_loop() { LD_PRELOAD=$machine BERTH_TEST_LOOP=1 "$@"; }
losing_packets() { LD_PRELOAD=$machine BERTH_TEST_PACKET_LOSS=0.2 "$@"; }

printf '| fault | the operator reads | braking after, ms | standing after, ms | the run |\n|---|---|---|---|---|\n' >"$table"

for node in estimator testbed lidar-driver facility-driver arm-driver; do
  inject "killed_$node" "$node killed" 300 "$node" kill_node
done
for node in estimator testbed; do
  inject "hung_$node" "$node hung" 300 "$node" stop_node
done
for node in estimator testbed; do
  inject "handler_$node" "$node: endless loop in a handler" 300 "$node" loop_in_handler that_may_loop
done
node=estimator
sign='takes longer than its budget' inject worker "estimator: endless loop in its worker" 300 "takes longer than its budget" \
  loop_in_worker that_may_loop
inject logger "recorder killed" - "lcm-logger ended" kill_recorder
inject full "disk full" - "nothing is recorded any more" fill_disk on_small_disk
inject loss "a fifth of all packets lost" - "verdict" true losing_packets
inject clock "system clock stepped back by an hour" - "verdict: PASS" step_clock with_own_clock
yesterday=$run
inject replayed "another session's log played, all of it" - "verdict: PASS" play_yesterday

# The same into a cell that stands.
port=$((port + 1))
url="udpm://239.255.76.67:$port?ttl=0"
expect 0 "$bin/berth" up --layout range --detach --out "$work/standing" --lcm-url "$url"
sleep 5
at=$(now)
play_yesterday
wait $!
expect 0 "$bin/berth" stop
run=$(only_run "$work/standing")
IFS=$'\t' read -r braking standing words < <("$home/test/system/after_fault.py" "$run" "$at")
words=$(grep -aoE -m1 "a command of '[^']*' belongs to session [0-9]+ and moves nothing" "$run/run.lcm" | head -1) || true
printf '| the same, the cell standing | `command-of-another-session`: %s | %s | %s | |\n' "$words" "$braking" "$standing" | tee -a "$table"
[ "$standing" = 0 ] || failed+=("another session's log moved an arm of a standing cell")
[ -n "$words" ] || failed+=("nothing said of another session's commands")

[ ${#failed[@]} = 0 ] || { printf '%s\n' "${failed[@]}"; fail "${#failed[@]} of the faults"; }
