"""Sections on the course of a campaign: conditions of the runs, steps not done, answers, times, messages."""

from collections.abc import Iterator
from datetime import datetime

from bench.campaign_report.content import CampaignReport
from bench.campaign_report.mountings import MOUNTING_RULE
from bench.campaign_report.photos import name_photo
from bench.campaigns import ItemView, RunFact
from bench.report import format_name, format_significant
from bench.report.layout import Section, Table

Row = tuple[str, ...]
NOT_DONE = ("skipped", "failed", "held_back")
"""States of steps that ended without being done."""
_SHOWN_MESSAGES = 500
"""Largest number of messages in a report, the newest ones."""


def format_time(time: datetime | None) -> str:
    """Format a UTC; a dash without one."""
    return "–" if time is None else f"{time:%Y-%m-%d %H:%M:%S} UTC"


def make_head_rows(report: CampaignReport) -> list[Row]:
    """Make the rows of name, document, persons and times of a campaign."""
    view, state = report.view, report.state
    document = state.campaign
    rows = [
        ("Campaign", view.id),
        ("Document", f"{document.schema_name}, {len(state.items)} steps"),
        ("SHA-256 of the document and its methods", report.key),
        ("Seed", str(document.seed)),
        ("Operator", view.operator or "not given"),
        ("Bench", "rig agent" if view.bench == "agent" else view.bench),
        ("Started", format_time(view.created)),
        ("Ended" if state.has_ended else "Latest change", format_time(view.updated)),
        ("State", f"{view.status}: {view.reason}" if view.reason else view.status),
    ]
    return [*rows, *_make_time_rows(report)]


def _make_time_rows(report: CampaignReport) -> list[Row]:
    times = report.view.times
    return [
        ("Time in motion", format_duration(times.stroking_s)),
        ("Time at rest", format_duration(times.rest_s)),
        ("Time held", f"{format_duration(times.held_s)} (paused, waiting, in setup steps, or without a process)"),
    ]


def format_duration(seconds: float) -> str:
    """Format a duration [s] in hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min {rest:02d} s" if hours else f"{minutes} min {rest:02d} s"


def make_conditions(report: CampaignReport) -> Section:
    """Make the section on the conditions of each complete run."""
    rows = [_make_run_row(report, fact) for fact in report.state.facts]
    header = ("Run", "Specimen", "Method", "Drive", "Mounting", "Temperature", "Start", "Length", "Outcome")
    widths = (2, 4, 4, 4, 4, 5, 6, 3, 4)
    names = [(str(report.numbers[fact.run]), fact.item, fact.run) for fact in report.state.facts]
    return Section(
        "Conditions of the runs",
        [MOUNTING_RULE, "The temperature is the reading of the thermometer at the end of the run."],
        [
            Table(rows, header, widths, "Complete runs in the order of time"),
            Table(names, ("Run", "Step", "Id in the catalogue"), (1, 1, 6), "Step and id of each run"),
        ]
        if rows
        else [],
    )


def _make_run_row(report: CampaignReport, fact: RunFact) -> Row:
    unit = next(cell.drive_unit for cell in report.cells if fact in cell.facts)
    temperature = "not known" if fact.temperature_c is None else f"{fact.temperature_c:.1f} °C"
    return (
        str(report.numbers[fact.run]),
        fact.specimen,
        fact.method,
        "of the method" if fact.drive is None else f"{fact.drive:g} {unit}",
        str(report.mountings[fact.run]),
        temperature,
        format_time(report.starts[fact.run]),
        f"{format_significant(fact.duration_s)} s",
        fact.outcome,
    )


def make_steps(report: CampaignReport) -> Section:
    """Make the section on steps that were skipped, failed or held back, and on interrupted ones."""
    items = report.view.items
    ended = [item for item in items if item.state in NOT_DONE]
    interrupted = [item for item in items if item.parts or item.crashes]
    rows = [(item.id, item.label, format_name(item.state), item.reason or "no reason given") for item in ended]
    parts = [_make_part_row(item) for item in interrupted]
    tables = [
        Table(rows, ("Step", "Content", "State", "Reason"), (1, 4, 2, 5), "Skipped, failed and held-back steps"),
        Table(parts, ("Step", "Content", "Incomplete runs", "Crashes"), (1, 4, 6, 1), "Interrupted steps"),
    ]
    texts = [] if rows else ["No step was skipped, has failed or was held back."]
    if pending := sum(item.state in ("pending", "active") for item in items):
        texts.append(f"{pending} of {len(items)} steps have not been completed.")
    return Section("Steps that were not done", texts, [table for table in tables if table.rows])


def _make_part_row(item: ItemView) -> Row:
    return item.id, item.label, ", ".join(item.parts) or "none", str(item.crashes)


def make_setup_steps(report: CampaignReport) -> Section:
    """Make the section on the setup steps of the bench that have begun, such as a tare between two runs."""
    items = [item for item in report.view.items if item.kind == "setup" and item.started is not None]
    rows = [
        (
            item.id,
            item.label,
            format_time(item.started),
            format_time(item.ended),
            format_name(item.state),
            item.reason or "–",
        )
        for item in items
    ]
    table = Table(
        rows, ("Step", "Content", "Begun", "Ended", "State", "Result"), (1, 3, 3, 3, 2, 5), "Setup steps"
    )
    return Section("Setup steps", [] if rows else ["No setup step has begun."], [table] if rows else [])


def make_answers(report: CampaignReport) -> Section:
    """Make the section on the questions to persons and their answers."""
    rows = list(_list_answers(report))
    header = ("Step", "Question", "Asked", "Answered", "By", "Note", "Photo")
    table = Table(rows, header, (2, 5, 4, 4, 3, 5, 3), "Answers of persons")
    texts = [] if rows else ["No person was asked."]
    if lost := [item for item in report.state.items if item.photo and item.id not in report.photos]:
        names = ", ".join(f"{item.photo} of step {item.id}" for item in lost)
        texts.append(f"Not shown, because they are missing, unreadable or too many: {names}.")
    pictures = [name_photo(item) for item in report.photos]
    return Section("Questions and answers", texts, [table] if rows else [], pictures)


def _list_answers(report: CampaignReport) -> Iterator[Row]:
    """Yield a row for each prompt that was asked, and for each decision on a failed step."""
    asked = {item.id for item in report.view.items if item.kind == "prompt" and item.started is not None}
    answers = [
        event for event in report.view.events if event.kind == "edit" and event.text.startswith("answered: ")
    ]
    for item in report.view.items:
        if item.id in asked:
            who = next((event.who for event in answers if event.item == item.id), "")
            answered = format_time(item.ended) if item.state == "done" else format_name(item.state)
            times = (format_time(item.started), answered)
            yield item.id, item.label, *times, who or "not given", item.note or "–", item.photo or "–"
    for event in answers:
        if event.item not in asked:
            question = next((item.label for item in report.view.items if item.id == event.item), "")
            text = event.text.removeprefix("answered: ")
            time = format_time(event.at)
            yield event.item, f"{question} has failed", "–", time, event.who or "not given", text, "–"


def make_messages(report: CampaignReport) -> Section:
    """Make the section on the messages of a campaign; its restore points are left out."""
    events = [event for event in report.view.events if event.kind != "restore_point"]
    shown = events[-_SHOWN_MESSAGES:]
    rows = [
        (format_time(event.at), format_name(event.kind), event.item or "–", event.text, event.who or "–")
        for event in shown
    ]
    header = ("Time", "Kind", "Step", "Text", "By")
    texts = [] if len(shown) == len(events) else [f"The newest {len(shown)} of {len(events)} messages."]
    table = Table(rows, header, (4, 3, 2, 8, 2), "Messages, oldest first")
    return Section("Messages", texts or ([] if rows else ["There are no messages."]), [table] if rows else [])
