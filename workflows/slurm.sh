#!/bin/sh
# Workers of `tetralod work` as an array of jobs, for clusters with Slurm whose nodes share the folder:
#   tetralod part volume.vtu --parts 64 -o volume.parts
#   sbatch --array=1-32 workflows/slurm.sh volume.parts
# Options of `work` may follow. Jobs may start and end at any time, also by a limit: a task that is lost so is done by another.
#SBATCH --job-name=tetralod
#SBATCH --array=1-8
#SBATCH --cpus-per-task=1
# For the largest task that a worker may get: the last ones hold what is left of all parts (docs/howto/cluster.md).
#SBATCH --mem=8G
#SBATCH --time=04:00:00
set -eu
: "${1:?the folder of tetralod part is missing}"
exec "${TETRALOD:-tetralod}" work "$@" --threads "${SLURM_CPUS_PER_TASK:-1}"
