"""Force to expect of planned strokes, simulated from a fit, with its 95 % band."""

from importlib.metadata import version

import numpy as np

from identification.documents import Fit, ForceSeries, Forecast, Provenance
from identification.errors import IdentificationError
from identification.experiment_design import PlannedStrokes
from identification.fitting import Piece, PiecePrediction, make_damper_model, make_piece_model
from identification.predict.bands import (
    compute_limits,
    estimate_force_uncertainty,
    estimate_record_noise,
    find_unobserved_active,
    make_band,
)


def forecast_force(fit: Fit, planned: PlannedStrokes) -> tuple[Forecast, ForceSeries]:
    """Simulate a fit on planned strokes; the inner displacement starts at the displacement.

    Raises:
        IdentificationError: the drives of strokes and fit have different units.
    """
    if planned.drive_unit != fit.drive_unit:
        raise IdentificationError(
            f"{planned.method} is driven in {planned.drive_unit}, the fit in {fit.drive_unit}; give another method"
        )
    model, stroke = make_damper_model(fit), planned.excitation
    count = len(stroke.displacement)
    piece = Piece(planned.method, stroke, np.zeros(count), np.zeros(count))
    y0 = float(stroke.displacement[0])
    force = piece.simulate(make_piece_model(piece, model.coordinates, (0.0, 0.0), y0, ()))[0]
    prediction, noise = PiecePrediction(force, y0, 0.0), estimate_record_noise(fit, None)
    uncertainty = estimate_force_uncertainty(fit, model, piece, prediction, noise)
    unobserved = find_unobserved_active(fit, model, piece, prediction, noise)
    document = Forecast(
        method=planned.method,
        samples=count,
        largest_force_n=float(np.abs(force).max()),
        band=make_band(fit, [uncertainty], None, [stroke.sampled_drive], unobserved),
        provenance=Provenance(
            logs=fit.provenance.logs, version=version("mrbench"), seed=fit.provenance.seed, settings={"free": None}
        ),
    )
    series = ForceSeries(
        time=stroke.time,
        displacement=stroke.displacement,
        velocity=stroke.velocity,
        drive=stroke.sampled_drive,
        force=np.full(count, np.nan),
        simulated=force,
        stretch=np.zeros(count, np.int64),
        held_out=np.ones(count, bool),
        names=(planned.method,),
        drive_unit=planned.drive_unit,
        band=compute_limits(force, uncertainty),
    )
    return document, series
