"""Benches of a service by name."""

from collections.abc import Iterator, Sequence
from http import HTTPStatus

from bench.agent_protocol import AgentStatus, BenchDescription
from bench.errors import AgentUnreachableError
from bench.service.benches.served_bench import ServedBench
from bench.service.problems import ProblemError, make_conflict, shorten


class ServedBenches:
    """Benches of a service, in the order of its command line."""

    def __init__(self, benches: Sequence[ServedBench]) -> None:
        """Use benches with different names; there is at least one."""
        self._benches = {bench.name: bench for bench in benches}

    def __iter__(self) -> Iterator[ServedBench]:
        return iter(self._benches.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the benches."""
        return tuple(self._benches)

    @property
    def are_several(self) -> bool:
        """True if a request has to name its bench."""
        return len(self._benches) > 1

    def find(self, name: str | None) -> ServedBench | None:
        """Return the bench with a name, or the only bench without one; None if there is no such bench."""
        if name is None:
            return None if self.are_several else next(iter(self))
        return self._benches.get(name)

    def get(self, name: str | None, advice: str = "give `bench`") -> ServedBench:
        """Return the bench with a name, or the only bench without one.

        Args:
            name: name of the bench; None if a request names none.
            advice: how a request names one.

        Raises:
            ProblemError: there is no such bench, or there are several and none is named.
        """
        found = self.find(name)
        if found is not None:
            return found
        names = ", ".join(self.names)
        if name is None:
            detail = f"this service has the benches {names}; {advice}"
            raise make_conflict("several-benches", "Several benches", detail)
        detail = f"there is no bench {shorten(name)}; this service has {names}"
        raise ProblemError(HTTPStatus.NOT_FOUND, "not-found", "Not found", detail)

    def describe(self, name: str | None) -> tuple[BenchDescription | None, str]:
        """Return what the agent says about a bench, or None with the reason why it is not known.

        Args:
            name: name of the bench; None for the only one.

        Raises:
            ProblemError: there is no bench with this name.
        """
        if name is None and self.are_several:
            return None, f"the service has several benches; name one of {', '.join(self.names)}"
        try:
            return self.get(name).monitor.describe_bench(), ""
        except AgentUnreachableError as error:
            return None, str(error)

    def find_by_executor(self, executor: str) -> ServedBench | None:
        """Return the bench of an executor of campaigns; None for a simulated plant."""
        return next((bench for bench in self if bench.executor == executor), None)

    def find_with_run(self, run_id: str) -> ServedBench | None:
        """Return the bench whose agent has last reported a run as the present one; None if none has."""
        return next((bench for bench in self if _has_run(bench.monitor.last_status, run_id)), None)

    def list_statuses(self) -> tuple[AgentStatus | None, ...]:
        """Return the present status of each bench; None for one whose agent does not answer."""
        return tuple(self.find_statuses().values())

    def find_statuses(self) -> dict[str, AgentStatus | None]:
        """Return the present status by bench; None for one whose agent does not answer."""
        return {bench.name: bench.monitor.latest_status for bench in self}

    def publish(self, topic: str, text: str, key: str) -> None:
        """Send a message about what all benches share to the listeners of each; called in the event loop."""
        for bench in self:
            bench.live.publish(topic, text, key)

    def request_end(self) -> None:
        """Let the threads of all benches end, without waiting for them."""
        for bench in self:
            bench.request_end()


def _has_run(status: AgentStatus | None, run_id: str) -> bool:
    return status is not None and status.run is not None and status.run.id == run_id
