"""Rows of flights against the library's own flights, and against each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fracctl as fc
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.execution.run import execute
from fracctl.flight import FlightEvaluation
from fracctl.flight.history import recorded
from fracctl.flight.implementations import Implementations
from fracctl.measures import settling_time
from fracctl.measures.settling_times import SettlingTimes
from fracctl.plants import HCW
from fracctl.plants.relative_motion import RelativeMotion
from fracctl.sampled import (
    Navigation,
    SampledLaw,
    Window,
    delta_v,
    dimensionless_time,
    memory_for,
    sampled_margins,
    settling_times,
    simulate,
)

SMALL = [
    *("experiment=flight_ic1", "horizon_periods=1.5", "evaluation.samples=3", "evaluation.first_sample=0"),
    *("evaluation.noise_samples=2", "evaluation.period_s=40", "figures=[]"),
]
ONE = ["initial_condition=[ic1]", "evaluation.band_m=1000"]
AWAY = "{k_p_u: -9, k_p_v: 2, k_p_w: 1, k_d_u: 1, k_d_v: 1, k_d_w: 1}"
TURN = 2.0 * np.pi


def built(words: list[str]) -> FlightEvaluation:
    found = build_checked(compose([*SMALL, *words]))[0]
    assert isinstance(found, FlightEvaluation)
    return found


def all_points(evaluation: FlightEvaluation) -> dict[str, np.ndarray]:
    axes = np.meshgrid(*evaluation.axes.values(), indexing="ij")
    return {name: values.ravel() for name, values in zip(evaluation.axes, axes, strict=True)}


@pytest.fixture(scope="module")
def evaluation() -> FlightEvaluation:
    return built([])


@pytest.fixture(scope="module")
def rows(evaluation: FlightEvaluation) -> dict[str, np.ndarray]:
    return evaluation(all_points(evaluation))


def of(rows: dict[str, np.ndarray], law: str, stage: str, start: str = "ic1") -> dict[str, np.ndarray]:
    there = (rows["law"] == law) & (rows["stage"] == stage) & (rows["initial_condition"] == start)
    return {name: values[there] for name, values in rows.items()}


def published(name: str, evaluation: FlightEvaluation) -> fc.controllers.LinearLaw:
    named = evaluation.laws[name]
    return named.law.from_parameters(("u", "v", "w"), dict(named.values))  # type: ignore[return-value]


def test_every_flight_has_its_row(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    assert list(rows) == list(evaluation.row_columns)
    for law in evaluation.laws:
        for stage, samples in (("ideal", [0]), ("sampled", [0]), ("noisy", [0, 1]), ("dispersed", [0, 1, 2])):
            assert of(rows, law, stage, "ic1_tenth")["sample"].tolist() == samples


def test_the_ideal_flight_is_the_loop_of_the_library(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    for name in ("published_pd", "published_pd_alpha"):
        loop = fc.ClosedLoop(HCW(), published(name, evaluation))
        trajectory = fc.solve(loop, [-0.001, 0.0, 0.0, 0.0, 0.002, 0.002], horizon=1.5 * TURN)
        assert of(rows, name, "ideal")["settling_time_100_m"] == pytest.approx(settling_time(trajectory), rel=1e-6)
        assert of(rows, name, "ideal")["stable"].tolist() == [True]


def test_the_sampled_flight_is_that_of_the_library(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    plant, law = HCW(), published("published_pd_alpha", evaluation)
    period = dimensionless_time(plant, 40.0)
    memory = memory_for(fc.ClosedLoop(plant, law), "exponentials", period, 0.01, "velocity")
    sampled = SampledLaw(law, memory, period, evaluation.sampling.delay, "velocity")
    flight = simulate(plant, sampled, [-0.001, 0.0, 0.0, 0.0, 0.002, 0.002], 1.5 * TURN)
    found = of(rows, "published_pd_alpha", "sampled")
    assert found["settling_time_300_m"] == settling_times(flight, [300.0 / plant.scales.length_m])
    assert found["delta_v_m_s"] == pytest.approx(delta_v(flight) * plant.scales.speed_m_s, rel=1e-12)
    last = flight.at_samples[0, -round(TURN / period) :, :3]
    rms = np.sqrt((last**2).sum(axis=1).mean()) * plant.scales.length_m
    assert found["hold_error_m"] == pytest.approx(rms, rel=1e-12)


def test_stages_add_what_they_say(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    """Noise parts samples; nonlinear motion moves what began 10 km off, and 100 times less from a tenth of that."""
    law = "published_pd"
    noisy, dispersed = (of(rows, law, stage) for stage in ("noisy", "dispersed"))
    assert len(set(noisy["settling_time_1000_m"].tolist())) == 2
    assert not np.isnan(dispersed["offset_u_percent"]).any()
    assert np.isnan(noisy["offset_u_percent"]).all()
    assert len(set(dispersed["mass_kg"].tolist())) == 3
    gap = {}
    for start in ("ic1", "ic1_tenth"):
        flights = [evaluation.fly(start, stage, [0], {"law_number": 0.0}) for stage in ("noisy", "nonlinear")]
        gap[start] = np.abs(flights[0].at_samples - flights[1].at_samples)[..., :3].max()
    assert 1e-7 < gap["ic1"] < 1e-5
    assert gap["ic1_tenth"] < 0.05 * gap["ic1"]


def test_a_flight_by_its_number(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    alone = built(["evaluation.first_sample=2", "evaluation.samples=1", "evaluation.stages=[dispersed]"])
    found = alone(all_points(alone))
    for name in rows.keys() - {"flight"}:
        again, before = of(found, "pd_lag", "dispersed"), of(rows, "pd_lag", "dispersed")
        np.testing.assert_array_equal(again[name], before[name][2:], err_msg=name)
    flown = evaluation.fly("ic1", samples=[2], design={"law_number": float(list(evaluation.laws).index("pd_lag"))})
    bands = np.array([300.0]) / HCW().scales.length_m
    assert settling_times(flown, bands)[0, 0] == of(rows, "pd_lag", "dispersed")["settling_time_300_m"][2]


def test_a_row_does_not_know_its_neighbours(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    points = all_points(evaluation)
    some = np.array([len(points["flight"]) - 1, 3, 8])
    found = evaluation({name: values[some] for name, values in points.items()})
    k = len(points["flight"])
    for name in evaluation.row_columns:
        for start in range(3):
            np.testing.assert_array_equal(found[name][3 * start : 3 * start + 3], rows[name][some + k * start], name)


def test_noise_is_not_drawn_from_the_stream_of_the_start(evaluation: FlightEvaluation) -> None:
    """Both are normal numbers of a sample; were they the same, what is measured would tell of the start."""
    drawn = evaluation.around.drawn(np.arange(3.0))
    offsets = np.column_stack([drawn[name] for name in drawn if name.endswith("percent")]) / 5.0
    flight = evaluation.fly("ic1_tenth", "noisy", range(3), {"law_number": 0.0})
    ideal = evaluation.fly("ic1_tenth", "sampled", range(3), {"law_number": 0.0})
    scales, sampled = HCW().scales, evaluation.sampling
    first = (flight.commands[:, 0] - ideal.commands[:, 0]) * scales.acceleration_m_s2
    law = published("published_pd", evaluation)
    k_p, k_d = np.asarray(law.k_p) / scales.time_s**2, np.asarray(law.k_d) / scales.time_s  # type: ignore[attr-defined]
    same = -(offsets[:, :3] @ k_p.T + 0.01 * offsets[:, 3:] @ k_d.T)
    assert sampled.feed == "velocity"
    assert np.abs(first - same).max() > 0.2 * np.abs(first).max()


def test_a_law_that_is_not_stable_is_not_flown() -> None:
    alone = built([*ONE, f"evaluation.laws={{away: {{type: pd, values: {AWAY}}}}}"])
    found = alone(all_points(alone))
    away = found["law"] == "away"
    assert set(found["status"][away].tolist()) == {"unstable"}
    assert "unstable" not in found["status"][~away]
    assert np.isinf(found["settling_time_100_m"][away]).all()
    assert found["stable"][away].tolist() == [False] * away.sum()


def test_flights_outside_their_band_are_unsettled(rows: dict[str, np.ndarray]) -> None:
    infinite = np.isinf(of(rows, "published_pd", "dispersed", "ic1_hundredth")["settling_time_1_m"])
    words = of(rows, "published_pd", "dispersed", "ic1_hundredth")["status"]
    assert infinite.any()
    assert (words[infinite] == "unsettled").all()


def test_one_law_over_its_gains(tmp_path: Path) -> None:
    words = [
        "evaluation=flight",
        "survey=out_of_plane_gains",
        "survey.axes={k_p_w: [0.5, 0.8], k_d_w: [2]}",
        "survey.slice=null",
    ]
    words += ["plant=hcw_out_of_plane", "controller=pd_alpha", "initial_condition=[ic1]", f"output_dir={tmp_path}"]
    words += ["evaluation.truth=null", "evaluation.dispersions={}", "controller.k_d_w=2", "survey.baseline={}"]
    result = execute(compose([*SMALL, "evaluation.laws={}", *words]))
    records = result.summary["tables"]["survival"]
    assert {(record["k_p_w"], record["stage"]) for record in records} >= {(0.5, "ideal"), (0.8, "dispersed")}
    assert len(records) == 10


def test_what_survives(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    found = evaluation.conclude([rows])
    (record,) = (
        r
        for r in found.tables["survival"]
        if (r["law"], r["stage"], r["initial_condition"]) == ("published_pd", "dispersed", "ic1")
    )
    times = of(rows, "published_pd", "dispersed")["settling_time_100_m_orbits"]
    assert record["samples"] == 3
    assert record["median_orbits"] == np.sort(times)[1]
    assert record["quantile_95_orbits"] == times.max()
    assert record["worst_sample"] == np.argmax(times)
    assert record["settled_percent"] == 100.0 * np.isfinite(times).mean()
    assert record["settled_percent_low"] == pytest.approx(100.0 * 0.025 ** (1.0 / 3.0)), "3 of 3, Clopper and Pearson"
    assert record["settled_percent_high"] == 100.0
    assert any(note.startswith("ic1 to 100 m, fastest ideal: ") for note in found.notes)


def test_the_worst_of_those_that_never_settle_is_held_worst(
    evaluation: FlightEvaluation, rows: dict[str, np.ndarray]
) -> None:
    own = of(rows, "published_pd", "dispersed")
    times, held = np.array([np.inf, 0.4, np.inf]), np.array([7.0, 90.0, 5.0])
    changed = own | {"settling_time_100_m_orbits": times, "hold_error_m": held}
    (record,) = evaluation.conclude([changed]).tables["survival"]
    assert record["worst_sample"] == 0
    assert record["settled_percent"] == pytest.approx(100.0 / 3.0)
    (record,) = evaluation.conclude([changed | {"hold_error_m": held[::-1]}]).tables["survival"]
    assert record["worst_sample"] == 2


def test_what_is_told_of_laws_that_never_settle(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    there = rows["initial_condition"] == "ic1"
    never = {name: values[there] for name, values in rows.items()}
    never["settling_time_100_m_orbits"] = np.full(there.sum(), np.inf)
    (note,) = evaluation.conclude([never]).notes
    assert note == "ic1 to 100 m, no law settles ideal; no law settles dispersed in 95 % of 3 flights"


def test_laws_as_designed_and_on_board(evaluation: FlightEvaluation, rows: dict[str, np.ndarray]) -> None:
    records = evaluation.conclude([rows]).tables["implementations"]
    assert len(records) == 3 * 6 * 2
    table = {(r["initial_condition"], r["law"], r["stage"]): r for r in records}
    for name in ("published_pd_alpha", "pd_lag"):
        ideal, sampled = (table["ic1_tenth", name, stage] for stage in ("ideal", "sampled"))
        loop = fc.ClosedLoop(evaluation.plant, published(name, evaluation))
        controller = evaluation.sampling.law(loop).discrete(3)
        assert ideal["sensitivity_peak"] == pytest.approx(fc.stability.margins(loop).sensitivity_peak)
        assert sampled["disk_margin"] == pytest.approx(sampled_margins(evaluation.plant, controller).disk_margin)
        assert sampled["sensitivity_peak"] > ideal["sensitivity_peak"], "samples and delay take from the margins"
        assert (sampled["states"], np.isnan(ideal["states"])) == (controller.n_states, True)
        flown = of(rows, name, "sampled", "ic1_tenth")
        assert sampled["settling_time_10_m_orbits"] == flown["settling_time_10_m_orbits"][0]
        assert sampled["delta_v_m_s"] == flown["delta_v_m_s"][0]
    quiet, loud = (table["ic1", name, "sampled"]["noise_control_mm_s2"] for name in ("pd_lag", "pd"))
    assert 0.0 < quiet < 0.2 * loud


def test_noise_on_board_is_that_of_a_long_flight() -> None:
    flights = built([*ONE, "horizon_periods=12", "evaluation.delay=0", "evaluation.largest_by=axis"])
    laws = Implementations(flights.loop, flights.sampling, flights.around.navigation)
    known = laws._of_law(0.0, "sampled")
    controller = flights.sampling.law(flights.loop({})).discrete(3)
    flown = simulate(HCW(), controller, np.zeros((8, 6)), flights.horizon, navigation=flights.around.navigation)
    late = flown.at_samples[:, 400:, :3] * HCW().scales.length_m
    spent = 1e3 * HCW().scales.acceleration_m_s2 * flown.commands[:, 400:]
    assert known["noise_position_m"] == pytest.approx(np.sqrt((late**2).mean(axis=(0, 1))).max(), rel=0.15)
    assert known["noise_control_mm_s2"] == pytest.approx(np.sqrt((spent**2).mean(axis=(0, 1))).max(), rel=0.05)


def test_the_table_is_that_of_any_number_of_workers(tmp_path: Path) -> None:
    def table(scheduler: str) -> str:
        words = [*SMALL, *ONE, "evaluation.stages=[noisy,dispersed]", f"output_dir={tmp_path / scheduler}"]
        where = execute(compose([*words, f"scheduler={scheduler}"])).run_directory
        return (where / "survival.csv").read_text()

    assert table("serial") == table("local")


def test_truth_with_drag_on_followers_of_their_own() -> None:
    words = ["evaluation.truth={type: perturbed_relative_motion, density_kg_m3: 5e-12}", "plant.chief.altitude_km=400"]
    words += ["plant.chief.semi_major_axis_km=null", "evaluation.dispersions.eccentricity=null"]
    words += ["evaluation.dispersions.true_anomaly_deg=null", "evaluation.stages=[nonlinear,dispersed]"]
    found = built([*ONE, *words, "+evaluation.dispersions.follower_ballistic_m2_kg=[uniform, 0.01, 0.03]"])
    rows = found(all_points(found))
    assert set(of(rows, "published_pd", "dispersed")["status"].tolist()) <= {"ok", "unsettled"}
    assert len(set(of(rows, "pd", "dispersed")["follower_ballistic_m2_kg"].tolist())) == 3


def test_truth_with_j2_and_drag_about_leaders_of_their_own() -> None:
    found = build_checked(
        compose(["experiment=flight_leo", *SMALL[1:], *ONE, "evaluation.stages=[nonlinear,dispersed]"])
    )[0]
    assert isinstance(found, FlightEvaluation)
    assert {"density_factor", "eccentricity", "argument_of_latitude_deg"} <= set(found.around.dispersions)
    rows = found(all_points(found))
    flown = of(rows, "published_pd", "dispersed")
    assert set(flown["status"].tolist()) <= {"ok", "unsettled"}
    assert len(set(flown["argument_of_latitude_deg"].tolist())) == 3
    alone = found.fly("ic1", samples=[1], design={"law_number": 0.0})
    together = found.fly("ic1", samples=[0, 1, 2], design={"law_number": 0.0})
    np.testing.assert_array_equal(alone.at_samples[0], together.at_samples[1])


def test_a_memory_may_know_the_drift_before_switch_on() -> None:
    plant, start = HCW(), np.array([[-1e-3, 2e-3, 0.0, 1e-4, 2e-3, 2e-3]])
    for truth in (plant, RelativeMotion(HCW().chief, 0.1, 30.0)):
        before = recorded(truth, start, None, 0.1, 0.5, 0, [0])
        assert before is not None
        count = round(0.5 * TURN / 0.1)
        assert before.shape == (1, count, 6)
        free = SampledLaw(fc.controllers.PD(np.zeros((3, 3)), np.zeros((3, 3))), Window(2), 0.1)
        if truth is plant:
            drift = simulate(plant, free, before[0, 0], count * 0.1)
            np.testing.assert_allclose(drift.states[-1], start[0], atol=1e-12)
            np.testing.assert_allclose(drift.states[:-1], before[0], atol=1e-12)
    assert recorded(plant, start, None, 0.1, 0.0, 0, [0]) is None
    noisy = recorded(plant, np.repeat(start, 50, axis=0), Navigation(1e-4, 0.0), 0.1, 0.5, 3, range(50))
    clean = recorded(plant, start, None, 0.1, 0.5, 0, [0])
    assert noisy is not None
    assert clean is not None
    np.testing.assert_allclose((noisy - clean)[..., :3].std(), 1e-4, rtol=0.05)
    np.testing.assert_array_equal((noisy - clean)[..., 3:], 0.0)


def test_a_recorded_history_matters_to_laws_with_memory_alone() -> None:
    words = [*ONE, "evaluation.stages=[sampled,dispersed]", "evaluation.navigation.position_noise_m=0"]
    short, known = (built([*words, f"evaluation.history_orbits={orbits}"]) for orbits in (0, 0.3))
    for law, same in ((0.0, True), (1.0, False)):
        flights = [f.fly("ic1", "sampled", design={"law_number": law}).commands for f in (short, known)]
        assert np.array_equal(*flights) is same
    alone = known.fly("ic1", samples=[1], design={"law_number": 1.0})
    together = known.fly("ic1", samples=[0, 1], design={"law_number": 1.0})
    np.testing.assert_array_equal(alone.at_samples[0], together.at_samples[1])


REFUSED = [
    (
        ["evaluation.truth.type=perturbed_relative_motion", "evaluation.history_orbits=1"],
        "evaluation.history_orbits = 1",
    ),
    (["evaluation.stages=[ideal,tested]"], "evaluation.stages = tested: must be among ideal"),
    (["evaluation.band_m=55"], "evaluation.band_m = 55: must be one of the measured bands"),
    (["~evaluation.band_m.ic1_tenth"], "must hold a band for ic1_"),
    (["measures=standard", "objectives=settling_time"], "measures = settling_time: cannot be taken of flights"),
    (["solver.cross_check=0.5"], "solver.cross_check = 0.5: has no second solver"),
    (["spacecraft.mass_kg=null", "spacecraft.thrust_n=null"], "needs a mass; set spacecraft.mass_kg"),
    (["evaluation.truth={type: hcw}"], "evaluation.truth.type = hcw: must be motion about a leader"),
    (["evaluation.truth={type: relative_motion, eccentricity: 2}"], "evaluation.truth.eccentricity = 2: must lie in"),
    (["evaluation.dispersions.offset_x_m=[normal, 0, 1]"], "must be one of offset_u_m, offset_v_m"),
    (
        ["evaluation.thrusters.impulse_bit_n_s=400"],
        "impulse_bit_n_s = 400: is more than the thrusters give in a period",
    ),
    (
        ["evaluation.dispersions.eccentricity=[normal, 0, 0.01]"],
        "draws -0.06, but eccentricity must lie in [0, 1); bound it: [normal, 0, 0.01, lowest, highest]",
    ),
    (["evaluation.dispersions.eccentricity=[uniform, 0, 1]"], "draws 1.0, but eccentricity must lie in [0, 1)"),
    (["evaluation.dispersions.mass_kg=[normal, 500, 100]"], "draws -100, but mass_kg must be positive"),
    (["evaluation.dispersions.thrust_factor=[choice, 0, 1]"], "draws 0, but thrust_factor must be positive"),
    (["evaluation.dispersions.position_noise_m=[normal, 1, 1]"], "draws -5, but position_noise_m must not be negative"),
    (["evaluation.memory_samples=20"], "evaluation.memory_samples = 20: goes with memory = window"),
    (
        ["evaluation.memory=window", "evaluation.memory_samples=50000"],
        "evaluation.memory_samples = 50000: must be at most",
    ),
    (["evaluation.delay=-1"], "evaluation.delay = -1"),
    (["survey=out_of_plane_gains"], "several laws have their own values"),
    (["evaluation.laws.pd.values.k_p_x=1"], "evaluation.laws.pd.values = k_p_x: must name parameters"),
    (["plant=hcw_out_of_plane", "controller=pd"], "must have 2 states"),
]


@pytest.mark.parametrize(("words", "sentence"), REFUSED)
def test_refusals(words: list[str], sentence: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        built(words)
    assert sentence in str(caught.value)


def test_a_tolerance_that_asks_for_too_long_a_window_says_so() -> None:
    flights = built([*ONE, "evaluation.memory=window", "evaluation.memory_tolerance=5e-6"])
    with pytest.raises(ArgumentError, match=r"`memory_tolerance` is below .* 20000 samples, but is 5e-06; allow more"):
        flights.fly("ic1", "sampled", [0], {"law_number": 1.0})


def test_a_look_at_no_flight_is_refused(evaluation: FlightEvaluation) -> None:
    with pytest.raises(ArgumentError, match="`stage`"):
        evaluation.fly("ic1", "ideal")


def test_the_truth_has_the_chief_of_the_design(evaluation: FlightEvaluation) -> None:
    assert isinstance(evaluation.around.truth, RelativeMotion)
    assert evaluation.around.truth.leader.a_km == HCW().chief.a_km


def test_bands_are_those_of_the_measure() -> None:
    assert "settling_time_300_m_orbits" in SettlingTimes([300.0]).columns


def test_forces_and_propellant_are_those_of_the_mass_that_flies() -> None:
    """A light spacecraft is accelerated beyond thrust over nominal mass, but no thruster gives more than it can."""
    words = ["+measures.peak_force={}", "+measures.propellant={}", "spacecraft.isp_s=220", "evaluation.samples=12"]
    alone = built([*ONE, *words, "evaluation.stages=[nonlinear,dispersed]", "initial_condition.ic1.u=-0.003"])
    rows = alone(all_points(alone))
    found = of(rows, "published_pd", "dispersed")
    given = 8.0 * found["thrust_factor"]
    np.testing.assert_allclose(found["peak_force_n"], given, rtol=1e-12, err_msg="all are at their limit")
    np.testing.assert_allclose(found["peak_force_n"], found["mass_kg"] * found["peak_acceleration_mm_s2"] / 1e3)
    burnt = found["mass_kg"] * -np.expm1(-found["delta_v_m_s"] / (9.80665 * 220.0))
    np.testing.assert_allclose(found["propellant_kg"], burnt, rtol=1e-12)
    certain = of(rows, "published_pd", "nonlinear")
    np.testing.assert_allclose(certain["peak_force_n"], 8.0, rtol=1e-12)


def test_a_bounded_eccentricity_flies() -> None:
    words = ["evaluation.dispersions.eccentricity=[normal, 0, 0.01, 0, 0.03]", "evaluation.stages=[dispersed]"]
    alone = built([*ONE, *words, "evaluation.samples=20", "horizon_periods=0.1"])
    drawn = of(alone(all_points(alone)), "published_pd", "dispersed")["eccentricity"]
    assert drawn.min() >= 0.0
    assert drawn.max() <= 0.03
    assert len(set(drawn.tolist())) == 20
