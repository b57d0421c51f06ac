"""The damper with what a diagnosis has found: a scenario that the simulated rig plays and `predict` simulates."""

from importlib.metadata import version
from typing import cast

import numpy as np

from identification.assemble import Assembled
from identification.damper.coordinates import to_parameters
from identification.gap.contender import Contender
from identification.gap.documents import DriveKind, Twin, TwinEffect
from identification.gap.judge import Judge
from identification.gap.model import named_effects
from identification.gap.residual import by_piece
from identification.motion import recorded_noise
from identification.prediction import normalised, per_drive, rmse
from identification.problem import COORDINATE_COUNT
from identification.results import Delay, Errors, Fit, NoiseFloor, Nuisances, Provenance, Stage
from identification.uncertainty import (
    coordinate_covariance,
    coordinate_estimates,
    covariance,
    parameter_estimates,
    strong_correlations,
)

_SMALLEST_K1 = 1e-3
"""[N/m] below which x0 = f0 / k1 is no number."""


def twin_of(
    assembled: Assembled, named: Contender, baseline: Fit, floor: float, specimen: str, provenance: Provenance
) -> Twin:
    """The scenario of a diagnosis.

    Args:
        assembled: the recordings.
        named: the named set, fitted; the plain law where none is named.
        baseline: the fit without effects.
        floor: noise of the force [N].
        specimen: name of the damper.
        provenance: of the diagnosis.
    """
    noise = float(np.median([recorded_noise(s) for s in assembled.stretches]))
    effects = [TwinEffect.model_validate(e) for e in named_effects(named.fit.active)]
    with_ = ", ".join(e.name for e in effects) or "no effect"
    point = named.fit.coordinates
    if abs(point.k1) < _SMALLEST_K1:
        point = point._replace(k1=_SMALLEST_K1)
    return Twin(
        description=f"twin of {specimen or 'a damper'}: the law with {with_}",
        damper=to_parameters(point)._asdict(),
        drive_kind=cast(DriveKind, baseline.drive_kind),
        drive_unit="A" if baseline.drive_unit == "A" else "V",
        effects=effects,
        sensors={"force": {"noise": floor}, "displacement": {"noise": noise}},
        nuisances=_nuisances(named),
        baseline=baseline,
        provenance=provenance,
    )


def baseline_fit(
    assembled: Assembled, judge: Judge, plain: Contender, floor: float, provenance: Provenance
) -> Fit:
    """The fit without effects as a document, judged on the strokes that a diagnosis keeps out."""
    problem, minimum = plain.fit.problem, plain.fit.minimum
    found = covariance(problem, minimum)
    spread = coordinate_covariance(problem, minimum, found)
    names = np.array(plain.fit.coordinates._fields)
    seen, inside = found.seen[:COORDINATE_COUNT], found.inside[:COORDINATE_COUNT]
    unit = assembled.drive_unit
    coordinates = coordinate_estimates(
        plain.fit.coordinates, spread, set(names[~seen]), set(names[seen & ~inside]), unit
    )
    errors = [-part for part in by_piece(plain.left.residual, judge.pieces)]
    return Fit(
        specimen=assembled.recordings[0].metadata["run"].get("specimen", ""),
        drive_kind=assembled.recordings[0].drive_kind,
        drive_unit=unit,
        drive_range=(problem.space.lowest_drive, problem.space.highest_drive),
        parameters=parameter_estimates(plain.fit.coordinates, spread, coordinates, unit),
        coordinates=coordinates,
        nuisances=_nuisances(plain),
        noise_floor_n=floor,
        floor=NoiseFloor(
            cycle_to_cycle=assembled.floor.cycle_to_cycle,
            high_frequency=assembled.floor.high_frequency,
            how=assembled.floor.how,
        ),
        rmse_n=Errors(train=plain.seen, validation=None, held_out=plain.unseen),
        nrmse=Errors(
            train=normalised(plain.left.residual[judge.seen], judge.force[judge.seen]),
            validation=None,
            held_out=normalised(plain.left.residual[judge.unseen], judge.force[judge.unseen]),
        ),
        per_drive=per_drive([p.stroke.drive for p in judge.pieces], errors, [p.force for p in judge.pieces], unit),
        stages=[
            Stage(
                name="refine",
                seconds=0.0,
                rmse_n=rmse(plain.left.residual[judge.seen]),
                iterations=minimum.iterations,
                note="as the diagnosis starts from it: channels taken as recorded",
            )
        ],
        agreement=None,
        result="converged" if minimum.converged else f"not converged: stopped after {minimum.iterations} steps",
        correlations=strong_correlations(spread),
        provenance=Provenance(
            logs=provenance.logs, version=version("mrbench"), seed=provenance.seed, settings={"stages": "refine"}
        ),
    )


def _nuisances(contender: Contender) -> Nuisances:
    """y(0) of each stretch, and the lags that the fit left in the channels beside what their clocks say."""
    unknowns, problem = contender.fit.minimum.unknowns, contender.fit.problem
    most = 1e6 * problem.delay_limit * problem.delay_prior
    force, drive = (
        Delay(
            value=float(unknowns[at]) * problem.delay_prior,
            ci95=None,
            prior_sd=problem.delay_prior,
            outside_prior=False,
            note=f"no more than {most:.3g} µs: what is later is an effect here",
        )
        for at in (COORDINATE_COUNT, COORDINATE_COUNT + 1)
    )
    starts = {p.name: problem.setting(unknowns, i).y0 for i, p in enumerate(problem.pieces)}
    return Nuisances(y0=starts, force_delay=force, drive_delay=drive)
