"""Effect in a fit: its form and its search coordinates.

The search coordinate of a parameter that cannot be zero (length, velocity, time constant) is its logarithm. That
of any other parameter is its value over its usual size. Both are of order one for a damper of any size.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import LIBRARY_SIZE, DamperSize, Quantity, compute_scale_factor, scale_quantity
from identification.damper.definitions import DEFINED_ACTIONS
from identification.damper.effects import EFFECTS, Effect, Form
from identification.simulate import ActiveEffect


@dataclass(frozen=True)
class EffectModel:
    """One form of one effect."""

    effect: Effect
    """The effect."""
    form_name: str
    """Name of the form."""
    size: DamperSize = LIBRARY_SIZE
    """Size of the damper, by which bounds, scales and starts of the library's effects are scaled."""
    prior_deviations: tuple[float, ...] = ()
    """Standard deviations (P,) of the search coordinates about zero, before any measurement; empty for none."""

    @staticmethod
    def from_name(name: str, form_name: str | None = None) -> "EffectModel":
        """Return a form of an effect; the usual one if ``form_name`` is None."""
        return EffectModel(EFFECTS[name], EFFECTS[name].find_form(form_name).name)

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @property
    def form(self) -> Form:
        """The form of the effect."""
        return self.effect.find_form(self.form_name)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """The parameters of the form, with bounds and scales for the damper's size."""
        if not self._is_scaled:
            return self.form.parameters
        return tuple(scale_quantity(q, self.size) for q in self.form.parameters)

    @cached_property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        """Starting values of a search, for the damper's size."""
        if not self._is_scaled:
            return self.form.starts
        factors = [compute_scale_factor(q.scaling_unit, self.size) for q in self.form.parameters]
        return tuple(tuple(v * f for v, f in zip(start, factors, strict=True)) for start in self.form.starts)

    @property
    def _is_scaled(self) -> bool:
        """True for a form of the library; a defined effect has the bounds of one damper."""
        return self.form.action not in DEFINED_ACTIONS

    @property
    def log_mask(self) -> BoolArray:
        """(P,) True for parameters whose search coordinate is the logarithm."""
        return np.array([q.low > 0 for q in self.quantities])

    def to_search(self, values: tuple[float, ...]) -> Array:
        """Return search coordinates (P,) of parameter values, clipped to their bounds."""
        clipped = [min(max(v, q.low), q.high) for v, q in zip(values, self.quantities, strict=True)]
        return np.array(
            [np.log(v) if q.low > 0 else v / q.scale for v, q in zip(clipped, self.quantities, strict=True)]
        )

    def to_values(self, coordinates: Array) -> tuple[float, ...]:
        """Return parameter values at search coordinates (P,)."""
        return tuple(
            float(np.exp(p)) if q.low > 0 else float(p) * q.scale
            for p, q in zip(coordinates, self.quantities, strict=True)
        )

    def differentiate(self, coordinates: Array) -> Array:
        """Return the derivatives (P,) of the values over their search coordinates."""
        return np.array(
            [np.exp(p) if q.low > 0 else q.scale for p, q in zip(coordinates, self.quantities, strict=True)]
        )

    def get_bounds(self) -> tuple[Array, Array]:
        """Return lowest and highest search coordinates, (P,) each."""
        low = [np.log(q.low) if q.low > 0 else q.low / q.scale for q in self.quantities]
        high = [np.log(q.high) if q.low > 0 else q.high / q.scale for q in self.quantities]
        return np.array(low), np.array(high)

    def make_active_effect(self, coordinates: Array) -> ActiveEffect:
        """Return the effect with the values at search coordinates (P,)."""
        return ActiveEffect(self.effect, self.to_values(coordinates), self.form_name)
