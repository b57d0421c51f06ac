"""The answer in two sentences: how large the gap is and what makes it, then what to check at the rig."""

from collections.abc import Sequence

from identification.damper.effects import EFFECTS
from identification.gap.documents import Diagnosis, EffectSet, Gap, NamedEffect, Verdict

_CHECKS: dict[str, str] = {
    "field_saturation": "step the drive upwards at one stroke and see where the force stops growing",
    "magnetic_remanence": "compare the force at one drive on the way up and on the way down, then demagnetise",
    "coil_lag": "record the coil current over a drive step, and look for a driver delay or eddy currents",
    "gas_spring": "measure the force at rest at several positions, and the gas pressure",
    "seal_friction": "move slowly at zero drive through many reversals, and look at the rod seal",
    "orifice_turbulence": "repeat the stroke at twice the speed and zero drive",
    "direction_asymmetry": "compare extension and compression at the same speed, and look at valves and piston",
    "viscous_heating": "repeat the first stroke cold and warm, with the temperature recorded",
    "end_stop": "shorten the stroke, and see whether the force at its end goes away",
    "clevis_backlash": "feel for play in the clevis pins, and preload or replace them",
    "fixture_compliance": "clamp the damper's ends and measure how far the fixture gives under load",
    "moving_mass": "weigh what moves between load cell and damper, or run it with the damper taken off",
    "force_delay": "look up filter and delay of the force channel, and tap the load cell against an accelerometer",
    "force_drift": "zero the load cell unloaded before and after the run, and let it warm up",
    "mains_hum": "look at shield and earth of the load cell's cable",
    "displacement_nonlinearity": "calibrate the displacement sensor over the whole stroke",
    "force_filter": "look up the low-pass of the force channel",
    "displacement_delay": "look up filter and delay of the displacement channel",
    "shear_thinning": "repeat the stroke at several speeds and zero drive",
    "side_load_friction": "align the ends of the damper, and look for a bent rod",
    "coil_resistance_drift": "record the coil current, and measure the coil's resistance cold and warm",
    "driver_slew": "record the coil current over large steps of the drive",
    "cavitation_void": "turn the damper upside down, bleed it, and raise the gas pressure",
    "fluid_compressibility": "bleed the damper, and repeat a small swift stroke",
    "drive_dependent_shape": "repeat slow reversals at every drive, and compare the shape of the loops",
    "bypass_leak": "creep at zero drive, and see whether the force at low speed falls away",
    "settling_after_rest": "repeat the first stroke after rests of different length",
    "gas_heating": "watch the force at rest after long strokes while the damper cools",
    "force_ringing": "tap the fixture, and look for its natural frequency in the force",
    "clock_drift": "compare the clocks of the instruments over the whole recording",
    "sample_hold": "look up the update rate of the force channel",
    "coil_crosstalk": "lead the coil's cable away from the load cell's, and step the drive at rest",
}


def advice(name: str) -> str:
    """What to check at the rig where an effect is suspected."""
    return _CHECKS.get(name, "repeat the stroke at other drives and speeds")


def explanation(
    verdict: Verdict,
    gap: Gap,
    effects: Sequence[NamedEffect],
    alternatives: Sequence[EffectSet],
    rest: str,
) -> str:
    """Two sentences for a person.

    Args:
        verdict: of the diagnosis.
        gap: its size.
        effects: the named ones, the largest share first.
        alternatives: other sets that these data allow.
        rest: where what is not explained shows, in words.
    """
    if verdict == "no_gap":
        return (
            f"The refitted law repeats the force on strokes that it never saw to {gap.before_n:.3g} N, and "
            f"{gap.noise_floor_n:.3g} N of that is noise. Nothing needs to be added to the simulation."
        )
    start = (
        f"On strokes that no fit saw the refitted law misses the force by {gap.before_n:.3g} N where noise alone "
        f"makes {gap.noise_floor_n:.3g} N"
    )
    if verdict == "unexplained":
        return f"{start}, and no known effect explains it. {rest}"
    return f"{start}; {_said(effects)} {_shrunk(gap, len(effects))}. {_next(verdict, effects, alternatives, rest)}"


def nearest(names: Sequence[str], before: float, after: float, floor: float) -> str:
    """What known effects would take away where none is named.

    Args:
        names: of the effects that come nearest, together.
        before: error on unseen strokes of the refitted law [N].
        after: the same with them [N].
        floor: noise of the force [N].
    """
    return (
        f"nearest of what is known: {' with '.join(names)} would bring the error on unseen strokes from "
        f"{before:.3g} to {after:.3g} N, {after / floor:.3g} times the noise floor; too far from it to be named"
    )


def _said(effects: Sequence[NamedEffect]) -> str:
    """The named effects with their sizes."""
    return " and ".join(f"{e.name} ({_sizes(e)})" for e in effects)


def _sizes(effect: NamedEffect) -> str:
    values = [
        f"{name} {p.value:.3g} {'' if p.unit == '1' else p.unit}".strip() for name, p in effect.parameters.items()
    ]
    return f"{EFFECTS[effect.name].meaning}; {', '.join(values)}"


def _shrunk(gap: Gap, count: int) -> str:
    makes, closes = ("brings", "closes") if count == 1 else ("together bring", "close")
    if gap.shrinkage is None:
        return f"{makes} it to {gap.after_n:.3g} N"
    closed = min(gap.shrinkage, 1.0)
    return f"{makes} it to {gap.after_n:.3g} N and {closes} {100 * closed:.0f} % of the gap"


def _next(verdict: Verdict, effects: Sequence[NamedEffect], alternatives: Sequence[EffectSet], rest: str) -> str:
    """What to check, and what remains open."""
    text = f"Check: {'; '.join(advice(e.name) for e in effects)}"
    likely = [a for a in alternatives if a.probability >= 0.1]
    if likely:
        other = " or ".join(" with ".join(a.effects) or "nothing at all" for a in likely)
        text += f" (these strokes would also allow {other})"
    if verdict == "partly_explained":
        text += f"; {rest[0].lower()}{rest[1:]}".rstrip(".")
    return f"{text}."


def summary(diagnosis: Diagnosis) -> str:
    """The answer in a line."""
    names = ", ".join(f"{e.name} {e.probability:.0%}" for e in diagnosis.effects) or "nothing named"
    gap = diagnosis.gap
    shrunk = "" if gap.shrinkage is None else f", shrinkage {gap.shrinkage:.2f}"
    return (
        f"{diagnosis.verdict}: {names}; held-out force error {gap.before_n:.3g} to {gap.after_n:.3g} N, "
        f"noise floor {gap.noise_floor_n:.3g} N{shrunk}{_witnessed(diagnosis)}"
    )


def _witnessed(diagnosis: Diagnosis) -> str:
    if diagnosis.witness is None:
        return ""
    said = diagnosis.witness.said
    return f". {said}".removesuffix(".")
