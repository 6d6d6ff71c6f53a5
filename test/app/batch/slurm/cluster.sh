#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A Slurm cluster of this one machine, by hand: no systemd, nothing in /etc, everything in one directory.
#
#   test/app/batch/slurm/cluster.sh up [DIR]       starts munged, slurmctld and slurmd; prints the line that lets sbatch find them
#   test/app/batch/slurm/cluster.sh status [DIR]   what runs, the nodes, the queue
#   test/app/batch/slurm/cluster.sh down [DIR]     ends its jobs and its daemons (no others)
#
# DIR is /tmp/berth-slurm-USER when not given. BERTH_SLURM_CPUS: processors that Slurm may hand out (all of the machine's).
# Packages: cmake/packages/slurm.  Users: root, or any one whose jobs then run as itself.
set -euo pipefail

say() { printf 'cluster: %s\n' "$*" >&2; }
fail() { say "$*"; exit 2; }

action=${1:-}
directory=${2:-/tmp/berth-slurm-$(id -un)}
case $action in up | down | status) ;; *) sed -n '3,10s/^# \{0,1\}//p' "$0"; exit 2 ;; esac
export SLURM_CONF=$directory/slurm.conf

# pid NAME: of a daemon of this directory that runs; a number that was handed to another program is not it.
pid() {
  local number
  number=$(cat "$directory/$1.pid" 2>/dev/null) || return 1
  [ "$(cat "/proc/$number/comm" 2>/dev/null)" = "$1" ] && echo "$number"
}

# until_true SECONDS WHAT COMMAND...
until_true() {
  local tenths=$(($1 * 10)) what=$2
  shift 2
  until "$@" >/dev/null 2>&1; do
    tenths=$((tenths - 1))
    [ $tenths -gt 0 ] || { tail -n 5 "$directory"/*.log >&2; fail "$what: not within its time; see $directory/*.log"; }
    sleep 0.1
  done
}

# start NAME COMMAND...: a daemon that forks itself; what it says goes to its log.
start() {
  local name=$1
  shift
  "$@" 2>>"$directory/$name.log" && return
  tail -n 5 "$directory/$name.log" >&2
  fail "$name does not start; see $directory/$name.log"
}

free_port() {
  local port=$1
  while (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do port=$((port + 10)); done
  echo "$port"
}

node_is_idle() { sinfo --noheader --format=%T | grep -qE '^(idle|mixed|allocated)$'; }

write_configuration() {
  local cpus memory port
  cpus=${BERTH_SLURM_CPUS:-$(nproc)}
  # Below what slurmd finds, or the node is refused.
  memory=$(($(slurmd -C | sed -n 's/.*RealMemory=\([0-9]*\).*/\1/p') * 9 / 10))
  port=$(free_port $((21000 + $(id -u) % 1000)))
  cat >"$SLURM_CONF" <<END
ClusterName=berth
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$directory/munge/munge.socket
CryptoType=crypto/munge
StateSaveLocation=$directory/state
SlurmdSpoolDir=$directory/spool
SlurmctldPidFile=$directory/slurmctld.pid
SlurmdPidFile=$directory/slurmd.pid
SlurmctldLogFile=$directory/slurmctld.log
SlurmdLogFile=$directory/slurmd.log
# No systemd, no control groups, no data base of accounts: a bare machine has none.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
# What this file says of the machine is right, so that a scheduler can be tried with more processors than there are.
SlurmdParameters=config_overrides
MaxArraySize=10001
ReturnToService=2
KillWait=5
MinJobAge=600
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$cpus RealMemory=$memory State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
}

up() {
  local program
  for program in munged slurmctld slurmd sbatch; do
    command -v "$program" >/dev/null || PATH=$PATH:/usr/sbin:/sbin
    command -v "$program" >/dev/null || fail "$program is not installed: apt-get install $(sed 's/#.*//' "$(dirname "$0")/../../cmake/packages/slurm" | xargs)"
  done
  if pid slurmctld >/dev/null && pid slurmd >/dev/null && pid munged >/dev/null; then
    say "it is up already"
  else
    down
    mkdir -p "$directory"/{munge,state,spool}
    chmod 755 "$directory" "$directory/munge"
    write_configuration
    [ -f "$directory/munge/key" ] || (umask 077 && head -c 1024 /dev/urandom >"$directory/munge/key")
    # --force: munged would rather not run as root, nor read a key outside of /etc.
    start munged munged --force --key-file="$directory/munge/key" --socket="$directory/munge/munge.socket" \
      --pid-file="$directory/munged.pid" --log-file="$directory/munged.log" --seed-file="$directory/munge/seed"
    until_true 10 munged munge --socket="$directory/munge/munge.socket" --no-input
    start slurmctld slurmctld -f "$SLURM_CONF"
    until_true 20 slurmctld scontrol ping
    start slurmd slurmd -f "$SLURM_CONF" -N "$(hostname -s)"
    until_true 30 "the node" node_is_idle
  fi
  echo "export SLURM_CONF=$SLURM_CONF"
}

down() {
  local daemon number
  if pid slurmctld >/dev/null; then
    scancel --user="$(id -un)" 2>/dev/null || true
    local tenths=100
    while [ -n "$(squeue --noheader 2>/dev/null)" ] && [ $tenths -gt 0 ]; do tenths=$((tenths - 1)); sleep 0.1; done
  fi
  for daemon in slurmd slurmctld munged; do
    number=$(pid $daemon) || continue
    kill "$number" 2>/dev/null || true
    tenths=50
    while kill -0 "$number" 2>/dev/null && [ $tenths -gt 0 ]; do tenths=$((tenths - 1)); sleep 0.1; done
    kill -KILL "$number" 2>/dev/null || true
    rm -f "$directory/$daemon.pid"
  done
}

status() {
  local daemon running=0
  for daemon in munged slurmctld slurmd; do
    if number=$(pid $daemon); then echo "$daemon runs as $number"; running=$((running + 1)); else echo "$daemon does not run"; fi
  done
  [ $running = 3 ] || return 1
  echo "export SLURM_CONF=$SLURM_CONF"
  sinfo
  squeue
}

$action
