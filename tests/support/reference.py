"""Generator of the reference, loaded from its file because ``docs`` is not a package."""

import importlib.util
from pathlib import Path

PATH = Path(__file__).parents[2] / "docs" / "generate_reference.py"


def load_generator():
    spec = importlib.util.spec_from_file_location("generate_reference", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


generator = load_generator()
