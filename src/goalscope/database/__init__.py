"""Databases that hold episodes: SQLite files and PostgreSQL, by one path."""
