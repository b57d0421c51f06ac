"""Causes of a gap: each changes a rig by a strength and a form that is drawn.

The forms are those of textbooks, in other functions than the product's: Langevin's and Froehlich's magnetisation,
Preisach's plays, LuGre friction, a polytropic gas, a hardening joint.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.independent.plant import Array, Plant
from benchmarks.independent.rig import FieldMap, Rig, follow_with_play
from benchmarks.independent.strokes import Strokes
from identification.damper.effects import Stage

_STIFFEST = 0.7
"""Largest stiffness of a mounting times the step, over the damping behind it [1]: the integration stays stable."""


class Scales(NamedTuple):
    """Scales of the recording of a damper, over which the strengths of its causes are stated."""

    force: float
    """[N]"""
    drive: float
    """[V or A]"""
    strokes: Strokes

    @property
    def length(self) -> float:
        """Half the longest stroke [m]."""
        return self.strokes.amplitude

    @property
    def speed(self) -> float:
        """Peak speed [m/s]."""
        return self.strokes.peak_speed

    @property
    def duration(self) -> float:
        """Duration of the recording [s]."""
        return float(self.strokes.time[-1])


Cause = Callable[[Rig, float, np.random.Generator, Scales], Rig]
"""Returns a rig with a cause of a strength [1]."""


def saturate(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let the field level off."""
    k = 3.0 * strength / s.drive
    forms: tuple[FieldMap, ...] = (
        lambda u: u / (1.0 + k * u), lambda u: np.arctan(k * u) / k, lambda u: -np.expm1(-k * u) / k,
    )  # fmt: skip
    return replace(rig, field_maps=(*rig.field_maps, forms[random.integers(len(forms))]))


def retain(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let a part of the field follow the drive behind plays of four widths (Preisach)."""
    widths, weights = s.drive * np.array([0.05, 0.15, 0.35, 0.6]), random.dirichlet(np.ones(4))

    def remember(field: Array) -> Array:
        plays = [w * follow_with_play(field, width) for w, width in zip(weights, widths, strict=True)]
        return np.asarray((1.0 - strength) * field + strength * np.sum(plays, axis=0))

    return replace(rig, field_maps=(*rig.field_maps, remember))


def delay_coil(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Delay the field by a dead time or a second lag."""
    if random.random() < 0.3:
        return replace(rig, dead_time=0.02 * strength)
    return replace(rig, second_lag=0.03 * strength)


def compress_gas(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add a polytropic gas column, in either sense."""
    length = random.choice([-1.0, 1.0]) * s.length * random.uniform(1.4, 4.0)
    plant = rig.plant._replace(
        gas_force=strength * s.force, gas_length=length, gas_exponent=random.uniform(1.0, 1.4)
    )
    return replace(rig, plant=plant)


def rub(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add friction of a seal (LuGre without viscous part)."""
    friction = strength * s.force
    plant = rig.plant._replace(
        friction=friction,
        static_friction=friction * random.uniform(1.1, 1.8),
        stribeck_speed=s.speed * random.uniform(0.01, 0.1),
        bristle_stiffness=friction / (s.length * random.uniform(0.003, 0.03)),
    )
    return replace(rig, plant=plant)


def stir(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add turbulence of an orifice: a force over a power of the speed."""
    power = random.uniform(0.7, 1.4)
    plant = rig.plant._replace(turbulence=strength * s.force / s.speed ** (1.0 + power), turbulence_power=power)
    return replace(rig, plant=plant)


def favour_direction(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Make one direction stiffer, with a smooth transition."""
    plant = rig.plant._replace(
        asymmetry=min(strength, 0.9) * random.choice([-1.0, 1.0]),
        asymmetry_speed=s.speed * random.uniform(0.02, 0.3),
    )
    return replace(rig, plant=plant)


def heat(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Soften the fluid with the stored energy."""
    cooling = 1.0 / (s.duration * random.uniform(0.2, 2.0))
    scale = 1.0 / (0.4 * s.force * s.speed * min(s.duration, 1.0 / cooling))
    return replace(rig, plant=rig.plant._replace(heating=strength, heat_scale=scale, cooling=cooling))


def add_stop(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add a stop of rubber at one end or at both."""
    start, power = s.length * random.uniform(0.6, 0.92), random.choice([1.0, 1.5, 2.0])
    ends = random.integers(3)
    plant = rig.plant._replace(
        stop_stiffness=3.0 * strength * s.force / (s.length - start) ** power,
        stop_high=start if ends != 1 else np.inf,
        stop_low=-start if ends != 0 else -np.inf,
        stop_power=power,
    )
    return replace(rig, plant=plant)


def loosen(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add play of the mounting."""
    stiffness = rig.plant.mount_stiffness or s.force / (0.002 * s.length)
    plant = rig.plant._replace(gap=0.05 * strength * s.length)
    return replace(rig, plant=plant._replace(mount_stiffness=min(stiffness, _find_stiffest(plant, s))))


def soften_mounting(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add a joint between load cell and damper that may harden."""
    reach, ratio = 0.2 * s.length * max(strength, 0.02), random.choice([0.0, 0.3, 1.0])
    # Where the hardening part alone carries the force, the slope is as many times larger.
    stiffness = min(s.force / reach, _find_stiffest(rig.plant, s) / (1.0 + 3.0 * ratio))
    hardening = ratio * stiffness**3 / s.force**2
    return replace(rig, plant=rig.plant._replace(mount_stiffness=stiffness, mount_hardening=hardening))


def _find_stiffest(plant: Plant, s: Scales) -> float:
    """Return the largest stiffness of a mounting that the step can integrate [N/m]."""
    damping = min(plant.c0_base, plant.c0_base + s.drive * plant.c0_slope)
    return _STIFFEST * damping / s.strokes.step


def add_mass(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add a mass between load cell and damper."""
    mass = strength * s.force * s.length / s.speed**2
    return _change_force(rig, lambda force, strokes: force + mass * strokes.sample(strokes.acceleration))


def delay_force(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Delay the force channel."""
    delay = 0.05 * strength * s.length / s.speed

    def delay_samples(force: Array, strokes: Strokes) -> Array:
        time = strokes.sample(strokes.time)
        return np.asarray(np.interp(time - delay, time, force))

    return _change_force(rig, delay_samples)


def drift(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let the zero of the force drift: towards a limit, in a wave, or with a power of the time."""
    size, form, pace, phase = strength * s.force, random.integers(3), random.uniform(), random.uniform(0.0, 6.0)

    def add_drift(force: Array, strokes: Strokes) -> Array:
        part = strokes.sample(strokes.time) / s.duration
        waves = (-np.expm1(-part / (0.1 + 0.4 * pace)), np.sin(2.0 * np.pi * part / (0.5 + pace) + phase))
        return force + size * (*waves, part ** (0.7 + 1.3 * pace))[form]

    return _change_force(rig, add_drift)


def hum(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Add a mains line of 50 or 60 Hz with its third harmonic."""
    angle = 2.0 * np.pi * random.choice([50.0, 60.0]) * (1.0 + 2e-4 * random.standard_normal())
    size, third, phases = strength * s.force, random.uniform(0.0, 0.4), random.uniform(0.0, 6.28, 2)

    def add_line(force: Array, strokes: Strokes) -> Array:
        time = strokes.sample(strokes.time)
        line = np.sin(angle * time + phases[0]) + third * np.sin(3.0 * angle * time + phases[1])
        return np.asarray(force + size * line)

    return _change_force(rig, add_line)


def distort_displacement(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Bend the displacement channel: by a cubic, a wave or a square."""
    size, form = 0.2 * strength * s.length, random.integers(3)
    angle, phase = random.uniform(2.0, 4.0), random.uniform(0.0, 6.0)

    def bend(x: Array) -> Array:
        r = x / s.length
        return np.asarray(x + size * (r**3 - 0.6 * r, np.sin(angle * r + phase), r**2)[form])

    return replace(rig, displacement_maps=(*rig.displacement_maps, bend))


def vary_with_position(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let the force of the fluid depend on the position: a bore that is not straight."""
    plant = rig.plant._replace(
        position_gain=min(strength, 0.8),
        position_angle=random.uniform(1.5, 4.0) / s.length,
        position_phase=random.uniform(0.0, 6.28),
    )
    return replace(rig, plant=plant)


def bend_load_cell(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Make the load cell nonlinear."""
    square, fourth = random.uniform(-1.0, 1.0, 2)

    def bend(force: Array, strokes: Strokes) -> Array:
        r = force / np.abs(force).max()
        return np.asarray(force + strength * s.force * (square * r**2 + fourth * r**4))

    return _change_force(rig, bend)


def lose_fluid(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let the damper lose a part of its force at two moments: a valve that breaks."""
    first, second = s.duration * random.uniform(0.15, 0.45), s.duration * random.uniform(0.55, 0.85)
    plant = rig.plant._replace(gain_loss=min(strength, 0.5), first_loss=first, second_loss=second)
    return replace(rig, plant=plant)


def slow_decay(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let the field fall more slowly than it rises: a free-wheeling diode."""
    return replace(rig, fall=rig.rise / (1.0 + 8.0 * strength))


def switch_delay(rig: Rig, strength: float, random: np.random.Generator, s: Scales) -> Rig:
    """Let the displacement be late at times: a buffer that is read a cycle later again and again."""
    delay, period = 0.3 * strength * s.length / s.speed, s.duration * random.uniform(0.1, 0.5)
    part, begin = random.uniform(0.3, 0.7), random.uniform(0.0, 1.0)

    def hold(x: Array) -> Array:
        time = np.linspace(0.0, s.duration, len(x))
        is_late = (time / period + begin) % 1.0 < part
        return np.interp(time - delay * is_late, time, x)

    return replace(rig, displacement_maps=(*rig.displacement_maps, hold))


def _change_force(rig: Rig, change: Callable[[Array, Strokes], Array]) -> Rig:
    return replace(rig, force_maps=(*rig.force_maps, change))


KNOWN: dict[str, Cause] = {
    "field_saturation": saturate,
    "magnetic_remanence": retain,
    "coil_lag": delay_coil,
    "gas_spring": compress_gas,
    "seal_friction": rub,
    "orifice_turbulence": stir,
    "direction_asymmetry": favour_direction,
    "viscous_heating": heat,
    "end_stop": add_stop,
    "fixture_compliance": soften_mounting,
    "clevis_backlash": loosen,
    "moving_mass": add_mass,
    "force_delay": delay_force,
    "force_drift": drift,
    "mains_hum": hum,
    "displacement_nonlinearity": distort_displacement,
}
"""Causes in the library of the product, by their name there; in the order in which they are combined."""
UNKNOWN: dict[str, tuple[Cause, Stage]] = {
    "gain over displacement": (vary_with_position, "damper"),
    "load cell over force": (bend_load_cell, "force_channel"),
    "loss of force in steps": (lose_fluid, "damper"),
    "field that falls slowly": (slow_decay, "coil"),
    "delay in steps": (switch_delay, "displacement_channel"),
}
"""Causes outside the library, with their stages."""
