"""Schemas read off constructors: the options of a plant, solver or measure are the arguments of its class."""

from __future__ import annotations

import dataclasses
import inspect
import types
import typing
from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Annotated, Any, TypeAlias

from numpy.typing import ArrayLike
from pydantic import AfterValidator, Field, create_model
from pydantic_core import InitErrorDetails, PydanticCustomError

from fracctl.config import registry
from fracctl.config.fields import Number, Path, Strict, Typed, Whole, refusal, refuse
from fracctl.errors import ArgumentError, ConfigurationError, FracctlError

Factory: TypeAlias = Callable[..., Any]


def factory_of(kind: str, value: Any) -> Factory:
    """Return what the `type` of a mapping stands for.

    Raises:
        ValidationError: the value is no mapping, or its type is missing or unknown.
    """
    if not isinstance(value, Mapping):
        raise refuse(refusal((), value, "must be a mapping of options"))
    name = value.get("type")
    if not isinstance(name, str):
        known = ", ".join(registry.names(kind))
        raise refuse(refusal(("type",), name, f"must be one of {known}"))
    return named_factory(kind, name, ("type",))


def named_factory(kind: str, name: str, path: Path = ()) -> Factory:
    """Return what a name stands for; the ValidationError that it stands for nothing lies at `path`."""
    try:
        factory: Factory = registry.load(kind, name)
    except ConfigurationError as error:
        raise refuse(refusal(path, name, str(error))) from error
    return factory


@cache
def options_of(factory: Factory) -> type[Strict]:
    """Return the schema of a factory's arguments.

    Annotations are those of pydantic; a dataclass is a mapping of its fields, ArrayLike a number or nested lists.
    """
    return create_model(_name(factory), __base__=Strict, **_fields(factory, ()))


@cache
def typed_options_of(factory: Factory, omitted: tuple[str, ...] = ()) -> type[Typed]:
    """Return the schema of `type` and a factory's arguments without those omitted."""
    return create_model(_name(factory), __base__=Typed, **_fields(factory, omitted))


def _name(factory: Factory) -> str:
    return f"{getattr(factory, '__name__', 'Factory')}Options"


def _fields(factory: Factory, omitted: tuple[str, ...]) -> dict[str, Any]:
    hints = _hints(factory)
    fields: dict[str, Any] = {}
    for name, parameter in inspect.signature(factory).parameters.items():
        if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD) and name not in omitted:
            default = ... if parameter.default is parameter.empty else parameter.default
            fields[name] = (_schema(hints.get(name, Any)), default)
    return fields


def construct(factory: Factory, options: Strict, **further: Any) -> Any:
    """Call the factory with validated options.

    Raises:
        ValidationError: the factory refuses an argument; the line names the option.
    """
    arguments = {name: value for name, value in options if name != "type"}
    hints = _hints(factory)
    for name, value in arguments.items():
        nested = _dataclass_in(hints.get(name))
        if nested is not None and isinstance(value, Strict):
            arguments[name] = _call(nested, dict(value), (name,))
    return _call(partial(factory, **further), arguments, ())


def _call(factory: Factory, arguments: dict[str, Any], path: Path) -> Any:
    try:
        return factory(**arguments)
    except ArgumentError as error:
        raise refuse(_refused(error, arguments, path)) from error
    except (FracctlError, ValueError, TypeError) as error:
        raise refuse(refusal(path, arguments, str(error), "sentence")) from error


def _refused(error: ArgumentError, arguments: Mapping[str, Any], path: Path) -> InitErrorDetails:
    keys = error.name.split(".")
    value: Any = arguments
    for key in keys:
        entries = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
        if key not in entries:
            return refusal(path, arguments, str(error), "sentence")
        value = entries[key]
    shape = f", but is {error.value}" if str(error.value).startswith("of shape") else ""
    cure = f"; {error.instead}" if error.instead else ""
    return refusal((*path, *keys), value, f"{error.allowed}{shape}{cure}")


def _hints(factory: Factory) -> dict[str, Any]:
    return typing.get_type_hints(factory.__init__ if isinstance(factory, type) else factory)  # type: ignore[misc]


def _numbers(value: Any) -> Any:
    """Accept a number or nested lists of numbers."""
    for entry in value if isinstance(value, list | tuple) else ():
        _numbers(entry)
    if not isinstance(value, int | float | list | tuple) or isinstance(value, bool):
        raise PydanticCustomError("refused", "must be a number, or a matrix as a list of rows")
    return value


def _schema(hint: Any) -> Any:
    """What a value of this annotation may look like in a configuration."""
    if hint == ArrayLike:
        return Annotated[Any, AfterValidator(_numbers)]
    if hint == ArrayLike | None:
        return Annotated[Any, AfterValidator(_numbers)] | None
    if hint in (float, int, bool):
        return {float: Number, int: Whole, bool: Annotated[bool, Field(strict=True)]}[hint]
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return options_of(hint)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return typing.Union[tuple(_schema(part) for part in typing.get_args(hint))]  # noqa: UP007 - made at run time
    if typing.get_origin(hint) in (list, dict):
        return typing.get_origin(hint)[tuple(_schema(part) for part in typing.get_args(hint))]
    return hint


def _dataclass_in(hint: Any) -> type | None:
    parts = (hint, *typing.get_args(hint))
    return next((part for part in parts if isinstance(part, type) and dataclasses.is_dataclass(part)), None)
