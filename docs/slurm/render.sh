#!/bin/bash
#SBATCH --array=1-16
#SBATCH --cpus-per-task=32
#SBATCH --time=04:00:00
#SBATCH --signal=TERM@120
# Renders a scene in shards, one a task of the array:
#
#     sbatch render.sh scene.pbrt --mutations 20000
#
# A task that is out of time writes its checkpoint, and goes on with it when the same is submitted
# once more. What has come to its end stays as it is.
part=part$SLURM_ARRAY_TASK_ID
if [ -e "$part" ]; then
    exec srun phalanx resume "$part"
fi
exec srun phalanx render "$@" --checkpoint "$part" \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
