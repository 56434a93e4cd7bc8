"""Stability margins: closed forms, a rational loop by another package, and loops at the limits that margins name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal

import fracctl as fc
from fracctl.controllers import PD, PID, PDAlpha, PDDAlpha, PDLag, PILambdaDMu
from fracctl.errors import UnsupportedError
from fracctl.plants import HCW, HCWInPlane, HCWOutOfPlane, LinearPlant
from fracctl.stability import Margins, margins

Complex = np.ndarray


def of(law: object, plant: LinearPlant | None = None) -> Margins:
    return margins(fc.ClosedLoop(plant or HCWOutOfPlane(), law))


def out_of_plane(controller: Callable[[Complex], Complex]) -> Callable[[np.ndarray], Complex]:
    """L(iω) of a law out of plane, written down by hand."""
    return lambda omega: controller(1j * omega) / (1.0 - omega**2)


def test_pd_of_a_double_integrator() -> None:
    """ω_c² = (k_D² + √(k_D⁴ + 4 k_P²))/2, phase margin atan(k_D ω_c / k_P)."""
    k_p, k_d = 0.7, 1.3
    found = of(PD(k_p, k_d), LinearPlant(0.0))
    crossover = np.sqrt(0.5 * (k_d**2 + np.sqrt(k_d**4 + 4.0 * k_p**2)))
    phase = np.arctan2(k_d * crossover, k_p)
    assert found.stable is True
    assert found.crossover == pytest.approx(crossover, rel=1e-12)
    assert found.phase_margin_deg == pytest.approx(np.degrees(phase), rel=1e-12)
    assert found.delay_margin == pytest.approx(phase / crossover, rel=1e-12)
    assert np.isnan(found.delay_margin_s)
    assert (found.gain_margin, found.gain_reduction) == (np.inf, 0.0)
    assert found.gain_reduction_db == -np.inf


@pytest.mark.parametrize("alpha", [0.3, 0.61, 0.9])
def test_a_fractional_law_of_a_double_integrator(alpha: float) -> None:
    """L = k s^(α-2) is a ray at the angle απ/2 from the negative axis; ω_c = k^(1/(2-α))."""
    k = 2.5
    found = of(PDAlpha(1e-16, k, alpha), LinearPlant(0.0))
    angle = 0.5 * np.pi * alpha
    assert found.phase_margin_deg == pytest.approx(90.0 * alpha, rel=1e-10)
    assert found.crossover == pytest.approx(k ** (1.0 / (2.0 - alpha)), rel=1e-10)
    assert found.delay_margin == pytest.approx(angle / k ** (1.0 / (2.0 - alpha)), rel=1e-10)
    assert found.sensitivity_peak == pytest.approx(1.0 / np.sin(angle), rel=1e-10)
    assert found.sensitivity_frequency == pytest.approx((k / np.cos(angle)) ** (1.0 / (2.0 - alpha)), rel=1e-6)
    assert found.complementary_peak == pytest.approx(1.0 / np.sin(angle), rel=1e-10)
    assert found.disk_margin == pytest.approx(2.0 * np.tan(0.5 * angle), rel=1e-10)
    assert found.disk_phase_margin_deg == pytest.approx(90.0 * alpha, rel=1e-10)


@pytest.mark.parametrize(("k_p", "k_d"), [(0.55, 2.0), (1e-4, 1e-6), (3e-7, 2e-8), (40.0, 0.02)])
def test_pd_near_the_resonance_of_the_plant(k_p: float, k_d: float) -> None:
    """|k_P + i k_D ω| = |1 - ω²| has two roots, which lie within k_P of the resonance where gains are small."""
    found = of(PD(k_p, k_d))
    square = np.roots([1.0, -(2.0 + k_d**2), 1.0 - k_p**2])
    crossings = np.sqrt(square[square > 0.0])
    phases = np.abs(np.angle(-(k_p + 1j * k_d * crossings) / (1.0 - crossings**2)))
    assert found.phase_margin_deg == pytest.approx(np.degrees(phases.min()), rel=1e-6)
    assert found.crossover == pytest.approx(crossings[phases.argmin()], rel=1e-8)


@pytest.mark.parametrize("law", [PDAlpha(4.0, 1.5, 0.9), PD(4.0, 1.5), PDLag(4.0, 1.5, 0.1)])
def test_gain_at_frequency_zero(law: object) -> None:
    """u'' = 3u needs k_P > 3, whatever the derivative does."""
    found = of(law, LinearPlant(3.0))
    assert found.gain_reduction == pytest.approx(0.75, rel=1e-12)
    assert found.gain_reduction_db == pytest.approx(20.0 * np.log10(0.75), rel=1e-12)
    assert of(PDAlpha(-0.5, 2.0, 0.9)).gain_margin == pytest.approx(2.0, rel=1e-12)


def test_a_rational_loop_by_another_package() -> None:
    """PID with filter on w'' = -w - 0.3 w': the same loop as polynomials, on four million frequencies."""
    k_p, k_i, k_d, lag, damping = 0.8, 1.9, 1.2, 0.4, -0.3
    found = of(PID(k_p, k_i, k_d, lag), LinearPlant(-1.0, damping))
    numerator = np.polyadd(np.polymul([lag, 1.0], [k_p, k_i]), [k_d, 0.0, 0.0])
    denominator = np.polymul([lag, 1.0, 0.0], [1.0, -damping, 1.0])
    omega = np.geomspace(1e-3, 1e3, 4_000_000)
    _, loop = signal.freqs(numerator, denominator, omega)
    assert found.stable is True
    assert np.all(np.roots(np.polyadd(numerator, denominator)).real < 0.0)
    across = np.flatnonzero(np.diff(np.sign(np.abs(loop) - 1.0)))
    phases = np.angle(-loop[across])
    assert found.phase_margin_deg == pytest.approx(np.degrees(np.abs(phases)).min(), abs=1e-3)
    assert found.delay_margin == pytest.approx((np.mod(phases, 2.0 * np.pi) / omega[across]).min(), rel=1e-4)
    real = np.flatnonzero((np.diff(np.sign(loop.imag)) != 0.0) & (loop.real[1:] < 0.0))
    factors = 1.0 / np.abs(loop[real])
    assert found.gain_margin == pytest.approx(factors[factors > 1.0].min(initial=np.inf), rel=1e-4)
    assert found.gain_reduction == pytest.approx(factors[factors < 1.0].max(initial=0.0), abs=1e-4)
    assert found.sensitivity_peak == pytest.approx(np.max(1.0 / np.abs(1.0 + loop)), rel=1e-9)
    assert found.complementary_peak == pytest.approx(np.max(np.abs(loop / (1.0 + loop))), rel=1e-9)
    assert found.disk_margin == pytest.approx(2.0 / np.max(np.abs((1.0 - loop) / (1.0 + loop))), rel=1e-9)


def test_the_gain_margins_put_a_pole_on_the_axis() -> None:
    """An integral makes a loop that too little and too much control both lose, by Hurwitz' criterion.

    s³ + d s² + (1 + c k_P) s + c k_I with the factor c: the pole is on the axis at d (1 + c k_P) = c k_I.
    """
    k_p, k_i, damping = 0.2, 0.9, 0.5
    found = of(PILambdaDMu(k_p, k_i, 0.0), LinearPlant(-1.0, -damping))
    assert found.stable is False
    k_i = 0.3
    found = of(PILambdaDMu(k_p, k_i, 0.0), LinearPlant(-1.0, -damping))
    assert found.gain_margin == pytest.approx(damping / (k_i - damping * k_p), rel=1e-10)
    found = of(PILambdaDMu(k_p, k_i, 1.0), LinearPlant(-1.0, 0.2))
    # d = c k_D - 0.2: (c k_D - 0.2)(1 + c k_P) = c k_I
    limits = np.roots([k_p, 1.0 - 0.2 * k_p - k_i, -0.2])
    assert found.gain_reduction == pytest.approx(limits.max(), rel=1e-10)


LAWS = {
    "pd": (PD(0.55, 2.0), lambda s: 0.55 + 2.0 * s),
    "pd_alpha": (PDAlpha(0.85, 2.0, 0.91), lambda s: 0.85 + 2.0 * s**0.91),
    "pd_lag": (PDLag(1.3, 2.0, 0.2), lambda s: 1.3 + 2.0 * s / (0.2 * s + 1.0)),
    "pid": (PID(0.8, 0.4, 1.6, 0.1), lambda s: 0.8 + 0.4 / s + 1.6 * s / (0.1 * s + 1.0)),
    "pdd_alpha": (PDDAlpha(0.6, 0.5, 1.2, 0.6), None),
    "pi_lambda_d_mu": (
        PILambdaDMu(0.5, 0.3, 1.5, 0.7, 0.85),
        lambda s: 0.5 + 0.3 * s**-0.7 + 1.5 * s**0.85,
    ),
    "lqr": (fc.design.LQR(), lambda s: (np.sqrt(2.0) - 1.0) + np.sqrt(2.0 * np.sqrt(2.0) - 1.0) * s),
}


@pytest.mark.parametrize("name", LAWS)
def test_the_delay_margin_puts_a_root_on_the_axis(name: str) -> None:
    """1 + L(iω) e^{-iωτ} vanishes somewhere at the delay margin, and nowhere for any shorter delay."""
    law, controller = LAWS[name]
    if controller is None:
        k_p, k_d, k_d_alpha, alpha = (float(getattr(law, n)) for n in ("k_p", "k_d", "k_d_alpha", "alpha"))
        loop = out_of_plane(lambda s: k_p + k_d * s + k_d_alpha * s**alpha)
    else:
        loop = out_of_plane(controller)
    delay = of(law).delay_margin
    omega = np.geomspace(1e-4, 1e3, 200_001)
    nearest = np.abs(1.0 + loop(omega) * np.exp(-1j * omega * delay)).argmin()
    fine = np.linspace(omega[nearest - 1], omega[nearest + 1], 100_001)
    assert np.abs(1.0 + loop(fine) * np.exp(-1j * fine * delay)).min() < 1e-6
    for share in (0.0, 0.2, 0.5, 0.8, 0.95, 0.99):
        assert np.abs(1.0 + loop(omega) * np.exp(-1j * omega * share * delay)).min() > 5e-3


IN_PLANE = (
    PDAlpha([[4.5, 0.2], [-0.3, 1.4]], [[2.2, 1.1], [-0.9, 1.8]], [0.92, 0.97]),
    PDLag([[4.0, 0.0], [0.0, 1.0]], [[2.0, -1.0], [1.0, 2.0]], [0.1, 0.3]),
)
STIFFNESS, DAMPING = np.diag([3.0, 0.0]), np.array([[0.0, 2.0], [-2.0, 0.0]])


def in_plane(law: PDAlpha | PDLag, s: np.ndarray) -> tuple[Complex, Complex]:
    """C and M at s (k,), written down by hand."""
    s = s[:, None, None]
    if isinstance(law, PDAlpha):
        control = law.k_p + law.k_d * s ** np.asarray(law.alpha)
    else:
        control = law.k_p + law.k_d * s / (np.asarray(law.time_constant) * s + 1.0)
    return control, s**2 * np.eye(2) - s * DAMPING - STIFFNESS


@pytest.mark.parametrize("law", IN_PLANE)
def test_the_disk_margin_is_reached_by_a_perturbation(law: PDAlpha | PDLag) -> None:
    """The worst Δ, of norm α, makes I + F L singular on the axis; smaller ones leave the encirclements as they are."""
    found = of(law, HCWInPlane())
    omega = np.geomspace(1e-4, 1e4, 40_000)  # without the plant's pole at 1
    control, plant = in_plane(law, 1j * omega)
    loop = control @ np.linalg.inv(plant)
    sensitivity = np.linalg.inv(np.eye(2) + loop)
    left, values, right = np.linalg.svd(sensitivity - loop @ sensitivity)
    worst = values[:, 0].argmax()
    assert found.disk_margin == pytest.approx(2.0 / values[worst, 0], rel=1e-6)
    assert found.sensitivity_peak == pytest.approx(np.linalg.norm(sensitivity, 2, axis=(1, 2)).max(), rel=1e-6)
    assert np.isnan(found.phase_margin_deg)

    def factor(delta: np.ndarray) -> np.ndarray:
        return (np.eye(2) + 0.5 * delta) @ np.linalg.inv(np.eye(2) - 0.5 * delta)

    destabilising = found.disk_margin * np.outer(right[worst, 0].conj(), left[worst, :, 0].conj())
    singular = np.linalg.svd(np.eye(2) + factor(destabilising) @ loop[worst], compute_uv=False)
    assert singular[-1] < 1e-5 * singular[0]

    def encirclements(delta: np.ndarray) -> float:
        """Of 0 by det(M + F C) / det(M + C), from -i∞ to i∞."""
        c, m = (np.concatenate([part[::-1].conj(), part]) for part in (control, plant))
        ratio = np.linalg.det(m + factor(delta) @ c) / np.linalg.det(m + c)
        return float(np.angle(ratio[1:] / ratio[:-1]).sum() / (2.0 * np.pi))

    assert abs(round(encirclements(1.03 * destabilising))) == 1
    assert round(encirclements(0.97 * destabilising)) == 0
    random = np.random.default_rng(3)
    for _ in range(20):
        delta = random.normal(size=(2, 2)) + 1j * random.normal(size=(2, 2))
        delta *= 0.99 * found.disk_margin / np.linalg.norm(delta, 2)
        assert round(encirclements(delta)) == 0


def test_the_published_optima_of_ic1() -> None:
    """PD 84°, PD^α 71-78°, PD with lag 50°; M_s 1.0, 1.0, 1.4."""
    pd, pd_alpha, lag = of(PD(0.55, 2.0)), of(PDAlpha(0.85, 2.0, 0.91)), of(PDLag(1.3, 2.0, 0.2))
    assert [pd.phase_margin_deg, pd_alpha.phase_margin_deg] == pytest.approx([84.0, 71.0], abs=0.5)
    ic2 = of(PDAlpha(0.75, 1.95, 0.97))
    assert ic2.phase_margin_deg == pytest.approx(78.0, abs=0.6)
    assert lag.phase_margin_deg == pytest.approx(50.0, abs=0.6)
    peaks = [pd.sensitivity_peak, pd_alpha.sensitivity_peak, lag.sensitivity_peak]
    assert peaks == pytest.approx([1.0, 1.0, 1.4], abs=0.05)
    assert pd.sensitivity_frequency == np.inf
    assert pd.delay_margin_s == pytest.approx(pd.delay_margin / 6.313e-4, rel=1e-3)


def test_a_batch_is_its_members() -> None:
    random = np.random.default_rng(7)
    k_p, k_d, alpha = random.uniform(0.1, 2.0, 6), random.uniform(0.1, 2.0, 6), random.uniform(0.6, 1.0, 6)
    together = of(PDAlpha(k_p, k_d, alpha))
    for member in range(6):
        alone = of(PDAlpha(k_p[member], k_d[member], alpha[member]))
        for name in ("phase_margin_deg", "delay_margin", "sensitivity_peak", "complementary_peak", "disk_margin"):
            assert getattr(together, name)[member] == pytest.approx(getattr(alone, name), rel=1e-9)


def test_loops_that_are_not_stable_have_no_margins() -> None:
    found = of(PD([0.5, 0.5, 0.5], [1.0, 0.0, -1.0]))
    assert list(found.stable) == [True, None, False]
    for name in ("gain_margin", "phase_margin_deg", "delay_margin_s", "sensitivity_peak", "disk_margin"):
        assert list(np.isnan(getattr(found, name))) == [False, True, True]


def test_three_controls_that_are_not_coupled() -> None:
    """The worst of in-plane and out-of-plane motion."""
    gains = np.zeros((2, 3, 3))
    gains[:, :2, :2] = [[[4.5, 0.2], [-0.3, 1.4]], [[2.2, 1.1], [-0.9, 1.8]]]
    gains[:, 2, 2] = 0.85, 2.0
    whole = of(PDAlpha(gains[0], gains[1], 0.91), HCW())
    parts = of(PDAlpha(gains[0, :2, :2], gains[1, :2, :2], 0.91), HCWInPlane()), of(PDAlpha(0.85, 2.0, 0.91))
    assert whole.disk_margin == pytest.approx(min(part.disk_margin for part in parts), rel=1e-9)
    assert whole.sensitivity_peak == pytest.approx(max(part.sensitivity_peak for part in parts), rel=1e-9)


def test_delayed_feedback_is_refused() -> None:
    loop = fc.ClosedLoop(HCWOutOfPlane(), fc.controllers.DelayedFeedback([[0.1, 0.2]], 1.0))
    with pytest.raises(UnsupportedError, match="delayed states"):
        margins(loop)
