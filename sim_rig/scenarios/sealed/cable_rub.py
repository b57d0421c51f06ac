"""Unknown to the library: a cable that presses the harder the further the rod is out, and rubs."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, V, X


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]; the memory is the bend of the cable over its pre-sliding distance [1] (Dahl)."""
    rate[0] = (now[V] - abs(now[V]) * memory[0]) / values[2]
    return float(values[0] * memory[0] * max(1.0 + now[X] / values[1], 0.0) ** 2)


def fastest(rub: float, reach: float, bend: float) -> float:
    """Fastest rate [1/s], at 0.5 m/s."""
    return 0.5 / bend


CABLE_RUB = Form(
    effect="cable_rub",
    form="position_dahl",
    stage="mounting",
    place=Place.PARALLEL,
    parameters=(
        Quantity("rub", "N", 0.0, 2000.0, 15.0, "friction at zero"),
        Quantity("reach", "m", 1e-3, 1.0, 0.012, "displacement that presses it twice as far"),
        Quantity("bend", "m", 1e-5, 0.05, 3e-3, "pre-sliding distance"),
    ),
    meaning="a cable is dragged along",
    act=force,
    fastest=fastest,
    known=False,
)
