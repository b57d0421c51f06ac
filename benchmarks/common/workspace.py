"""A folder in which the product's commands are typed as a person would type them."""

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
    """A folder in which commands are typed, and what was typed.

    What a command would write is made once: in a folder that was kept, work goes on where it stopped.
    """

    folder: Path
    commands: list[str] = field(default_factory=list)

    def run(self, line: str) -> None:
        """Run a command line as a person would; stop with its own words where it fails."""
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
        """A JSON document."""
        found: dict[str, Any] = json.loads((self.folder / f"{name}.json").read_text())
        return found

    def identify(self, log: str, name: str, options: str) -> "SimulatedFit":
        """Identify a log and simulate the fit on all of it."""
        self.run(f"mrbench identify {log}.mcap {options} --out {name}.json")
        return self.simulate_fit(log, name, name)

    def simulate_fit(self, log: str, name: str, series: str, options: str = "") -> "SimulatedFit":
        """A fit on the whole log."""
        self.run(f"mrbench predict {name}.json {log}.mcap{options} --out {series}.p.json --series {series}.npz")
        return SimulatedFit(self.read_document(name), read_series(self.folder / f"{series}.npz"))


@dataclass(frozen=True)
class SimulatedFit:
    """A fit, and its force beside the recorded one."""

    document: dict[str, Any]
    series: PredictionSeries

    @property
    def delay(self) -> dict[str, Any]:
        """Lag of the force behind the displacement, as the fit reports it."""
        found: dict[str, Any] = self.document["nuisances"]["force_delay"]
        return found
