"""Alembic archives: meshes at any time, as records of arrays (extra `alembic`)."""

from __future__ import annotations

SUFFIXES = (".abc",)
