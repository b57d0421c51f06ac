"""Rows of the report's tables, with every number rounded to its uncertainty and with its unit."""

from typing import NamedTuple

import orjson
from markupsafe import Markup, escape

from bench.endings import read_ending
from bench.log import Log, utc_at
from bench.report.documents import DelayEstimate, DriveError, Estimate, Fit
from bench.report.summary import is_gauge
from bench.report.values import (
    format_drive,
    format_force,
    format_percent,
    format_quantity,
    format_ratio,
    format_significant,
    format_unit,
)
from identification.damper import COORDINATES, PARAMETERS

_GREEK = {"alpha": "α", "beta": "β", "gamma": "γ", "eta": "η", "rho": "ρ"}
_MEANINGS = {
    "parameters": {quantity.symbol: quantity.meaning for quantity in PARAMETERS},
    "coordinates": {quantity.symbol: quantity.meaning for quantity in COORDINATES},
}
_GAUGE_NOTE = "rescaling it together with α, β and γ changes no force, so its value is a convention"
_MIN_FORCE_TO_NOISE = 2.0
"""Threshold on the standard deviation of the force over the noise floor: below it, an NRMSE has no meaning."""


class ParameterRow(NamedTuple):
    """One parameter."""

    symbol: Markup
    name: str
    value: str
    unit: str
    certainty: str
    """known, not known or gauge."""
    meaning: str
    note: str


class DriveRow(NamedTuple):
    """The force error at one drive."""

    drive: str
    rmse: str
    over_floor: str
    nrmse: str
    samples: int
    note: str


PropertyRows = list[tuple[str, str]]
"""Rows of name and value as text."""


def format_symbol(name: str) -> Markup:
    """Return the typeset name of a parameter: ``c0_a`` is c with the index 0a."""
    head, _, tail = name.partition("_")
    letters = head.rstrip("0123456789")
    index = head[len(letters) :] + tail
    body = escape(_GREEK.get(letters, letters))
    return Markup("<i>{}</i>").format(body) + (Markup("<sub>{}</sub>").format(index) if index else Markup())


def make_parameter_rows(estimates: dict[str, Estimate], form: str) -> list[ParameterRow]:
    """Make the rows of a table of parameters.

    Args:
        estimates: estimates by name.
        form: ``parameters`` or ``coordinates``.
    """
    return [
        _make_parameter_row(name, estimate, _MEANINGS[form].get(name, "")) for name, estimate in estimates.items()
    ]


def _make_parameter_row(name: str, estimate: Estimate, meaning: str) -> ParameterRow:
    quantity = format_quantity(estimate.value, estimate.ci95, estimate.unit)
    certainty = "gauge" if is_gauge(name, estimate) else "known" if estimate.identifiable else "not known"
    note = _GAUGE_NOTE if certainty == "gauge" else estimate.note.removeprefix(f"{meaning}: ")
    return ParameterRow(format_symbol(name), name, quantity.value, quantity.unit, certainty, meaning, note)


def make_drive_rows(errors: list[DriveError], floor: float) -> list[DriveRow]:
    """Make the rows of the force error by drive; ``floor`` is the noise floor [N]."""
    span = max((e.drive for e in errors), default=0.0) - min((e.drive for e in errors), default=0.0)
    return [
        DriveRow(
            f"{format_drive(e.drive, span)} {e.unit}",
            format_force(e.rmse_n),
            format_ratio(e.rmse_n / floor) if floor > 0 else "–",
            format_percent(e.nrmse),
            e.samples,
            "mostly noise" if e.rmse_n / max(e.nrmse, 1e-12) < _MIN_FORCE_TO_NOISE * floor else "",
        )
        for e in errors
    ]


def format_delay(delay: DelayEstimate) -> str:
    """Describe a delay, and whether the clock errors explain it."""
    if delay.ci95 is None:
        return "not observable with these strokes"
    verdict = "more than the clock errors explain" if delay.outside_prior else "explained by the clock errors"
    prior = format_quantity(delay.prior_sd, None, "s")
    return f"{format_quantity(delay.value, delay.ci95, 's')} ({verdict}: {prior} standard deviation)"


def make_floor_rows(fit: Fit) -> PropertyRows:
    """Make the rows of the noise floor and its estimates."""
    cycle_to_cycle = fit.floor.cycle_to_cycle
    return [
        ("Noise floor", f"{format_quantity(fit.noise_floor_n, fit.floor.ci95, 'N')}: {fit.floor.basis}"),
        ("From repeated cycles", "no repeated cycles" if cycle_to_cycle is None else format_force(cycle_to_cycle)),
        ("From frequencies above those of a damper", format_force(fit.floor.high_frequency)),
    ]


def make_nuisance_rows(fit: Fit) -> PropertyRows:
    """Make the rows of the quantities estimated together with the damper."""
    starts = fit.nuisances.y0
    inner = [f"{name}: {format_quantity(value, None, 'm')}" for name, value in starts.items()]
    return [
        ("Delay of force behind displacement", format_delay(fit.nuisances.force_delay)),
        ("Additional delay of force behind drive", format_delay(fit.nuisances.drive_delay)),
        ("Inner displacement at the start", "; ".join(inner)),
    ]


def make_correlation_rows(fit: Fit) -> PropertyRows:
    """Make the rows of the strongly correlated pairs of coordinates."""
    return [
        (f"{pair.replace(',', ' and ')}", f"{value:+.3f}".replace("-", "−"))
        for pair, value in sorted(fit.correlations.items(), key=lambda item: -abs(item[1]))
    ]


def make_header_rows(log: Log, sha256: str) -> PropertyRows:
    """Make the rows of the recording's identity."""
    run = log.metadata.get("run", {})
    time = log.samples["time"]
    rows = [
        ("Run", _shorten(run.get("id", ""))),
        ("Specimen", run.get("specimen", "")),
        ("Method", _shorten(run.get("method", ""))),
        ("Recorded", _format_start_time(run.get("utc_offset", ""), int(log.samples["time_ns"][0]))),
        ("Operator", run.get("operator", "")),
        ("Length", f"{len(time)} samples, {format_significant(float(time[-1]), 4)} s"),
        ("Ending", _describe_ending(log)),
        ("Continues", _shorten(run.get("continues", ""))),
        ("Drive", f"{run.get('drive_kind', '')} [{run.get('drive_unit', '')}]"),
        ("Recorded with", _format_pairs(run.get("versions", ""))),
        ("Log", log.path.name),
        ("SHA-256", sha256),
    ]
    return [(name, value) for name, value in rows if value]


def _describe_ending(log: Log) -> str:
    """Return the ending of the run with its reason; empty for an import, and if it is not known."""
    if log.metadata.get("run", {}).get("source") != "run":
        return ""
    record = log.metadata.get("outcome", {})
    return ": ".join(filter(None, [read_ending(record), record.get("reason", "")]))


def _format_start_time(utc_offset: str, first_ns: int) -> str:
    """Format UTC of the first sample; the bench clock may have started weeks before."""
    start = utc_at(utc_offset, first_ns)
    return "not known" if start is None else f"{start:%Y-%m-%d %H:%M:%S} UTC"


def _shorten(text: str, length: int = 120) -> str:
    return text if len(text) <= length else f"{text[:length].rpartition(', ')[0] or text[:length]}, …"


def _format_pairs(text: str) -> str:
    """Format a JSON object as names and values."""
    try:
        return ", ".join(f"{name} {value}" for name, value in orjson.loads(text).items())
    except (orjson.JSONDecodeError, AttributeError):
        return text


def make_channel_rows(log: Log) -> list[tuple[str, str, str, str, str]]:
    """Make the rows of name, unit, rate, filter and delay of every channel."""
    return [_make_channel_row(name, text) for name, text in log.metadata.get("channels", {}).items()]


def _make_channel_row(name: str, text: str) -> tuple[str, str, str, str, str]:
    info = orjson.loads(text)
    low_pass = info.get("filter")
    filter_text = (
        f"{low_pass.get('kind', '')}, order {low_pass.get('order', '')}, {low_pass.get('cutoff_hz', 0.0):g} Hz"
        if low_pass
        else "none"
    )
    unit = format_unit(str(info.get("unit", ""))).replace("degC", "°C")
    delay = str(format_quantity(info.get("delay_s", 0.0), None, "s"))
    return name, unit, f"{info.get('rate_hz', 0.0):g} Hz", filter_text, delay


def make_outcome_rows(log: Log) -> PropertyRows:
    """Make the rows of the recording's outcome and its counts."""
    outcome = log.metadata.get("outcome", {})
    names = {"/bench/sample": "samples", "/bench/segment": "segment marks", "/bench/event": "events"}
    counts = ", ".join(f"{outcome[topic]} {name}" for topic, name in names.items() if topic in outcome)
    lost = _format_pairs(outcome.get("lost", ""))
    units = log.metadata.get("units", {})
    rows = [
        (
            "Outcome",
            " – ".join(filter(None, (outcome.get("outcome", "not known"), outcome.get("reason", "")))),
        ),
        ("Messages", counts),
        ("Lost readings", lost or "none"),
        ("Velocity from", units.get("velocity_from", "")),
        ("Resampled", units.get("resampled", "")),
        ("Alarms", "; ".join(str(e.get("text", "")) for e in log.events if e.get("kind") == "alarm") or "none"),
    ]
    return [(name, value) for name, value in rows if value]


def make_provenance_rows(fit: Fit) -> PropertyRows:
    """Make the rows of the fit's logs, settings and stages."""
    p = fit.provenance
    stages = "; ".join(
        f"{s.name}: {format_force(s.rmse_n)} after {s.iterations} steps, "
        f"{format_significant(s.seconds, 2)} s of processor time"
        for s in fit.stages
    )
    settings = ", ".join(f"{name} = {value}" for name, value in p.settings.items() if value is not None)
    logs = [(f"Fitted log {name}", f"SHA-256 {digest}") for name, digest in p.logs.items()]
    agreement = [("Agreement of the stages", fit.agreement)] if fit.agreement else []
    return [
        ("Result", fit.result),
        ("Stages", stages),
        *agreement,
        *logs,
        ("Fitted with", f"mrbench {p.version}, seed {p.seed}"),
        ("Settings", settings),
    ]
