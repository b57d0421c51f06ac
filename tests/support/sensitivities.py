"""Comparison of sensitivities with central differences of the simulated force."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.simulate import SENSITIVITY_COLUMNS, Excitation, SimulationModel, simulate

_USUAL_SIZE = 1e-3
"""Size of y0 [m] and of the delays [s], which may be zero."""


def move_unknown(model: SimulationModel, name: str, relative: float) -> tuple[SimulationModel, float]:
    """Return the model with one unknown moved, and the size to which the move is relative."""
    if name in Coordinates._fields:
        value = getattr(model.coordinates, name)
        return replace(model, coordinates=model.coordinates._replace(**{name: value * (1 + relative)})), value
    if name in SENSITIVITY_COLUMNS:
        return replace(model, **{name: getattr(model, name) + _USUAL_SIZE * relative}), _USUAL_SIZE
    owner, _, symbol = name.partition(".")
    effects, size = [], 0.0
    for effect in model.effects:
        values = list(effect.values)
        if effect.effect.name == owner:
            at = [q.symbol for q in effect.form.parameters].index(symbol)
            size = values[at]
            values[at] *= 1 + relative
        effects.append(effect._replace(values=tuple(values)))
    return replace(model, effects=tuple(effects)), size


def compare_sensitivities(
    model: SimulationModel, excitation: Excitation, relative: float
) -> Iterator[tuple[str, Array, Array]]:
    """Yield name, sensitivity (N,) and central difference (N,) of every unknown, times its size [N]."""
    response = simulate(model, excitation, sensitivities=True)
    for k, name in enumerate(response.columns):
        # Phase is frequency times the time since the start of the run, so the step of a frequency is smaller.
        step = relative / 100 if name.endswith("frequency") else relative
        (ahead, size), (behind, _) = (move_unknown(model, name, s) for s in (step, -step))
        forces = [simulate(m, excitation, response.step_counts).force for m in (ahead, behind)]
        yield name, response.sensitivities[:, k] * size, (forces[0] - forces[1]) / (2 * step)


def compute_worst_error(model: SimulationModel, excitation: Excitation, relative: float = 3e-6) -> float:
    """Compute the largest RMS error of a sensitivity, relative to its RMS [1].

    Where an unknown has no influence, sensitivity and difference have to be zero. A corner of backlash or of a
    loop can lie between the two differences, so the worst hundredth of the samples is left out.
    """
    worst = 0.0
    for _, sensitivity, difference in compare_sensitivities(model, excitation, relative):
        if not difference.any():
            assert not sensitivity.any()
            continue
        error = np.sort(np.abs(sensitivity - difference))[: -len(sensitivity) // 100]
        worst = max(worst, float(np.sqrt(np.mean(error**2)) / np.sqrt(np.mean(sensitivity**2))))
    return worst
