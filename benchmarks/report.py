"""Tables as text, and everything as files."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.verdicts import Verdict, number


def markdown(table: pd.DataFrame) -> str:
    """Return a table in Markdown, its columns padded so that it reads well as it is."""
    cells = [[str(column) for column in table.columns]]
    cells += [[_cell(value) for value in row] for row in table.itertuples(index=False)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(table.columns))]
    right = [kind.kind in "if" for kind in table.dtypes]
    forms = list(zip(widths, right, strict=True))
    rows = [[text.rjust(w) if r else text.ljust(w) for text, (w, r) in zip(row, forms, strict=True)] for row in cells]
    lines = [f"| {' | '.join(row)} |" for row in rows]
    rule = "|".join("-" * (w + 1) + (":" if r else "-") for w, r in forms)
    return "\n".join([lines[0], f"|{rule}|", *lines[1:]])


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float)):
        return number(float(value))
    return str(value).replace("|", r"\|")


def verdict_table(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Return the verdicts as the table that opens the summary."""
    rows = [(v.quantity, v.asked, number(v.measured), "yes" if v.met else "no") for v in verdicts]
    return pd.DataFrame(rows, columns=["quantity", "asked", "measured", "met"])


def summary(
    verdicts: Sequence[Verdict],
    tables: Mapping[str, pd.DataFrame],
    machine: Mapping[str, str],
    loads: Mapping[str, float],
    notes: Sequence[str],
) -> str:
    """Return the whole report in Markdown."""
    described = pd.DataFrame(machine.items(), columns=["machine", ""])
    busy = ", ".join(f"{when} {value:.2g}" for when, value in loads.items())
    parts = ["# Benchmarks", markdown(verdict_table(verdicts)), *notes]
    for title, table in tables.items():
        parts += [f"## {title}", markdown(table)]
    parts += ["## Where", markdown(described), f"Load (running processes): {busy}."]
    return "\n\n".join(parts) + "\n"


def write(
    folder: Path, verdicts: Sequence[Verdict], tables: Mapping[str, pd.DataFrame], text: str, facts: Mapping[str, Any]
) -> None:
    """Write summary.md, results.json and one CSV a table."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "summary.md").write_text(text, encoding="utf-8")
    for name, table in tables.items():
        table.to_csv(folder / f"{name}.csv", index=False)
    records = {name: json.loads(table.to_json(orient="records")) for name, table in tables.items()}
    content = {**facts, "verdicts": [dataclasses.asdict(v) for v in verdicts], "tables": records}
    (folder / "results.json").write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
