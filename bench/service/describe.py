"""The OpenAPI description of the REST interface.

``python -m bench.service.describe`` writes it to ``docs/reference/openapi.json``; a test compares.
"""

import json
from pathlib import Path

from bench.service.application import create_app

FILE = Path(__file__).parent.parent.parent / "docs" / "reference" / "openapi.json"
"""Where the description is kept."""


def openapi_text() -> str:
    """The description, as it stands in its file."""
    return json.dumps(create_app().openapi(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(openapi_text(), encoding="utf-8")
