"""Sphinx settings of the documentation; `make docs` builds it."""

from __future__ import annotations

import importlib
import importlib.metadata
import re
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))

from docutils.nodes import document  # noqa: E402
from reproduction_tables import write_pages  # noqa: E402 - it lies beside this file
from sphinx.addnodes import pending_xref  # noqa: E402
from sphinx.util import logging  # noqa: E402

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
autodoc_default_options = {"members": True}
myst_enable_extensions = ["colon_fence"]
ROOMS = (
    "controllers",
    "design",
    "figures",
    "flight",
    "measures",
    "plants",
    "sampled",
    "solvers",
    "stability",
    "surveys",
)
PAGES = {
    "README.md": "index",
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    "LICENSE": "license",
    "experiments/README.md": "reproduction",
}
"""Files outside this folder, and where they are shown."""


def setup(app: Any) -> None:
    """Write the pages of reproduction, mend links, and read docstrings as they are written: |x| and k_p are text."""
    app.connect("builder-inited", _tables)
    app.connect("doctree-read", _mend_links)
    app.connect("env-check-consistency", _miss_names)
    app.connect("autodoc-process-docstring", _plain_text, priority=100)


def _tables(_app: Any) -> None:
    write_pages(HERE / "_generated")


def _miss_names(_app: Any, env: Any) -> None:
    """Warn of public names that the reference leaves out; constants stand in the sources."""
    shown = {name.rpartition(".")[2] for name in env.get_domain("py").objects}
    for room in ROOMS:
        public = importlib.import_module(f"fracctl.{room}").__all__
        if missing := [name for name in public if not name.isupper() and name not in shown]:
            logging.getLogger(__name__).warning("library.md leaves out %s of fracctl.%s", ", ".join(missing), room)


def _mend_links(_app: Any, doctree: document) -> None:
    """Lead links of the repository, as from README.md to a file, to the page that shows the file."""
    for node in doctree.findall(pending_xref):
        if node.get("reftype") == "myst" and (page := _page_of(node["reftarget"])):
            node.attributes |= {"refdomain": "doc", "reftarget": page, "reftargetid": None}


def _page_of(target: str) -> str | None:
    found = [path for path in (ROOT / target, ROOT / f"{target}.md") if path.is_file()]
    if not found:
        return None
    name = found[0].relative_to(ROOT).as_posix()
    if paper := re.fullmatch(r"experiments/(\w+)/README.md", name):
        return f"_generated/{paper[1]}"
    return PAGES.get(name, found[0].stem)


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
