#!/bin/sh
# `trueup trials` as a Slurm array: one part an array task, merged by a job that waits for all of them.
#
#   sh slurm_trials.sh 'pick(jar)' 20 4 /shared/trials/pick
#
# The program is `$TRUEUP`, or `trueup` on the PATH; it, the task and the folder must be at the same paths on every machine.
# Sent again, each part goes on where it ended.
set -eu
task=$1 n=$2 parts=$3 out=$4
trueup=${TRUEUP:-trueup}
mkdir -p "$out"
array=$(sbatch --parsable --job-name=trueup --array="1-$parts" --cpus-per-task=2 --mem=4G --requeue \
    --output="$out/part-%a.log" <<JOB
#!/bin/sh
export RAYON_NUM_THREADS="\$SLURM_CPUS_PER_TASK"
exec "$trueup" trials --task "$task" --n $n --shard "\$SLURM_ARRAY_TASK_ID/$parts" --out "$out" --budget 1800 --quiet
JOB
)
sbatch --job-name=trueup-merge --dependency="afterok:${array%%;*}" --output="$out/table.txt" <<JOB
#!/bin/sh
exec "$trueup" trials merge "$out"
JOB
