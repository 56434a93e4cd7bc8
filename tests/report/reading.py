"""A report as its reader meets it: parsed strictly, with its text, tables and references."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"meta", "link", "br", "img", "input", "hr"}


@dataclass
class Page(HTMLParser):
    """What a page holds; every element must be closed where it belongs."""

    source: str
    ids: list[str] = field(default_factory=list)
    references: list[str] = field(default_factory=list)
    headings: list[str] = field(default_factory=list)
    tables: list[dict[str, list[list[str]] | str]] = field(default_factory=list)
    texts: dict[str, list[str]] = field(default_factory=dict)
    """By class, or by name of the element without one."""
    sections: dict[str, list[str]] = field(default_factory=dict)
    """By the id of the heading."""
    pictures: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()
        self._open: list[tuple[str, dict[str, str]]] = []
        self._rows: list[list[str]] = []
        self.feed(self.source)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        if "id" in given:
            self.ids.append(given["id"])
        self.references += [given[name] for name in ("href", "src", "xlink:href", "action", "data") if name in given]
        self.references += [value for value in given.values() if "url(" in value]
        if given.get("role") == "img":
            self.pictures.append(given["aria-label"])
        if tag == "table":
            self._rows = []
            self.tables.append({"caption": "", "rows": self._rows})
        if tag == "tr":
            self._rows.append([])
        if tag in ("td", "th"):
            self._rows[-1].append("")
        if tag in ("h1", "h2", "h3"):
            self.headings.append(tag)
        if tag not in VOID:
            self._open.append((tag, given))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self._open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self._open[-1][0] == tag, f"</{tag}> closes <{self._open[-1][0]}>"
        self._open.pop()

    def handle_data(self, data: str) -> None:
        if not data.strip():
            return
        tags = [tag for tag, _ in self._open]
        if "td" in tags or "th" in tags:
            self._rows[-1][-1] += data.strip()
        if "caption" in tags:
            self.tables[-1]["caption"] = data.strip()
        for tag, given in self._open[-2:]:
            self.texts.setdefault(given.get("class", tag), []).append(data.strip())
        for tag, given in self._open:
            if tag == "section":
                self.sections.setdefault(given["aria-labelledby"], []).append(data.strip())

    @property
    def result(self) -> str:
        return " ".join(self.texts.get("result", []))

    @property
    def alerts(self) -> str:
        return " ".join(self.sections.get("alerts", []))

    @property
    def commands(self) -> list[list[str]]:
        """Words of every command."""
        return [shlex.split(text) for text in self.texts.get("command", [])]

    def table(self, caption: str) -> list[list[str]]:
        """Rows, the head first, of the table whose caption begins so."""
        found = [table["rows"] for table in self.tables if str(table["caption"]).startswith(caption)]
        assert len(found) == 1, [table["caption"] for table in self.tables]
        rows = found[0]
        assert isinstance(rows, list)
        return rows
