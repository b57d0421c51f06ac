"""Steps of the demonstration, in the order of a laboratory test."""

import contextlib
import signal
import subprocess
from collections.abc import Iterator

from rich.console import Console

from bench.demo.api_client import ApiClient
from bench.demo.folder import DemoFolder
from bench.demo.processes import start_processes
from bench.demo.recording import await_job, cancel_jobs, record
from bench.demo.summary import print_answer, print_files, print_truth, print_way_to_page
from bench.errors import ReportError, RunError
from bench.processes import MRBENCH_COMMAND
from bench.progress import show_progress


class Demo:
    """One demonstration.

    Args:
        folder: methods to record and files to write.
        progress_console: console for the name of each step.
    """

    def __init__(self, folder: DemoFolder, progress_console: Console) -> None:
        self._folder, self._progress_console = folder, progress_console
        self._step, self._steps = 0, 6 if folder.validation_method is None else 8

    def run(self, console: Console, *, serve: bool) -> None:
        """Execute all steps and print the answer, then the truth. Only then is the truth file opened.

        Args:
            console: console for the results.
            serve: whether the service keeps running until Ctrl-C.

        Raises:
            ReportError: the folder cannot be created.
            RunError: a process, a run or a command failed; the message names it and the reason.
        """
        self._make_folder()
        self._steps += (len(self._folder.further_methods) + 1) * serve
        self._announce(
            f"start simulated rig with a hidden effect (seed {self._folder.seed}), agent, service, worker"
        )
        with _handle_termination(), start_processes(self._folder) as page, _stop_jobs(ApiClient(page)) as api:
            self._print_line(f"the page is open while the demo runs: {page}")
            self._find_effect(api)
            print_answer(self._folder, console)
            self._announce("open the truth")
            print_truth(self._folder, console)
            self._announce("write the report")
            self._write_report()
            print_files(self._folder, console)
            if serve:
                with contextlib.suppress(KeyboardInterrupt):
                    self._keep_serving(api, page, console)
            else:
                print_way_to_page(console)

    def _keep_serving(self, api: ApiClient, page: str, console: Console) -> None:
        """Record further runs, which the page shows as they are made, and wait for Ctrl-C."""
        console.print(f"\nthe bench keeps running: {page}\nCtrl-C stops it", soft_wrap=True, highlight=False)
        for method in self._folder.further_methods:
            self._announce(f"record {method}, a further run to explore")
            self._record_run(api, method)
        self._announce("three runs are recorded, and are identified and diagnosed one after the other")
        signal.pause()

    def _find_effect(self, api: ApiClient) -> None:
        """Record, identify and diagnose; then record validation strokes and play the twin on them."""
        folder = self._folder
        run = self._record(api, folder.method)
        api.download(f"/runs/{run}/log", folder.log)
        self._announce("identify the damper")
        fit = await_job(api, run, "identify")
        api.download(f"/fits/{fit['id']}", folder.fit)
        self._announce("diagnose the sim-to-real gap")
        diagnosis = await_job(api, run, "diagnose")
        api.download(f"/diagnoses/{diagnosis['id']}", folder.diagnosis)
        api.download(f"/twins/{diagnosis['id']}", folder.twin)
        if folder.validation_method is not None and folder.validation_log is not None:
            run = self._record(api, folder.validation_method)
            api.download(f"/runs/{run}/log", folder.validation_log)
            self._announce("play the twin on the validation strokes")
            _run_mrbench("predict", folder.twin, folder.validation_log, "--out", folder.prediction)

    def _record(self, api: ApiClient, method: str) -> str:
        self._announce(f"record {method} over the wires")
        return self._record_run(api, method)

    def _record_run(self, api: ApiClient, method: str) -> str:
        with show_progress(method) as progress:
            return record(api, method, progress, lambda text: self._progress_console.print(text, highlight=False))

    def _write_report(self) -> None:
        folder = self._folder
        unseen = () if folder.prediction is None else ("--unseen", folder.prediction)
        answer = ("--fit", folder.fit, "--diagnosis", folder.diagnosis, "--truth", folder.truth, *unseen)
        _run_mrbench("report", folder.log, *answer, "--out", folder.report, "--plots", folder.plots)

    def _make_folder(self) -> None:
        try:
            self._folder.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ReportError(
                f"{self._folder.path}: cannot be created ({error.strerror}); give another --out"
            ) from error

    def _announce(self, step: str) -> None:
        self._step += 1
        self._print_line(f"{self._step}/{self._steps} {step}")

    def _print_line(self, text: str) -> None:
        """Print a line unbroken, because a broken address cannot be opened."""
        self._progress_console.print(text, highlight=False, soft_wrap=True)


def _run_mrbench(*arguments: object) -> None:
    """Run a command as a process; it shows its own progress and error message."""
    if subprocess.run([*MRBENCH_COMMAND, *map(str, arguments)], check=False).returncode != 0:
        raise RunError(f"mrbench {arguments[0]} failed; see its message above")


@contextlib.contextmanager
def _stop_jobs(api: ApiClient) -> Iterator[ApiClient]:
    """Cancel at the end the jobs that nobody waits for, such as those on the validation strokes."""
    try:
        yield api
    finally:
        with contextlib.suppress(RunError):
            cancel_jobs(api)


@contextlib.contextmanager
def _handle_termination() -> Iterator[None]:
    """Make SIGTERM act like Ctrl-C, so that the processes of the bench end before this one."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
