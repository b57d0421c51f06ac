"""Catalogues with rows in every table, and their content as values that can be compared."""

from datetime import datetime, timedelta, timezone

from sqlalchemy import JSON, BigInteger, Boolean, Enum, Float, Integer, insert, select

from bench.catalogue import Catalogue, JobRow, RunFilter, RunRow, make_sqlite_url, open_database
from bench.catalogue.models import Base, UtcTime

ZONE = timezone(timedelta(hours=5, minutes=30))
STARTED = datetime(2026, 3, 1, 15, 30, 0, 123456, tzinfo=ZONE)
TEXT = "Öl 'x' \"y\" %s ; \\ \t\n \N{GRINNING FACE}"
JSON_VALUE = {"z": TEXT, "a": [1e-300, 2**70, 0.1, True, None], "empty": {}, "path": r"C:\u0000", "ß": -0.0}
NUL, REPLACED = "before\0after", "before\N{REPLACEMENT CHARACTER}after"
SEARCHES = {
    "specimen": RunFilter(specimen="MR-2"),
    "text in any case": RunFilter(text="a. Öl_"),
    "text of a note": RunFilter(text="100% dry"),
    "no text": RunFilter(text="l_8"),
    "tag": RunFilter(tag="spare"),
    "effect": RunFilter(effect="backlash"),
    "former effect": RunFilter(effect="gas_spring"),
    "parameter": RunFilter(parameter="k0", parameter_min=1.5, parameter_max=2.5),
    "time": RunFilter(started_from=STARTED + timedelta(hours=1), started_to=STARTED + timedelta(hours=2)),
}


def fill_all_tables(url):
    """Add two rows to every table: one with unusual values in all columns, one without optional values."""
    engine = open_database(url)
    with engine.begin() as connection:
        for table in Base.metadata.sorted_tables:
            rows = [{one.name: make_value(one, number) for one in table.columns} for number in (1, 2)]
            connection.execute(insert(table), rows[0])
            connection.execute(
                insert(table), {name: rows[1][name] for name in rows[1] if not table.c[name].nullable}
            )
    engine.dispose()


def make_value(column, number):
    """Return a value for a column; a reference and its target get the same."""
    if column.foreign_keys:
        return make_value(next(iter(column.foreign_keys)).column, number)
    if isinstance(column.type, JSON):
        return JSON_VALUE
    if isinstance(column.type, Enum):
        return column.type.enums[-1]
    if isinstance(column.type, UtcTime):
        return STARTED + timedelta(microseconds=number)
    if isinstance(column.type, Boolean):
        return number == 1
    if isinstance(column.type, Float):
        return 0.1 + number
    if isinstance(column.type, BigInteger):
        return 2**62 + number
    if isinstance(column.type, Integer):
        return 40 + number if column.primary_key else 2**31 - number
    return f"{column.table.name} {column.name} {number} {TEXT}"


def fill_for_search(url, folder):
    """Add three runs with results, notes and tags."""
    catalogue = Catalogue(open_database(url), folder)
    for number in (1, 2, 3):
        started = STARTED + timedelta(hours=number)
        row = RunRow(
            id=f"run-{number}", method="quick", specimen=f"MR-{number}",
            operator="A. Öl_7" if number == 1 else "B", started=started, state="ended", log=f"{number}.mcap",
            tags=["spare"] if number == 2 else [],
        )  # fmt: skip
        catalogue.add(row)
        for later in (1, 2):
            gap = {"effects": ["gas_spring" if later == 1 else "backlash"], "verdict": "explained"}
            fit = {"parameters": {"k0": float(number * later), "note": "text"}}
            for kind, summary in (("diagnose", gap), ("identify", fit)):
                job = JobRow(
                    id=f"{kind}-{number}-{later}", run_id=row.id, kind=kind, key=f"{kind}{number}{later}",
                    settings={}, state="done", created=started, summary=summary,
                    finished=started + timedelta(minutes=later),
                )  # fmt: skip
                catalogue.add(job)
    catalogue.notebook.add_note("run-3", "A", "kept 100% DRY")
    catalogue.close()


def search(url, folder):
    """Return the runs that each search finds."""
    catalogue = Catalogue(open_database(url), folder)
    found = {name: [row.id for row in catalogue.list_runs(10, None, one)] for name, one in SEARCHES.items()}
    catalogue.close()
    return found


def read_all(url):
    """Return all rows by table, read through the models and in an order that no database determines."""
    engine = open_database(url)
    with engine.connect() as connection:
        content = {
            table.name: sorted(map(repr, connection.execute(select(table))))
            for table in Base.metadata.sorted_tables
        }
    engine.dispose()
    return content


def make_file(folder):
    """Create a data folder with an empty SQLite catalogue, and return its URL."""
    folder.mkdir()
    url = make_sqlite_url(folder / "catalogue.db")
    open_database(url).dispose()
    return url
