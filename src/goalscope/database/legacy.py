"""SQLite files from before Alembic's revisions."""

from __future__ import annotations

from collections.abc import Callable

from sqlalchemy import Connection

__all__ = ["bring_over"]

MIGRATIONS = (
    """
CREATE TABLE episodes (
    id TEXT PRIMARY KEY,
    created TEXT NOT NULL,
    domain TEXT NOT NULL,
    profile TEXT,
    method TEXT NOT NULL,
    model TEXT NOT NULL,
    task TEXT NOT NULL,
    settings TEXT NOT NULL,
    ended TEXT CHECK (ended IN ('terminated', 'truncated')),
    score REAL CHECK (score BETWEEN 0 AND 1)
) STRICT;
CREATE TABLE rounds (
    episode TEXT NOT NULL REFERENCES episodes (id),
    number INTEGER NOT NULL CHECK (number >= 1),
    json TEXT NOT NULL,
    PRIMARY KEY (episode, number)
) STRICT, WITHOUT ROWID
""",
    """
CREATE TABLE about (
    name TEXT PRIMARY KEY,
    value TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE cells (
    key TEXT PRIMARY KEY,
    spec TEXT NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 0,
    error TEXT,
    identity TEXT,
    result TEXT
) STRICT
""",
    """
UPDATE rounds SET json = json_set(
    json_remove(json, '$.belief.temperature', '$.belief.evidence'),
    '$.belief.calibration', json_object(
        'temperature', json_extract(json, '$.belief.temperature'), 'reference', 0.0,
        'unstated', NULL, 'switching', json_extract(json, '$.belief.evidence') = 'last', 'n', 0,
        'thresholds', json_array()
    ),
    '$.belief.pinned', json_array()
) WHERE CASE WHEN json_valid(json) THEN json_type(json, '$.belief.temperature') END IS NOT NULL;
UPDATE episodes SET settings = json_set(
    json_remove(settings, '$.temperature', '$.evidence'), '$.calibration', NULL
) WHERE CASE WHEN json_valid(settings) THEN json_type(settings, '$.temperature') END IS NOT NULL;
UPDATE cells SET result = json_set(result, '$.calibration', json_object(
    'temperature', 2.0, 'reference', 0.0, 'unstated', NULL, 'switching', 0.0, 'n', 0,
    'thresholds', json_array()
)) WHERE CASE WHEN json_valid(result) THEN json_type(result, '$.role-play') END IS NOT NULL
""",
    """
CREATE TABLE corrections (
    episode TEXT NOT NULL REFERENCES episodes (id),
    after INTEGER NOT NULL,
    json TEXT NOT NULL
) STRICT
""",
)
"""What each version added: the first made the tables, the second those of experiments, the third
made a calibration of the temperature and the kind of evidence, the fourth keeps what is said of the
goals between rounds."""
CARRIED = {
    "episodes": (
        "id, created, domain, profile, method, model, task, settings, ended, score",
        "created, rowid",
    ),
    "rounds": ("episode, number, json", "episode, number"),
    "corrections": ("episode, after, json", "rowid"),
    "about": ("name, value", "name"),
    "cells": ("key, spec, attempts, error, identity, result", "rowid"),
}
"""Of each table of the last version: its columns, and the order of its rows."""


def bring_over(connection: Connection, version: int, make_tables: Callable[[], None]) -> None:
    """Bring a file to the last of these versions, and its rows into the tables of today's kind.

    Args:
        connection: In a transaction.
        version: Of the file.
        make_tables: Makes the tables of the revision that holds all of these.
    """
    run = connection.exec_driver_sql
    for migration in MIGRATIONS[version:]:
        for statement in migration.split(";"):
            run(statement)
    for table in CARRIED:
        run(f"ALTER TABLE {table} RENAME TO old_{table}")
    make_tables()
    for table, (columns, order) in CARRIED.items():
        run(f"INSERT INTO {table} ({columns}) SELECT {columns} FROM old_{table} ORDER BY {order}")
    for table in reversed(CARRIED):
        run(f"DROP TABLE old_{table}")
