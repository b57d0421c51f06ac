"""Fits of the law with effects of the library to two real dampers, and their errors on validation strokes.

`MRBENCH_SHARED` names the folder with `data/utfsm_sine` and `data/nees_dyke`. The validation strokes are in
separate logs, so that neither fits nor diagnoses can read them; only y(0) is estimated on them. ``--keep FOLDER``
keeps logs, diagnoses and results, and continues an interrupted call. The output is the tables of
`docs/evidence/real-damper-effects.md`.
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

from benchmarks.common import load_results, run_mrbench
from identification.fitting import Dataset, EffectModel, assemble, compute_nrmse, compute_rmse, predict_piece
from identification.gap import make_diagnosis_problem
from identification.gap.data import EvaluationData
from identification.gap.fits import FitOptions, JointFit, fit_jointly
from identification.logs import load

_TEST_STROKES = ("5mm_4Hz", "25mm_0.5Hz")
_FITTED_FRACTION = 0.6
"""Fraction of the random stroke that is fitted [1]."""
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
"""Sets of effects that are fitted to each damper; each fit starts from the result of the previous one."""
_FIT_OPTIONS = FitOptions(decimation=1, starts=4, descents=2, regression_start=False, refit_full=False)


class Logs(NamedTuple):
    """Fitted and validation log of one damper."""

    training: Path
    validation: Path


def import_sines(data: Path, folder: Path) -> Logs:
    """Import the 30 sinusoidal strokes, with the validation strokes in a separate log."""
    files = sorted((data / "utfsm_sine").glob("*.csv.gz"))
    tests = [f for f in files if f.name.startswith(tuple(f"{name}_" for name in _TEST_STROKES))]
    logs = Logs(folder / "utfsm-fitted.mcap", folder / "utfsm-unseen.mcap")
    _import_files([f for f in files if f not in tests], logs.training)
    _import_files(tests, logs.validation)
    return logs


def import_random_stroke(data: Path, folder: Path) -> Logs:
    """Import the random stroke, with its end in a separate log."""
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


def compute_errors(fit: JointFit, fitted: Dataset, validation: Dataset) -> dict[str, Any]:
    """Compute the errors of a fit on fitted and on validation strokes; return them with its effects."""
    point, active = fit.coordinates, fit.active_effects
    delays = fit.problem.compute_residual_delays(fit.minimum.unknowns)
    by_file, errors, forces = {}, [], []
    for piece in validation.pieces:
        complete = replace(piece, train=np.ones(len(piece.force)))
        error = (
            predict_piece(complete, point, (float(delays[0]), float(delays[1])), effects=active).force
            - piece.force
        )
        by_file[piece.name] = compute_nrmse(error, piece.force)
        errors.append(error)
        forces.append(piece.force)
    fitted_errors = np.concatenate([e[p.train > 0] for e, p in zip(fit.force_errors, fitted.pieces, strict=True)])
    fitted_forces = np.concatenate([p.force[p.train > 0] for p in fitted.pieces])
    return {
        "fitted": compute_nrmse(fitted_errors, fitted_forces),
        "unseen": compute_nrmse(np.concatenate(errors), np.concatenate(forces)),
        "unseen_n": compute_rmse(np.concatenate(errors)),
        "effects": fit.values,
        "deviations": {k: {s: float(d) for s, d in v.items()} for k, v in fit.deviations.items()},
        "coordinates": point._asdict(),
        "by_file": by_file,
    }


def load_fits(logs: Logs, sets: Sequence[Names], out: Path) -> list[dict[str, Any]]:
    """Return the results of all sets; fit them if no results are stored."""
    found: list[dict[str, Any]] = load_results(out, lambda: _fit_sets(logs, sets))
    return found


def _fit_sets(logs: Logs, sets: Sequence[Names]) -> list[dict[str, Any]]:
    fitted, validation = assemble([load(logs.training)]), assemble([load(logs.validation)])
    problem = make_diagnosis_problem(fitted, EvaluationData.make(fitted).pieces)
    last, found = None, []
    for names in sets:
        last = fit_jointly(problem, tuple(EffectModel.from_name(*name) for name in names), last, _FIT_OPTIONS)
        found.append({"set": [list(name) for name in names], **compute_errors(last, fitted, validation)})
        print(names, found[-1]["fitted"], found[-1]["unseen"], file=sys.stderr, flush=True)
    return found


def render_table(found: Sequence[dict[str, Any]]) -> str:
    """Return the table with one row for each set."""
    rows = [
        "| effects | NRMSE fitted | **NRMSE validation** | RMSE validation | sizes |",
        "| --- | ---: | ---: | ---: | --- |",
    ]
    for f in found:
        names = ", ".join(f"`{name}` ({form})" for name, form in f["set"]) or "none"
        sizes = "; ".join(f"{s} {v:.3g}" for values in f["effects"].values() for s, v in values.items()) or "–"
        rows.append(f"| {names} | {f['fitted']:.4f} | **{f['unseen']:.4f}** | {f['unseen_n']:.1f} N | {sizes} |")
    return "\n".join(rows)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, required=True, help="folder for logs, diagnoses and results")
    parser.add_argument("--diagnose", action="store_true", help="also diagnose the fitted logs")
    options = parser.parse_args()
    data = Path(os.environ.get("MRBENCH_SHARED", ".")) / "data"
    options.keep.mkdir(parents=True, exist_ok=True)
    for name, make in (("utfsm", import_sines), ("nees", import_random_stroke)):
        logs = make(data, options.keep)
        diagnosis = options.keep / f"{name}.diagnosis.json"
        if options.diagnose and not diagnosis.exists():
            run_mrbench("diagnose", logs.training, "--out", diagnosis)
        found = load_fits(logs, SETS[name], options.keep / f"{name}.json")
        print(f"\n## {name}\n\n{render_table(found)}\n")
        print("\n".join(f"| `{file}` | {error:.3f} |" for file, error in found[-1]["by_file"].items()))


if __name__ == "__main__":
    main()
