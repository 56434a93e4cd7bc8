"""Reports of stored runs: what they say of each kind of run, and that they hold all they need."""

from __future__ import annotations

import json
import math
import re
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fracctl.cli.main import main
from fracctl.config.command import Command
from fracctl.config.compose import compose
from fracctl.execution.run import RunResult, execute
from fracctl.report import contents
from fracctl.report.page import comparison_page, run_page
from fracctl.report.stored import StoredRun
from fracctl.report.tables import MOST_ROWS
from fracctl.store import RunDirectory, tables
from fracctl.store.identity import run_id
from tests.comparison.test_comparison import FEW
from tests.configs.test_files import TINY, TINY_FLIGHT, TINY_SEARCH, TINY_SETTINGS
from tests.report.reading import Page

GRID = [
    "survey.axes.alpha_w=[0.91,1.0]",
    "survey.axes.k_p_w=[0.55,0.85]",
    "survey.axes.k_d_w=0:2:0.05",
    "scheduler=serial",
]
MEMORY = ["horizon_periods=0.5", "solver.step=0.02", "scheduler=serial"]
LIBRATION = ["horizon_periods=3", "solver.steps=40", "measures.lyapunov_exponent.periods=2"]
KINDS: dict[str, tuple[list[str], str]] = {
    "single": (
        ["controller.alpha_w=0.91", "controller.k_p_w=0.85"],
        r"From ic1 settling_time is 0\.4795 orbits \(1\.326 h\)",
    ),
    "grid": (
        ["experiment=ic1_outofplane", *GRID],
        r"least, 0\.4795 orbits \(1\.326 h\), at alpha_w = 0\.91, .*: 24\.1 % less than .* 0\.6318 orbits \(1\.747 h\)",
    ),
    "pareto": (
        ["experiment=ic1_inplane_pareto", *TINY_SEARCH],
        r"settling_time is least, .* overshoot is least, .* control_effort is least, ",
    ),
    "delayed": (
        ["experiment=libration", *LIBRATION, "measures.lyapunov_exponent.transient_periods=0"],
        r"From tumbling periodicity is least, .* at gain_factor = 1: .* % less than .*, the free motion\.",
    ),
    "laws": (
        ["experiment=tether", *MEMORY],
        r"From release the length settles to 2 % under .*FDA-SMC after 0\.\d+ orbits.*; under DA-SMC ",
    ),
    "quantiles": (
        ["experiment=tether_monte_carlo", "evaluation.samples=3", *MEMORY],
        r"From release under FDA-SMC, 3 dispersed runs: \w+ has the median .* in 95 % of them\. From .* DA-SMC",
    ),
    "accuracy": (
        ["experiment=solver_accuracy", *TINY, *TINY_SETTINGS["solver_accuracy"]],
        r"Largest error of positions and controls over their peaks, .*contour with tolerance 1e-08: \d",
    ),
}
SLOW_KINDS = {
    "flight": (
        ["experiment=flight_ic1", *TINY_FLIGHT, "scheduler=serial"],
        r"From ic1 to 100 m, flown dispersed: .*From ic1_hundredth to 1 m, flown dispersed: ",
    ),
    "comparison": (
        ["experiment=fair_outofplane", *FEW, "scheduler=serial"],
        r"Against pd, over all starts and limits and the bands of 100 m, 10 m: pd_alpha is .*lqr is ",
    ),
}


def computed(words: list[str]) -> RunResult:
    return execute(compose(words), command=Command.of(words))


def page_of(directory: Path) -> Page:
    return Page(run_page(StoredRun.read(directory)))


def check_form(page: Page) -> None:
    """One file that needs no other, whose names are unique, and whose parts can be told without seeing them."""
    assert [name for name, times in Counter(page.ids).items() if times > 1] == []
    inside = [re.sub(r".*url\(([^)]*)\).*", r"\1", reference) for reference in page.references]
    assert [reference for reference in inside if not reference.startswith(("#", "data:"))] == []
    assert {reference[1:] for reference in inside if reference.startswith("#")} <= {*page.ids}
    assert page.headings[0] == "h1"
    assert page.headings.count("h1") == 1
    assert all(table["caption"] for table in page.tables)
    assert all(label.strip(" :") for label in page.pictures)
    assert "@import" not in page.source
    assert "<script src" not in page.source


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("outputs")


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    folder = tmp_path_factory.mktemp("grid")
    return computed([*KINDS["grid"][0], "figures=gain_contours", f"output_dir={folder}"])


@pytest.fixture
def stored(grid: RunResult, tmp_path: Path) -> Path:
    """A copy of the grid's run that a test may change."""
    copy = tmp_path / grid.run_directory.name
    shutil.copytree(grid.run_directory, copy)
    return copy


def change(directory: Path, **content: Any) -> None:
    path = directory / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | content), encoding="utf-8")


@pytest.mark.parametrize("kind", [*KINDS, *(pytest.param(kind, marks=pytest.mark.slow) for kind in SLOW_KINDS)])
def test_a_report_of_each_kind_of_run(kind: str, folder: Path) -> None:
    words, sentence = (KINDS | SLOW_KINDS)[kind]
    config = compose(words)
    result = computed([*words, f"output_dir={folder}"])
    page = page_of(result.run_directory)
    check_form(page)
    assert re.search(sentence, page.result), page.result
    (command,) = page.commands
    assert command[:2] == ["fracctl", "run"]
    assert run_id(compose(command[2:]).model_dump(mode="json")) == result.run_directory.name
    assert len(page.pictures) == page.source.count("<svg") == len(config.figures)
    assert any(str(table["caption"]).startswith("Evaluated points") for table in page.tables)
    assert all(note in page.sections["notes"] + page.sections.get("alerts", []) for note in result.summary["notes"])
    assert {config.plant.type, config.solver.type} <= {re.split(r"[:,]", text)[0] for text in page.sections["what"]}
    assert f"name: {config.name}" in " ".join(page.sections["configuration"])
    assert result.run_directory.name in page.sections["provenance"]


def test_the_numbers_are_those_of_the_tables(grid: RunResult) -> None:
    page = page_of(grid.run_directory)
    rows = {row[0]: row[1:] for row in page.table("Optima of settling_time")}
    optima = grid.optima
    for place, kind in enumerate(("overall", "baseline"), start=1):
        chosen = optima[(optima["kind"] == kind) & (optima["objective_name"] == "settling_time")].iloc[0]
        for name in ("alpha_w", "k_d_w", "settling_time", "overshoot", "control_effort"):
            assert float(rows[name][place]) == pytest.approx(chosen[name], rel=1e-5)
        assert rows["settling time"][place].startswith(f"{chosen['settling_time'] / math.tau:.4g} orbits (")


def test_a_long_table_is_cut_to_the_best_and_says_where_all_is(grid: RunResult) -> None:
    page, rows = page_of(grid.run_directory), grid.evaluations
    assert len(rows) > MOST_ROWS
    head, *shown = page.table("Evaluated points")
    assert len(shown) == MOST_ROWS
    best = rows[rows["status"] == "ok"]["settling_time"].nsmallest(MOST_ROWS)
    assert [float(row[head.index("settling_time")]) for row in shown] == pytest.approx(best.tolist(), rel=1e-5)
    remark = f"These are the best {MOST_ROWS} of {len(rows)} rows by settling_time; all are in evaluations.parquet."
    assert remark in page.texts["remark"]


def test_of_a_long_table_only_what_is_shown_is_held(stored: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Row groups of ten, points that failed or are unstable first among them; the best come from all of them."""
    path = stored / "evaluations.parquet"
    table = pq.read_table(path)
    n = table.num_rows
    columns = {name: table.column(name).to_pylist() for name in ("status", "stable")}
    columns["status"][::2] = ["failed"] * len(range(0, n, 2))
    columns["stable"][3::11] = [False] * len(range(3, n, 11))
    for name, values in columns.items():
        place = table.column_names.index(name)
        table = table.set_column(place, table.schema.field(name), pa.array(values, table.schema.field(name).type))
    pq.write_table(table, path, row_group_size=10, write_page_checksum=True)
    held = []
    whole = tables.to_pandas
    monkeypatch.setattr(tables, "to_pandas", lambda rows: (held.append(rows.num_rows), whole(rows))[1])
    (shown,) = contents._evaluated(StoredRun.read(stored))
    assert max(held) <= MOST_ROWS + 10 < n
    rows = whole(table)
    good = rows["status"].eq("ok") & rows["stable"].ne(False).fillna(True)
    assert 0 < good.sum() < MOST_ROWS
    first = rows[good].sort_values("settling_time", kind="stable")
    others = rows[~good].sort_values("settling_time", kind="stable")
    expected = pd.concat([first, others]).head(MOST_ROWS)
    names = [column.name for column in shown.columns]
    for name in ("k_d_w", "k_p_w", "alpha_w", "settling_time"):
        keys = [row[names.index(name)].key for row in shown.rows]
        np.testing.assert_array_equal(np.array(keys, float), expected[name].to_numpy(float))
    counted = rows["status"].value_counts()
    assert shown.caption.startswith(f"Evaluated points: {n} rows, ")
    assert all(f"{number} {word}" in shown.caption for word, number in counted.items())
    assert f"the best {MOST_ROWS} of {n} rows by settling_time" in shown.remark


def test_columns_have_their_units(folder: Path) -> None:
    result = execute(compose(["experiment=ic1_bands", f"output_dir={folder}", "figures=null"]))
    page = page_of(result.run_directory)
    units = {row[0]: row[1] for row in page.table("Optima of settling_time")}
    assert units["overshoot_m"] == "m"
    assert units["delta_v_m_s"] == "m/s"
    assert units["settling_time_100_m_min"] == "min"
    assert units["settling_time_100_m"] == units["k_p_w"] == ""
    assert page.pictures == []


def test_published_numbers_stand_beside_those_of_the_run(folder: Path) -> None:
    result = execute(compose(["experiment=outofplane", *GRID, "figures=null", f"output_dir={folder}"]))
    page = page_of(result.run_directory)
    check_form(page)
    head, *rows = page.table("D. Yaylali, E. Butcher, A. Sinclair")
    found = {row[0]: dict(zip(head, row, strict=True)) for row in rows}
    fastest = found["IC1: settling time of the fastest PD law"]
    assert (fastest["published"], fastest["unit"], fastest["computed"]) == ("0.63", "T_orb", "0.632")
    assert fastest["verdict"] == "reproduced"
    assert {row["verdict"] for row in found.values()} > {"reproduced"}, "this grid is too coarse for all"
    assert any("fracctl reproduce fractional_hcw/out_of_plane" in remark for remark in page.texts["remark"])


def test_a_report_is_the_same_on_repeat(grid: RunResult) -> None:
    run = StoredRun.read(grid.run_directory)
    assert run_page(run) == run_page(StoredRun.read(grid.run_directory))
    assert len(run_page(run)) < 600_000


def test_the_report_is_no_part_of_the_run(stored: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(stored)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(stored / "report.html")
    Page((stored / "report.html").read_text(encoding="utf-8"))
    assert main(["validate", str(stored)]) == 0
    directory = RunDirectory(stored)
    directory.write_manifest()
    assert "report.html" not in (stored / "manifest.sha256").read_text(encoding="utf-8")
    assert not (stored / "report.html").exists(), "what the run was before"


def test_an_unfinished_run_says_so_first(stored: Path) -> None:
    for path in stored.iterdir():
        if path.is_file() and path.name != "run.json":
            path.unlink()
    change(stored, status="interrupted", summary=None)
    page = page_of(stored)
    check_form(page)
    assert "This run is not finished: it was interrupted" in page.alerts
    assert page.result == "There is no result yet."
    assert page.commands[0][:3] == ["fracctl", "run", "experiment=ic1_outofplane"]
    assert f"It gives the run id {stored.name}; where that run is stored, it goes on" in " ".join(
        page.sections["again"]
    )
    assert page.tables == []


def test_an_error_and_missing_results_are_told_first(stored: Path, grid: RunResult) -> None:
    notes = ["3 of 9 rows failed and are in no result", "a note of another kind"]
    summary = grid.summary | {"error": "2 points could not be computed (why)", "notes": notes}
    change(stored, status="incomplete", summary=summary)
    page = page_of(stored)
    for text in ("is not finished: some of its points", "2 points could not be computed (why)", notes[0]):
        assert text in page.alerts
    assert notes[1] not in page.alerts
    assert page.sections["notes"][-1] == notes[1]


def test_damage_is_told_and_the_rest_shown(stored: Path) -> None:
    path = stored / "evaluations.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    page = page_of(stored)
    assert "evaluations.parquet has changed" in page.alerts
    assert "cannot read" in page.alerts
    assert "figure 'gain_contours'" in page.alerts
    assert page.table("Optima of settling_time")
    assert len(page.pictures) == len(StoredRun.read(stored).configuration["figures"]) - 1


def test_a_run_of_another_version_says_that_its_id_will_differ(stored: Path, grid: RunResult) -> None:
    assert f"It gives the run id {grid.run_directory.name}" in " ".join(page_of(stored).sections["again"])
    other = stored.rename(stored.with_name("0123456789ab"))
    content = json.loads((other / "run.json").read_text(encoding="utf-8"))
    content["summary"]["run_id"], content["provenance"]["sources"] = other.name, "0" * 64
    change(other, **content)
    assert "this run is of another version of fracctl" in " ".join(page_of(other).sections["again"])


def test_a_configuration_that_does_not_fit_any_more_is_shown_all_the_same(stored: Path) -> None:
    configuration = StoredRun.read(stored).configuration | {"gone": {"since": "long"}}
    change(stored, configuration=configuration)
    page = page_of(stored)
    assert page.commands == []
    assert "does not read it any more" in " ".join(page.sections["again"])
    assert "since: long" in " ".join(page.sections["configuration"])
    assert "orbits" in page.result


def test_a_run_stored_without_its_command_says_so(stored: Path) -> None:
    change(stored, command=None)
    page = page_of(stored)
    assert page.commands == []
    assert "stored without its command" in " ".join(page.sections["again"])


def test_words_that_lead_elsewhere_by_now_say_so(stored: Path) -> None:
    command = StoredRun.read(stored).content["command"]
    change(stored, command=command | {"words": [*command["words"], "seed=7"]})
    assert "It gives another configuration now" in " ".join(page_of(stored).sections["again"])
    change(stored, command=command | {"words": [*command["words"], "sede=7"]})
    assert "It gives no run any more: unknown key 'sede'" in " ".join(page_of(stored).sections["again"])


def test_the_command_of_a_study_names_it_and_tells_of_its_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Composing happens once: the command is what was typed, and not searched for."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "my_study.yaml"
    file.write_text("name: mine\ncontroller:\n  alpha_w: 0.93\n", encoding="utf-8")
    words = ["my_study", "controller.k_p_w=0.7", "scheduler=serial", "figures=null"]
    assert main(["run", *words]) == 0
    (directory,) = (tmp_path / "outputs" / "mine").iterdir()
    monkeypatch.chdir("/")
    count = Counter[str]()
    composed = Command.compose
    monkeypatch.setattr(Command, "compose", lambda own: (count.update(["composed"]), composed(own))[1])
    page = page_of(directory)
    assert count == {"composed": 1}
    assert page.commands == [["fracctl", "run", *words[:2], "figures=null"]]
    said = " ".join(page.sections["again"])
    assert f"It gives the run id {directory.name}" in said
    assert f"{file} is the study" in said
    file.write_text("name: mine\ncontroller:\n  alpha_w: 0.94\n", encoding="utf-8")
    assert f"{file} has changed since" in " ".join(page_of(directory).sections["again"])
    file.unlink()
    assert f"{file} is not there any more" in " ".join(page_of(directory).sections["again"])


def test_text_of_a_run_is_text_on_the_page(stored: Path, grid: RunResult) -> None:
    note = "<script>alert(1)</script> & 'quotes'"
    change(stored, summary=grid.summary | {"notes": [note]})
    page = page_of(stored)
    check_form(page)
    assert note in page.sections["notes"]
    assert "<script>alert" not in page.source


def test_runs_side_by_side(grid: RunResult, folder: Path) -> None:
    other = ["survey.axes.k_d_w=[1.5,1.6]", "figures=gain_contours", f"output_dir={folder}"]
    slower = computed(["experiment=ic1_outofplane", *GRID, *other])
    runs = [StoredRun.read(result.run_directory) for result in (grid, slower)]
    page = Page(comparison_page(runs))
    check_form(page)
    assert [row[0] for row in page.table("The runs")] == ["run", "A: ic1_outofplane", "B: ic1_outofplane"]
    _, *differing = page.table("Where the configurations differ")
    assert differing == [["survey.axes.k_d_w", "0:2:0.05", "[1.5, 1.6]"]]
    rows = {row[0]: row[1:] for row in page.table("Optimum of settling_time from ic1")}
    one, other = (run.results[0]["optimum"]["settling_time"] for run in runs)
    assert float(rows["change against A"][2]) == pytest.approx(100.0 * (other / one - 1.0), rel=1e-5)
    assert rows["change against A"][0] == "%"
    assert float(rows["settling_time"][1]) == pytest.approx(one, rel=1e-5)
    assert len(page.pictures) == 2 * len(runs[0].configuration["figures"])
    assert [run_id(compose(words[2:]).model_dump(mode="json")) for words in page.commands] == [
        grid.run_directory.name,
        slower.run_directory.name,
    ]


def test_runs_of_different_experiments_are_compared_in_what_they_share(grid: RunResult, folder: Path) -> None:
    single = execute(compose([*KINDS["single"][0], f"output_dir={folder}", "figures=null"]))
    tether = execute(compose([*KINDS["laws"][0], f"output_dir={folder}", "figures=null"]))
    runs = [StoredRun.read(result.run_directory) for result in (grid, single, tether)]
    page = Page(comparison_page(runs))
    check_form(page)
    assert page.table("Optimum of settling_time from ic1")[0] == ["quantity", "unit", "A: ic1_outofplane", "B: custom"]
    apart = Page(comparison_page(runs[1:]))
    assert "No two of these runs have a result for the same objective" in " ".join(apart.sections["shared"])


def law(condition: str, name: str, orbits: float | None, **more: Any) -> dict[str, Any]:
    return {"initial_condition": condition, "law": name, "settling_orbits": orbits} | more


def spread_of(condition: str, name: str, measure: str, median: float) -> dict[str, Any]:
    return {"initial_condition": condition, "law": name, "measure": measure, "samples": 40, "median": median}


def survived(condition: str, name: str, stage: str, orbits: float | None) -> dict[str, Any]:
    return {"initial_condition": condition, "law": name, "stage": stage, "band_m": 100.0, "median_orbits": orbits}


def compared(condition: str, limit: float, name: str, objective: float) -> dict[str, Any]:
    keys = {"initial_condition": condition, "limit": "gain", "limit_value": limit, "threshold_m": 10.0, "law": name}
    return keys | {"objective": objective, "verdict": "better"}


def test_tables_of_laws_are_joined(stored: Path, grid: RunResult) -> None:
    """The same law, start, stage or measure of several runs stand together; a run alone with one has it alone."""
    other = stored.with_name("0123456789ab")
    shutil.copytree(stored, other)
    one = {
        "laws": [law("ic1", "pd", 0.5), law("ic1", "lqr", None), law("ic2", "pd", 0.7)],
        "quantiles": [spread_of("ic1", "pd", "effort", 1.0), spread_of("ic1", "pd", "overshoot", 2.0)],
        "survival": [survived("ic1", "pd", "ideal", 0.25), survived("ic1", "pd", "sampled", None)],
        "comparison": [compared("ic1", 4.0, "pd", 3.0), compared("ic1", 8.0, "pd", 2.0)],
        "alone": [{"initial_condition": "ic1"}],
    }
    two = {
        "laws": [law("ic1", "pd", 0.25, delta_v_m_s=12.0), law("ic1", "pid", 0.9)],
        "quantiles": [spread_of("ic1", "pd", "effort", 1.5)],
        "survival": [survived("ic1", "pd", "ideal", 0.5)],
        "comparison": [compared("ic1", 8.0, "pd", 2.5)],
    }
    for directory, tables_of_run in ((stored, one), (other, two)):
        change(directory, summary=grid.summary | {"tables": tables_of_run})
    page = Page(comparison_page([StoredRun.read(stored), StoredRun.read(other)]))
    check_form(page)
    captions = [str(table["caption"]) for table in page.tables]
    assert len([caption for caption in captions if caption.startswith("The laws side by side")]) == 2
    assert page.table("The laws side by side, from ic1") == [
        ["quantity", "unit", "A: pd", "B: pd", "A: lqr", "B: pid"],
        ["settling_orbits", "orbits", "0.5", "0.25", "never", "0.9"],
        ["delta_v_m_s", "m/s", "–", "12", "–", "–"],
    ]
    assert page.table("The laws side by side, from ic2")[0] == ["quantity", "unit", "A: pd"]
    assert page.table("Quantiles over dispersed runs") == [
        ["initial_condition", "law", "measure", "run", "samples", "median"],
        ["ic1", "pd", "effort", "A", "40", "1"],
        ["ic1", "pd", "effort", "B", "40", "1.5"],
        ["ic1", "pd", "overshoot", "A", "40", "2"],
    ]
    assert [row[2:4] + row[-1:] for row in page.table("What survives")[1:]] == [
        ["ideal", "A", "0.25"],
        ["ideal", "B", "0.5"],
        ["sampled", "A", "never"],
    ]
    assert [[row[2], *row[5:7]] for row in page.table("Every law at its best")[1:]] == [
        ["4", "A", "3"],
        ["8", "A", "2"],
        ["8", "B", "2.5"],
    ]
    assert not any("alone" in caption for caption in captions)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "needs the directory of a run"),
        (["nowhere"], "'nowhere' does not exist"),
        (["empty"], "'empty' holds no run: it has no run.json"),
        (["outputs"], "'outputs' holds no run: it has no run.json; did you mean 'outputs/one/0123'?"),
        (["file"], "'file' is a file"),
        (["outputs/one/0123"], "run.json has no configuration"),
        (["empty", "empty"], "'empty' is named twice"),
        (["experiment=tether"], "takes directories of runs, not the override"),
        (["outputs/one/0123", "--to", "empty"], "--to empty is a directory; name a file in it, as empty/report.html"),
        (["--jsn"], "unknown option '--jsn'; did you mean '--json'?"),
    ],
)
def test_what_is_no_run_gets_a_sentence(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("empty", "outputs/one/0123"):
        Path(folder).mkdir(parents=True)
    Path("file").touch()
    Path("outputs/one/0123/run.json").write_text("{}", encoding="utf-8")
    assert main(["report", *words]) in (1, 2)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    assert said in captured.err


def test_where_the_page_goes(
    stored: Path, grid: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(stored), "--to", "pages/own.html", "--json"]) == 0
    line = json.loads(capsys.readouterr().out)
    assert line == {"report": str(tmp_path / "pages" / "own.html"), "runs": [str(stored)]}
    assert not (stored / "report.html").exists()
    assert main(["report", str(stored), str(grid.run_directory)]) == 0
    assert capsys.readouterr().out == "comparison.html\n"
    assert Page(Path("comparison.html").read_text(encoding="utf-8")).table("The runs")
    assert main(["report", str(stored), "--to", f"{stored}/run.json/page.html"]) == 1
    assert "--to FILE writes it elsewhere" in capsys.readouterr().err
