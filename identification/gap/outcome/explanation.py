"""Explanation of a diagnosis in two sentences: the size of the gap with its cause, then a check at the rig."""

from collections.abc import Sequence

from identification.damper.effects import EFFECTS
from identification.documents import (
    Diagnosis,
    Discovery,
    EffectSet,
    Gap,
    NamedEffect,
    Remainder,
    TwinResidual,
    Verdict,
)

_EXPLAINABLE_THRESHOLD = 0.3
"""Explainable share above which the remainder counts as explainable."""
_LIKELY_ALTERNATIVE = 0.1
"""Smallest probability of an alternative that is mentioned."""
_SMALL_UNITS = {"m": ((1e6, "µm", 1e-3), (1e3, "mm", 1.0)), "s": ((1e3, "ms", 1.0),)}
"""Units of small values, each with its factor and the value [SI] below which it is used."""
_CHECKS: dict[str, str] = {
    "field_saturation": "step the drive upwards at one stroke, and find where the force stops increasing",
    "magnetic_remanence": "compare the force at one drive on the way up and on the way down, then demagnetise",
    "coil_lag": "record the coil current over a drive step, and look for a driver delay or eddy currents",
    "gas_spring": "measure the force at rest at several positions, and the gas pressure",
    "seal_friction": "move slowly at zero drive through many reversals, and inspect the rod seal",
    "orifice_turbulence": "repeat the stroke at twice the speed and zero drive",
    "direction_asymmetry": "compare extension and compression at the same speed, and inspect valves and piston",
    "viscous_heating": "repeat the first stroke cold and warm, with the temperature recorded",
    "end_stop": "shorten the stroke, and check whether the force at its end disappears",
    "clevis_backlash": "check the clevis pins for backlash, and preload or replace them",
    "fixture_compliance": "clamp the damper's ends, and measure the deformation of the fixture under load",
    "moving_mass": "weigh the moving parts between load cell and damper, or run the bench without the damper",
    "force_delay": "look up filter and delay of the force channel, and tap the load cell next to an accelerometer",
    "force_drift": "zero the load cell unloaded before and after the run, and let it warm up",
    "mains_hum": "check shield and earth of the load cell's cable",
    "displacement_nonlinearity": "calibrate the displacement sensor over the whole stroke",
    "force_filter": "look up the low-pass of the force channel",
    "displacement_delay": "look up filter and delay of the displacement channel",
    "shear_thinning": "repeat the stroke at several speeds and zero drive",
    "side_load_friction": "align the ends of the damper, and check the rod for bending",
    "coil_resistance_drift": "record the coil current, and measure the coil's resistance cold and warm",
    "driver_slew": "record the coil current over large steps of the drive",
    "cavitation_void": "turn the damper upside down, bleed it, and raise the gas pressure",
    "fluid_compressibility": "bleed the damper, and repeat a small fast stroke",
    "drive_dependent_shape": "repeat slow reversals at every drive, and compare the shape of the loops",
    "bypass_leak": "move very slowly at zero drive, and check whether the force at low speed drops",
    "settling_after_rest": "repeat the first stroke after rests of different length",
    "gas_heating": "record the force at rest after long strokes while the damper cools",
    "force_ringing": "tap the fixture, and find its natural frequency in the force",
    "clock_drift": "compare the clocks of the instruments over the whole recording",
    "sample_hold": "look up the update rate of the force channel",
    "coil_crosstalk": "separate the cables of coil and load cell, and step the drive at rest",
}
"""Check at the rig for each suspected effect."""


def suggest_check(name: str) -> str:
    """Return the check at the rig for a suspected effect."""
    return _CHECKS.get(name, "repeat the stroke at other drives and speeds")


def explain_diagnosis(
    verdict: Verdict,
    gap: Gap,
    effects: Sequence[NamedEffect],
    alternatives: Sequence[EffectSet],
    remainder: str,
) -> str:
    """Return two sentences for a person.

    Args:
        verdict: verdict of the diagnosis.
        gap: size of the gap.
        effects: the named effects, the largest share first.
        alternatives: other sets that the data allow.
        remainder: sentence about the unexplained part.
    """
    if verdict == "no_gap":
        return (
            f"The error of the refitted law on held-out strokes is {gap.before_n:.3g} N, and noise accounts for "
            f"{gap.noise_floor_n:.3g} N of it. Nothing needs to be added to the simulation."
        )
    size = (
        f"The refitted law misses the force on held-out strokes by {gap.before_n:.3g} N, and noise alone causes "
        f"{gap.noise_floor_n:.3g} N"
    )
    if verdict == "unexplained":
        return f"{size}, and no known effect explains the difference. {remainder}"
    cause = f"{_describe_effects(effects)} {_describe_shrinkage(gap, len(effects))}"
    return f"{size}; {cause}. {_describe_checks(verdict, effects, alternatives, remainder)}"


def describe_nearest(names: Sequence[str], before: float, after: float, floor: float) -> str:
    """Return the note on the most similar known effects where none is named.

    Args:
        names: names of these effects.
        before: error of the refitted law on held-out strokes [N].
        after: the same with the effects [N].
        floor: noise of the force [N].
    """
    return (
        f"closest known effects: {' with '.join(names)} would reduce the error on held-out strokes from "
        f"{before:.3g} to {after:.3g} N, {after / floor:.3g} times the noise floor; this is too much to name them"
    )


def describe_discovery(discovery: Discovery, before: float) -> str:
    """Return the note on a cause outside the library; ``before`` is the error of the refitted law [N]."""
    place, variables = discovery.place.replace("_", " "), " and ".join(discovery.variables).replace("_", " ")
    function = f"the formula {discovery.formula.expression}" if discovery.formula else "an estimated curve"
    return (
        f"outside the library: {function} at the {place}, over {variables}, reduces the error on held-out strokes "
        f"from {before:.3g} to {discovery.rmse_n:.3g} N"
    )


def describe_learned_residual(residual: TwinResidual | None) -> str:
    """Return the note on the learned residual; None where none predicts conditions that were left out."""
    if residual is None:
        return "no residual is learned: what is left does not predict stroke conditions that were left out"
    return (
        f"learned residual: {residual.before_n:.3g} N without and {residual.after_n:.3g} N with it, each of "
        f"{residual.conditions} stroke conditions predicted from the others"
    )


def locate_remainder(remainder: Remainder, drive_unit: str) -> str:
    """Return the sentence on the condition in which the remainder is largest, and on what it depends."""
    largest = remainder.map[0]
    variables = " and ".join(v.replace("_", " ") for v in remainder.variables[:2])
    dependence = "it does not correlate with any recorded stroke or drive quantity"
    if remainder.explainable > _EXPLAINABLE_THRESHOLD:
        dependence = f"a flexible model of stroke and drive explains {remainder.explainable:.0%} of it"
        dependence += f", mostly from {variables}" if variables else ""
    return (
        f"The remainder is largest at {largest.drive:.3g} {drive_unit}, "
        f"{1e3 * largest.amplitude_m:.3g} mm and {largest.frequency_hz:.3g} Hz ({largest.gap_n:.3g} N), and "
        f"{dependence}."
    )


def _describe_effects(effects: Sequence[NamedEffect]) -> str:
    return " and ".join(f"{e.name} ({_describe_parameters(e)})" for e in effects)


def _describe_parameters(effect: NamedEffect) -> str:
    values = [f"{name.replace('_', ' ')} {_format(p.value, p.unit)}" for name, p in effect.parameters.items()]
    known = EFFECTS.get(effect.name)
    meaning = known.meaning if known else "an effect of the user's own"
    return "; ".join([meaning, ", ".join(values)]) if values else meaning


def _format(value: float, unit: str) -> str:
    """Return a value in SI with its unit; small lengths are in mm or µm, short times in ms."""
    for factor, name, largest in _SMALL_UNITS.get(unit, ()):
        if abs(value) < largest:
            return f"{value * factor:.3g} {name}"
    return f"{value:.3g}" if unit == "1" else f"{value:.3g} {unit}"


def _describe_shrinkage(gap: Gap, count: int) -> str:
    reduces, closes = ("reduces", "closes") if count == 1 else ("together reduce", "close")
    if gap.shrinkage is None:
        return f"{reduces} this error to {gap.after_n:.3g} N"
    closed = min(gap.shrinkage, 1.0)
    return f"{reduces} this error to {gap.after_n:.3g} N and {closes} {100 * closed:.0f} % of the gap"


def _describe_checks(
    verdict: Verdict, effects: Sequence[NamedEffect], alternatives: Sequence[EffectSet], remainder: str
) -> str:
    """Return the checks of the named effects, likely alternatives, and the unexplained part."""
    text = f"Check: {'; '.join(suggest_check(e.name) for e in effects)}"
    likely = [a for a in alternatives if a.probability >= _LIKELY_ALTERNATIVE]
    if likely:
        sets = " or ".join(" with ".join(a.effects) or "no effect at all" for a in likely)
        text += f" (these strokes would also allow {sets})"
    if verdict == "partly_explained" and remainder:
        text += f"; {remainder[0].lower()}{remainder[1:]}".rstrip(".")
    return f"{text}."


def summarise_diagnosis(diagnosis: Diagnosis) -> str:
    """Return the diagnosis in one line."""
    names = ", ".join(f"{e.name} {e.probability:.0%}" for e in diagnosis.effects) or "no effect named"
    gap = diagnosis.gap
    shrinkage = "" if gap.shrinkage is None else f", shrinkage {gap.shrinkage:.2f}"
    return (
        f"{diagnosis.verdict}: {names}; held-out force error {gap.before_n:.3g} to {gap.after_n:.3g} N, "
        f"noise floor {gap.noise_floor_n:.3g} N{shrinkage}{_summarise_discovery(diagnosis)}"
        f"{_summarise_held_out(diagnosis.gap)}{_describe_cross_check(diagnosis)}"
    )


def tabulate_diagnoses(diagnoses: Sequence[tuple[str, Diagnosis]]) -> str:
    """Return a table of several diagnoses, one row for each, from their names and documents."""
    width = max([len(name) for name, _ in diagnoses] + [len("log")])
    rows = [f"{'log':<{width}}  verdict           before N  after N  floor N  shrinkage  effects (probability)"]
    for name, diagnosis in diagnoses:
        gap = diagnosis.gap
        shrinkage = "-" if gap.shrinkage is None else f"{gap.shrinkage:.2f}"
        effects = ", ".join(f"{e.name} ({e.probability:.0%})" for e in diagnosis.effects) or "-"
        rows.append(
            f"{name:<{width}}  {diagnosis.verdict:<16}  {gap.before_n:>8.3g}  {gap.after_n:>7.3g}  "
            f"{gap.noise_floor_n:>7.3g}  {shrinkage:>9}  {effects}"
        )
    return "\n".join(rows)


def _summarise_held_out(gap: Gap) -> str:
    """Return the errors on the strokes that the user held out, with and without the learned residual."""
    if gap.held_out is None:
        return ""
    text = f"; on the strokes held out {gap.held_out.rmse_n:.3g} N"
    if gap.held_out.with_residual is None:
        return text
    return f"{text}, with the learned residual {gap.held_out.with_residual.rmse_n:.3g} N"


def _summarise_discovery(diagnosis: Diagnosis) -> str:
    if diagnosis.discovery is None:
        return ""
    return f"; {describe_discovery(diagnosis.discovery, diagnosis.gap.before_n)}"


def _describe_cross_check(diagnosis: Diagnosis) -> str:
    if diagnosis.cross_check is None:
        return ""
    return f". {diagnosis.cross_check.message}".removesuffix(".")
