"""Facets by their names, as people know them."""

from __future__ import annotations

from collections.abc import Sequence

from quiltcli.errors import JobError
from quiltcli.job.frames import parse_facets
from quiltcli.job.model import suggest


def facet_ids(text: str, names: Sequence[str]) -> tuple[int, ...]:
    """Ids, ascending, of facets in a list such as `left,right` or `left,5-7`.

    Args:
        text: names, ids and ranges of ids, separated by commas.
        names: of the display's facets, empty where one has none.

    Raises:
        JobError: a name that no facet has, or several have; a facet that is named twice.
    """
    found: list[int] = []
    for part in (part.strip() for part in text.split(",")):
        if not part:
            raise JobError(f"--facets: a facet is missing in {text!r} (expected such as left,3,7-9)")
        if part not in names:
            if any(letter.isalpha() for letter in part):
                near = suggest(part, [name for name in names if name])
                hint = f" (did you mean {near!r}?)" if near else ""
                raise JobError(f"--facets: there is no facet named {part!r}{hint}")
            found += parse_facets(part)
        elif names.count(part) > 1:
            raise JobError(f"--facets: {names.count(part)} facets are named {part!r} (give their ids)")
        else:
            found.append(names.index(part) + 1)
    for facet in found:
        if found.count(facet) > 1:
            raise JobError(f"--facets: facet {facet} is named twice in {text!r}")
    return tuple(sorted(found))
