"""Field in the damper at the samples and half way between them, with its derivatives.

Without an effect of the coil, the field and its derivatives have closed forms. The derivatives of lags and
memories are differences of the whole transform. A function of the field without memory is applied to the samples
that the integration needs, and its derivatives are exact.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper import Quantity
from identification.damper.effects import Action, Form, step_response
from identification.simulate.curves import apply_lag, differentiate_by_parameters
from identification.simulate.dual import differentiate
from identification.simulate.memories import trace_memory
from identification.simulate.motion import compile_once
from identification.simulate.simulation_model import Excitation, SimulationModel
from identification.simulate.variables import make_coil_variables

COIL_ACTIONS: tuple[Action, ...] = (
    "drive_delay",
    "field",
    "field_memory",
    "drive_function",
    "drive_response",
    "field_function",
)
"""Actions that change the field."""
_MAP_ACTIONS: tuple[Action, ...] = ("field", "field_memory", "field_function")
"""Those that act on the field; the others act on the command."""
_MIN_LAG = 1e-6
"""Second lag below which the drive passes without lag [s]."""
_ETA = Quantity("eta", "1/s", 0.0, math.inf, 100.0, "")
_DELAY = Quantity("delay", "s", -math.inf, math.inf, 0.1, "")


class DamperField(NamedTuple):
    """Field in the damper, and its derivatives over A unknowns: eta, drive delay, coil, force delay."""

    u: Array
    """(N,) field at the samples [V or A]."""
    middle: Array
    """(N-1,) field half way between the samples."""
    du: Array
    """(A, N) derivatives of the field."""
    dmiddle: Array
    """(A, N-1) derivatives of the field half way between the samples."""
    columns: tuple[int, ...]
    """Columns of the coil's unknowns, among the parameters of the effects."""


def compute_damper_field(
    model: SimulationModel, excitation: Excitation, sensitivities: bool = True
) -> DamperField:
    """Compute the field along an excitation; derivatives over effects of the coil only with ``sensitivities``."""
    late = sum(values[0] for _, _, values in model.select_forms("time_shift"))
    delay = model.force_delay + model.drive_delay + late
    effects, maps = _split_coil(model)
    field = _compute_lagged_field(effects, model.coordinates.eta, delay, excitation, sensitivities)
    for at, form, values in maps:
        field = _apply_map(field, form, values, at, sensitivities)
    return field


_CoilEffect = tuple[int, Form, tuple[float, ...]]
"""Column of the first parameter among those of all effects, form, and values."""


def _split_coil(model: SimulationModel) -> tuple[list[_CoilEffect], list[_CoilEffect]]:
    """Return the effects of the coil up to the last one with a past, and the functions of the field behind it.

    Lags act on the command and maps on the field, so all lags come first, whatever the order of the effects.
    """
    coil = model.select_forms(*COIL_ACTIONS)
    coil = sorted(coil, key=lambda effect: effect[1].action in _MAP_ACTIONS)
    count = max((k + 1 for k, (_, form, _) in enumerate(coil) if form.action != "field"), default=0)
    return coil[:count], coil[count:]


def _compute_lagged_field(
    coil: Sequence[_CoilEffect], eta: float, delay: float, excitation: Excitation, sensitivities: bool
) -> DamperField:
    """Compute the field behind the lag of eta, the delay and some effects of the coil."""
    finer = excitation.drive_oversampling
    h = 1.0 / (excitation.rate * finer)
    if not coil:
        u, middle, du, dmiddle = compute_field(excitation.drive, eta, delay, h)
        u, middle = _decimate_field(u, middle, finer)
        du, dmiddle = _decimate_field(du, dmiddle, finer)
        # A delay of the force acts on the field as a delay of the drive does, so the last row repeats that row.
        return DamperField(u, middle, np.vstack([du, du[1:]]), np.vstack([dmiddle, dmiddle[1:]]), ())
    values = (eta, delay, *(v for _, _, some in coil for v in some))
    quantities = (_ETA, _DELAY, *(q for _, form, _ in coil for q in form.parameters))

    def whole(*parameters: float) -> Array:
        return _apply_coil(coil, parameters, excitation, h)

    both = whole(*values)
    columns = tuple(at + k for at, _, some in coil for k in range(len(some)))
    if not sensitivities:
        return DamperField(*_split_half_samples(both, finer), np.empty((0, 0)), np.empty((0, 0)), columns)
    rows = differentiate_by_parameters(whole, values, quantities)
    return DamperField(
        *_split_half_samples(both, finer), *_split_half_samples(np.stack([*rows, rows[1]]), finer), columns
    )


def _apply_map(
    field: DamperField, form: Form, values: tuple[float, ...], at: int, sensitivities: bool
) -> DamperField:
    """Return the field behind a function of the field without memory, with the columns of its parameters."""
    columns = (*field.columns, *range(at, at + len(values)))
    if not sensitivities:
        u, middle = (np.asarray(form.function(u, *values)) for u in (field.u, field.middle))
        return DamperField(u, middle, field.du, field.dmiddle, columns)
    u, du = _differentiate_map(form, values, field.u, field.du)
    middle, dmiddle = _differentiate_map(form, values, field.middle, field.dmiddle)
    return DamperField(u, middle, du, dmiddle, columns)


def _differentiate_map(form: Form, values: tuple[float, ...], u: Array, rows: Array) -> tuple[Array, Array]:
    """Return a function of the field (N,) and its derivatives (A + P, N), before the last row, of the delay."""
    found, (over_u, *own) = differentiate(form.function, (u, *values))
    moved = over_u * rows
    return found, np.vstack([moved[:-1], *own, moved[-1:]])


def _split_half_samples(both: Array, finer: int) -> tuple[Array, Array]:
    """Return the values at the samples of the motion, and half way between, from half samples of the drive."""
    return np.ascontiguousarray(both[..., :: 2 * finer]), np.ascontiguousarray(both[..., finer :: 2 * finer])


def _decimate_field(at: Array, middle: Array, finer: int) -> tuple[Array, Array]:
    """Return the values at the samples of the motion, and half way between, from those of the drive."""
    if finer == 1:
        return at, middle
    halves = at[..., finer // 2 :: finer] if finer % 2 == 0 else middle[..., finer // 2 :: finer]
    return np.ascontiguousarray(at[..., ::finer]), np.ascontiguousarray(halves)


def _apply_coil(
    coil: Sequence[_CoilEffect], parameters: tuple[float, ...], excitation: Excitation, h: float
) -> Array:
    """Apply all effects of the coil in the order of the chain; return the field at half samples (2N-1,)."""
    drive = excitation.drive
    eta, delay, lag, part, layers, at = parameters[0], parameters[1], 0.0, 1.0, 1, 2
    maps, responses = [], []
    for _, form, some in coil:
        own = parameters[at : at + len(some)]
        at += len(some)
        if form.action == "drive_delay":
            further, slower, part, layers = form.function(*own)
            delay, lag = delay + further, lag + slower
        elif form.action == "drive_function":
            drive = drive + form.function(make_coil_variables(drive, excitation.start, h), *own)
        elif form.action == "drive_response":
            responses.append(step_response.compute_weights(form.function, own, h))
        else:
            maps.append((form, own))
    for weights in responses:
        drive = step_response.apply_weights(weights, drive)
    u = apply_two_lags(drive, eta, lag, delay, h)
    for _ in range(1, layers):
        u = apply_lag(u, lag, 0.5 * h)
    if part < 1.0:
        u = part * u + (1.0 - part) * apply_two_lags(drive, eta, 0.0, delay, h)
    # Lags act on the command and maps on the field, so all lags come first, whatever the order of the effects.
    return _apply_maps(maps, u, excitation.start, 0.5 * h)


def _apply_maps(maps: list[tuple[Any, tuple[float, ...]]], u: Array, start: float, h: float) -> Array:
    """Apply functions of the field, with and without memory, in the order of the chain."""
    for form, own in maps:
        if form.action == "field":
            u = form.function(u, *own)
        elif form.action == "field_function":
            u = u + form.function(make_coil_variables(u, start, h), *own)
        else:
            rise = form.name_values(own)["initial_rise"]
            u = form.function(u, trace_memory(compile_once(form.memory), form.memories, rise, u, *own), *own)
    return np.asarray(u)


@njit_cached
def apply_two_lags(drive: Array, eta: float, lag: float, delay: float, h: float) -> Array:
    """Return the field at half samples (2N-1,) after two lags and a dead time; exact for a held drive."""
    count = len(drive)
    found = np.empty(2 * count - 1)
    whole = math.floor(delay / h)
    early = delay / h - whole
    usual = _compute_decay_weights(eta, lag, 0.5 * h)
    w = u = drive[0]
    found[0] = u
    for i in range(count - 1):
        old = drive[min(max(i - whole - 1, 0), count - 1)]
        new = drive[min(max(i - whole, 0), count - 1)]
        for half in range(2):
            switch = min(max(early - 0.5 * half, 0.0), 0.5)
            if old == new or switch == 0.0:
                w, u = _advance_lags(w, u, new, usual)
            elif switch == 0.5:
                w, u = _advance_lags(w, u, old, usual)
            else:
                w, u = _advance_lags(w, u, old, _compute_decay_weights(eta, lag, switch * h))
                w, u = _advance_lags(w, u, new, _compute_decay_weights(eta, lag, (0.5 - switch) * h))
            found[2 * i + 1 + half] = u
    return found


@njit_cached
def _advance_lags(w: float, u: float, drive: float, weights: tuple[float, float, float]) -> tuple[float, float]:
    """Advance the lagged drive and the field towards a constant drive."""
    slow, fade, mixed = weights
    return drive + (w - drive) * slow, drive + (u - drive) * fade + (w - drive) * mixed


@njit_cached
def _compute_decay_weights(eta: float, lag: float, t: float) -> tuple[float, float, float]:
    """Return the decay factors after t [s]: of the lagged drive, the field, and the drive in the field [1]."""
    fade = math.exp(-eta * t)
    if lag < _MIN_LAG:
        return 0.0, fade, 0.0
    slow = math.exp(-t / lag)
    difference = eta - 1.0 / lag
    # The difference of two nearly equal decay factors would lose precision. No exponent below is positive, so
    # nothing overflows.
    if abs(difference * t) < 1e-7:
        mixed = t * slow
    elif difference > 0.0:
        mixed = -slow * math.expm1(-difference * t) / difference
    else:
        mixed = fade * math.expm1(difference * t) / difference
    return slow, fade, eta * mixed


@njit_cached
def compute_field(drive: Array, eta: float, delay: float, h: float) -> tuple[Array, Array, Array, Array]:
    """Compute the field u for a drive that is held between samples and delayed by ``delay`` [s] (eq. 8).

    Args:
        drive: (N,) measured drive [V or A].
        eta: rate constant [1/s].
        delay: delay of either sign [s]; the field starts in equilibrium with the first drive.
        h: time between samples [s].

    Returns:
        u (N,), u half way between samples (N-1,), and their derivatives over eta and delay,
        (2, N) and (2, N-1).
    """
    count = len(drive)
    u, middle = np.empty(count), np.empty(count - 1)
    du, dmiddle = np.zeros((2, count)), np.zeros((2, count - 1))
    whole = math.floor(delay / h)
    early = delay / h - whole
    value, over_eta = drive[0], 0.0
    u[0] = value
    for i in range(count - 1):
        old = drive[min(max(i - whole - 1, 0), count - 1)]
        new = drive[min(max(i - whole, 0), count - 1)]
        if early < 0.5:
            middle[i], dmiddle[0, i] = _advance_field(value, over_eta, old, new, eta, early * h, (0.5 - early) * h)
            dmiddle[1, i] = eta * (middle[i] - new)
        else:
            middle[i], dmiddle[0, i] = _advance_field(value, over_eta, old, old, eta, 0.5 * h, 0.0)
            dmiddle[1, i] = eta * (middle[i] - old)
        value, over_eta = _advance_field(value, over_eta, old, new, eta, early * h, (1.0 - early) * h)
        u[i + 1], du[0, i + 1] = value, over_eta
        du[1, i + 1] = eta * (value - new)
    return u, middle, du, dmiddle


@njit_cached
def _advance_field(
    value: float, over_eta: float, old: float, new: float, eta: float, first: float, second: float
) -> tuple[float, float]:
    """Advance field and derivative over eta by ``first`` [s] towards ``old``, then ``second`` [s] to ``new``."""
    fade = math.exp(-eta * first)
    slope = (over_eta - first * (value - old)) * fade
    value = old + (value - old) * fade
    fade = math.exp(-eta * second)
    return new + (value - new) * fade, (slope - second * (value - new)) * fade
