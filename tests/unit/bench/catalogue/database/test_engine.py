"""Migration of a new database by processes that open it at once."""

from concurrent.futures import ThreadPoolExecutor, wait

from sqlalchemy import inspect

from bench.catalogue.database.address import make_sqlite_url, parse_address
from bench.catalogue.database.engine import make_engine, migrate, open_database


def test_a_second_process_waits_until_the_first_has_made_the_tables(tmp_path):
    url = make_sqlite_url(tmp_path / "catalogue.db")
    engine = make_engine(parse_address(url))
    with engine.connect() as first, ThreadPoolExecutor(1) as pool:
        migrate(first)
        second = pool.submit(open_database, url)
        assert not wait([second], timeout=0.5).done
        first.commit()
        opened = second.result(timeout=30)
    assert "runs" in inspect(opened).get_table_names()
    opened.dispose()
    engine.dispose()


def test_a_present_database_is_opened_beside_a_writer(tmp_path):
    url = make_sqlite_url(tmp_path / "catalogue.db")
    engine = open_database(url)
    with engine.connect() as writer:
        writer.exec_driver_sql("BEGIN IMMEDIATE")
        open_database(url).dispose()
    engine.dispose()
