"""Observer of a run: receives every event that the sequencer reports."""

from typing import Protocol


class RunObserver(Protocol):
    """Receiver of the sequencer's events; called on the thread of the run or of the setpoints."""

    def on_state(self, text: str) -> None:
        """Handle a change of state, described for a person."""

    def on_setpoints_active(self, active: bool) -> None:
        """Handle the begin or the end of setpoints and of the SYNCs that are sent with them."""

    def on_arrived(self) -> None:
        """Handle the arrival of the rod at the start of the programme."""

    def on_late_setpoint(self, now_ns: int, delay: float) -> None:
        """Handle a setpoint that was sent late: bench clock [ns] and delay [s]."""

    def on_setpoints_failed(self, reason: str) -> None:
        """Handle the end of setpoints by an error; called at once."""
