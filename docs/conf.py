"""Sphinx settings of the documentation; `make docs` builds it."""

from __future__ import annotations

import importlib.metadata
import re
from itertools import pairwise
from typing import Any

project = "fracctl"
author = "The fracctl authors"
copyright = author  # noqa: A001 - the name Sphinx asks for
version = release = importlib.metadata.version("fracctl")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"fracctl {release}"

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_default_options = {"members": True, "undoc-members": False, "show-inheritance": False}
myst_enable_extensions = ["colon_fence"]
suppress_warnings = ["myst.xref_missing"]


def setup(app: Any) -> None:
    """Read docstrings as they are written: equations stand indented, |x| and k_p are plain text."""
    app.connect("autodoc-process-docstring", _plain_text, priority=100)


def _plain_text(*event: Any) -> None:
    lines: list[str] = event[-1]
    read: list[str] = []
    equation = False
    for before, line in pairwise(["", *lines]):
        indented = line.startswith("    ")
        if indented and not before and not equation:
            read += ["::", ""]
        equation = (equation or not before) if indented else equation and not line
        read.append(line if equation else _escape(line))
    lines[:] = read


def _escape(line: str) -> str:
    spans = re.split(r"(`+[^`]*`+)", line)
    spans[::2] = [re.sub(r"\||_(?=\W|$)", r"\\\g<0>", text) for text in spans[::2]]
    return "".join(spans)
