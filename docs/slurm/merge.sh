#!/bin/bash
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
# Adds the shards up that render.sh has made:
#
#     sbatch --dependency=afterok:JOB merge.sh scene.exr
exec srun phalanx merge part* -o "$1"
