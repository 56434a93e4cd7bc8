"""`fracctl reproduce`: what it takes, what it prints, its exit codes."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml

from fracctl.cli.main import main
from fracctl.config.compose import compose
from fracctl.errors import RunError
from fracctl.reproduction.suites import suites_directory
from tests.report.reading import Page
from tests.report.test_report import check_form
from tests.reproduction.test_section import SMALL_GRID

NAME = "fractional_hcw/out_of_plane"


@pytest.fixture(scope="module")
def output_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("outputs")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch, output_dir: Path) -> Path:
    """Runs have a small grid and a directory of their own."""

    def compose_small(words: list[str]) -> Any:
        return compose([*words, *SMALL_GRID, f"output_dir={output_dir}"])

    monkeypatch.setattr("fracctl.reproduction.section.compose", compose_small)
    return output_dir


@pytest.fixture(autouse=True)
def own_suites(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A copy of one section that a test may change; returns its published.csv."""
    source, folder = suites_directory() / "fractional_hcw", tmp_path / "experiments" / "fractional_hcw"
    folder.mkdir(parents=True)
    suite = yaml.safe_load((source / "suite.yaml").read_text(encoding="utf-8"))
    suite["sections"] = {"out_of_plane": suite["sections"]["out_of_plane"]}
    (folder / "suite.yaml").write_text(yaml.safe_dump(suite), encoding="utf-8")
    header, *rows = (source / "published.csv").read_text(encoding="utf-8").splitlines()
    kept = [row for row in rows if row.partition(",")[0] in suite["sections"]["out_of_plane"]["rows"]]
    (folder / "published.csv").write_text("\n".join([header, *kept]) + "\n", encoding="utf-8")
    monkeypatch.setattr("fracctl.reproduction.suites.suites_directory", lambda: tmp_path / "experiments")
    return folder / "published.csv"


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.parametrize("words", [[NAME], [], ["fractional_hcw/"], [NAME, "fractional_hcw"]])
def test_the_table_and_the_directory(words: list[str], small: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", *words]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    lines = captured.out.splitlines()
    assert lines[0] == f"{NAME}: Out-of-plane motion, Figures 2 to 5"
    assert lines[1].split() == ["id", "published", "unit", "computed", "exact", "difference", "verdict", "reason"]
    assert lines[2].split() == ["ic1_st_pd_settling_time", "0.63", "T_orb", "0.630", "0.632", "+0.000", "reproduced"]
    assert lines[-2].startswith("51 rows: 50 reproduced, 1 not reproduced")
    assert lines[-1] == str(small / "reproduce" / NAME)
    assert len(lines) == 55, "each section once"
    assert {path.name for path in Path(lines[-1]).iterdir()} == {"table.csv", "table.parquet", "table.md"}


@pytest.mark.usefixtures("small")
def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", NAME, "--json", "--quiet"]) == 0
    captured = capsys.readouterr()
    (line,) = captured.out.splitlines()
    content = json.loads(line)
    assert list(content) == ["paper", "section", "directory", "runs", "counts", "failed", "error", "rows"]
    assert (content["paper"], content["section"]) == ("fractional_hcw", "out_of_plane")
    assert content["counts"] == {"reproduced": 50, "not_reproduced": 1, "not_decidable": 0}
    assert (content["failed"], content["error"]) == ([], None)
    assert Path(content["runs"]["exact"]["outofplane"]).is_dir()
    assert len(content["rows"]) == 51
    assert content["rows"][0]["published"] == "0.63"


@pytest.mark.usefixtures("small")
def test_a_row_that_must_hold_and_does_not(own_suites: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(own_suites, "1e-3,2.726,0.001", "1e-3,2.746,0.001")
    assert main(["reproduce", NAME]) == 1
    captured = capsys.readouterr()
    (line,) = captured.err.splitlines()
    assert line == (
        f"error: {NAME}: not reproduced: ic1_psi_pd_control_effort: IC1: control effort of the best PD law (table IC1) "
        "is published as 2.746 1e-3, computed 2.7264, exact 2.7264"
    )
    assert "1 that must hold does not" in captured.out
    assert main(["reproduce", NAME, "--json"]) == 1
    content = json.loads(capsys.readouterr().out)
    assert content["failed"] == ["ic1_psi_pd_control_effort"]
    assert "2.746" in content["error"]


@pytest.mark.usefixtures("small")
def test_a_wrong_expectation(own_suites: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(own_suites, "%,2.4,0.1,not_reproduced", "%,2.4,0.1,reproduced")
    assert main(["reproduce", NAME]) == 1
    assert "ic2_psi_overshoot_reduction" in capsys.readouterr().err
    change(own_suites, "%,2.4,0.1,reproduced", "%,2.4,0.1,not_decidable")
    assert main(["reproduce", NAME]) == 0
    assert "49" not in (out := capsys.readouterr().out).splitlines()[-2]
    assert "0 not reproduced, 1 not decidable" in out


@pytest.mark.usefixtures("small")
def test_an_unexpected_success_is_noted(own_suites: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(own_suites, "%,2.4,0.1,", "%,2.3,0.1,")
    assert main(["reproduce", NAME]) == 0
    note = "note: ic2_psi_overshoot_reduction comes out, although published.csv expects not_reproduced"
    assert note in capsys.readouterr().out.splitlines()
    assert main(["reproduce", NAME, "--quiet"]) == 0
    assert "note:" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fractional_hwc"], "there is no paper 'fractional_hwc'; did you mean 'fractional_hcw'?"),
        (["nonsense"], "there is no paper 'nonsense'; papers: fractional_hcw"),
        (["out_of_plane"], f"there is no paper 'out_of_plane'; did you mean '{NAME}'?"),
        (["fractional_hcw/out_of_plan"], f"'fractional_hcw' has no section 'out_of_plan'; did you mean '{NAME}'?"),
        (["fractional_hcw/xyz"], f"'fractional_hcw' has no section 'xyz'; sections: {NAME}"),
        (["fractional_hwc/out_of_plane"], f"there is no paper 'fractional_hwc'; did you mean '{NAME}'?"),
        ([NAME, "nonsense"], "there is no paper 'nonsense'; papers: fractional_hcw"),
        (["--jsn"], "unknown option '--jsn'; did you mean '--json'?"),
    ],
)
def test_misspelt(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"error: {said}\n"


def test_a_broken_suite(own_suites: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(own_suites, "%,2.4,0.1,", "%%,2.4,0.1,")
    assert main(["reproduce"]) == 3
    assert "there is no unit '%%'" in capsys.readouterr().err
    shutil.rmtree(own_suites.parent)
    assert main(["reproduce"]) == 3
    assert "there is no suite in" in capsys.readouterr().err


def test_a_run_that_fails(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def fail(config: Any, **options: Any) -> None:
        raise RunError("the disk is full")

    monkeypatch.setattr("fracctl.reproduction.section.execute", fail)
    assert main(["reproduce", "--json"]) == 1
    captured = capsys.readouterr()
    assert captured.err == f"error: {NAME}: the disk is full\n"
    expected = {"paper": "fractional_hcw", "section": "out_of_plane", "error": "the disk is full"}
    assert json.loads(captured.out) == expected


@pytest.mark.usefixtures("small")
def test_a_terminal_gets_the_reasons_below_the_table(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "110")
    assert main(["reproduce", NAME]) == 0
    text = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)
    lines = [line.rstrip() for line in text.splitlines()]
    assert max(map(len, lines[:-1])) <= 110
    (first,) = [line for line in lines if line.lstrip().startswith("ic2_psi_overshoot_reduction: ")]
    assert "It follows from the printed overshoots" in first
    assert lines[-1].endswith(f"reproduce/{NAME}")


def test_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "--help"]) == 0
    assert "fracctl reproduce fractional_hcw" in capsys.readouterr().out
    assert main(["--help"]) == 0
    assert "reproduce" in capsys.readouterr().out


def test_a_report_of_a_paper_has_verdicts_reasons_and_figures(
    monkeypatch: pytest.MonkeyPatch, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn = [word for word in SMALL_GRID if not word.startswith("figures")]
    monkeypatch.setattr(
        "fracctl.reproduction.section.compose", lambda words: compose([*words, *drawn, f"output_dir={small}"])
    )
    assert main(["reproduce", "--report", NAME]) == 0
    path = Path(capsys.readouterr().out.splitlines()[-1])
    assert path == small / "reproduce" / "fractional_hcw" / "report.html"
    page = Page(path.read_text(encoding="utf-8"))
    check_form(page)
    (table,) = page.tables
    head, *rows = page.table(str(table["caption"]))
    assert head == ["quantity", "place", "published", "unit", "computed", "exact", "difference", "verdict", "reason"]
    counts = Counter(row[head.index("verdict")] for row in rows)
    words = ("reproduced", "not reproduced", "not decidable")
    counted = ", ".join(f"{counts[word]} {word}" for word in words)
    assert page.result == f"{len(rows)} numbers and claims: {counted}."
    assert all(row[-1] for row in rows if row[head.index("verdict")] != "reproduced"), "every other has its reason"
    assert [label.partition(":")[0] for label in page.pictures] == ["figure_2", "figure_3", "figure_4", "figure_5"]
    assert page.commands == [["fracctl", "reproduce", "--report", NAME]]


def test_a_report_tells_first_what_does_not_come_out(
    own_suites: Path, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(own_suites, "T_orb,0.63,0.01,reproduced", "T_orb,0.93,0.01,reproduced")
    assert main(["reproduce", "--report", "--json", NAME]) == 1
    line = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert line["paper"] == "fractional_hcw"
    page = Page(Path(line["report"]).read_text(encoding="utf-8"))
    assert "IC1: settling time of the fastest PD law does not come out as it must" in page.alerts
