"""Folder in which commands of the product are run through the shell."""

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.common.prediction_series import PredictionSeries, read_series

_OUT_OPTION = re.compile(r"--out (\S+)")


@dataclass(frozen=True)
class Workspace:
    """Folder in which commands are run, and the list of these commands.

    A command whose output file exists is not run again, so that an interrupted benchmark can continue.
    """

    folder: Path
    commands: list[str] = field(default_factory=list)

    def run(self, line: str) -> None:
        """Run a command line; exit with its error output if it fails."""
        self.commands.append(line)
        out = _OUT_OPTION.search(line)
        if out and (self.folder / out[1]).exists():
            return
        print(line, file=sys.stderr)
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["sh", "-c", line], cwd=self.folder, env=os.environ | {"PATH": path}, capture_output=True, text=True
        )
        if done.returncode:
            sys.exit(f"{line}\nended with {done.returncode}: {done.stderr}")

    def read_document(self, name: str) -> dict[str, Any]:
        """Read a JSON document."""
        document: dict[str, Any] = json.loads((self.folder / f"{name}.json").read_text())
        return document

    def identify(self, log: str, name: str, options: str) -> "SimulatedFit":
        """Identify a log and simulate the fit on the whole log."""
        self.run(f"mrbench identify {log}.mcap {options} --out {name}.json")
        return self.simulate_fit(log, name, name)

    def simulate_fit(self, log: str, name: str, series: str, options: str = "") -> "SimulatedFit":
        """Simulate a fit on the whole log."""
        self.run(f"mrbench predict {name}.json {log}.mcap{options} --out {series}.p.json --series {series}.npz")
        return SimulatedFit(self.read_document(name), read_series(self.folder / f"{series}.npz"))


@dataclass(frozen=True)
class SimulatedFit:
    """Fit, with its simulated and the recorded force."""

    document: dict[str, Any]
    series: PredictionSeries

    @property
    def delay(self) -> dict[str, Any]:
        """Lag of the force behind the displacement, as in the fit document."""
        delay: dict[str, Any] = self.document["nuisances"]["force_delay"]
        return delay
