#!/bin/bash
#SBATCH --nodes=8
#SBATCH --ntasks-per-node=1
#SBATCH --cpus-per-task=32
#SBATCH --time=04:00:00
#SBATCH --signal=USR1@120
# Renders a scene by one process a node, which MPI starts:
#
#     sbatch mpi.sh scene.pbrt --mutations 20000 -o scene.exr
#
# If it is out of time it writes its checkpoint, and the same, submitted once more, goes on with it.
# So it does after a node was lost.
if [ -e night ]; then
    exec srun --mpi=pmix phalanx resume night -o scene.exr
fi
exec srun --mpi=pmix phalanx render "$@" --checkpoint night
