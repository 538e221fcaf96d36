"""`simrecon batch` on the nodes of a Slurm cluster, by dask-jobqueue (`pip install dask-jobqueue`).

    python -m tools.ops.slurm_batch --slurm-jobs 40 --partition main --time 08:00:00 -- INPUTS… -o OUT

Run it where jobs may be submitted from: on a login node in tmux, or as a small job of its own. It starts a
scheduler, submits Slurm jobs while there are clips for them, runs `simrecon batch` with what is behind `--`,
and cancels the jobs when that ends. Workers that Slurm ends are replaced; their clips go on from the last
window. OUT and the inputs must lie on a file system that all nodes see, and the nodes need the same Python
environment.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys

from dask_jobqueue import SLURMCluster


def main() -> int:
    """Start the cluster, run the batch, close the cluster."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--slurm-jobs", type=int, required=True, help="jobs at most")
    parser.add_argument("--cores", type=int, default=1, help="of each job, one clip on each")
    parser.add_argument("--memory", default="2GB", help="of each job")
    parser.add_argument("--time", default="08:00:00", help="of each job, as sbatch has it")
    parser.add_argument("--partition", help="of Slurm")
    parser.add_argument("--account", help="of Slurm")
    parser.add_argument("--interface", help="network interface that the nodes reach, such as ib0")
    parser.add_argument("--prologue", action="append", default=[], help="line of the job before the worker")
    parser.add_argument("--script", action="store_true", help="print the job script and end")
    parser.add_argument("batch", nargs=argparse.REMAINDER, help="-- and the arguments of simrecon batch")
    options = parser.parse_args()
    with SLURMCluster(
        queue=options.partition,
        account=options.account,
        cores=options.cores,
        processes=options.cores,
        memory=options.memory,
        walltime=options.time,
        interface=options.interface,
        job_script_prologue=options.prologue,
        job_extra_directives=["--requeue"],
    ) as cluster:
        if options.script:
            print(cluster.job_script())
            return 0
        cluster.adapt(minimum_jobs=0, maximum_jobs=options.slurm_jobs)
        arguments = options.batch[1:] if options.batch[:1] == ["--"] else options.batch
        command = [sys.executable, "-m", "simrecon", "batch", *arguments]
        command += [
            "--scheduler",
            cluster.scheduler_address,
            "--jobs",
            str(options.slurm_jobs * options.cores),
        ]
        print(shlex.join(command), flush=True)
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
