"""``mrbench worker``: a process that executes identification jobs, on this or another machine."""

from pathlib import Path
from typing import Annotated

import typer


def worker(
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Scheduler; by default that of the service that uses --data."),
    ] = None,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    nice: Annotated[
        int,
        typer.Option(
            min=0,
            max=19,
            envvar="MRBENCH_NICE",
            help="Niceness of the process; use less than 19 only on a machine without a rig.",
        ),
    ] = 19,
) -> None:
    """Execute identification jobs, one at a time, at the lowest priority.

    Ends when the scheduler ends.
    """
    from bench.jobs import find_scheduler, run_worker
    from bench.log_lines import log_to_stderr

    log_to_stderr()
    run_worker(scheduler or find_scheduler(data), nice)
