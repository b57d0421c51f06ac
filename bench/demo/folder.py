"""What the demo leaves in its folder."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class DemoFolder:
    """What is recorded, and where everything goes."""

    path: Path
    method: str
    """Identified."""
    unseen: str | None
    """Method of a second recording that the fit never sees; none to leave it out."""

    @property
    def log(self) -> Path:
        """The recording that is identified."""
        return self.path / f"{self.method}.mcap"

    @property
    def unseen_log(self) -> Path | None:
        """The recording that is only predicted."""
        return None if self.unseen is None else self.path / f"{self.unseen}.mcap"

    @property
    def fit(self) -> Path:
        """The identified damper."""
        return self.path / "fit.json"

    @property
    def prediction(self) -> Path:
        """How well the fit repeats the unseen strokes."""
        return self.path / "prediction.json"

    @property
    def diagnosis(self) -> Path | None:
        """What is missing in the simulation; left out of the short demo, for it may take a minute."""
        return None if self.unseen is None else self.path / "diagnosis.json"

    @property
    def report(self) -> Path:
        """The page."""
        return self.path / "report.html"

    @property
    def plots(self) -> Path:
        """The page's pictures."""
        return self.path / "plots"

    @property
    def rig(self) -> Path:
        """Where the simulated rig says how it is reached."""
        return self.path / "rig.toml"

    @property
    def config(self) -> Path:
        """The bench's configuration: the rig, and where the agent listens."""
        return self.path / "bench.toml"

    @property
    def data(self) -> Path:
        """The service's folder."""
        return self.path / "service"
