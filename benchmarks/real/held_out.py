"""Diagnosis of two real dampers with each stroke condition held out in turn: error of twin and learned residual.

    python -m benchmarks.real.held_out --keep FOLDER [--jobs 2] [--only utfsm]

`MRBENCH_SHARED` names the folder with `data/utfsm_sine` and `data/nees_dyke`. Each stroke condition of the first
and each fifth in time of the second is held out by `mrbench diagnose --hold-out PATTERN --residual`, without any
manual choice. Stored diagnoses in FOLDER are not repeated. The output is a part of
`docs/evidence/real-damper-effects.md`.
"""

import argparse
import gzip
import json
import os
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.common import run_mrbench
from identification.fitting import HoldOut, assemble
from identification.logs import load

_PARTS = 5
"""Number of parts in time of the random stroke."""


class HeldOutPart(NamedTuple):
    """Part of a recording that was held out, and its diagnosis."""

    name: str
    samples: int
    force: tuple[float, float]
    """Sum [N] and sum of squares [N²] of the recorded force."""
    diagnosis: dict[str, Any]

    @property
    def physics(self) -> float:
        """RMSE of law and named effects [N]."""
        return float(self.diagnosis["gap"]["held_out"]["rmse_n"])

    @property
    def with_residual(self) -> float:
        """RMSE with the learned residual [N]; that of the physics where none was learned."""
        learned = self.diagnosis["gap"]["held_out"]["with_residual"]
        return self.physics if learned is None else float(learned["rmse_n"])

    @property
    def nrmse(self) -> float:
        """NRMSE of law and named effects."""
        return float(self.diagnosis["gap"]["held_out"]["nrmse"])


def import_sines(data: Path, folder: Path) -> tuple[Path, list[str]]:
    """Import the 30 sinusoidal strokes; return the log and the patterns of its six stroke conditions."""
    files = sorted((data / "utfsm_sine").glob("*.csv.gz"))
    conditions = sorted({f.name.rsplit("_", 1)[0] for f in files})
    return _import_files(files, folder / "utfsm.mcap"), [f"{name}_*" for name in conditions]


def import_random_stroke(data: Path, folder: Path) -> tuple[Path, list[str]]:
    """Import the random stroke in five parts; return the log and the patterns of the parts."""
    text = gzip.decompress((data / "nees_dyke" / "ranran_50.csv.gz").read_bytes()).decode()
    head, *rows = text.splitlines()
    files = []
    for k in range(_PARTS):
        files.append(folder / f"part_{k + 1}.csv")
        part = rows[k * len(rows) // _PARTS : (k + 1) * len(rows) // _PARTS]
        files[-1].write_text("\n".join([head, *part]) + "\n", encoding="utf-8")
    return _import_files(files, folder / "nees.mcap"), [f"{f.stem}*" for f in files]


def _import_files(files: Sequence[Path], log: Path) -> Path:
    if not log.exists():
        run_mrbench("import", *files, "--out", log)
    return log


def diagnose_without(log: Path, pattern: str) -> HeldOutPart:
    """Diagnose a log with one part held out, unless its diagnosis is stored."""
    name = pattern.rstrip("_*")
    out = log.with_name(f"{log.stem}-{name}.json")
    if not out.exists():
        run_mrbench(
            "diagnose", log, "--hold-out", pattern, "--residual", "--out", out, "--twin", out.with_suffix(".twin")
        )
    dataset = assemble([load(log)], HoldOut((pattern,)))
    masks = [h & s.valid_mask for h, s in zip(dataset.held_out, dataset.stretches, strict=True)]
    force = np.concatenate([p.force[mask] for p, mask in zip(dataset.pieces, masks, strict=True)])
    sums = float(force.sum()), float(force @ force)
    return HeldOutPart(name, len(force), sums, json.loads(out.read_text(encoding="utf-8")))


def render(parts: Sequence[HeldOutPart]) -> str:
    """Return the table of a recording, the errors over all held-out samples, and the agreement of the names."""
    rows = [
        "| held out | verdict | named effects (share) | RMSE physics | RMSE with residual | NRMSE physics |",
        "| --- | --- | --- | ---: | ---: | ---: |",
    ]
    for part in parts:
        effects = part.diagnosis["effects"]
        named = ", ".join(f"`{e['name']}` ({e['share']:.2f})" for e in effects) or "–"
        rows.append(
            f"| {part.name} | {part.diagnosis['verdict']} | {named} | {part.physics:.1f} N "
            f"| {part.with_residual:.1f} N | {part.nrmse:.4f} |"
        )
    return "\n".join([*rows, "", _describe_total(parts), _describe_agreement(parts)])


def _describe_total(parts: Sequence[HeldOutPart]) -> str:
    """Return the errors over all held-out samples of a recording."""
    count = np.array([p.samples for p in parts])
    mean, square = (sum(p.force[k] for p in parts) / count.sum() for k in (0, 1))
    deviation = np.sqrt(square - mean**2)
    totals = []
    for errors in ([p.physics for p in parts], [p.with_residual for p in parts]):
        rmse = np.sqrt(np.average(np.square(errors), weights=count))
        totals.append(f"{rmse:.1f} N, NRMSE {rmse / deviation:.4f}")
    nrmse = [p.nrmse for p in parts]
    return (
        f"All held-out samples: physics {totals[0]}; with the learned residual {totals[1]}. "
        f"NRMSE of the physics by part: median {np.median(nrmse):.4f}, worst {max(nrmse):.4f}."
    )


def _describe_agreement(parts: Sequence[HeldOutPart]) -> str:
    """Return in how many parts each effect and each place is named."""
    texts = []
    for key in ("name", "place"):
        counts = Counter(value for p in parts for value in {e[key] for e in p.diagnosis["effects"]})
        texts.append(", ".join(f"{value} {n} of {len(parts)}" for value, n in counts.most_common()) or "none")
    return f"Named: {texts[0]}. Places: {texts[1]}."


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, required=True, help="folder for logs and diagnoses")
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses at the same time")
    parser.add_argument("--only", choices=("utfsm", "nees"), help="only this recording")
    options = parser.parse_args()
    data = Path(os.environ.get("MRBENCH_SHARED", ".")) / "data"
    options.keep.mkdir(parents=True, exist_ok=True)
    for name, make in (("utfsm", import_sines), ("nees", import_random_stroke)):
        if options.only in (None, name):
            log, patterns = make(data, options.keep)
            with ThreadPoolExecutor(options.jobs) as pool:
                parts = list(pool.map(partial(diagnose_without, log), patterns))
            print(f"\n### {name}\n\n{render(parts)}\n")


if __name__ == "__main__":
    main()
