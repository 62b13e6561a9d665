"""Mappings that say in one of their keys which kind they are, such as `kind: sphere`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Tag

from quiltcli.job.model import Model, complaint, describe, either, suggest


def tagged(models: Mapping[str, type[Model]], key: str, example: str) -> Any:
    """The type of a mapping that is one of several models.

    Args:
        models: the models, by what `key` says.
        key: the key that tells them apart.
        example: such a mapping, for messages.
    """

    def check(value: Any) -> Any:
        """A mapping must say which kind it is before its keys can be judged."""
        if not isinstance(value, (dict, Model)):
            raise complaint(f"expected {example}, got {describe(value)}")
        kind = value.get(key) if isinstance(value, dict) else value.__dict__[key]
        if kind is None:
            raise complaint(f"missing key (expected {either(list(models))})", key)
        if kind not in tuple(models):
            near = suggest(kind, models)
            hint = f" (did you mean {near!r}?)" if near else ""
            raise complaint(f"expected {either(list(models))}, got {describe(kind)}{hint}", key)
        return value

    def tag(value: Any) -> str:
        kind = value[key] if isinstance(value, dict) else getattr(value, key)
        return f"<{models[kind].__name__}>"

    first, *rest = [Annotated[model, Tag(f"<{model.__name__}>")] for model in models.values()]
    union: Any = first
    for other in rest:
        union = union | other
    return Annotated[union, Discriminator(tag), BeforeValidator(check)]
