"""The reference of every key of the YAML files, made from their JSON Schemas: one page a kind of file.

`python -m quiltcli.job.reference docs/reference` writes the pages. A key's meaning is the docstring
below it in its model; where its first sentence ends with a comma and the name of a unit, the unit
gets a column of its own.
"""

from quiltcli.job.reference.pages import keys, pages, split_unit, write_pages
from quiltcli.job.reference.words import EXAMPLES

__all__ = ["EXAMPLES", "keys", "pages", "split_unit", "write_pages"]
