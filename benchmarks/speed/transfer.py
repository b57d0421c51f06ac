"""Time of the transfer of a catalogue from SQLite to PostgreSQL and back, each row compared.

python -m benchmarks.speed.transfer --catalogue postgresql://USER@HOST/EMPTY_DATABASE [--runs 10000]
"""

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.catalogue import FILE_TARGET, make_sqlite_url, open_database, transfer_catalogue
from benchmarks.common import print_line
from benchmarks.speed.catalogue import RUN_COUNT, fill_catalogue


def run(url: str, count: int = RUN_COUNT) -> None:
    """Print the time of both directions.

    Args:
        url: empty database.
        count: number of runs; each has a fit and a diagnosis.
    """
    with TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "catalogue.db"
        engine = open_database(make_sqlite_url(file))
        fill_catalogue(engine, count)
        engine.dispose()
        print(
            f"transfer: a catalogue of {count} runs with their jobs, two each, {file.stat().st_size / 1e6:.1f} MB"
        )
        _measure(folder, url, "from SQLite to PostgreSQL")
        file.rename(folder / "former.db")
        _measure(folder, FILE_TARGET, "from PostgreSQL to SQLite")


def _measure(folder: Path, target: str, direction: str) -> None:
    began = time.perf_counter()
    rows = sum(transfer_catalogue(folder, target, lambda share: None).tables.values())
    took = time.perf_counter() - began
    print_line(f"{direction}, {rows} rows", took, "s", f"{rows / took:.0f} rows/s")


def main() -> None:
    """Measure a catalogue of any size."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.transfer", description=__doc__)
    parser.add_argument("--catalogue", metavar="URL", required=True, help="empty database")
    parser.add_argument("--runs", type=int, default=RUN_COUNT, help="number of runs")
    asked = parser.parse_args()
    run(asked.catalogue, asked.runs)


if __name__ == "__main__":
    main()
