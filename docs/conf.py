"""Sphinx settings of the documentation; `make docs` builds it."""

from __future__ import annotations

import importlib.metadata
import re
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from reproduction_tables import write_pages  # noqa: E402 - it lies beside this file

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
    """Write the pages of reproduction; read docstrings as written: equations stand indented, |x| and k_p are plain."""
    app.connect("builder-inited", _tables)
    app.connect("autodoc-process-docstring", _plain_text, priority=100)


def _tables(_app: Any) -> None:
    write_pages(HERE / "_generated")


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
