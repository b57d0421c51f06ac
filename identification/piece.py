"""One continuous stretch of a recording as the fit sees it, and the force it would have recorded."""

from dataclasses import dataclass, replace
from functools import cached_property

from identification.arrays import Array
from identification.condition import SAME, Condition
from identification.force_channel import LowPass, filter_lag
from identification.simulate import Setting, Stroke, simulate

_MOST_FOR_PLAY = 8
"""Times a thinned rate at which play is still looked at."""


@dataclass(frozen=True)
class Piece:
    """One continuous stretch as the fit sees it."""

    name: str
    stroke: Stroke
    force: Array
    """(N,) recorded force [N]."""
    train: Array
    """(N,) 1.0 where the sample is fitted, 0.0 where it is held out or was not measured."""
    force_delay: float = 0.0
    """[s] known lag of the force channel behind the displacement channel."""
    drive_delay: float = 0.0
    """[s] known further lag of the force channel behind the drive channel."""
    low_pass: LowPass | None = None
    """What the force channel does to the force, beside delaying it."""
    finer_for_play: int = 4
    """Times the rate at which play in the mounting is looked at."""
    log: int = 0
    """Which of the logs it comes from."""
    condition: Condition = SAME
    """What that log has of its own."""

    def recorded(self, setting: Setting, *, slopes: bool = False) -> tuple[Array, Array]:
        """Force [N] (N,) as the channel would record it, and its slopes (N, unknowns) if asked for."""
        force, J = self._recorded(replace(setting, coordinates=self.condition.of(setting.coordinates)), slopes)
        return force, self.condition.chained(J) if slopes else J

    def _recorded(self, setting: Setting, slopes: bool) -> tuple[Array, Array]:
        if self.low_pass is not None:
            found = simulate(setting, self._finer(self.low_pass.finer), slopes=slopes)
            passed = self.low_pass.apply(found.force)
            return passed, self.low_pass.apply(found.slopes) if slopes else found.slopes
        # Play begins and ends within a sample, and the damper's velocity jumps there.
        times = self.finer_for_play if setting.acting("displacement_follower") else 1
        found = simulate(setting, self._finer(times), slopes=slopes)
        return found.force[::times], found.slopes[::times]

    def quicker(self) -> "Piece":
        """The same with filter and play looked at in the samples only: a good way near, a little beside."""
        low_pass = replace(self.low_pass, finer=1) if self.low_pass else None
        return replace(self, low_pass=low_pass, finer_for_play=1)

    def coarser(self, times: int) -> "Piece":
        """The same at every so many samples: too few for a filter, of which only the delay remains."""
        stroke = self.stroke.coarser(times)
        # The stroke ends on a whole step and may have dropped the last samples.
        thin = slice(0, len(stroke.displacement) * times, times)
        late = self.force_delay + filter_lag(self.low_pass.reported if self.low_pass else None)
        return replace(
            self,
            stroke=stroke,
            force=self.force[thin],
            train=self.train[thin],
            low_pass=None,
            force_delay=late,
            finer_for_play=min(times * self.finer_for_play, _MOST_FOR_PLAY),
        )

    def _finer(self, times: int) -> Stroke:
        """The stroke at a higher rate, made once."""
        if times not in self._finer_strokes:
            self._finer_strokes[times] = self.stroke.finer(times)
        return self._finer_strokes[times]

    @cached_property
    def _finer_strokes(self) -> dict[int, Stroke]:
        # No field: `replace` makes a piece without it, and a changed stroke never meets those of another.
        return {}
