"""Connection between load cell and damper: its values for the integration, and their derivatives.

The connections of the library are springs with five values. With an elongation of any other shape, all together
become one table over the force. A parameter of the table acts as a displacement of the actuator would: by the
negative derivative of the elongation at the present force.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from identification.arrays import Array, njit_cached
from identification.damper.effects import Form
from identification.damper.effects.connection import (
    FORCES,
    compute_elongation,
    differentiate_table,
    tabulate_elongation,
)
from identification.simulate.compliant_mount.springs import CONNECTION_COUNT, FILM_DAMPING, FIXED_COUNT
from identification.simulate.curves import differentiate_by_parameters
from identification.simulate.dual import differentiate
from identification.simulate.simulation_model import SimulationModel

_FILM_DAMPING = FILM_DAMPING - (FIXED_COUNT - CONNECTION_COUNT)
"""Position of the film damping among the values of a connection."""
_LEAST_LAG = 1e-7
"""Lag of a damper behind the stiffest connection of a table [s]; it gives the least slope of a table."""

_compute_elongation = njit_cached(compute_elongation)


def gather_connections(model: SimulationModel) -> Array:
    """Return the values (5,) of all connections together, as listed at ``Action``; zeros for a rigid mount.

    Where the elongation is a table, its (G,) values [m] follow, and only the film damping of the five counts.
    """
    # Without a connection there are no rows. Their sum is zero, which means rigid.
    parts = [form.function(*values) for _, form, values in model.select_forms("connection")]
    total = np.asarray(np.sum(np.array(parts, float).reshape(-1, CONNECTION_COUNT), axis=0))
    elongations = _evaluate_forms(model)
    if elongations is None:
        return total
    film = np.zeros(CONNECTION_COUNT)
    film[_FILM_DAMPING] = total[_FILM_DAMPING]
    least = _LEAST_LAG / model.coordinates.c0_a
    return np.concatenate([film, tabulate_elongation(np.sum(elongations, axis=0), least)])


def differentiate_connections(model: SimulationModel, partial_force: Array) -> list[tuple[int, Array]]:
    """Return the derivatives (N,) of the force over the parameters of the connections, by column.

    Args:
        model: the model.
        partial_force: (N, 17 + ...) sensitivities over the fixed values of the integration and more.
    """
    over_values = partial_force[:, FIXED_COUNT - CONNECTION_COUNT : FIXED_COUNT]
    return [
        (at + k, over_values @ row)
        for at, form, values in model.select_forms("connection")
        for k, row in enumerate(differentiate(form.function, values)[1])
    ]


def differentiate_tables(model: SimulationModel) -> tuple[list[int], Array]:
    """Return columns and derivatives (T, G) [m] of the table over its parameters; none without a table."""
    elongations, columns, rows = _evaluate_forms(model), [], []
    if elongations is None:
        return [], np.empty((0, 0))
    total = np.sum(elongations, axis=0)
    for at, form, values in model.select_forms("connection", "elongation_function"):
        for k, row in enumerate(
            differentiate_by_parameters(partial(_evaluate_form, form), values, form.parameters)
        ):
            columns.append(at + k)
            rows.append(differentiate_table(total, row))
    return columns, np.array(rows)


def _evaluate_forms(model: SimulationModel) -> list[Array] | None:
    """Return the elongation (G,) of every connection at ``FORCES`` [m]; None if none of them is a table."""
    if not model.select_forms("elongation_function"):
        return None
    forms = model.select_forms("connection", "elongation_function")
    return [_evaluate_form(form, *values) for _, form, values in forms]


def _evaluate_form(form: Form, *values: float) -> Array:
    if form.action == "elongation_function":
        function: Callable[..., Any] = form.function
        return np.asarray(function({"force": FORCES}, *values), float)
    return _evaluate_spring(np.array(form.function(*values), float))


@njit_cached
def _evaluate_spring(values: Array) -> Array:
    """Return the elongation (G,) of a spring with some values (5,)."""
    found = np.empty(len(FORCES))
    for i in range(len(FORCES)):
        found[i] = _compute_elongation(FORCES[i], values[0], values[1], values[2], values[4])
    return found
