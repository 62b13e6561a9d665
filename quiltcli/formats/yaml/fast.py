"""The libyaml reader with YAML 1.2 scalars; importable only where PyYAML was built with libyaml."""

from __future__ import annotations

from yaml.cyaml import CParser  # type: ignore[attr-defined]

from quiltcli.formats.yaml.core import CoreResolver


class FastLoader(CParser, CoreResolver):
    """Composes the same nodes as the reader in Python, some times faster."""

    def __init__(self, text: str) -> None:
        CParser.__init__(self, text)
        CoreResolver.__init__(self)
