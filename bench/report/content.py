"""The rows of the report's tables: every number rounded to what is known of it, with its unit."""

from datetime import datetime
from typing import NamedTuple

import orjson
from markupsafe import Markup, escape

from bench.recorder.reader import Log
from bench.report.documents import Delay, DriveError, Estimate, Fit
from bench.report.summary import is_gauge
from bench.report.values import level, newton, percent, quantity, significant, times, unit_text
from identification.damper.coordinates import COORDINATES
from identification.damper.parameters import PARAMETERS

_GREEK = {"alpha": "α", "beta": "β", "gamma": "γ", "eta": "η", "rho": "ρ"}
_MEANINGS = {
    "parameters": {quantity.symbol: quantity.meaning for quantity in PARAMETERS},
    "coordinates": {quantity.symbol: quantity.meaning for quantity in COORDINATES},
}
_GAUGE = "rescaling α, β and γ along with it leaves every force as it is, so it is fixed by convention"
_MOSTLY_NOISE = 2.0
"""[1] spread of the force over the noise floor below which an NRMSE says nothing."""


class ParameterRow(NamedTuple):
    """One parameter."""

    symbol: Markup
    name: str
    value: str
    unit: str
    known: str
    """fixed, not fixed or gauge."""
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


Facts = list[tuple[str, str]]
"""Name and value, in words."""


def symbol(name: str) -> Markup:
    """A parameter's name as it is typeset: ``c0_a`` as c with the index 0a."""
    head, _, tail = name.partition("_")
    letters = head.rstrip("0123456789")
    index = head[len(letters) :] + tail
    body = escape(_GREEK.get(letters, letters))
    return Markup("<i>{}</i>").format(body) + (Markup("<sub>{}</sub>").format(index) if index else Markup())


def parameter_rows(estimates: dict[str, Estimate], form: str) -> list[ParameterRow]:
    """A table of parameters.

    Args:
        estimates: by name.
        form: ``parameters`` or ``coordinates``.
    """
    return [_parameter_row(name, estimate, _MEANINGS[form].get(name, "")) for name, estimate in estimates.items()]


def _parameter_row(name: str, estimate: Estimate, meaning: str) -> ParameterRow:
    shown = quantity(estimate.value, estimate.ci95, estimate.unit)
    known = "gauge" if is_gauge(name, estimate) else "fixed" if estimate.identifiable else "not fixed"
    note = _GAUGE if known == "gauge" else estimate.note.removeprefix(f"{meaning}: ")
    return ParameterRow(symbol(name), name, shown.value, shown.unit, known, meaning, note)


def drive_rows(errors: list[DriveError], floor: float) -> list[DriveRow]:
    """The force error by drive; ``floor`` is the noise of the force [N]."""
    span = max((e.drive for e in errors), default=0.0) - min((e.drive for e in errors), default=0.0)
    return [
        DriveRow(
            f"{level(e.drive, span)} {e.unit}",
            newton(e.rmse_n),
            times(e.rmse_n / floor) if floor > 0 else "–",
            percent(e.nrmse),
            e.samples,
            "hardly any force but noise" if e.rmse_n / max(e.nrmse, 1e-12) < _MOSTLY_NOISE * floor else "",
        )
        for e in errors
    ]


def delay_text(delay: Delay) -> str:
    """A lag, and whether the clocks explain it."""
    if delay.ci95 is None:
        return "cannot be seen in these strokes"
    verdict = "more than the clocks explain" if delay.outside_prior else "within what the clocks explain"
    prior = quantity(delay.prior_sd, None, "s")
    return f"{quantity(delay.value, delay.ci95, 's')} ({verdict}: {prior} standard deviation)"


def floor_facts(fit: Fit) -> Facts:
    """How the noise floor of the fitted recordings was got."""
    repeated = fit.floor.cycle_to_cycle
    return [
        ("Noise floor", f"{newton(fit.noise_floor_n)}: {fit.floor.how}"),
        ("From repeated cycles", "nothing repeats" if repeated is None else newton(repeated)),
        ("From what is too swift for a damper", newton(fit.floor.high_frequency)),
    ]


def nuisance_facts(fit: Fit) -> Facts:
    """What was estimated along with the damper."""
    starts = fit.nuisances.y0
    inner = [f"{name}: {quantity(value, None, 'm')}" for name, value in starts.items()]
    return [
        ("Lag of force behind displacement", delay_text(fit.nuisances.force_delay)),
        ("Further lag of force behind drive", delay_text(fit.nuisances.drive_delay)),
        ("Inner displacement at the start", "; ".join(inner)),
    ]


def correlation_facts(fit: Fit) -> Facts:
    """Pairs that the strokes hardly tell apart."""
    return [
        (f"{pair.replace(',', ' and ')}", f"{value:+.3f}".replace("-", "−"))
        for pair, value in sorted(fit.correlations.items(), key=lambda item: -abs(item[1]))
    ]


def header_facts(log: Log, sha256: str) -> Facts:
    """What the recording says of itself."""
    run = log.metadata.get("run", {})
    time = log.samples["time"]
    facts = [
        ("Run", _short(run.get("id", ""))),
        ("Specimen", run.get("specimen", "")),
        ("Method", _short(run.get("method", ""))),
        ("Recorded", _when(run.get("utc_offset", ""))),
        ("Operator", run.get("operator", "")),
        ("Length", f"{len(time)} samples, {significant(float(time[-1]), 4)} s"),
        ("Drive", f"{run.get('drive_kind', '')} [{run.get('drive_unit', '')}]"),
        ("Recorded with", _pairs(run.get("versions", ""))),
        ("Log", log.path.name),
        ("SHA-256", sha256),
    ]
    return [(name, value) for name, value in facts if value]


def _when(utc: str) -> str:
    try:
        return f"{datetime.fromisoformat(utc):%Y-%m-%d %H:%M:%S} UTC"
    except ValueError:
        return "not known"


def _short(text: str, longest: int = 120) -> str:
    return text if len(text) <= longest else f"{text[:longest].rpartition(', ')[0] or text[:longest]}, …"


def _pairs(text: str) -> str:
    """A JSON object as words."""
    try:
        return ", ".join(f"{name} {value}" for name, value in orjson.loads(text).items())
    except (orjson.JSONDecodeError, AttributeError):
        return text


def channel_rows(log: Log) -> list[tuple[str, str, str, str, str]]:
    """Name, unit, rate, filter and delay of every channel, as read back from its instrument."""
    return [_channel_row(name, text) for name, text in log.metadata.get("channels", {}).items()]


def _channel_row(name: str, text: str) -> tuple[str, str, str, str, str]:
    said = orjson.loads(text)
    kept = said.get("filter")
    words = (
        f"{kept.get('kind', '')}, order {kept.get('order', '')}, {kept.get('cutoff_hz', 0.0):g} Hz"
        if kept
        else "none"
    )
    unit, rate = unit_text(str(said.get("unit", ""))), f"{said.get('rate_hz', 0.0):g} Hz"
    return name, unit.replace("degC", "°C"), rate, words, str(quantity(said.get("delay_s", 0.0), None, "s"))


def outcome_facts(log: Log) -> Facts:
    """How the recording ended, with what was counted."""
    outcome = log.metadata.get("outcome", {})
    names = {"/bench/sample": "samples", "/bench/segment": "segment marks", "/bench/event": "events"}
    counts = ", ".join(f"{outcome[topic]} {name}" for topic, name in names.items() if topic in outcome)
    lost = _pairs(outcome.get("lost", ""))
    units = log.metadata.get("units", {})
    facts = [
        (
            "Outcome",
            " – ".join(word for word in (outcome.get("outcome", "not known"), outcome.get("reason", "")) if word),
        ),
        ("Messages", counts),
        ("Lost readings", lost or "none"),
        ("Velocity from", units.get("velocity_from", "")),
        ("Resampled", units.get("resampled", "")),
        ("Alarms", "; ".join(str(e.get("text", "")) for e in log.events if e.get("kind") == "alarm") or "none"),
    ]
    return [(name, value) for name, value in facts if value]


def provenance_facts(fit: Fit) -> Facts:
    """What the fit was made from and how."""
    p = fit.provenance
    stages = "; ".join(
        f"{s.name}: {newton(s.rmse_n)} after {s.iterations} steps, {significant(s.seconds, 2)} s of processor time"
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
