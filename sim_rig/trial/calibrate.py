"""How large an effect has to be: the excess that a refit of the law alone would leave.

The strokes are simulated without noise, with and without the effect, and the law's slopes over its thirteen
coordinates are projected out of the difference. What is left is the excess of a refit to first order, and
before = sqrt(floor² + excess²). A whole refit does better where it moves far: under a delay that the projection
holds for 3.2 times the floor, an identification stood at 2.2. A ratio stands for one that is at most as large, and
the answer of a trial has the measured one beside it.
"""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from identification.damper.coordinates import Coordinates, to_coordinates, to_parameters
from identification.damper.parameters import Parameters
from sim_rig.compiled import Array
from sim_rig.errors import PlantError
from sim_rig.plant import Plant, blocks_in
from sim_rig.scenario import Scenario, parse_scenario
from sim_rig.scenarios.sealed import FORMS, Place
from sim_rig.sealed_plant import SealedPlant, displacement_read
from sim_rig.trial.specimens import SIZES, scenario_document, specimen
from sim_rig.trial.strokes import RATE, Kind, samples, strokes

STEP = 0.01
"""[1] step of the slopes, over the logarithm of each coordinate."""
EVERY = 5
"""Samples of which one is looked at."""
NEAR = 0.06
"""[1] relative error of the ratio's excess that is good enough."""
MOST_TRIALS = 7
"""Simulations with the effect."""
_RIGID = {"stiffness": 1e12, "start_ramp": 0.0}
"""An actuator that the load does not move, so that both simulations make the same stroke."""


class Bench:
    """One damper under one method, without noise."""

    def __init__(self, size: str, parameters: dict[str, float], displacement: Array, drive: Array) -> None:
        """Simulate the law alone, and its slopes.

        Args:
            size: of the damper, by name.
            parameters: its fourteen.
            displacement: (N+1,) commands [m].
            drive: (N,) commands [V or A].
        """
        self._size, self._parameters = size, parameters
        self._point = np.array(to_coordinates(Parameters(**parameters)))
        self._displacement, self._drive = displacement, drive
        self.force = self._at(np.zeros(len(self._point)), displacement)
        slopes = np.column_stack([self._slope(place) for place in range(len(self._point))])
        lengths = np.linalg.norm(slopes, axis=0)
        seen = lengths > 1e-6 * lengths.max()  # under one constant drive, eta moves nothing
        self._taken_up, _ = np.linalg.qr(slopes[:, seen] / lengths[seen])

    def excess(self, effect: dict[str, Any]) -> float:
        """Root mean square force [N] of an effect that the law cannot take up.

        Raises:
            PlantError: the specimen has no finite motion with it.
        """
        missing = self._difference(effect)
        left = missing - self._taken_up @ (self._taken_up.T @ missing)
        return float(np.sqrt(np.mean(left**2)))

    def _difference(self, effect: dict[str, Any]) -> Array:
        """Force that a fit with the true coordinates would miss [N]."""
        scenario = self._scenario(self._parameters, sealed=[effect])
        if FORMS[effect["form"]].place is Place.POSITION:
            # A fit is given the displacement that was read, while the damper makes the true one.
            read = displacement_read(scenario, self._displacement)
            return self.force - self._at(np.zeros(len(self._point)), read)
        plant = SealedPlant(scenario, float(self._displacement[0]), float(self._drive[0]))
        return self._force(plant, self._displacement) - self.force

    def _at(self, moved: Array, displacement: Array) -> Array:
        """Force of the law [N] with its coordinates moved by these parts."""
        parameters = to_parameters(Coordinates(*(self._point * np.exp(moved))))._asdict()
        plant = Plant(self._scenario(parameters), float(displacement[0]), float(self._drive[0]))
        return self._force(plant, displacement)

    def _scenario(self, parameters: dict[str, float], **more: Any) -> Scenario:
        document = scenario_document(self._size, parameters, actuator=_RIGID, **more)
        return parse_scenario(json.dumps(document), "of a trial's draw")

    def _force(self, plant: Plant, displacement: Array) -> Array:
        return plant.play(1 / RATE, displacement, self._drive).force[:: EVERY * blocks_in(1 / RATE)]

    def _slope(self, place: int) -> Array:
        moved = np.zeros(len(self._point))
        moved[place] = STEP
        return (self._at(moved, self._displacement) - self.force) / STEP


@cache
def bench_for(size: str, kind: Kind, seed: int, variant: int) -> Bench:
    """The bench of a method for a damper, kept for further effects."""
    return Bench(size, specimen(size, seed), *samples(strokes(kind, size, seed, variant)))


def floor(size: str, noise: dict[str, float]) -> float:
    """Noise of the recorded force [N] with these settings of the load cell."""
    return float(np.hypot(noise["noise"], noise.get("slow_noise", 0.0))) or SIZES[size].noise


def sized(
    effect: dict[str, Any], wanted: float, excess: Callable[[dict[str, Any]], float]
) -> tuple[dict[str, Any], float]:
    """The effect at a size whose excess is the wanted one, and the excess that it has.

    A secant over the logarithms. A form whose largest size does not reach it comes with less.

    Args:
        effect: as a scenario names it, its first parameter to be chosen.
        wanted: [N]
        excess: of an effect [N].
    """
    quantity = FORMS[effect["form"]].parameters[0]
    size, power, before = quantity.scale, 1.0, None
    found = (effect, 0.0)
    for _ in range(MOST_TRIALS):
        tried = {**effect, "parameters": {**effect["parameters"], quantity.symbol: size}}
        try:
            left = max(excess(tried), 1e-9)
        except PlantError:
            size *= 0.3
            continue
        if not found[1] or abs(np.log(left / wanted)) < abs(np.log(found[1] / wanted)):
            found = (tried, left)
        if abs(left / wanted - 1) < NEAR or (size >= quantity.high and left < wanted):
            break
        if before is not None and size != before[0]:
            power = float(np.clip(np.log(left / before[1]) / np.log(size / before[0]), 0.3, 3.0))
        before = (size, left)
        size = float(min(size * np.clip((wanted / left) ** (1 / power), 0.05, 20.0), quantity.high))
    return found
