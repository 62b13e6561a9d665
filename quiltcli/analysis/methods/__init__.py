"""Comparison: every render method on the user's own job, held against rays."""

from __future__ import annotations

from quiltcli.analysis.methods.findings import VARIANTS, Findings, Variant, variants_of
from quiltcli.analysis.methods.study import CompareOptions, Study, compare
from quiltcli.analysis.methods.table import COLUMNS, study_json, study_rows, study_words

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
