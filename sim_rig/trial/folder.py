"""The folder of a trial: what is sealed, what a diagnosis may see, what it said; a killed trial goes on here."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal, NamedTuple

from pydantic import Field, ValidationError

from sim_rig.errors import TrialError
from sim_rig.trial.truth import Document

Draw = Literal["blind", "grid"]


class Seal(Document):
    """What is published before anything is recorded."""

    cases: int = Field(description="how many")
    seed: int = Field(description="of the draw")
    draw: Draw = Field(description="blind mixture, or single effects over a grid of sizes")
    version: str = Field(description="of mrbench")
    sha256: str = Field(description="of the sealed truth")


class Outcome(Document):
    """How the diagnosis of one case went."""

    seconds: float = Field(description="that it took, in s")
    failure: str | None = Field(description="its complaint, where it gave no answer")


class Files(NamedTuple):
    """The files of one case."""

    scenario: Path
    log: Path
    unseen: Path
    diagnosis: Path
    twin: Path
    prediction: Path
    outcome: Path


class TrialFolder:
    """Where a trial keeps its files, beside its answer."""

    def __init__(self, out: Path) -> None:
        """The folder of the answer ``out``: that name with ``.cases`` in place of its suffix.

        Raises:
            TrialError: there is no place for it.
        """
        if not out.parent.is_dir():
            raise TrialError(f"{out}: there is no folder {out.parent}; choose another place")
        self.root = out.resolve().with_suffix(".cases")
        self.truth = self.root / "sealed" / "truth.json"
        self._seal = self.root / "seal.json"

    def prepare(self) -> None:
        """Make the folders."""
        for name in ("sealed", "methods", "logs", "unseen", "diagnoses", "predictions"):
            (self.root / name).mkdir(parents=True, exist_ok=True)

    def seal(self) -> Seal | None:
        """What was published, or nothing if no truth is sealed yet.

        Raises:
            TrialError: the file is no seal.
        """
        if not self._seal.exists():
            return None
        try:
            return Seal.model_validate_json(self._seal.read_bytes())
        except ValidationError as error:
            raise TrialError(f"{self._seal}: is no seal; remove the folder or choose another --out") from error

    def publish(self, seal: Seal) -> None:
        """Publish the seal."""
        _whole(self._seal, seal.model_dump_json(indent=2) + "\n")

    def method(self, name: str) -> Path:
        """The file of a method."""
        return self.root / "methods" / f"{name}.json"

    def files(self, case: str) -> Files:
        """The files of a case by its name."""
        return Files(
            scenario=self.root / "sealed" / f"{case}.json",
            log=self.root / "logs" / f"{case}.mcap",
            unseen=self.root / "unseen" / f"{case}.mcap",
            diagnosis=self.root / "diagnoses" / f"{case}.json",
            twin=self.root / "diagnoses" / f"{case}.twin.json",
            prediction=self.root / "predictions" / f"{case}.json",
            outcome=self.root / "diagnoses" / f"{case}.outcome.json",
        )

    def outcome(self, case: str) -> Outcome | None:
        """How a diagnosis went, or nothing if it has not ended."""
        path = self.files(case).outcome
        return Outcome.model_validate_json(path.read_bytes()) if path.exists() else None

    @contextmanager
    def claim(self, case: str) -> Iterator[bool]:
        """Hold a case, so that several processes can share a trial; False where another one holds it."""
        path = self.root / "diagnoses" / f"{case}.claim"
        with path.open("w") as held:
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                yield False
            else:
                yield True

    def put(self, path: Path, text: str) -> None:
        """Write a file whole or not at all."""
        _whole(path, text)


def _whole(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
