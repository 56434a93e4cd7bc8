"""SVG files as elements of a page: small, and with names that no other picture of the page has."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree

_SVG = "http://www.w3.org/2000/svg"
_LINK = "{http://www.w3.org/1999/xlink}href"
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_LONG = re.compile(r"-?\d+\.\d{3,}")
_PLACES = ("d", "x", "y", "width", "height")
"""Attributes whose numbers are places in points; a hundredth is finer than any screen."""
_LEAST, _MOST = 1.1, 1.65
"""Pixels that a point of a picture may take: what is wider than the page scrolls within itself."""
_STYLE = {"stroke-linejoin": "round", "stroke-linecap": "butt"}
"""What the style sheet of the file says of all its elements; in a page it would speak of all of the page."""


def inline(svg: bytes, prefix: str) -> str:
    """Return a Matplotlib SVG file as an element for a page.

    Args:
        svg: the file.
        prefix: of every name in it; no other picture of the page may have it.
    """
    ElementTree.register_namespace("", _SVG)
    root = ElementTree.fromstring(svg)
    for parent in list(root.iter()):
        for child in [child for child in parent if child.tag in (f"{{{_SVG}}}metadata", f"{{{_SVG}}}style")]:
            parent.remove(child)
    used = {name for element in root.iter() for name in _references(element)}
    for element in root.iter():
        _tidy(element, used, prefix)
    root.attrib.pop("version", None)
    width = float(root.attrib.pop("width").removesuffix("pt"))
    del root.attrib["height"]
    size = {"style": f"min-width:{_LEAST * width:.0f}px;max-width:{_MOST * width:.0f}px"}
    root.attrib |= _STYLE | size | {"aria-hidden": "true", "focusable": "false"}
    return ElementTree.tostring(root, encoding="unicode")


def _references(element: ElementTree.Element) -> Iterator[str]:
    for key, value in element.attrib.items():
        if key == _LINK and value.startswith("#"):
            yield value[1:]
        yield from _REFERENCE.findall(value)


def _tidy(element: ElementTree.Element, used: set[str], prefix: str) -> None:
    """Keep the names that are used, under the prefix, and round places."""
    name = element.attrib.pop("id", None)
    if name in used:
        element.set("id", f"{prefix}-{name}")
    link = element.attrib.pop(_LINK, None)
    if link is not None:
        element.set("href", f"#{prefix}-{link[1:]}" if link.startswith("#") else link)
    for key, value in element.attrib.items():
        placed = _LONG.sub(_short, value) if key in _PLACES else value
        spaced = " ".join(placed.split()) if key == "d" else placed
        element.set(key, _REFERENCE.sub(rf"url(#{prefix}-\1)", spaced))
    element.text = (element.text or "").strip() or None
    element.tail = None


def _short(found: re.Match[str]) -> str:
    return f"{float(found[0]):.2f}".rstrip("0").rstrip(".")
