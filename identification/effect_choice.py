"""An effect that a fit may use: which form of it, and its parameters as search numbers.

Parameters that cannot be zero (lengths, velocities, time constants) are searched by their logarithm, all others in
units of their usual size; both are of order one.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper.effects import EFFECTS, Effect, Form
from identification.damper.parameters import Quantity
from identification.simulate import ActiveEffect


@dataclass(frozen=True)
class EffectChoice:
    """One form of one effect."""

    name: str
    """Name of the effect in documents."""
    form_name: str
    """Name of the form."""

    @staticmethod
    def of(name: str, form_name: str | None = None) -> "EffectChoice":
        """A form of an effect; the usual one if none is named."""
        return EffectChoice(name, EFFECTS[name].form(form_name).name)

    @property
    def effect(self) -> Effect:
        """The effect."""
        return EFFECTS[self.name]

    @property
    def form(self) -> Form:
        """Its form."""
        return self.effect.form(self.form_name)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Its parameters."""
        return self.form.parameters

    @property
    def logarithmic(self) -> BoolArray:
        """(P,) True for parameters that are searched by their logarithm."""
        return np.array([q.low > 0 for q in self.quantities])

    def to_search(self, values: tuple[float, ...]) -> Array:
        """(P,) search numbers of parameter values, moved into their bounds."""
        inside = [min(max(v, q.low), q.high) for v, q in zip(values, self.quantities, strict=True)]
        return np.array(
            [np.log(v) if q.low > 0 else v / q.scale for v, q in zip(inside, self.quantities, strict=True)]
        )

    def to_values(self, numbers: Array) -> tuple[float, ...]:
        """Parameter values at search numbers (P,)."""
        return tuple(
            float(np.exp(p)) if q.low > 0 else float(p) * q.scale
            for p, q in zip(numbers, self.quantities, strict=True)
        )

    def slopes(self, numbers: Array) -> Array:
        """(P,) derivative of each value over its search number."""
        return np.array(
            [np.exp(p) if q.low > 0 else q.scale for p, q in zip(numbers, self.quantities, strict=True)]
        )

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest search numbers, (P,) each."""
        low = [np.log(q.low) if q.low > 0 else q.low / q.scale for q in self.quantities]
        high = [np.log(q.high) if q.low > 0 else q.high / q.scale for q in self.quantities]
        return np.array(low), np.array(high)

    def active(self, numbers: Array) -> ActiveEffect:
        """The effect at search numbers (P,)."""
        return ActiveEffect(self.effect, self.to_values(numbers), self.form_name)
