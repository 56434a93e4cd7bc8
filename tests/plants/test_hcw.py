"""The Hill-Clohessy-Wiltshire plants against the written-out equations, the free motion and the chief's scales."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from fracctl.errors import ArgumentError
from fracctl.plants import HCW, Chief, HCWInPlane, HCWOutOfPlane, LinearPlant
from tests.references import loops, series


def state_matrix(plant: LinearPlant) -> np.ndarray:
    m = plant.n_controls
    return np.block([[np.zeros((m, m)), np.eye(m)], [plant.stiffness, plant.damping]])


def test_equations_are_those_of_the_paper() -> None:
    """u'' = 2v' + 3u, v'' = -2u', w'' = -w: rows of the state matrix over [u v w u' v' w']."""
    rows = state_matrix(HCW())[3:]
    np.testing.assert_array_equal(rows, [[3, 0, 0, 0, 2, 0], [0, 0, 0, -2, 0, 0], [0, 0, -1, 0, 0, 0]])
    np.testing.assert_array_equal(HCWInPlane().stiffness, loops.IN_PLANE_STIFFNESS)
    np.testing.assert_array_equal(HCWInPlane().damping, loops.IN_PLANE_DAMPING)
    np.testing.assert_array_equal(HCWOutOfPlane().stiffness, loops.OUT_OF_PLANE_STIFFNESS)
    np.testing.assert_array_equal(HCWOutOfPlane().damping, loops.OUT_OF_PLANE_DAMPING)


@pytest.mark.parametrize("time", [0.1, 1.0, np.pi, 12.0])
def test_transition_matrix_is_the_closed_form(time: float) -> None:
    start = np.array([1.1e-3, -0.7e-3, 0.4e-3, -0.3e-3, 1.9e-3, 0.6e-3])
    moved = scipy.linalg.expm(state_matrix(HCW()) * time) @ start
    in_plane = series.free_in_plane(start[[0, 1, 3, 4]], time)[0]
    out_of_plane = series.free_out_of_plane(start[[2, 5]], time)[0]
    expected = [*in_plane[:2], out_of_plane[0], *in_plane[2:], out_of_plane[1]]
    np.testing.assert_allclose(moved, expected, atol=1e-14)


@pytest.mark.parametrize(("plant", "rows"), [(HCWInPlane(), [0, 1]), (HCWOutOfPlane(), [2])])
def test_parts_are_blocks_of_the_whole(plant: LinearPlant, rows: list[int]) -> None:
    whole, others = HCW(), [i for i in range(3) if i not in rows]
    np.testing.assert_array_equal(plant.stiffness, whole.stiffness[np.ix_(rows, rows)])
    np.testing.assert_array_equal(plant.damping, whole.damping[np.ix_(rows, rows)])
    assert not whole.stiffness[np.ix_(rows, others)].any()
    assert not whole.damping[np.ix_(rows, others)].any()
    assert plant.components == tuple(whole.components[i] for i in rows)


def test_names() -> None:
    assert HCW().state_names == ("u", "v", "w", "u_dot", "v_dot", "w_dot")
    assert HCWInPlane().state_names == ("u", "v", "u_dot", "v_dot")
    assert HCWOutOfPlane().state_names == ("w", "w_dot")
    assert HCWOutOfPlane().components == ("w",)
    assert HCWInPlane().n_controls == 2


def test_scales_at_ten_thousand_kilometres() -> None:
    """The orbit of the paper: n = 6.313e-4 rad/s, T = 2.764 h, 6313 m/s, 3986 mm/s² (GM/a² = 3.986 m/s²)."""
    chief = Chief()
    assert chief.a_km == 1e4
    assert chief.mean_motion_rad_s == pytest.approx(6.313e-4, rel=1e-4)
    scales = chief.scales
    assert scales.length_m == 1e7
    assert scales.time_s * chief.mean_motion_rad_s == pytest.approx(1.0, rel=1e-15)
    assert scales.period_s / 3600.0 == pytest.approx(2.764, rel=2e-4)
    assert scales.speed_m_s == pytest.approx(6313.0, rel=1e-4)
    assert scales.acceleration_m_s2 == pytest.approx(398600.4418e9 / 1e14, rel=1e-14)
    for plant in (HCW(), HCWInPlane(), HCWOutOfPlane()):
        assert plant.scales == scales


def test_initial_conditions_in_si_units() -> None:
    """IC1 out of plane is 12.6 m/s; δ = 1e-5 is 100 m."""
    scales = HCWOutOfPlane().scales
    assert scales is not None
    assert 0.002 * scales.speed_m_s == pytest.approx(12.6, abs=0.05)
    assert 1e-5 * scales.length_m == pytest.approx(100.0)


def test_scales_follow_keplers_third_law() -> None:
    low, high = Chief(semi_major_axis_km=7000.0), Chief(semi_major_axis_km=28000.0)
    assert high.scales.period_s / low.scales.period_s == pytest.approx(8.0, rel=1e-14)
    moon = Chief(semi_major_axis_km=1e4, gravitational_parameter_km3_s2=4902.8)
    assert moon.mean_motion_rad_s == pytest.approx(np.sqrt(4902.8 / 1e12), rel=1e-14)


def test_chief_by_its_altitude() -> None:
    """500 km above the equator of WGS 84: a period of 94.6 min."""
    chief = Chief(altitude_km=500.0)
    assert chief.a_km == 6878.137
    assert chief.scales.period_s / 60.0 == pytest.approx(94.62, abs=5e-3)
    sentence = (
        "`altitude_km` must not be given beside semi_major_axis_km = 7000, but is 500.0; set one of the two to null"
    )
    with pytest.raises(ArgumentError, match=sentence):
        Chief(7000.0, altitude_km=500.0)


@pytest.mark.parametrize("name", ["semi_major_axis_km", "altitude_km", "gravitational_parameter_km3_s2"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_chief_refuses_what_is_no_orbit(name: str, value: float) -> None:
    with pytest.raises(ArgumentError, match=f"`{name}` must (be positive|hold finite numbers only), but is"):
        Chief(**{name: value})


def test_linear_plant_takes_numbers_and_matrices() -> None:
    oscillator = LinearPlant(-4.0, -0.1)
    assert oscillator.components == ("x",)
    assert oscillator.scales is None
    np.testing.assert_array_equal(oscillator.stiffness, [[-4.0]])
    np.testing.assert_array_equal(oscillator.damping, [[-0.1]])
    pair = LinearPlant([[-1.0, 0.5], [0.5, -2.0]])
    assert pair.state_names == ("x1", "x2", "x1_dot", "x2_dot")
    np.testing.assert_array_equal(pair.damping, np.zeros((2, 2)))
    assert LinearPlant(np.eye(2), components=("a", "b")).components == ("a", "b")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            {"stiffness": [1.0, 2.0]},
            r"`stiffness` must be a number or a square matrix \(m, m\), but is of",
        ),
        ({"stiffness": np.zeros((2, 3))}, r"`stiffness` must be a number or a square matrix"),
        ({"stiffness": np.zeros((0, 0))}, r"`stiffness` must be a number or a square matrix"),
        ({"stiffness": np.nan}, r"`stiffness` must hold finite numbers only, but is nan"),
        ({"stiffness": "soft"}, r"`stiffness` must be a number or an array of numbers, but is 'soft'"),
        ({"stiffness": np.eye(2), "damping": 1.0}, r"`damping` must have the shape of `stiffness`, \(2, 2\)"),
        ({"stiffness": np.eye(2), "components": ("a",)}, r"`components` must be 2 different names"),
        ({"stiffness": np.eye(2), "components": ("a", "a")}, r"`components` must be 2 different names"),
    ],
)
def test_linear_plant_refuses_in_sentences(arguments: dict, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        LinearPlant(**arguments)
