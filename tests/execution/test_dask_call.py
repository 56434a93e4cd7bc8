"""What travels to a worker of a Dask cluster says what the worker must be."""

from __future__ import annotations

import pickle

import pytest

from fracctl.execution import dask_call
from fracctl.execution.dask_call import OtherProgram, answer, difference, packed, program
from fracctl.execution.worker import Work
from fracctl.store import identity

WORK = Work.of("a.module:function", {"plant": {"type": "gravity_gradient"}})
OTHER = Work.of("a.module:function", {"plant": {"type": "hcw"}})


def size_of(work: Work) -> int:
    return len(work.data)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if an installed package had a plant."""
    monkeypatch.setattr(identity, "_entry_points", lambda: (("gravity_gradient", "pitch.plants"),))
    monkeypatch.setattr(identity, "package_digest", lambda name: f"digest of {name}")
    monkeypatch.setattr(dask_call, "package_digest", lambda name: f"digest of {name}")


@pytest.mark.usefixtures("installed")
def test_a_call_is_answered_by_the_same_program() -> None:
    for work in (WORK, OTHER):
        assert pickle.loads(answer(packed(size_of, [work], {}))) == len(work.data)


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(("digest", "said"), [("another", "other sources of pitch"), ("", "no package pitch")])
def test_a_worker_with_another_extension_refuses_runs_that_need_it(
    monkeypatch: pytest.MonkeyPatch, digest: str, said: str
) -> None:
    needs, does_not = (packed(size_of, [work], {}) for work in (WORK, OTHER))
    monkeypatch.setattr(dask_call, "package_digest", lambda name: digest)
    with pytest.raises(OtherProgram, match=f"^{said}$"):
        answer(needs)
    assert pickle.loads(answer(does_not)) == len(OTHER.data)


def test_versions_and_sources_make_a_difference() -> None:
    here = program()
    assert difference(here, here) is None
    assert {"numpy", "scipy", "numba", "llvmlite", "pymoo", "moocore"} <= set(here)
    for name in identity.DECISIVE:
        assert difference(here, {**here, name: "0.0"}) == f"{name} 0.0 instead of {here[name]}"
    version = here["fracctl"]
    assert difference(here, {**here, "sources of fracctl": "0"}) == f"other sources of fracctl {version}"
