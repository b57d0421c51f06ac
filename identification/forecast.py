"""A fit on planned strokes: the force to expect, with its band, before anything is recorded."""

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from identification.bands import band, force_spread, limits, record_noise, shown_but_unseen
from identification.errors import IdentificationError
from identification.foresight.planned import Planned, read_planned
from identification.gap.model import model_of_fit
from identification.piece import Piece
from identification.prediction import Predicted, piece_setting
from identification.results import Fit, Forecast, Provenance
from identification.series import Series

COMPILE = (sys.executable, "-m", "bench.cli", "run")
"""Command that makes a method's exact samples; the method and options follow."""
_LONGEST = 300.0
"""[s] after which it is given up."""


def planned_strokes(method: str, command: tuple[str, ...] = COMPILE) -> Planned:
    """The exact samples of a method, from the bench.

    Args:
        method: a shipped method by its name, or a file of one; or planned strokes that the bench has written.
        command: what compiles a method.

    Raises:
        IdentificationError: there is no such method, or it cannot be compiled.
    """
    if method.endswith(".npz"):
        return read_planned(Path(method))
    with TemporaryDirectory(prefix="mrbench-") as folder:
        samples = Path(folder) / "planned.npz"
        words = [*command, method, "--dry-run", "--planned", str(samples)]
        # A process, since nothing of the bench is imported here (decision 0009).
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=_LONGEST, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise IdentificationError(
                f"{method}: is neither a log nor a method that compiles ({error})"
            ) from error
        if done.returncode != 0:
            said = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
            raise IdentificationError(f"{method}: is no log, and as a method: {said.removeprefix('mrbench: ')}")
        return read_planned(samples)


def forecast(fit: Fit, planned: Planned) -> tuple[Forecast, Series]:
    """Simulate a fit on planned strokes; the damper starts at rest, y where the piston is.

    Raises:
        IdentificationError: the strokes are driven in another unit than the fit.
    """
    if planned.drive_unit != fit.drive_unit:
        raise IdentificationError(
            f"{planned.method} is driven in {planned.drive_unit}, the fit in {fit.drive_unit}; give another method"
        )
    model, stroke = model_of_fit(fit), planned.stroke
    count = len(stroke.displacement)
    piece = Piece(planned.method, stroke, np.zeros(count), np.zeros(count))
    y0 = float(stroke.displacement[0])
    force = piece.recorded(piece_setting(piece, model.point, (0.0, 0.0), y0, ()))[0]
    found, noise = Predicted(force, y0, 0.0), record_noise(fit, None)
    spread = force_spread(fit, model, piece, found, noise)
    unseen = shown_but_unseen(fit, model, piece, found, noise)
    document = Forecast(
        method=planned.method,
        samples=count,
        largest_force_n=float(np.abs(force).max()),
        band=band(fit, [spread], None, [stroke.drive_seen], unseen),
        provenance=Provenance(
            logs=fit.provenance.logs, version=version("mrbench"), seed=fit.provenance.seed, settings={"free": None}
        ),
    )
    series = Series(
        time=stroke.time,
        displacement=stroke.displacement,
        velocity=stroke.velocity,
        drive=stroke.drive_seen,
        force=np.full(count, np.nan),
        simulated=force,
        stretch=np.zeros(count, np.int64),
        held_out=np.ones(count, bool),
        names=(planned.method,),
        drive_unit=planned.drive_unit,
        band=limits(force, spread),
    )
    return document, series
