"""Views of campaigns as lines of text, for the command line."""

from bench.campaigns.view import CampaignView

_STATES = ("done", "active", "pending", "failed", "skipped", "held_back")
"""States of items in the order in which they are counted."""


def format_view(view: CampaignView) -> list[str]:
    """Format a campaign as lines of text."""
    counts = {name: sum(item.state == name for item in view.items) for name in _STATES}
    summary = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in counts.items() if count)
    times = view.times
    lines = [
        f"{view.id}: {view.status}{f' ({view.reason})' if view.reason else ''}; {summary}",
        f"in motion {times.stroking_s:.0f} s, at rest {times.rest_s:.0f} s, held {times.held_s:.0f} s",
    ]
    if view.current is not None:
        lines.append(f"current: {view.current.id} {view.current.label}, {view.phase}")
    if view.question is not None:
        lines.append(f"asks: {view.question.text}")
    if view.next is not None and view.expected_end is not None:
        lines.append(
            f"next: {view.next.id} {view.next.label}; expected end {view.expected_end:%Y-%m-%d %H:%M} UTC"
        )
    return lines
