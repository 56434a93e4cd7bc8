"""What YAML reads differently from how it is written: `on:` is a truth value, 0:2:0.05 a number in base 60."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import yaml

_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_TEXT = "tag:yaml.org,2002:str"


def traps(file: Path) -> list[str]:
    """Return a sentence for every key that is not text and every value in base 60."""
    root = yaml.compose(file.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    return [f"{file}, line {line}: {problem}" for line, problem in _in(root)] if root else []


def _in(node: yaml.Node) -> Iterator[tuple[int, str]]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.tag != _TEXT:
                yield _line(key), f"YAML does not read the key {_written(key)} as text; put it in quotes"
            yield from _in(value)
    elif isinstance(node, yaml.SequenceNode):
        for entry in node.value:
            yield from _in(entry)
    elif node.tag in _NUMBERS and ":" in node.value:
        yield _line(node), f'YAML reads {node.value} as a number in base 60; put it in quotes: "{node.value}"'


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1


def _written(node: yaml.Node) -> str:
    return f"'{node.value}'" if isinstance(node, yaml.ScalarNode) else "of a list or mapping"
