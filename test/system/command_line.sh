#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What a user gets wrong is said clearly, with exit code 2.
. "$(dirname "$0")/common.sh"

expect 0 "$bin/berth" --help
prints "run"
verbs=$(sed -n '/^Subcommands:/,$s/^  \([a-z][a-z-]*\)  .*/\1/p' "$work/out.txt")
[ "$(wc -w <<<"$verbs")" -gt 20 ] || fail "berth --help lists no more verbs than: $verbs"
for verb in $verbs; do expect 0 "$bin/berth" $verb --help; done
for program in arm-driver lidar-driver facility-driver estimator testbed simulated-cell procedure; do
  expect 0 "$bin/berth-$program" --help
  expect 2 "$bin/berth-$program" --run /nonexistent
done
# Devices at ports below 1024, where nobody listens.
cp -r config "$work/nobody"
sed -i 's/127\.0\.0\.1:150/127.0.0.1:1/' "$work/nobody/devices.yaml"
expect 2 "$bin/berth" doctor --hardware --seconds 1 --config "$work/nobody"
prints "replica arm connection 127.0.0.1:121: no answer"
prints "127.0.0.1:124: no answer"
expect 2 "$bin/berth" doctor --hardware --seconds 1 --layout nowhere
prints "nowhere"
expect 2 "$bin/berth" doctor --layout range
expect 2 "$bin/berth"
expect 2 "$bin/berth" fly
prints "found 'fly', which is no command"
expect 2 "$bin/berth" estimat --help
prints "did you mean 'estimate'?"
expect 2 "$bin/berth" log chekc --help
prints "berth log: found 'chekc', which is no command; did you mean 'check'?"
expect 2 "$bin/berth" run nowhere.yaml --twin --out "$work"
prints "nowhere.yaml"
expect 2 "$bin/berth" run procedures/approach.yaml --twin --out "$work" --target nothing.ply
prints "nothing.ply"
expect 2 "$bin/berth" run procedures/approach.yaml --twin --out "$work" --set nonsense=1
prints "nonsense"
expect 2 "$bin/berth" run procedures/approach.yaml --out "$work" --lcm-url tcpq://localhost:7700
prints "tcpq"
expect 0 "$bin/berth" config describe
prints "config/lidars/*.yaml"
expect 0 "$bin/berth" config describe lidar --json
prints '"meaning"'
expect 0 "$bin/berth" config describe lidar
prints "beam.range_sigma"
expect 0 "$bin/berth" config describe config/lidars/ilris_3d.yaml
prints "ILRIS-3D"
expect 2 "$bin/berth" config describe lidra
prints "found 'lidra', expected a file or one of: "
expect 0 "$bin/berth" check procedures
prints "0 with errors"
expect 0 "$bin/berth" check --schema
cmp "$work/out.txt" procedures/schema.json || fail "the schema shipped is another one"
printf 'name: x\nsteps:\n  - moove: {to: [0, 0, 1, 0, 0, 0]}\n' >"$work/bad.yaml"
expect 2 "$bin/berth" check "$work/bad.yaml"
prints "bad.yaml:3"
for key in layout target; do
  printf 'name: x\n%s: nowhere\nsteps:\n  - wait: 1 s\n' $key >"$work/bad.yaml"
  expect 2 "$bin/berth" check "$work/bad.yaml"
  prints "bad.yaml:2: key '$key'"
done
expect 2 "$bin/berth" run --twin --layout nowhere procedures/approach.yaml
prints "--layout: found 'nowhere', expected one of"

# All files are checked, the others too when one is bad; a run is refused before anything starts.
cat >"$work/far.yaml" <<'END'
name: far
layout: range
steps:
  - move: {to: [0, 0, 9000, 0, 0, 0], speed: 100 mm/s}
END
expect 2 "$bin/berth" check "$work/bad.yaml" "$work/far.yaml" procedures/approach.yaml
prints "3 procedures, 1 ready, 2 with errors"
expect 2 "$bin/berth" check --json "$work/far.yaml"
refusal=$(sed -n 's/^ *"found": "\(the testbed refuses: .*\)",$/\1/p' "$work/out.txt")
[ -n "$refusal" ] || fail "check does not refuse the move"
expect 2 "$bin/berth" run --twin --out "$work/far" "$work/far.yaml"
prints "far.yaml:4: error: step 'move': $refusal"
[ ! -e "$work/far" ] || fail "something was started"
# The testbed of the twin refuses in the same words.
expect 2 "$bin/berth" run --twin --no-check --out "$work/far" "$work/far.yaml"
prints "step 'move': $refusal"
expect 2 "$bin/berth" run --out "$work" procedures/approach.yaml --answer a=b
prints "--answer is for --twin"
expect 2 "$bin/berth" attach
prints "nothing is running"
expect 0 "$bin/berth" compare --list --json
prints '"name": "position_error"'
expect 2 "$bin/berth" compare "$work"
echo "not a log" >"$work/bad.lcm"
expect 2 "$bin/berth" compare "$work/bad.lcm"

# Prompts in the twin: answered beforehand by the step's name, else out of time.
cat >"$work/ask.yaml" <<'END'
name: ask
layout: free
steps:
  - prompt: {text: "Is the way clear?", choices: ["yes", "no"], go_on: ["yes"]}
    name: clear
    timeout: 20 s
END
expect 0 "$bin/berth" run --twin --out "$work/ask" "$work/ask.yaml" --answer clear=yes
expect 1 "$bin/berth" run --twin --out "$work/ask" "$work/ask.yaml" --answer clear=no
expect 2 "$bin/berth" run --twin --out "$work/ask" "$work/ask.yaml"
prints "TIMEOUT"

# What is shipped is found from any directory; what lies there goes before.
mkdir -p "$work/elsewhere/procedures"
programs=$(cd "$bin" && pwd)
(cd "$work/elsewhere" && expect 0 "$programs/berth" check procedures/track_static.yaml)
echo "steps: []" >"$work/elsewhere/procedures/track_static.yaml"
(cd "$work/elsewhere" && expect 2 "$programs/berth" check procedures/track_static.yaml)

# ./berth reports at once that another one builds in the same folder, then goes on.
tree=$work/tree
mkdir -p "$tree/cmake/packages" "$tree/build/release/bin" "$work/path"
cp berth "$tree/"
touch "$tree/cmake/packages/run" "$tree/cmake/packages/build" "$tree/build/release/build.ninja"
printf '#!/bin/sh\n' >"$work/path/ninja"
printf '#!/bin/sh\necho built "$@"\n' >"$tree/build/release/bin/berth"
chmod +x "$work/path/ninja" "$tree/build/release/bin/berth"
exec 8>>"$tree/build/release/.lock"
flock 8
echo 4711 >"$tree/build/release/.lock"
PATH=$work/path:$PATH "$tree/berth" check >"$work/out.txt" 2>&1 8>&- &
waiting=$!
for _ in $(seq 100); do grep -q waiting "$work/out.txt" && break; sleep 0.1; done
prints "waiting for another build in this folder (process 4711) to end"
exec 8>&-
wait $waiting || fail "./berth did not go on"
prints "built check"
