"""The ground of all schemas: no unknown keys, numbers that are numbers, errors that know the keys around them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

Path = tuple[str | int, ...]
"""Keys that lead to a value."""
Made = TypeVar("Made")

_FILE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")


def refusal(path: Path, value: Any, allowed: str, kind: str = "refused", **context: Any) -> InitErrorDetails:
    """One line of a ValidationError: what lies at `path`, and what is allowed there."""
    custom = PydanticCustomError(kind, allowed, context or None)
    return InitErrorDetails(type=custom, loc=path, input=value)


def unknown(path: Path, value: Any, known: Iterable[str]) -> InitErrorDetails:
    """One line of a ValidationError about a key that is not among those known."""
    return refusal(path, value, "unknown key", "unknown_key", known=list(known))


def refuse(*lines: InitErrorDetails) -> ValidationError:
    """A ValidationError of these lines; inside a validator they join those of the model around it."""
    return ValidationError.from_exception_data("configuration", list(lines))


def lines_of(error: ValidationError, path: Path = (), known: Iterable[str] = ()) -> list[InitErrorDetails]:
    """The lines of a ValidationError, moved below `path`; `known` are the keys of the model that raised it."""
    found = []
    for line in error.errors(include_url=False):
        where = (*path, *line["loc"])
        if line["type"] == "extra_forbidden":
            found.append(unknown(where, line["input"], known))
        else:
            found.append(refusal(where, line["input"], line["msg"], line["type"], **line.get("ctx", {})))
    return found


def each(entries: Mapping[str, Any], make: Callable[[str, Any], Made]) -> dict[str, Made]:
    """Make something of every entry; the errors of all of them are raised together."""
    made, lines = {}, []
    for name, entry in entries.items():
        try:
            made[name] = make(name, entry)
        except ValidationError as error:
            lines += lines_of(error, (name,))
    if lines:
        raise refuse(*lines)
    return made


class Strict(BaseModel):
    """A frozen model without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, protected_namespaces=())

    @model_validator(mode="wrap")
    @classmethod
    def _name_neighbours(cls, data: Any, handler: ModelWrapValidatorHandler[Strict]) -> Strict:
        """Attach the keys that are allowed to the errors about keys that are not."""
        try:
            return handler(data)
        except ValidationError as error:
            raise refuse(*lines_of(error, known=cls.model_fields)) from error


class Typed(Strict):
    """Options of what a name stands for."""

    type: str
    """The name, known to the registry."""


def _file_name(value: Any) -> Any:
    text = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
    if not isinstance(text, str) or not _FILE_NAME.fullmatch(text):
        raise refuse(refusal((), value, "must be a name of letters, digits, '_', '-' and '.'"))
    return text


def _folder(value: Any) -> Any:
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise refuse(refusal((), value, "must be the path of a directory"))
    return value


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number; neither text nor a truth value."""
Whole = Annotated[int, Field(strict=True)]
"""A whole number."""
Name = Annotated[str, BeforeValidator(_file_name)]
"""A name that is also one of a file or folder."""
Folder = Annotated[str, BeforeValidator(_folder)]
"""The path of a directory, which need not exist."""
