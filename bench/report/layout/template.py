"""Templates of self-contained pages: one environment, with common macros and styles, and the plots in them."""

import base64
from dataclasses import dataclass

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined


@dataclass(frozen=True)
class Picture:
    """One plot or photo of a report."""

    title: str
    caption: str
    content: bytes
    """Image file."""
    media_type: str = "image/png"
    width: float = 1.0
    """[1] Part of the text's width that it fills on paper."""

    @property
    def data(self) -> str:
        """Image file in base64."""
        return base64.b64encode(self.content).decode()

    @property
    def kind(self) -> str:
        """Class of the figure on a page: plot or photo."""
        return "plot" if self.media_type == "image/png" else "photo"


def make_environment(package: str) -> Environment:
    """Return the environment of the templates of a package; every value is escaped.

    Args:
        package: name of the package that contains the template. `base.html`, `macros.html` and
            `report.css` are common to all.
    """
    return Environment(
        loader=ChoiceLoader([PackageLoader(package, "."), PackageLoader("bench.report.layout", ".")]),
        autoescape=True,
        undefined=StrictUndefined,  # an unknown name in the template is an error
        trim_blocks=True,
        lstrip_blocks=True,
    )
