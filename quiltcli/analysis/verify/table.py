"""The verdict as a table."""

from __future__ import annotations

from quiltcli.analysis.verify.frame import Verdict
from quiltcli.analysis.verify.seams import COUNTS as SEAM_COUNTS
from quiltcli.analysis.verify.tally import COUNTS, FAULTS, Errors

COLUMNS = ("", "facets", "bleed", "")


def verdict_rows(verdict: Verdict) -> list[tuple[str, ...]]:
    """Rows of the table in `COLUMNS`; the last column marks what is out of tolerance."""
    rows: list[tuple[str, ...]] = []
    for key, name in COUNTS.items():
        rows.append((name, f"{verdict.inside[key]:,}", f"{verdict.bleed[key]:,}", ""))
    for key, name in FAULTS.items():
        inside, bleed = verdict.inside[key], verdict.bleed[key]
        rows.append((name, f"{inside:,}", f"{bleed:,}", _mark(inside + bleed)))
    rows.append(("drawn outside lit facets", f"{verdict.outside:,}", "", _mark(verdict.outside)))
    both = (verdict.inside.errors, verdict.bleed.errors)
    rows += [
        ("depth error, median", *(_metres(errors, errors.quantile(0.5)) for errors in both), ""),
        ("depth error, 99.9 %", *(_metres(errors, errors.quantile(0.999)) for errors in both), ""),
        ("depth error, greatest", *(_metres(errors, errors.most) for errors in both), ""),
        ("  share of its tolerance", *(f"{100 * errors.most_share:.1f} %" for errors in both), ""),
    ]
    seams = verdict.seams
    for key, name in SEAM_COUNTS.items():
        rows.append((name, f"{seams.counts[key]:,}", "", _mark(seams.failures * (key == "seam"))))
    rows.append(("seam jump, greatest", f"{seams.most:.3g} m", "", ""))
    rows.append(("  share of its tolerance", f"{100 * seams.most_share:.1f} %", "", ""))
    for name, found in (("facets", verdict.areas.display), ("scene faces", verdict.areas.scene)):
        rows.append((f"{name} of over 3 corners", f"{found.faces:,}", "", ""))
        rows.append(("  not covered by their triangles", f"{found.wrong:,}", "", _mark(found.wrong)))
        if found.crossing:
            rows.append(("  crossing themselves: no verdict", f"{found.crossing:,}", "", ""))
    return rows


def _metres(errors: Errors, value: float) -> str:
    return f"{value:.3g} m" if errors.count else "-"


def _mark(count: int) -> str:
    return "FAIL" if count else ""
