"""The network of elements (local extreme learning machines, locELM)."""

from identification.pinn.elements.multistart import train_elements

__all__ = [
    "train_elements",
]
