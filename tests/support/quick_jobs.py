"""Command line in place of mrbench: service and worker as they are, with jobs that only take a little time.

``serve`` and ``worker`` are the real ones. ``identify``, ``diagnose`` and ``report`` report progress, start
a child process as a heavy command would, and write small documents.
"""

import functools
import json
import subprocess
import sys
import time
from pathlib import Path

COMMAND = (sys.executable, "-m", "tests.support.quick_jobs")
DURATION = 1.2
"""Duration of one command [s]."""


def main(arguments):
    name = arguments[0]
    if name in ("serve", "worker"):
        _use_this_command()
        from bench.cli import main as run_mrbench

        sys.argv = ["mrbench", *arguments]
        return run_mrbench()
    with subprocess.Popen(["sleep", "600"]) as child:
        _report_progress(name)
        child.kill()
    return _write_documents(name, arguments)


def _use_this_command():
    import bench.jobs.dask_task
    import bench.service.serving

    bench.service.serving.start_local_engine = functools.partial(
        bench.service.serving.start_local_engine, mrbench=COMMAND
    )
    bench.jobs.dask_task.execute_job = functools.partial(bench.jobs.dask_task.execute_job, mrbench=COMMAND)


def _report_progress(name):
    began = time.monotonic()
    while (elapsed := time.monotonic() - began) < DURATION:
        line = {"stage": f"stage of {name}", "fraction": elapsed / DURATION, "message": ""}
        print(json.dumps(line), file=sys.stderr, flush=True)
        time.sleep(DURATION / 20)


def _write_documents(name, arguments):
    from tests.support.result_documents import diagnosis_document, fit_document

    out = Path(arguments[arguments.index("--out") + 1])
    documents = {"identify": fit_document, "diagnose": diagnosis_document}
    out.write_text(json.dumps(documents[name]()) if name in documents else "<title>report</title>")
    if "--twin" in arguments:
        Path(arguments[arguments.index("--twin") + 1]).write_text('{"schema": "mrbench.scenario/1"}')


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
