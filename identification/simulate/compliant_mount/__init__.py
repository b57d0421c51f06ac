"""Simulation on a compliant mount, where the displacement of the damper is a third state."""

from identification.simulate.compliant_mount.connections import (
    differentiate_connections,
    differentiate_tables,
    gather_connections,
)
from identification.simulate.compliant_mount.integration import integrate
from identification.simulate.compliant_mount.sensitivities import integrate_with_sensitivities
from identification.simulate.compliant_mount.springs import CONNECTION_COUNT, F0, FIXED_COUNT, K1
from identification.simulate.compliant_mount.stacked_inputs import stack_derivatives, stack_inputs

__all__ = [
    "CONNECTION_COUNT",
    "F0",
    "FIXED_COUNT",
    "K1",
    "differentiate_connections",
    "differentiate_tables",
    "gather_connections",
    "integrate",
    "integrate_with_sensitivities",
    "stack_derivatives",
    "stack_inputs",
]
