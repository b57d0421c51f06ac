"""Size of an effect, chosen by the excess that a refit of the law alone would leave.

The strokes are simulated without noise, with and without the effect. The law's sensitivities to its thirteen
coordinates are projected out of the difference. The remainder is the excess of a refit to first order, and the
error of the refitted law is sqrt(floor² + excess²). A full refit that moves far is better: for a delay with a
projected ratio of 3.2, an identification reached 2.2. A ratio is therefore an upper bound, and the result of a
trial contains the measured one as well.
"""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from identification.damper import Coordinates, Parameters, to_coordinates, to_parameters
from sim_rig.effect_forms import FORMS, Place
from sim_rig.errors import PlantError
from sim_rig.plant import AlternativePlant, Array, Plant, apply_displacement_channel, count_substeps
from sim_rig.scenario import Scenario, parse_scenario
from sim_rig.trial.cases.specimens import SIZES, draw_specimen, make_scenario_document
from sim_rig.trial.cases.strokes import RATE, RunKind, make_strokes, sample_strokes

SENSITIVITY_STEP = 0.01
"""[1] step of the finite differences, in the logarithm of each coordinate."""
DECIMATION = 5
"""Every n-th sample is used."""
SIZE_TOLERANCE = 0.06
"""[1] tolerated relative error of the excess."""
MAX_SIMULATIONS = 7
"""Largest number of simulations with the effect."""
_RIGID_ACTUATOR = {"stiffness": 1e12, "start_ramp": 0.0}
"""Actuator that the load does not deflect, so that both simulations have the same stroke."""


class SizingModel:
    """Noise-free simulation of one damper under one method, with its sensitivities."""

    def __init__(self, size: str, parameters: dict[str, float], displacement: Array, drive: Array) -> None:
        """Simulate the law alone, and its sensitivities.

        Args:
            size: of the damper, by name.
            parameters: the damper's fourteen.
            displacement: (N+1,) commands [m].
            drive: (N,) commands [V or A].
        """
        self._size, self._parameters = size, parameters
        self._point = np.array(to_coordinates(Parameters(**parameters)))
        self._displacement, self._drive = displacement, drive
        self.force = self._simulate_law(np.zeros(len(self._point)), displacement)
        sensitivities = np.column_stack([self._compute_sensitivity(i) for i in range(len(self._point))])
        norms = np.linalg.norm(sensitivities, axis=0)
        observable = norms > 1e-6 * norms.max()  # under one constant drive, eta has no influence
        self._sensitivity_basis, _ = np.linalg.qr(sensitivities[:, observable] / norms[observable])

    def compute_residual(self, effect: dict[str, Any]) -> float:
        """Return the root mean square force [N] of an effect that the law cannot fit.

        Raises:
            PlantError: the specimen has no finite motion with it.
        """
        difference = self._compute_difference(effect)
        residual = difference - self._sensitivity_basis @ (self._sensitivity_basis.T @ difference)
        return float(np.sqrt(np.mean(residual**2)))

    def _compute_difference(self, effect: dict[str, Any]) -> Array:
        """Return the force [N] that the law with its true coordinates does not explain."""
        scenario = self._make_scenario(self._parameters, alternative_effects=[effect])
        if FORMS[effect["form"]].place is Place.DISPLACEMENT_CHANNEL:
            # A fit uses the displacement that was read, while the damper moves by the true one.
            reading = apply_displacement_channel(scenario, self._displacement)
            return self.force - self._simulate_law(np.zeros(len(self._point)), reading)
        plant = AlternativePlant(scenario, float(self._displacement[0]), float(self._drive[0]))
        return self._simulate_force(plant, self._displacement) - self.force

    def _simulate_law(self, log_change: Array, displacement: Array) -> Array:
        """Return the force of the law [N] with its coordinates changed by these logarithms."""
        parameters = to_parameters(Coordinates(*(self._point * np.exp(log_change))))._asdict()
        plant = Plant(self._make_scenario(parameters), float(displacement[0]), float(self._drive[0]))
        return self._simulate_force(plant, displacement)

    def _make_scenario(self, parameters: dict[str, float], **more: Any) -> Scenario:
        document = make_scenario_document(self._size, parameters, actuator=_RIGID_ACTUATOR, **more)
        return parse_scenario(json.dumps(document), "of a trial")

    def _simulate_force(self, plant: Plant, displacement: Array) -> Array:
        return plant.simulate(1 / RATE, displacement, self._drive).force[:: DECIMATION * count_substeps(1 / RATE)]

    def _compute_sensitivity(self, index: int) -> Array:
        log_change = np.zeros(len(self._point))
        log_change[index] = SENSITIVITY_STEP
        return (self._simulate_law(log_change, self._displacement) - self.force) / SENSITIVITY_STEP


@cache
def make_sizing_model(size: str, kind: RunKind, seed: int, variant: int) -> SizingModel:
    """Return the sizing model of a method and a damper, cached for further effects."""
    return SizingModel(size, draw_specimen(size, seed), *sample_strokes(make_strokes(kind, size, seed, variant)))


def compute_noise_floor(size: str, noise: dict[str, float]) -> float:
    """Return the noise of the recorded force [N] for these settings of the load cell."""
    return float(np.hypot(noise["noise"], noise.get("slow_noise", 0.0))) or SIZES[size].noise


def find_size(
    effect: dict[str, Any], target: float, compute_excess: Callable[[dict[str, Any]], float]
) -> tuple[dict[str, Any], float]:
    """Return the effect at the size with the requested excess, and the excess that it reaches.

    It is found by a secant method over the logarithms. A form whose largest size does not reach the excess is
    returned with the largest one tried.

    Args:
        effect: as in a scenario; its first parameter is chosen.
        target: [N] requested excess.
        compute_excess: returns the excess [N] of an effect.
    """
    quantity = FORMS[effect["form"]].parameters[0]
    size, power, previous = quantity.scale, 1.0, None
    best = (effect, 0.0)
    for _ in range(MAX_SIMULATIONS):
        candidate = {**effect, "parameters": {**effect["parameters"], quantity.symbol: size}}
        try:
            excess = max(compute_excess(candidate), 1e-9)
        except PlantError:
            size *= 0.3
            continue
        if not best[1] or abs(np.log(excess / target)) < abs(np.log(best[1] / target)):
            best = (candidate, excess)
        if abs(excess / target - 1) < SIZE_TOLERANCE or (size >= quantity.high and excess < target):
            break
        if previous is not None and size != previous[0]:
            power = float(np.clip(np.log(excess / previous[1]) / np.log(size / previous[0]), 0.3, 3.0))
        previous = (size, excess)
        size = float(min(size * np.clip((target / excess) ** (1 / power), 0.05, 20.0), quantity.high))
    return best
