#!/bin/bash
# A sweep on a cluster: `sbatch examples/sweep/slurm.sh`. Each task runs every sixteenth unit; the folder is on a file system
# that all of them share. What a task has not ended when its time is up goes on where it was when the script is submitted again.
#SBATCH --job-name=sweep
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
#SBATCH --signal=B:INT@60
set -eu
export RAYON_NUM_THREADS="${SLURM_CPUS_PER_TASK:-1}"
exec python -m lagrangian.sweep examples/sweep/plan.toml --out sweep \
    --unit "${SLURM_ARRAY_TASK_ID}/${SLURM_ARRAY_TASK_COUNT}"
