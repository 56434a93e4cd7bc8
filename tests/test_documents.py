"""The documentation: its commands can be given, its pages can be found, its tables are those of the results."""

from __future__ import annotations

import importlib.util
import json
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from fracctl.cli.main import main
from fracctl.reproduction.suites import read_suite

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
ELSEWHERE = ("extending.md",)
"""Pages whose commands need what the page builds; the tests of that run them."""
STUDY = "my_study"
"""The reader's own file, which `fracctl init` writes."""
COMPOSING = ("run", "show", "validate", "list", "export")


def shell_lines(text: str) -> list[str]:
    """Commands of ``sh`` blocks, and of ``console`` blocks behind their prompt, but for mistakes that are shown."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    prompts = re.findall(r"^```console\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return lines + [
        line for block in prompts for line in re.findall(r"^\$ (.*)\n(?!error: )", block, flags=re.MULTILINE)
    ]


def is_complete(command: str) -> bool:
    """Whether nothing has to be filled in: no DIR, no <run id>, no …, no name that is left out."""
    return not re.search(r"\b[A-Z]{3,}(_[A-Z]+)?\b|[<>…|]|=$|\boutputs/", command)


def commands() -> list[str]:
    found: list[str] = []
    for text in (page.read_text(encoding="utf-8") for page in PAGES if page.name not in ELSEWHERE):
        prose = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
        found += [line for line in shell_lines(text) if line.startswith("fracctl ")]
        found += re.findall(r"`(fracctl [^`\n]*)`", prose)
    plain = [" ".join(shlex.quote(word) for word in shlex.split(line, comments=True)) for line in found]
    wanted = re.compile(rf"fracctl ({'|'.join(COMPOSING)})\b")
    return [line for line in dict.fromkeys(plain) if wanted.match(line) and is_complete(line)]


@pytest.mark.parametrize("command", commands())
def test_commands_of_the_documentation_are_valid(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    if STUDY in command:
        assert main(["init", STUDY]) == 0
    words = [word for word in shlex.split(command)[1:] if word not in ("--json", "--fresh", "--quiet")]
    compose_only = ["--cfg", "job"] if words[0] == "run" else []
    assert main(words + compose_only) == 0, capsys.readouterr().err


TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
CONSOLE = re.findall(r"^```console\n\$ fracctl (.*?)\n(.*?)^```", TUTORIAL, flags=re.DOTALL | re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize(("command", "shown"), CONSOLE)
def test_the_tutorial_shows_what_comes_out(
    command: str, shown: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code = main(shlex.split(command))
    printed = capfd.readouterr()
    assert code == (3 if shown.startswith("error: ") else 0)
    assert (printed.out + printed.err).startswith(shown.partition("…")[0])


def test_commands_are_looked_for_where_they_stand() -> None:
    found = commands()
    assert "fracctl run experiment=ic1_bands" in found, "in a line of text"
    assert "fracctl show experiment=ic1_outofplane" in found, "in a block"
    assert not is_complete("fracctl export --to DIR")
    assert not is_complete("fracctl run experiment=")
    assert main(["run", "experiment=ic1_outofplain", "--cfg", "job"]) == 3


def test_every_page_is_in_the_table_of_contents() -> None:
    listed: set[str] = set()
    for page in PAGES:
        for block in re.findall(
            r"^```{toctree}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
        ):
            listed |= {line.strip() for line in block.splitlines() if line.strip() and not line.startswith(":")}
    assert {page.stem for page in PAGES} - listed == {"README", "index"}


def test_links_between_pages_lead_somewhere() -> None:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        links = [link for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", text) if "://" not in link]
        assert [link for link in links if not (page.parent / link).exists()] == [], page.name


def test_every_page_with_python_is_run() -> None:
    (listed,) = re.findall(
        r"parametrize\(\s*\"name\",\s*\[(.*?)\]",
        (ROOT / "tests/test_project.py").read_text(encoding="utf-8"),
        re.DOTALL,
    )
    shown = {f"docs/{page.name}" for page in PAGES[1:] if ">>> " in page.read_text(encoding="utf-8")}
    assert shown <= set(re.findall(r"\"(docs/[^\"]*)\"", listed))


@pytest.fixture
def tables() -> ModuleType:
    spec = importlib.util.spec_from_file_location("reproduction_tables", ROOT / "docs" / "reproduction_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


ROW = {
    "id": "a",
    "place": "Fig. 2",
    "quantity": "speed | of a law",
    "unit": "1",
    "published": "0.48",
    "tolerance": 0.01,
    "computed": 0.4790625,
    "exact": None,
    "difference": -0.001,
    "verdict": "not_reproduced",
    "expected": "not_decidable",
    "reason": "It hangs on a step that is not given.",
}


def test_pages_of_reproduction_hold_what_is_computed(tables: ModuleType, tmp_path: Path) -> None:
    section = {
        "paper": "fractional_hcw",
        "section": "out_of_plane",
        "counts": {"reproduced": 0, "not_reproduced": 1},
        "rows": [ROW],
    }
    (tmp_path / tables.ROWS).write_text(json.dumps(section) + "\n", encoding="utf-8")
    (page,) = tables.write_pages(tmp_path)
    text = page.read_text(encoding="utf-8")
    assert page.name == "fractional_hcw.md"
    assert text.startswith("# Fractional control in linearized relative-orbit dynamics\n")
    assert read_suite("fractional_hcw").sections["out_of_plane"].title in text
    assert "0 reproduced, 1 not reproduced" in text
    assert "| speed \\| of a law (Fig. 2) | 0.48 | 0.47906 | - | not reproduced (1) |\n" in text
    assert "\n1. It hangs on a step that is not given.\n" in text


def test_a_section_that_failed_stops_the_documentation(tables: ModuleType, tmp_path: Path) -> None:
    failed = {"paper": "fractional_hcw", "section": "in_plane", "error": "no space left on device"}
    (tmp_path / tables.ROWS).write_text(json.dumps(failed) + "\n", encoding="utf-8")
    with pytest.raises(ValueError, match="fractional_hcw/in_plane: no space left on device"):
        tables.write_pages(tmp_path)
