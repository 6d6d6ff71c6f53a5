# SPDX-License-Identifier: BSD-3-Clause
# replay RUN: plays its log with the stock player, the estimator's own outputs left out, into a
# berth-estimator on a bus of its own, and compares the estimates number for number.
replay() {
  local run=$1 replay_url="udpm://239.255.76.67:$((port + 1))?ttl=0&recv_buf_size=212992" logger node
  rm -f "$work/replayed.lcm"
  lcm-logger --quiet --lcm-url="$replay_url" "$work/replayed.lcm" &
  logger=$!
  "$bin/berth-estimator" --run "$run" --lcm-url "$replay_url" &
  node=$!
  # Ready: its first NODE_STATUS is in the log.
  for _ in $(seq 100); do
    sleep 0.2
    "$bin/berth" log info "$work/replayed.lcm" 2>/dev/null | grep -q NODE_STATUS && break
  done
  # A node is alive here: berth replay must not play onto this bus.
  expect 2 "$bin/berth" replay "$run" --lcm-url "$replay_url"
  prints "is alive"
  lcm-logplayer --lcm-url="$replay_url" --speed=4 \
    --regexp='^(?!POSE_ESTIMATE$|SCAN_REQUEST$|ESTIMATOR_STATE$|ESTIMATOR_DIAGNOSTICS$|NODE_STATUS$|HEARTBEAT$|ARM_).*' \
    "$run/run.lcm" >/dev/null
  sleep 2
  kill -TERM $node $logger
  wait $node $logger || true
  "$bin/berth" log estimates "$run/run.lcm" >"$work/recorded.jsonl"
  "$bin/berth" log estimates "$work/replayed.lcm" >"$work/replayed.jsonl"
  [ -s "$work/recorded.jsonl" ] || fail "no estimates were recorded"
  diff "$work/recorded.jsonl" "$work/replayed.jsonl" >"$work/diff.txt" || {
    head -c 2000 "$work/diff.txt"
    fail "the replay gives other estimates"
  }
  echo "$(wc -l <"$work/recorded.jsonl") estimates the same, number for number"
}

# beside RUN: berth replay with an estimator beside it, and berth reestimate, give the recorded
# estimates again.
beside() {
  local run=$1 count beside_url="udpm://239.255.76.67:$((port + 2))?ttl=0"
  count=$("$bin/berth" log estimates "$run/run.lcm" | wc -l)
  expect 0 "$bin/berth" replay "$run" --estimate --rate 32 --lcm-url "$beside_url"
  prints "$count estimates compared with recorded ones, $count identical"
  expect 0 "$bin/berth" reestimate "$run" --out "$work/again"
  prints "all estimates are identical to the recorded ones"
}
