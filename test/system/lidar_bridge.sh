#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The example of a bridge serves a vendor's SDK by the protocol; `berth lidar test` of it, and of an address without a device.
. "$(dirname "$0")/common.sh"
address=127.0.0.1:$port

expect 2 "$bin/berth" lidar test "$address"
prints "no answer from $address"
expect 2 "$bin/berth" lidar test nowhere

"$bin/../examples/lidar_bridge" "$address" >"$work/bridge.txt" &
bridge=$!
for _ in $(seq 100); do grep -q listening "$work/bridge.txt" && break; sleep 0.1; done
expect 0 "$bin/berth" lidar test "$address"
prints "Stub S1 0001, version 2"
prints " 0 failed"
# A second one finds the port taken, and reports it.
expect 2 "$bin/../examples/lidar_bridge" "$address"
prints "cannot be listened on"
kill $bridge
wait $bridge || fail "the bridge does not end in peace"
