"""The steps of the demo, in the order in which a laboratory would take them."""

import contextlib
import signal
import subprocess
from collections.abc import Iterator

from rich.console import Console

from bench.child_process import MRBENCH
from bench.demo.folder import DemoFolder
from bench.demo.processes import processes
from bench.demo.recording import await_fit, record
from bench.demo.rest import Rest
from bench.demo.summary import summarise
from bench.errors import ReportError, RunError
from bench.progress import progress_bar


class Demo:
    """One demonstration.

    Args:
        folder: what is recorded, and where everything goes.
        says: where each step is announced.
    """

    def __init__(self, folder: DemoFolder, says: Console) -> None:
        self._folder, self._says = folder, says
        self._step, self._steps = 0, 4 if folder.unseen is None else 7

    def carry_out(self, console: Console, *, serve: bool) -> None:
        """Do everything, and say in short what came out.

        Args:
            console: where the results go.
            serve: whether the service stays up until Ctrl-C.

        Raises:
            ReportError: the folder cannot be made.
            RunError: a process, a run or a command failed; the message says which and why.
        """
        self._make_folder()
        self._announce("bring up simulated rig, agent, service and worker")
        with _ended_in_order(), processes(self._folder) as page:
            rest = Rest(page)
            self._stroke(rest)
            if self._folder.diagnosis is not None:
                self._announce("look for what the simulation lacks")
                _mrbench("diagnose", self._folder.log, "--out", self._folder.diagnosis)
            self._announce("write the report")
            self._report()
            summarise(self._folder, console)
            if serve:
                console.print(f"\nthe bench stays up: {page}\nCtrl-C ends it", soft_wrap=True, highlight=False)
                _until_interrupted()

    def _stroke(self, rest: Rest) -> None:
        """Record and identify; then record what the fit never saw, and predict it."""
        folder = self._folder
        run = self._recorded(rest, folder.method)
        rest.download(f"/runs/{run}/log", folder.log)
        self._announce("identify the damper")
        await_fit(rest, run)
        rest.download(f"/runs/{run}/fit", folder.fit)
        if folder.unseen is not None and folder.unseen_log is not None:
            run = self._recorded(rest, folder.unseen)
            rest.download(f"/runs/{run}/log", folder.unseen_log)
            self._announce("predict the strokes that the fit never saw")
            _mrbench("predict", folder.fit, folder.unseen_log, "--out", folder.prediction)

    def _recorded(self, rest: Rest, method: str) -> str:
        self._announce(f"record {method} over the wires")
        with progress_bar(method) as progress:
            return record(rest, method, progress, lambda text: self._says.print(text, highlight=False))

    def _report(self) -> None:
        folder = self._folder
        diagnosed = () if folder.diagnosis is None else ("--diagnosis", folder.diagnosis)
        _mrbench(
            "report", folder.log, "--fit", folder.fit, *diagnosed, "--out", folder.report, "--plots", folder.plots
        )

    def _make_folder(self) -> None:
        try:
            self._folder.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ReportError(
                f"{self._folder.path}: cannot be made ({error.strerror}); give another --out"
            ) from error

    def _announce(self, what: str) -> None:
        self._step += 1
        self._says.print(f"{self._step}/{self._steps} {what}", highlight=False)


def _mrbench(*words: object) -> None:
    """Call a command as a person would; it shows its own progress, and says itself why it fails."""
    if subprocess.run([*MRBENCH, *map(str, words)], check=False).returncode != 0:
        raise RunError(f"mrbench {words[0]} failed; its line above says why")


def _until_interrupted() -> None:
    with contextlib.suppress(KeyboardInterrupt):
        signal.pause()


@contextlib.contextmanager
def _ended_in_order() -> Iterator[None]:
    """Let SIGTERM do what Ctrl-C does: the processes of the bench are ended before this one."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
