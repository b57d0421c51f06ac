"""PostgreSQL only: a column for texts, and the table `newest_values` for effects and parameters.

The column `texts` of a run contains its searched texts in small letters, with an index of groups of letters. A
trigger keeps the effects of the newest diagnosis and the parameters of the newest fit of each run as rows. A
search then reads an index instead of the JSON of every job.
"""

from alembic import op

revision = "0017"
down_revision = "0016"

_UPGRADE = (
    "CREATE EXTENSION IF NOT EXISTS pg_trgm",
    """
    ALTER TABLE runs ADD COLUMN texts text GENERATED ALWAYS AS (
        lower(specimen || chr(31) || method || chr(31) || operator || chr(31) || reason)
    ) STORED
    """,
    "CREATE INDEX runs_texts ON runs USING gin (texts gin_trgm_ops)",
    "CREATE INDEX notes_texts ON notes USING gin (text gin_trgm_ops)",
    """
    CREATE TABLE newest_values (
        run_id text NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
        kind text NOT NULL,
        name text NOT NULL,
        value double precision, -- null for an effect
        PRIMARY KEY (run_id, kind, name)
    )
    """,
    "CREATE INDEX newest_values_search ON newest_values (kind, name, value, run_id)",
    """
    CREATE FUNCTION store_newest_values(run text, job_kind text) RETURNS void LANGUAGE plpgsql AS $$
    DECLARE newest json;
    BEGIN
        DELETE FROM newest_values WHERE run_id = run AND kind = job_kind;
        SELECT summary INTO newest FROM jobs WHERE run_id = run AND kind = job_kind AND state = 'done'
            ORDER BY finished DESC, id DESC LIMIT 1;
        IF json_typeof(newest -> 'parameters') = 'object' THEN
            INSERT INTO newest_values SELECT run, job_kind, key, value::text::double precision
                FROM json_each(newest -> 'parameters') WHERE json_typeof(value) = 'number'
                ON CONFLICT DO NOTHING;
        END IF;
        IF json_typeof(newest -> 'effects') = 'array' THEN
            INSERT INTO newest_values SELECT run, job_kind, name
                FROM json_array_elements_text(newest -> 'effects') AS effect (name)
                ON CONFLICT DO NOTHING;
        END IF;
    END $$
    """,
    """
    CREATE FUNCTION follow_job() RETURNS trigger LANGUAGE plpgsql AS $$
    BEGIN
        PERFORM store_newest_values(NEW.run_id, NEW.kind);
        RETURN NULL;
    END $$
    """,
    """
    CREATE TRIGGER added_job AFTER INSERT ON jobs FOR EACH ROW
        WHEN (NEW.state = 'done') EXECUTE FUNCTION follow_job()
    """,
    """
    CREATE TRIGGER changed_job AFTER UPDATE OF state, finished, summary ON jobs FOR EACH ROW
        WHEN (OLD.state = 'done' OR NEW.state = 'done') EXECUTE FUNCTION follow_job()
    """,
    "SELECT store_newest_values(run_id, kind) FROM (SELECT DISTINCT run_id, kind FROM jobs) AS done",
)
_DOWNGRADE = (
    "DROP TRIGGER changed_job ON jobs",
    "DROP TRIGGER added_job ON jobs",
    "DROP FUNCTION follow_job()",
    "DROP FUNCTION store_newest_values(text, text)",
    "DROP TABLE newest_values",
    "DROP INDEX notes_texts",
    "ALTER TABLE runs DROP COLUMN texts",
)


def upgrade() -> None:
    """Create them; SQLite is searched as before."""
    _execute(_UPGRADE)


def downgrade() -> None:
    """Drop them; the extension stays, because others may use it."""
    _execute(_DOWNGRADE)


def _execute(statements: tuple[str, ...]) -> None:
    if op.get_bind().dialect.name == "postgresql":
        for statement in statements:
            op.execute(statement)
