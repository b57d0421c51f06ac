"""Effects with drawn forms: a random member of the class of functions of each effect, at any size of damper.

No form here is one of the library's, apart from those that have numbers only (delay, mass, compliance, backlash).
A drawn effect has no parameters but one strength, with which its size is set.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from identification.damper import DamperSize, Quantity
from identification.damper.effects import EFFECTS, Action, Effect, Form
from identification.simulate import ActiveEffect

Random = np.random.Generator
Function = Callable[..., Any]


class DrawnForm(NamedTuple):
    """A form drawn at random, with its strength still open."""

    name: str
    """Name of the effect."""
    action: Action
    make: Callable[[float], Function]
    """Function from the strength [1] to the form."""
    parameters: tuple[Quantity, ...] = ()
    values: tuple[float, ...] = ()
    memory: Function | None = None
    is_delay: bool = False
    """True if the strength multiplies the values, because the simulation reads the value and not the form."""

    def activate(self, strength: float) -> ActiveEffect:
        """Return the effect with a strength [1]."""
        known = EFFECTS[self.name]
        values = tuple(strength * v for v in self.values) if self.is_delay else self.values
        form = Form("drawn", self.action, self.parameters, (values,), self.make(strength), self.memory)
        return ActiveEffect(Effect(*known[:4], (form,)), values, "drawn")


def draw_form(name: str, random: Random, size: DamperSize, duration: float) -> DrawnForm:
    """Draw a form of an effect for a damper of a size and a recording of a duration [s]."""
    return _GENERATORS[name](random, size, duration)


def _draw_log(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _draw_step(random: Random) -> Function:
    """Return an odd increasing function from -1 to 1 with slope one at zero."""
    kind, weight = random.integers(0, 3), random.uniform(0.0, 1.0)

    def step(r: Any) -> Any:
        soft = (r / np.sqrt(1.0 + r * r), 2.0 / np.pi * np.arctan(0.5 * np.pi * r), r / (1.0 + np.abs(r)))[kind]
        return weight * np.tanh(r) + (1.0 - weight) * soft

    return step


def _draw_saturation(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    weight, hardness = random.uniform(0.0, 1.0), random.uniform(1.2, 5.0)
    step = _draw_step(random)

    def bend(r: Any) -> Any:
        knee = r / (1.0 + np.abs(r) ** hardness) ** (1.0 / hardness)
        return weight * step(r) + (1.0 - weight) * knee

    return DrawnForm("field_saturation", "field", lambda s: lambda u: bend(u * s / size.drive) * size.drive / s)


def _draw_coil_lag(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    dead, lag = random.dirichlet([1.0, 1.0])
    fraction, order = random.uniform(0.3, 1.0), int(random.integers(1, 3))
    return DrawnForm(
        "coil_lag", "drive_delay", lambda s: lambda: (0.05 * s * dead, 0.1 * s * lag, fraction, order)
    )


def _draw_gas_spring(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    length, power, weight = (
        random.uniform(1.3, 5.0) * size.length,
        random.uniform(1.0, 1.7),
        random.uniform(0.0, 1.0),
    )

    def press(x: Any) -> Any:
        r = x / length
        return weight * (1.0 - np.maximum(1.0 + r, 0.05) ** -power) + (1.0 - weight) * (1.0 - np.exp(-power * r))

    return DrawnForm("gas_spring", "parallel_force", lambda s: lambda x, v: s * size.force * press(x))


def _draw_friction(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    peak, power = random.uniform(0.3, 1.5), random.uniform(0.6, 2.0)
    stribeck, width = _draw_log(random, 0.03, 0.2) * size.velocity, _draw_log(random, 3e-3, 0.02) * size.velocity
    step = _draw_step(random)

    def rub(v: Any) -> Any:
        return (1.0 + peak * np.exp(-((np.abs(v) / stribeck) ** power))) * step(v / width)

    return DrawnForm("seal_friction", "parallel_force", lambda s: lambda x, v: s * size.force * rub(v))


def _draw_turbulence(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    power, onset = random.uniform(1.6, 2.4), random.uniform(0.0, 0.2) * size.velocity

    def flow(v: Any) -> Any:
        return np.sign(v) * (np.maximum(np.abs(v) - onset, 0.0) / size.velocity) ** power

    return DrawnForm("orifice_turbulence", "parallel_force", lambda s: lambda x, v: s * size.force * flow(v))


def _draw_asymmetry(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    on_yield, on_viscous = random.uniform(0.3, 1.0) * random.choice([-1, 1]), random.uniform(-1.0, 1.0)
    width, step = _draw_log(random, 0.01, 0.15) * size.velocity, _draw_step(random)

    def scale(s: float) -> Function:
        # A share above one would let the damper push in one direction.
        yielding, viscous = (float(np.clip(s * share, -0.9, 0.9)) for share in (on_yield, on_viscous))
        return lambda x, v: (
            1.0 + yielding * step(v / width),
            1.0 + viscous * step(v / width),
            1.0 + viscous * step(v / width),
        )

    return DrawnForm("direction_asymmetry", "scaling", scale)


def _draw_heating(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    energy, on_yield = 0.3 * size.force * size.velocity * duration, random.uniform(0.0, 1.0)
    kind, recovery = random.integers(0, 3), _draw_log(random, 0.3, 5.0) * duration
    quantity = next(q for q in EFFECTS["viscous_heating"].forms[0].parameters if q.symbol == "recovery_time")

    def soften(e: Any) -> Any:
        return (np.exp(-e), 1.0 / (1.0 + e), 0.5 + 0.5 * np.exp(-2.0 * e))[kind]

    def scale(s: float) -> Function:
        def factors(e: Any, recovery_time: float) -> Any:
            f = soften(s * e / energy)
            return f**on_yield, f, f

        return factors

    return DrawnForm("viscous_heating", "softening", scale, (quantity,), (recovery,))


def _draw_end_stop(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    gap, power = random.uniform(0.5, 0.85) * size.length, random.uniform(1.3, 3.0)
    sides = [(1.0, 1.0), (1.0, 0.0), (0.0, 1.0)][random.integers(0, 3)]

    def press(x: Any) -> Any:
        upper, lower = np.maximum(x - gap, 0.0), np.maximum(-x - gap, 0.0)
        reach = size.length - gap
        return sides[0] * (upper / reach) ** power - sides[1] * (lower / reach) ** power

    return DrawnForm("end_stop", "parallel_force", lambda s: lambda x, v: s * size.force * press(x))


def _draw_compliance(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    hardening = _draw_log(random, 0.1, 10.0) if random.random() < 0.5 else 0.0

    def connect(s: float) -> Function:
        compliance = 0.02 * s * size.length / size.force
        return lambda: (compliance, 0.0, hardening / (compliance * size.force) ** 2, 0.0, 0.0)

    return DrawnForm("fixture_compliance", "connection", connect)


def _draw_backlash(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    stiff = _draw_log(random, 3e-3, 0.03)

    def connect(s: float) -> Function:
        gap = 0.02 * s * size.length
        return lambda: (stiff * gap / (0.1 * size.force), gap, 0.0, 0.0, 0.0)

    return DrawnForm("clevis_backlash", "connection", connect)


def _draw_mass(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    mass = size.force * size.length / size.velocity**2
    return DrawnForm("moving_mass", "inertia", lambda s: lambda a: s * mass * a)


def _draw_delay(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    known = EFFECTS["force_delay"].forms[0]
    delay = 0.02 * size.length / size.velocity
    return DrawnForm(
        "force_delay", "time_shift", lambda s: known.function, known.parameters, (delay,), is_delay=True
    )


def _draw_drift(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    periods = duration * np.exp(random.uniform(np.log(0.6), np.log(4.0), 3))
    phases, sizes = random.uniform(0.0, 2.0 * np.pi, 3), random.dirichlet(np.ones(3))

    def wander(t: Any) -> Any:
        return sum(a * np.sin(2 * np.pi * t / p + q) for a, p, q in zip(sizes, periods, phases, strict=True))

    return DrawnForm("force_drift", "additive_force", lambda s: lambda t, u: s * size.force * wander(t))


def _draw_hum(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    frequency = random.choice([50.0, 60.0]) + random.uniform(-0.05, 0.05)
    phase, third, shift = random.uniform(0.0, 2 * np.pi), random.uniform(0.0, 0.4), random.uniform(0.0, 2 * np.pi)

    def hum(t: Any) -> Any:
        return np.sin(2 * np.pi * frequency * t + phase) + third * np.sin(6 * np.pi * frequency * t + shift)

    return DrawnForm("mains_hum", "additive_force", lambda s: lambda t, u: s * size.force * hum(t))


def _draw_displacement_error(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    even, odd, wave = random.standard_normal(3)
    pitch, step = random.uniform(0.6, 2.0) * size.length, _draw_step(random)

    def bend(x: Any) -> Any:
        r = x / size.length
        return even * r * r + odd * (step(r) - r) + 0.2 * wave * np.sin(2.0 * np.pi * x / pitch)

    return DrawnForm(
        "displacement_nonlinearity", "displacement_map", lambda s: lambda x: 0.01 * s * size.length * bend(x)
    )


def _draw_remanence(random: Random, size: DamperSize, duration: float) -> DrawnForm:
    known = EFFECTS["magnetic_remanence"].find_form("exponential")
    width, taper = _draw_log(random, 0.05, 1.0) * size.drive, random.uniform(0.0, 1.0) / size.drive

    def retain(s: float) -> Function:
        def add(field: Any, remembered: Any, residue: float, width: float, initial_rise: float) -> Any:
            return field + s * residue * remembered * np.exp(-taper * np.abs(field))

        return add

    values = (0.1 * size.drive, width, random.choice([0.0, 1.0]))
    return DrawnForm("magnetic_remanence", "field_memory", retain, known.parameters, values, known.memory)


_GENERATORS: dict[str, Callable[[Random, DamperSize, float], DrawnForm]] = {
    "field_saturation": _draw_saturation,
    "magnetic_remanence": _draw_remanence,
    "coil_lag": _draw_coil_lag,
    "gas_spring": _draw_gas_spring,
    "seal_friction": _draw_friction,
    "orifice_turbulence": _draw_turbulence,
    "direction_asymmetry": _draw_asymmetry,
    "viscous_heating": _draw_heating,
    "end_stop": _draw_end_stop,
    "clevis_backlash": _draw_backlash,
    "fixture_compliance": _draw_compliance,
    "moving_mass": _draw_mass,
    "force_delay": _draw_delay,
    "force_drift": _draw_drift,
    "mains_hum": _draw_hum,
    "displacement_nonlinearity": _draw_displacement_error,
}
DRAWN_EFFECTS: tuple[str, ...] = tuple(_GENERATORS)
"""Names of the effects with drawn forms."""
