"""Energy that the damper has dissipated along an excitation and not yet lost."""

import numpy as np

from identification.arrays import Array
from identification.simulate.digital_filter import filter_series
from identification.simulate.simulation_model import Excitation


def compute_stored_energy(excitation: Excitation, recovery: float) -> Array:
    """Compute the energy (N,) [J] that the damper has dissipated and not yet lost.

    Args:
        excitation: excitation with the dissipated power.
        recovery: time constant with which the energy leaves [s].
    """
    if excitation.power is None:
        return np.zeros(len(excitation.displacement))
    h = 1.0 / excitation.rate
    fade = np.exp(-h / recovery)
    # Exact for a power that is constant over a sample. expm1, because a recovery takes many samples.
    gain = -recovery * np.expm1(-h / recovery)
    power = np.concatenate([[0.0], 0.5 * (excitation.power[1:] + excitation.power[:-1])])
    return filter_series(np.array([gain, 0.0]), np.array([1.0, -fade]), power)
