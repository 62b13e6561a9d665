"""Comparison: every render method on the user's own job, held against rays."""

from __future__ import annotations

from quiltcli.compare.findings import VARIANTS, Findings, Variant, variants_of
from quiltcli.compare.study import CompareOptions, Study, compare
from quiltcli.compare.table import COLUMNS, study_json, study_rows, study_words

__all__ = [
    "COLUMNS",
    "VARIANTS",
    "CompareOptions",
    "Findings",
    "Study",
    "Variant",
    "compare",
    "study_json",
    "study_rows",
    "study_words",
    "variants_of",
]
