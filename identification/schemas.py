"""JSON Schemas of this room's documents, generated from their types.

``python -m identification.schemas`` writes them to ``docs/reference/schemas``; a test compares.
"""

import json
import sys
from pathlib import Path

from identification.foresight.documents import Foresight
from identification.gap.documents import Diagnosis
from identification.gap.trend_documents import Trend
from identification.results import Document, Fit, Forecast, Prediction

DOCUMENTS: dict[str, type[Document]] = {
    "diagnosis": Diagnosis,
    "fit": Fit,
    "forecast": Forecast,
    "foresight": Foresight,
    "prediction": Prediction,
    "trend": Trend,
}
"""Type of each document, by the name of its schema's file."""
FOLDER = Path(__file__).parent.parent / "docs" / "reference" / "schemas"
"""Where the schemas are kept."""


def schema_text(name: str) -> str:
    """The JSON Schema of a document, as it stands in its file."""
    schema = DOCUMENTS[name].model_json_schema(by_alias=True)
    form = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
    return json.dumps(form, indent=2, ensure_ascii=False) + "\n"


def write_schemas(folder: Path = FOLDER) -> None:
    """Write every schema into a folder, ``NAME.json`` each."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in DOCUMENTS:
        (folder / f"{name}.json").write_text(schema_text(name), encoding="utf-8")


if __name__ == "__main__":
    write_schemas(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
