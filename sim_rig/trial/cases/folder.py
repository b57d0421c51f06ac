"""Folder of a trial: sealed truth, logs, diagnoses and outcomes; a killed trial continues from its files."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal, NamedTuple

from pydantic import AliasChoices, Field, ValidationError

from sim_rig.errors import TrialError
from sim_rig.validation import FrozenModel

TrialKind = Literal["blind", "grid"]


class Seal(FrozenModel):
    """Hash and options of a trial, published before the first recording."""

    cases: int = Field(description="number of cases")
    seed: int = Field(description="seed of the random draw")
    kind: TrialKind = Field(
        validation_alias=AliasChoices("kind", "draw"),
        description="blind mixture, or single effects over a grid of sizes",
    )
    version: str = Field(description="version of mrbench")
    sha256: str = Field(description="SHA-256 of the sealed truth")


class DiagnosisOutcome(FrozenModel):
    """Duration and failure of the diagnosis of one case."""

    seconds: float = Field(description="[s] duration of the diagnosis")
    failure: str | None = Field(description="error message, if it failed; else null")


class CaseFiles(NamedTuple):
    """Files of one case."""

    scenario: Path
    log: Path
    validation_log: Path
    diagnosis: Path
    twin: Path
    prediction: Path
    outcome: Path


class TrialFolder:
    """Folder of a trial's files, next to its result."""

    def __init__(self, out: Path) -> None:
        """Use the folder of the result ``out``: its name with the suffix ``.cases``.

        Raises:
            TrialError: its parent folder does not exist.
        """
        if not out.parent.is_dir():
            raise TrialError(f"{out}: there is no folder {out.parent}; create it or choose another --out")
        self.root = out.resolve().with_suffix(".cases")
        self.truth = self.root / "sealed" / "truth.json"
        self._seal = self.root / "seal.json"

    def prepare(self) -> None:
        """Create the folders."""
        for name in ("sealed", "methods", "logs", self._validation_folder, "diagnoses", "predictions"):
            (self.root / name).mkdir(parents=True, exist_ok=True)

    @property
    def _validation_folder(self) -> str:
        """Folder of the validation logs, or its former name in a trial that has only that."""
        has_former_only = (self.root / "unseen").is_dir() and not (self.root / "validation").is_dir()
        return "unseen" if has_former_only else "validation"

    def read_seal(self) -> Seal | None:
        """Return the published seal, or None if no truth is sealed yet.

        Raises:
            TrialError: the file is not a seal.
        """
        if not self._seal.exists():
            return None
        try:
            return Seal.model_validate_json(self._seal.read_bytes())
        except ValidationError as error:
            raise TrialError(f"{self._seal}: is not a seal; remove the folder or choose another --out") from error

    def publish_seal(self, seal: Seal) -> None:
        """Publish the seal."""
        _write_atomically(self._seal, seal.model_dump_json(indent=2) + "\n")

    def get_method_path(self, name: str) -> Path:
        """Return the file of a method."""
        return self.root / "methods" / f"{name}.json"

    def get_case_files(self, case: str) -> CaseFiles:
        """Return the files of a case by its name."""
        return CaseFiles(
            scenario=self.root / "sealed" / f"{case}.json",
            log=self.root / "logs" / f"{case}.mcap",
            validation_log=self.root / self._validation_folder / f"{case}.mcap",
            diagnosis=self.root / "diagnoses" / f"{case}.json",
            twin=self.root / "diagnoses" / f"{case}.twin.json",
            prediction=self.root / "predictions" / f"{case}.json",
            outcome=self.root / "diagnoses" / f"{case}.outcome.json",
        )

    def read_outcome(self, case: str) -> DiagnosisOutcome | None:
        """Return the outcome of a diagnosis, or None if it has not ended."""
        path = self.get_case_files(case).outcome
        return DiagnosisOutcome.model_validate_json(path.read_bytes()) if path.exists() else None

    @contextmanager
    def claim(self, case: str) -> Iterator[bool]:
        """Lock a case, so that several processes can share a trial; yield False if another one has locked it."""
        path = self.root / "diagnoses" / f"{case}.claim"
        with path.open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                yield False
            else:
                yield True

    def write_file(self, path: Path, text: str) -> None:
        """Write a file atomically."""
        _write_atomically(path, text)


def _write_atomically(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
