"""Runs of laws with a memory from configuration: rows of one law, of several, of samples; what they conclude."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import fracctl
from fracctl.cli.main import main
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.controllers import AdaptiveSlidingMode, Saturation
from fracctl.dispersions import draws
from fracctl.execution.run import execute
from fracctl.memory_evaluation import LAWS, QUANTILES, MemoryEvaluation
from fracctl.plants import Tether
from fracctl.solvers import ImplicitMemory
from tests.execution.test_perform import Watch

SHORT = ["horizon_periods=1", "solver.step=0.02"]
MONTE_CARLO = ["experiment=tether_monte_carlo", *SHORT]


def evaluation(words: list[str]) -> MemoryEvaluation:
    found = build_checked(compose(words))[0]
    assert isinstance(found, MemoryEvaluation)
    return found


def rows(words: list[str]) -> dict[str, np.ndarray]:
    built, survey = build_checked(compose(words))
    blocks = []
    while asked := survey.ask():
        blocks += asked
    return built({name: np.concatenate([block.design[name] for block in blocks]) for name in blocks[0].design})


def test_a_row_is_the_run_of_the_library() -> None:
    one = evaluation(["experiment=tether", "evaluation=memory", *SHORT])
    found = one({"alpha_1": np.array([0.5, 0.0]), "phi_2": np.full(2, 0.0054)})
    plant = Tether()
    for place, alpha_1 in enumerate((0.5, 0.0)):
        law = AdaptiveSlidingMode(alpha_1=alpha_1, phi_2=0.0054)
        loop = fracctl.ClosedLoop(plant, law, Saturation(plant.limits, "axis"))
        start = [0.0009, 0.1, 0.1, 0.7, 0.0, 0.0]
        trajectory = ImplicitMemory(step=0.02).solve(loop, start, 2.0 * np.pi)
        assert found["settling_2_percent_orbits"][place] == fracctl.measures.length_settling(trajectory)
        assert found["overshoot_percent"][place] == fracctl.measures.length_overshoot(trajectory)
    assert found["alpha_1"].tolist() == [0.5, 0.0]
    assert found["nu"].tolist() == [0.5, 0.5], "what is not varied stands in the rows too"
    assert list(found) == list(one.row_columns)


def test_each_law_has_its_row_whatever_the_order_of_the_points() -> None:
    several = evaluation(["experiment=tether", *SHORT])
    forward, backward = (several({"law_number": np.array(order)}) for order in ([0.0, 1.0, 2.0], [2.0, 1.0, 0.0]))
    assert forward["law"].tolist() == ["FDA-SMC", "DA-SMC", "FO-SMC (reconstruction)"]
    assert backward["law"].tolist() == forward["law"].tolist()[::-1]
    for name in several.row_columns:
        np.testing.assert_array_equal(forward[name], backward[name][::-1], err_msg=name)
    alone = evaluation(["experiment=tether", "evaluation=memory", "controller=da_smc", *SHORT])({"nu": np.array([0.5])})
    assert alone["settling_2_percent_orbits"][0] == forward["settling_2_percent_orbits"][1]


def test_a_row_depends_on_its_point_alone() -> None:
    one = evaluation(["experiment=tether", "evaluation=memory", "horizon_periods=0.5", "solver.step=0.05"])
    weights = np.linspace(0.0, 1.5, 5)
    together, last = one({"alpha_1": weights}), one({"alpha_1": weights[-1:]})
    for name in one.row_columns:
        np.testing.assert_array_equal(together[name][-1:], last[name], err_msg=name)


def test_a_sample_is_flown_from_what_was_drawn() -> None:
    """From its own release speed and angles, and with its own disturbance."""
    sampled = evaluation([*MONTE_CARLO, "evaluation.samples=3"])
    found = sampled({"law_number": np.zeros(3), "sample": np.arange(3.0)})
    drawn = draws(sampled.dispersions, sampled._known, 0, range(3))
    assert set(drawn) <= set(found)
    for place in range(3):
        start = [0.0009, *(drawn[f"initial_{name}"][place] for name in ("theta", "phi", "length_dot")), 0.0, 0.0]
        amplitude = 0.05 * drawn["disturbance_factor"][place]
        plant = Tether(disturbance=[amplitude] * 3, disturbance_phase=drawn["disturbance_phase"][place])
        loop = fracctl.ClosedLoop(plant, AdaptiveSlidingMode(), Saturation(plant.limits, "axis"))
        alone = ImplicitMemory(step=0.02).solve(loop, start, 2.0 * np.pi)
        expected = fracctl.measures.length_settling(alone)
        assert found["settling_2_percent_orbits"][place] == pytest.approx(expected, abs=1e-4)
        assert found["theta_largest_rad"][place] == pytest.approx(abs(start[1]), abs=1e-4)


def test_a_sample_is_flown_again_by_its_number(tmp_path: Path) -> None:
    """Bitwise: what a table says of sample 17 is what one finds when looking closer at it."""
    common = [*SHORT, "figures=[]", f"output_dir={tmp_path}", "scheduler=serial"]
    words = [*common, "evaluation.samples=1"]
    again = fracctl.run("tether_monte_carlo", [*words, "evaluation.first_sample=17"]).evaluations
    table = fracctl.run("tether_monte_carlo", [*common, "evaluation.samples=20"]).evaluations
    expected = table[table["sample"] == 17].reset_index(drop=True)
    pd.testing.assert_frame_equal(again.drop(columns="point"), expected.drop(columns="point"), check_exact=True)


def test_tables_do_not_depend_on_the_workers(tmp_path: Path) -> None:
    words = [*SHORT, "figures=[]", "evaluation.samples=9"]
    tables = []
    for name, scheduler in {
        "serial": ["scheduler=serial"],
        "one": ["scheduler=local", "scheduler.workers=1"],
        "two": ["scheduler=local", "scheduler.workers=2"],
    }.items():
        result = fracctl.run("tether_monte_carlo", [*words, *scheduler, f"output_dir={tmp_path / name}"])
        tables.append(result.evaluations)
    pd.testing.assert_frame_equal(tables[0], tables[1], check_exact=True)
    pd.testing.assert_frame_equal(tables[0], tables[2], check_exact=True)


def test_another_seed_draws_other_samples() -> None:
    words = [*MONTE_CARLO, "evaluation.samples=2"]
    assert (rows(words)["initial_theta"] != rows([*words, "seed=1"])["initial_theta"]).all()


def test_statuses_and_a_note_on_how_runs_ended() -> None:
    words = ["experiment=tether_retrieval", "solver.step=0.02", "horizon_periods=2"]
    built, found = evaluation(words), rows(words)
    assert found["reference_rate"].tolist() == [0.0, 0.5, 0.7, 1.0]
    assert found["status"].tolist() == ["collision", "ok", "ok", "ok"]
    assert np.isinf(found["settling_2_percent_orbits"][0])
    conclusion = built.conclude([found])
    note, kernel = conclusion.notes
    assert kernel == "memory: relative error of its kernel at most 1e-08, a-priori"
    assert note == (
        "1 of 4 runs ended in collision: the tether's length fell to 0.0001, where the satellites meet and the "
        "equations end"
    )
    names = [record["law"] for record in conclusion.tables[LAWS]]
    assert names == [f"reference_rate = {rate:g}" for rate in (0.0, 0.5, 0.7, 1.0)]


def test_a_run_that_does_not_settle_is_unsettled() -> None:
    words = ["experiment=tether", "evaluation=memory", *SHORT, "controller.caputo=1"]
    assert rows(words)["status"].tolist() == ["unsettled"], "with Caputo's derivative it never does"


def test_laws_stand_beside_each_other() -> None:
    words = ["experiment=tether", *SHORT, "initial_condition=[release,release_fast]"]
    several = evaluation(words)
    found = several({"law_number": np.arange(3.0)})
    conclusion = several.conclude([found])
    records = conclusion.tables[LAWS]
    assert [(record["initial_condition"], record["law"]) for record in records] == [
        (start, law) for start in ("release", "release_fast") for law in several.laws
    ]
    for place, record in enumerate(records):
        assert record["overshoot_percent"] == found["overshoot_percent"][place]
        assert record["status"] == found["status"][place]
    assert conclusion.shown == {LAWS: records}


def test_many_points_are_a_survey_and_stand_in_no_table() -> None:
    built = evaluation(["experiment=tether_orders", "horizon_periods=0.2", "solver.step=0.1"])
    assert built.conclude([built({"alpha_1": np.linspace(0.0, 1.0, 9)})]).tables == {}
    assert built.conclude([built({"alpha_1": np.array([0.5])})]).tables == {}, "one point stands beside nothing"


def test_quantiles_of_each_law() -> None:
    words = [*MONTE_CARLO, "evaluation.samples=4"]
    built, found = evaluation(words), rows(words)
    conclusion = built.conclude([found])
    records = conclusion.tables[QUANTILES]
    assert {(record["law"], record["samples"]) for record in records} == {("FDA-SMC", 4), ("DA-SMC", 4)}
    own = found["law"] == "DA-SMC"
    (record,) = (r for r in records if r["law"] == "DA-SMC" and r["measure"] == "overshoot_percent")
    worst = np.argmax(found["overshoot_percent"][own])
    assert record["largest"] == found["overshoot_percent"][own].max()
    assert record["largest_sample"] == found["sample"][own][worst]
    assert conclusion.notes[:2] == ("4 samples of release, FDA-SMC, all ok", "4 samples of release, DA-SMC, all ok")


def test_a_dispersed_run_has_neither_objective_nor_optimum(tmp_path: Path) -> None:
    words = [*SHORT, "figures=[]", "evaluation.samples=2", "scheduler=serial", f"output_dir={tmp_path}"]
    result = fracctl.run("tether_monte_carlo", words)
    assert result.optima.empty
    assert "objective" not in result.evaluations
    assert result.summary["optimum"] is None


def test_an_interrupted_run_goes_on_where_it_was(tmp_path: Path) -> None:
    words = ["experiment=tether", *SHORT, "figures=[]", "scheduler=serial"]
    whole = execute(compose([*words, f"output_dir={tmp_path / 'whole'}"]))
    broken = compose([*words, f"output_dir={tmp_path / 'broken'}"])
    with pytest.raises(KeyboardInterrupt):
        execute(broken, progress=Watch(interrupt_after=1))
    again = execute(broken)
    assert "3 blocks: 1 were stored" in (again.run_directory / "run.log").read_text()
    pd.testing.assert_frame_equal(again.evaluations, whole.evaluations, check_exact=True)
    assert again.summary["tables"] == whole.summary["tables"]


def test_stored_samples_are_states_controls_demands_and_targets() -> None:
    built = evaluation(["experiment=tether_retrieval", *SHORT])
    trajectory = built.solve({"reference_rate": 0.7}, "deployed")
    times = np.linspace(0.0, 2.0 * np.pi, 30)
    samples = built.sampled(trajectory, times)
    assert list(samples) == list(built.sampled_columns)
    assert set(samples["target_length"]) == {0.1}, "where the approach leads, not how far it is within an orbit"
    assert set(samples["target_theta"]) == {0.0}
    limits = Tether().limits[0]
    for limit, name in zip(limits, ("length", "theta", "phi"), strict=True):
        np.testing.assert_allclose(
            samples[f"control_{name}"], np.clip(samples[f"demand_{name}"], -limit, limit), atol=1e-12
        )


def test_json_of_a_run_of_laws_is_strict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """FO-SMC does not settle within an orbit; what JSON cannot hold is null."""

    def refuse(word: str) -> float:
        raise AssertionError(f"{word} is no JSON")

    for experiment, samples in (("tether", []), ("tether_monte_carlo", ["evaluation.samples=2"])):
        words = [*SHORT, *samples, "figures=[]", "scheduler=serial", f"output_dir={tmp_path}"]
        assert main(["run", f"experiment={experiment}", "--json", *words]) == 0
        (line,) = capsys.readouterr().out.splitlines()
        said = json.loads(line, parse_constant=refuse)
        assert said["experiment"] == experiment
        if experiment == "tether":
            last = said["tables"]["laws"][-1]
            assert last["law"] == "FO-SMC (reconstruction)"
            assert last["settling_2_percent_orbits"] is None
        else:
            assert {record["quantile_95_high"] for record in said["tables"]["quantiles"]} == {None}, (
                "two samples bound nothing"
            )
