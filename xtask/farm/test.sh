#!/usr/bin/env bash
# Renders a sequence by a Slurm of one node on this machine and holds it against the same sequence rendered at once.
# Needs root and Debian's slurm-wlm and munge; nothing of them is left running. What it writes goes below target/.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v slurmctld slurmd sbatch munged >/dev/null || {
    apt-get update -q
    apt-get install -qy --no-install-recommends slurm-wlm munge
}
cargo build --release --quiet
export TWOLIGHT=$PWD/target/release/twolight
dir=$PWD/target/farm
rm -rf "$dir"
mkdir -p "$dir/state" "$dir/spool"
host=$(hostname -s)

cat >"$dir/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host
AuthType=auth/munge
CredType=cred/munge
SlurmUser=root
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
SlurmctldPort=16817
SlurmdPort=16818
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName=$host CPUs=$(nproc) RealMemory=500 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$dir/slurm.conf

started=()
finish() { for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done; }
trap finish EXIT
if ! munge -n >/dev/null 2>&1; then
    mkdir -p /run/munge && chown munge: /run/munge
    su munge -s /bin/sh -c "exec munged --foreground --force" 2>/dev/null &
    started+=($!)
fi
for _ in $(seq 50); do munge -n >/dev/null 2>&1 && break; sleep 0.2; done
slurmctld -D 2>/dev/null &
started+=($!)
slurmd -D 2>/dev/null &
started+=($!)
for _ in $(seq 100); do sinfo -h -o %T 2>/dev/null | grep -q idle && break; sleep 0.3; done

scene=$PWD/assets/cornell-box.gltf options="--orbit 6 --size 64x64 --error 10% --no-verify"
cd "$dir"
"$TWOLIGHT" solve "$scene" -o room.twl --error 10% --quiet
"$TWOLIGHT" render "$scene" --solution room.twl -o "once.##.exr" $options --quiet >/dev/null
sbatch --wait --array=0-3 "$OLDPWD/xtask/farm/sequence.sbatch" "$scene" room.twl "farm.##.exr" 6 $options
for frame in 00 01 02 03 04 05; do cmp "once.$frame.exr" "farm.$frame.exr"; done
# Submitted again, nothing is rendered again; of a frame that is missing only that one.
rm farm.03.exr
sbatch --wait --array=0-3 "$OLDPWD/xtask/farm/sequence.sbatch" "$scene" room.twl "farm.##.exr" 6 $options
cmp once.03.exr farm.03.exr
[ "$(cat twolight-*.log | grep -c '^farm')" -eq 1 ]
echo "six frames by four tasks of a Slurm array are the bytes of one run"
