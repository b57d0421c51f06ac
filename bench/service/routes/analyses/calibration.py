"""Route of the intervals of a fit with the calibration of its channels."""

from collections.abc import Mapping

from fastapi import APIRouter
from pydantic import Field

from bench.calibration import GAIN_FORMULA, combine_estimates
from bench.catalogue import read_log_summary
from bench.jobs import FIT_FILE
from bench.report import Estimate, Fit, read_fit
from bench.service.context import Context
from bench.service.problems import make_conflict
from bench.service.routes.results import find_newest
from bench.service.views import View

router = APIRouter(prefix="/runs", tags=["results"])


class CalibratedInterval(View):
    """Interval of one parameter with the calibration."""

    value: float = Field(description="estimate of the fit, in `unit`")
    unit: str
    ci95: tuple[float, float] | None = Field(
        description="95 % interval with the calibration, in `unit`; null if the fit has none, or a channel no "
        "certificate"
    )
    calibration: float | None = Field(
        description="[1] relative standard uncertainty from the calibration; null if a channel has no certificate"
    )
    missing: tuple[str, ...] = Field(description="gains without a certificate: force, displacement, drive")


class CalibratedFit(View):
    """Intervals of the newest fit of a run with the calibration; the fit itself is unchanged."""

    fit: str = Field(description="id of the fit")
    formula: str = Field(description="combination of both uncertainties, as text")
    coordinates: dict[str, CalibratedInterval]
    parameters: dict[str, CalibratedInterval]


@router.get("/{run_id}/fit/calibration")
def get_calibrated_fit(run_id: str, context: Context) -> CalibratedFit:
    """Return the intervals of the newest fit, combined in quadrature with those of the calibration.

    Refused for a fit of further logs, whose channels may have had other certificates.
    """
    row, job = context.get_run(run_id), find_newest(context, run_id, "identify")
    fit = read_fit(context.catalogue.resolve_path(job.result or "") / FIT_FILE)
    if list(fit.provenance.logs.values()) != [row.log_sha256] or "n" not in fit.parameters:
        detail = f"fit {job.id} is not of the log of run {run_id} alone; no certificates belong to it"
        raise make_conflict("several-logs", "The fit is of several logs", detail)
    record = read_log_summary(context.locate_log(row)).calibration
    coordinates, parameters = (_combine(part, fit, record) for part in (fit.coordinates, fit.parameters))
    return CalibratedFit(fit=job.id, formula=GAIN_FORMULA, coordinates=coordinates, parameters=parameters)


def _combine(part: Mapping[str, Estimate], fit: Fit, record: Mapping[str, str]) -> dict[str, CalibratedInterval]:
    estimates = {name: one.model_dump(include={"value", "unit", "ci95"}) for name, one in part.items()}
    combined = combine_estimates(estimates, fit.parameters["n"].value, record)
    return {name: CalibratedInterval(**estimates[name] | one._asdict()) for name, one in combined.items()}
