"""Figures as files: PNG in the resolution of a dense screen, and SVG."""

from __future__ import annotations

from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from bench.errors import ReportError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@lru_cache(maxsize=16)
def render_png(figure: Figure, dpi: int = 160) -> bytes:
    """Render a figure as PNG with the resolution of a dense screen; cached, as page and file use the same."""
    buffer = BytesIO()
    engine = figure.get_layout_engine()
    if engine is not None:
        # The layout is computed once, without the trial drawing of `savefig`; an SVG then has the same one.
        engine.execute(figure)
        figure.set_layout_engine("none")
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": "mrbench"})
    return buffer.getvalue()


def save_figures(figures: dict[str, Figure], folder: Path) -> None:
    """Write every figure as SVG and PNG under its name.

    Raises:
        ReportError: the folder cannot be written to.
    """
    import matplotlib

    try:
        folder.mkdir(parents=True, exist_ok=True)
        # A fixed salt and no date make equal figures equal files.
        with matplotlib.rc_context({"svg.hashsalt": "mrbench"}):
            for name, figure in figures.items():
                (folder / f"{name}.png").write_bytes(render_png(figure))
                figure.savefig(folder / f"{name}.svg", format="svg", metadata={"Date": None})
    except OSError as error:
        raise ReportError(
            f"{folder}: the plots cannot be written ({error.strerror}); give another --plots"
        ) from error
