"""What all models of the YAML files share: strict frozen models and the types of their values."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PrivateAttr,
    ValidationInfo,
    model_validator,
)
from pydantic_core import PydanticCustomError
from pydantic_core import core_schema as cs

from quiltcli.formats.inputs import foreign_fault, name_fault
from quiltcli.formats.yaml.source import Source, shorten

# A path below a model, and what is wrong with the value there.
Complaint: TypeAlias = tuple[tuple[str | int, ...], str]


def complaint(message: str, *at: str | int) -> PydanticCustomError:
    """Error for validators to raise; `at` leads from the value to the key that is at fault."""
    return complaints([(at, message)])


def complaints(found: Sequence[Complaint]) -> PydanticCustomError:
    """As `complaint`, for several at once."""
    return PydanticCustomError("quilt", "{text}", {"text": found[0][1], "found": list(found)})


@dataclass(frozen=True, eq=False)
class ShortFor:
    """A value that may stand for a mapping: `read` makes the one of the other, `schema` says what it is."""

    read: Callable[[Any], Any]
    schema: dict[str, Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> cs.CoreSchema:
        """Put the value where it belongs."""
        return cs.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: cs.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """One or the other, for editors."""
        return {"anyOf": [self.schema, handler(schema)]}


def describe(value: Any) -> str:
    """A value as it is named in messages."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text {shorten(value)!r}"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    return shorten(repr(value))


def suggest(word: object, known: Iterable[str]) -> str:
    """The known word nearest to `word`, or an empty text when none is near."""
    by_lower = {name.lower(): name for name in known}
    near = get_close_matches(str(word).lower(), by_lower, n=1, cutoff=0.7)
    return by_lower[near[0]] if near else ""


def one_of(names: Iterable[str], value: Any, also: str = "") -> str:
    """`value` itself if it is one of `names`; `also` names what else would have been good."""
    names = list(names)
    expected = either([*names, also] if also else names)
    if isinstance(value, str) and value in names:
        return str(value)
    near = suggest(value, names) if isinstance(value, str) else ""
    hint = f" (did you mean {near!r}?)" if near else ""
    raise complaint(f"expected {expected}, got {describe(value)}{hint}")


def either(names: Sequence[str]) -> str:
    """`a, b or c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


class Model(BaseModel):
    """A mapping of a YAML file: unknown keys are errors, nothing is converted, nothing changes later."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, use_attribute_docstrings=True, validate_default=False, strict=True
    )
    _source: Source = PrivateAttr(default_factory=Source)

    @property
    def source(self) -> Source:
        """Where this was written, for messages."""
        return self._source

    def cross_checks(self) -> Iterator[Complaint]:
        """What is wrong between keys that are each well on their own."""
        yield from ()

    @model_validator(mode="after")
    def _run_cross_checks(self) -> Model:
        found = list(self.cross_checks())
        if found:
            raise complaints(found)
        return self


class FileModel(Model):
    """A whole file; its first key says which kind of file and which version it is."""

    kind: ClassVar[str]


def attach(value: Any, source: Source) -> None:
    """Tell a model, and every model inside it, where it was written."""
    if isinstance(value, Model):
        value._source = source
        for name in type(value).model_fields:
            attach(getattr(value, name), source.at(name))
    elif isinstance(value, (tuple, dict)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            if isinstance(item, (Model, tuple)):
                attach(item, source.at(key))


def exactly_one(model: Model, *names: str) -> Iterator[Complaint]:
    """Complain unless exactly one of the keys was given."""
    given = [name for name in names if getattr(model, name) is not None]
    if not given:
        yield (), f"expected {either(names)}, got {'neither' if len(names) == 2 else 'none'}"
    if len(given) > 1:
        yield (given[1],), f"cannot stand beside {given[0]} (expected only one of {either(names)})"


@dataclass(frozen=True)
class OneOf:
    """Annotation of a text that must be one of some names."""

    names: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> cs.CoreSchema:
        """Validate by `one_of`."""
        return cs.no_info_before_validator_function(lambda value: one_of(self.names, value), handler(source))

    def __get_pydantic_json_schema__(
        self, schema: cs.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """An enumeration, for editors."""
        return {**handler(schema), "enum": list(self.names)}


@dataclass(frozen=True)
class Items:
    """Annotation of a list that must have `count` items."""

    count: int
    what: str = "numbers"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> cs.CoreSchema:
        """Check the length first: "expected 3 numbers, got 2" says more than three errors would."""
        return cs.no_info_before_validator_function(self._check, handler(source))

    def _check(self, value: Any) -> Any:
        if not isinstance(value, (list, tuple)):
            raise complaint(f"expected a list of {self.count} {self.what}, got {describe(value)}")
        if len(value) != self.count:
            raise complaint(f"expected {self.count} {self.what}, got {len(value)}")
        return tuple(value)


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _nonzero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if math.hypot(*value) < 1e-12:
        raise complaint("a direction must not be zero")
    return value


def _not_tiny(value: float) -> float:
    if value < 1e-9:
        raise complaint(f"must be at least 1e-09, got {describe(value)}")
    return value


# YAML has lists, the models tuples, which nobody can change.
Listed = BeforeValidator(_as_tuple)

# A million kilometres: beyond it the squares of lengths leave single precision, and no display is so large.
FARTHEST = 1e9
LARGEST_WHOLE = 2**31 - 1

Number = Annotated[float, Field(allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)]
# Clocks may count from 1970, in milliseconds too.
Seconds = Annotated[float, Field(allow_inf_nan=False, ge=-1e13, le=1e13)]
Positive = Annotated[float, Field(allow_inf_nan=False, gt=0, le=1e12), AfterValidator(_not_tiny)]
NotNegative = Annotated[float, Field(allow_inf_nan=False, ge=0, le=FARTHEST)]
Unit = Annotated[float, Field(allow_inf_nan=False, ge=0, le=1)]
Count = Annotated[int, Field(ge=1, le=LARGEST_WHOLE)]
Natural = Annotated[int, Field(ge=0, le=LARGEST_WHOLE)]
FrameNumber = Annotated[int, Field(ge=-999_999_999, le=999_999_999)]
Pixels = Annotated[int, Field(ge=1, le=1_000_000)]
Vec2 = Annotated[tuple[Number, Number], Items(2)]
Vec3 = Annotated[tuple[Number, Number, Number], Items(3)]
Direction = Annotated[tuple[Number, Number, Number], Items(3), AfterValidator(_nonzero)]
Rgb = Annotated[tuple[NotNegative, NotNegative, NotNegative], Items(3)]
Size = Annotated[tuple[Pixels, Pixels], Items(2, "whole numbers, width and height")]


class PathText(str):
    """A path typed on the command line, which is relative to the working directory."""

    __slots__ = ()


def located(value: Any, info: ValidationInfo) -> Path:
    """Path of a file named in YAML, relative to the YAML file's folder."""
    if not isinstance(value, (str, Path)) or not str(value):
        raise complaint(f"expected a file name, got {describe(value)}")
    if fault := name_fault(value):
        raise complaint(fault)
    base = (info.context or {}).get("base")
    if base is None or isinstance(value, PathText):
        return Path(value)
    path = Path(base) / value
    if name_fault(path):
        raise complaint(name_fault(path))
    tidy = Path(os.path.normpath(path))
    # "a/../b" is not "b" where a is a symbolic link to another place.
    return tidy if not path.exists() or (tidy.exists() and tidy.samefile(path)) else path


@dataclass(frozen=True)
class ExistingFile:
    """Annotation of a path that must be a file with one of some suffixes."""

    suffixes: tuple[str, ...] = ()
    what: str = "a file"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> cs.CoreSchema:
        """A path, located and looked up."""
        return cs.with_info_before_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: cs.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Text, for editors."""
        return {"type": "string", "format": "path", "minLength": 1}

    def _check(self, value: Any, info: ValidationInfo) -> Path:
        path = located(value, info)
        if self.suffixes and path.suffix.lower() not in self.suffixes:
            got = f"the suffix {path.suffix!r}" if path.suffix else f"{path.name!r}, which has no suffix"
            hint = " (export it as GLB)" if foreign_fault(path) and set(MESHES) & set(self.suffixes) else ""
            raise complaint(f"expected {self.what} ({', '.join(self.suffixes)}), got {got}{hint}")
        if info.context is None:
            return path
        if path.is_dir():
            raise complaint(f"{path} is a directory (expected {self.what})")
        if not path.exists():
            raise complaint(f"no such file: {path}{nearest_file(path)}")
        if not path.is_file():
            raise complaint(f"{path} is no regular file (expected {self.what})")
        return path


def nearest_file(path: Path) -> str:
    """Hint at a file beside `path` with nearly the same name."""
    try:
        near = suggest(path.name, sorted(p.name for p in path.parent.iterdir() if p.is_file()))
    except OSError:
        return ""
    return f" (did you mean {near!r}?)" if near else ""


DISPLAY_MESHES = (".obj", ".ply", ".off", ".stl", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")
MESHES = (*DISPLAY_MESHES, ".abc")
YAMLS = (".yaml", ".yml")
MeshPath = Annotated[Path, ExistingFile(DISPLAY_MESHES, "a mesh")]
YamlPath = Annotated[Path, ExistingFile(YAMLS, "a YAML file")]
ScenePath = Annotated[Path, ExistingFile(YAMLS + MESHES, "a scene")]
AnyPath = Annotated[Path, BeforeValidator(located)]
