"""Evaluate many recordings on workers that Slurm starts.

python slurm.py RUNS... [--workers N] [--queue NAME] [-- OPTIONS OF twbr evaluate]
"""

from __future__ import annotations

import argparse
import sys

from twbr_estimation.cli.main import main


def evaluate(address: str, runs: list[str], options: list[str]) -> int:
    """Run `twbr evaluate` on the cluster whose scheduler is at an address."""
    return main(["evaluate", *runs, "--dask", address, *options])


def parsed(arguments: list[str]) -> tuple[argparse.Namespace, list[str]]:
    """Return our arguments, and those after `--`, which are for `twbr evaluate`."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("runs", nargs="+", help="recordings, on a file system that all nodes see")
    parser.add_argument("--workers", type=int, default=10)
    parser.add_argument("--queue", help="partition of Slurm")
    parser.add_argument("--time", default="01:00:00", help="longest time of a worker")
    at = arguments.index("--") if "--" in arguments else len(arguments)
    return parser.parse_args(arguments[:at]), arguments[at + 1 :]


def run(arguments: list[str]) -> int:
    """Start the workers, evaluate, and return the exit status."""
    ours, options = parsed(arguments)
    from dask_jobqueue import SLURMCluster

    with SLURMCluster(
        queue=ours.queue, cores=1, processes=1, memory="2GB", walltime=ours.time
    ) as cluster:
        cluster.scale(ours.workers)
        return evaluate(cluster.scheduler_address, ours.runs, options)


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
