"""Two real dampers with effects of the library fitted beside the law: errors on strokes that no fit saw.

`MRBENCH_SHARED` names the folder that holds `data/utfsm_sine` and `data/nees_dyke`. The strokes that are held out
are kept in a log of their own, so that neither fits nor diagnoses can see them; on them y(0) alone is found.
``--keep FOLDER`` keeps logs, diagnoses and figures there and takes up where an earlier call stopped. Prints the
tables of `docs/evidence/real-damper-effects.md`.
"""

import argparse
import gzip
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.common import load_figures, run_mrbench
from identification.fitting import Dataset, EffectModel, assemble, compute_nrmse, compute_rmse, predict_piece
from identification.gap import make_diagnosis_problem
from identification.gap.data import EvaluationData
from identification.gap.fits import FitOptions, JointFit, fit_jointly
from identification.logs import load

_TEST_STROKES = ("5mm_4Hz", "25mm_0.5Hz")
_FITTED_FRACTION = 0.6
"""[1] of the random stroke that is fitted."""
_GREASED, _THIN = ("clevis_backlash", "greased_pin"), ("shear_thinning", "proportional")
_IRON, _SIDE = ("field_saturation", "magnetisation"), ("side_load_friction", "linear")
_BENT = ("displacement_nonlinearity", "polynomial")
_LATE, _TANH = ("displacement_delay", "pure_delay"), ("field_saturation", "tanh")
Names = tuple[tuple[str, str], ...]
SETS: dict[str, tuple[Names, ...]] = {
    "utfsm": (
        (),
        (_THIN,),
        (_GREASED,),
        (_GREASED, _THIN),
        (_GREASED, _THIN, _IRON),
        (_GREASED, _THIN, _IRON, _SIDE),
        (_GREASED, _THIN, _IRON, _SIDE, _BENT),
    ),
    "nees": ((), (_LATE,), (_LATE, _TANH), (_LATE, _TANH, _THIN)),
}
"""What is fitted to each damper, each set from where the one before it ended."""
_EFFORT = FitOptions(decimation=1, starts=4, descents=2, regression_start=False, refit_full=False)


class Logs(NamedTuple):
    """Two logs of one damper."""

    training: Path
    validation: Path


def import_sines(data: Path, folder: Path) -> Logs:
    """The 30 sinusoidal strokes, the test strokes apart."""
    files = sorted((data / "utfsm_sine").glob("*.csv.gz"))
    tests = [f for f in files if f.name.startswith(tuple(f"{name}_" for name in _TEST_STROKES))]
    logs = Logs(folder / "utfsm-fitted.mcap", folder / "utfsm-unseen.mcap")
    _import_files([f for f in files if f not in tests], logs.training)
    _import_files(tests, logs.validation)
    return logs


def import_random_stroke(data: Path, folder: Path) -> Logs:
    """The random stroke, its end apart."""
    logs = Logs(folder / "nees-fitted.mcap", folder / "nees-unseen.mcap")
    head, *rows = gzip.decompress((data / "nees_dyke" / "ranran_50.csv.gz").read_bytes()).decode().splitlines()
    cut = round(_FITTED_FRACTION * len(rows))
    for log, part in ((logs.training, rows[:cut]), (logs.validation, rows[cut:])):
        source = log.with_suffix(".csv")
        source.write_text("\n".join([head, *part]) + "\n", encoding="utf-8")
        _import_files([source], log)
    return logs


def _import_files(files: Sequence[Path], log: Path) -> None:
    if not log.exists():
        run_mrbench("import", *files, "--out", log)


def compute_errors(fit: JointFit, seen: Dataset, unseen: Dataset) -> dict[str, Any]:
    """Errors of a fit on fitted and on unseen strokes, and its effects."""
    point, active = fit.coordinates, fit.active_effects
    delays = fit.problem.compute_residual_delays(fit.minimum.unknowns)
    by_file, rest, force = {}, [], []
    for piece in unseen.pieces:
        whole = replace(piece, train=np.ones(len(piece.force)))
        error = (
            predict_piece(whole, point, (float(delays[0]), float(delays[1])), effects=active).force - piece.force
        )
        by_file[piece.name] = compute_nrmse(error, piece.force)
        rest.append(error)
        force.append(piece.force)
    own = np.concatenate([e[p.train > 0] for e, p in zip(fit.force_errors, seen.pieces, strict=True)])
    known = np.concatenate([p.force[p.train > 0] for p in seen.pieces])
    return {
        "fitted": compute_nrmse(own, known),
        "unseen": compute_nrmse(np.concatenate(rest), np.concatenate(force)),
        "unseen_n": compute_rmse(np.concatenate(rest)),
        "effects": fit.values,
        "deviations": {k: {s: float(d) for s, d in v.items()} for k, v in fit.deviations.items()},
        "coordinates": point._asdict(),
        "by_file": by_file,
    }


def load_fits(logs: Logs, sets: Sequence[Names], out: Path) -> list[dict[str, Any]]:
    """The figures of every set, made once."""
    found: list[dict[str, Any]] = load_figures(out, lambda: _fit_sets(logs, sets))
    return found


def _fit_sets(logs: Logs, sets: Sequence[Names]) -> list[dict[str, Any]]:
    seen, unseen = assemble([load(logs.training)]), assemble([load(logs.validation)])
    problem = make_diagnosis_problem(seen, EvaluationData.make(seen).pieces)
    last, found = None, []
    for names in sets:
        last = fit_jointly(problem, tuple(EffectModel(*name) for name in names), last, _EFFORT)
        found.append({"set": [list(name) for name in names], **compute_errors(last, seen, unseen)})
        print(names, found[-1]["fitted"], found[-1]["unseen"], file=sys.stderr, flush=True)
    return found


def render_table(found: Sequence[dict[str, Any]]) -> str:
    """One row a set."""
    rows = [
        "| beside the law | NRMSE fitted | **NRMSE unseen** | RMSE unseen | sizes |",
        "| --- | ---: | ---: | ---: | --- |",
    ]
    for f in found:
        names = ", ".join(f"`{name}` ({form})" for name, form in f["set"]) or "nothing"
        sizes = "; ".join(f"{s} {v:.3g}" for values in f["effects"].values() for s, v in values.items()) or "–"
        rows.append(f"| {names} | {f['fitted']:.4f} | **{f['unseen']:.4f}** | {f['unseen_n']:.1f} N | {sizes} |")
    return "\n".join(rows)


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--keep", type=Path, required=True, help="folder for logs, diagnoses and figures")
    options.add_argument("--diagnose", action="store_true", help="diagnose the fitted logs as well")
    asked = options.parse_args()
    data = Path(os.environ.get("MRBENCH_SHARED", ".")) / "data"
    asked.keep.mkdir(parents=True, exist_ok=True)
    for name, make in (("utfsm", import_sines), ("nees", import_random_stroke)):
        logs = make(data, asked.keep)
        diagnosis = asked.keep / f"{name}.diagnosis.json"
        if asked.diagnose and not diagnosis.exists():
            run_mrbench("diagnose", logs.training, "--out", diagnosis)
        found = load_fits(logs, SETS[name], asked.keep / f"{name}.json")
        print(f"\n## {name}\n\n{render_table(found)}\n")
        print("\n".join(f"| `{file}` | {error:.3f} |" for file, error in found[-1]["by_file"].items()))


if __name__ == "__main__":
    main()
