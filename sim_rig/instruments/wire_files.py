"""Wire files of ``drivers/wire``: the contracts between drivers and simulated instruments, read as data.

They are all that the two sides have in common. The code that interprets them is separate on each side.
"""

import tomllib
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).parents[2] / "drivers" / "wire"

ACTUATOR_EDS = _FOLDER / "actuator.eds"
"""Electronic data sheet of the servo drive."""


def load_wire_file(instrument: str) -> dict[str, Any]:
    """Return the contract of one kind of instrument."""
    return tomllib.loads((_FOLDER / f"{instrument}.toml").read_text(encoding="utf-8"))
