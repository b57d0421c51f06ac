"""Templates of self-contained pages: one environment, with common macros and styles, and the plots in them."""

import base64
from dataclasses import dataclass

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined


@dataclass(frozen=True)
class Picture:
    """One plot of a report."""

    title: str
    caption: str
    png: bytes

    @property
    def data(self) -> str:
        """PNG in base64."""
        return base64.b64encode(self.png).decode()


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
