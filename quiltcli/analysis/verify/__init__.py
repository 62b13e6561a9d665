"""Verification: a render held against rays cast through its pixels."""

from __future__ import annotations

from quiltcli.analysis.verify.frame import SAMPLE, Verdict, VerifyOptions, verify, verify_images
from quiltcli.analysis.verify.table import COLUMNS, verdict_rows

__all__ = ["COLUMNS", "SAMPLE", "Verdict", "VerifyOptions", "verdict_rows", "verify", "verify_images"]
