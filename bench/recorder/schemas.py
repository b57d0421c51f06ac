"""The messages' JSON Schemas as files.

``python -m bench.recorder.schemas`` writes them to ``docs/reference/schemas``; a test compares.
"""

import json
import sys
from pathlib import Path

from bench.recorder.messages import FAMILIES, MESSAGES, message_schema

FOLDER = Path(__file__).parents[2] / "docs" / "reference" / "schemas"
"""Where the schemas are kept."""


def schema_texts() -> dict[str, str]:
    """Each message's schema as text, by the name of its file."""
    return {
        f"{model.__name__.lower()}.json": json.dumps(message_schema(topic), indent=2, ensure_ascii=False) + "\n"
        for topic, model in {**MESSAGES, **FAMILIES}.items()
    }


def write_schemas(folder: Path = FOLDER) -> None:
    """Write every schema into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in schema_texts().items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_schemas(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
