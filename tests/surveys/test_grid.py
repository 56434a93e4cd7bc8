"""Grids: their points, and blocks that depend on the grid alone."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fracctl.errors import ArgumentError
from fracctl.surveys import Block, Grid, Single
from fracctl.surveys.grid import LARGEST_BLOCK


def blocks_of(grid: Grid) -> list[Block]:
    found: list[Block] = []
    while asked := grid.ask():
        found += asked
    return found


def axes(*lengths: int) -> dict[str, np.ndarray]:
    return {name: np.linspace(0.0, 1.0, length) for name, length in zip("abc", lengths, strict=False)}


def test_points_are_the_product_with_the_slice_outermost() -> None:
    grid = Grid({"a": np.array([1.0, 2.0]), "b": np.array([3.0, 4.0, 5.0])}, slice="b", fixed={"c": 7.0})
    points = [point for block in blocks_of(grid) for point in zip(*(block.design[n] for n in "bac"), strict=True)]
    assert points == [(b, a, 7.0) for b, a in itertools.product([3.0, 4.0, 5.0], [1.0, 2.0])]


def test_a_block_of_the_paper_s_survey_is_one_order() -> None:
    blocks = blocks_of(Grid(axes(41, 41, 21), slice="c"))
    assert len(blocks) == 21
    assert all(np.unique(block.design["c"]).size == 1 for block in blocks)


@given(
    lengths=st.tuples(st.integers(1, 40), st.integers(1, 30), st.integers(1, 30)),
    slice_=st.sampled_from([None, "a", "b", "c"]),
)
def test_blocks_follow_each_other_and_cover_the_grid(lengths: tuple[int, ...], slice_: str | None) -> None:
    grid = Grid(axes(*lengths), slice=slice_)
    blocks = blocks_of(grid)
    assert [block.number for block in blocks] == list(range(grid.n_blocks))
    assert [block.first_point for block in blocks] == np.cumsum([0] + [block.size for block in blocks])[:-1].tolist()
    assert sum(block.size for block in blocks) == grid.n_points
    assert all(0 < block.size <= LARGEST_BLOCK for block in blocks)
    points = {point for block in blocks for point in zip(*block.design.values(), strict=True)}
    assert len(points) == grid.n_points


@given(lengths=st.tuples(st.integers(1, 40), st.integers(1, 60), st.integers(1, 60)))
def test_a_block_holds_whole_slices_or_a_piece_of_one(lengths: tuple[int, ...]) -> None:
    per_slice = lengths[1] * lengths[2]
    for block in blocks_of(Grid(axes(*lengths), slice="a")):
        slices = np.unique(block.design["a"]).size
        assert slices == 1 or block.size == slices * per_slice


@pytest.mark.parametrize(
    ("lengths", "slice_", "fewest"),
    [((41, 41, 21), "c", 21), ((200, 200, 25), None, 62), ((100, 100, 1), "c", 16), ((100, 3, 3), "a", 16)],
)
def test_there_are_blocks_for_every_worker(lengths: tuple[int, ...], slice_: str | None, fewest: int) -> None:
    assert fewest <= Grid(axes(*lengths), slice=slice_).n_blocks <= 2 * fewest


def test_a_large_grid_is_made_block_by_block() -> None:
    grid = Grid({name: np.linspace(0.0, 1.0, 100) for name in "abcde"})
    assert grid.n_points == 10**10
    assert sum(block.size for block in grid.ask()) < 200_000


def test_finished_when_every_block_was_told() -> None:
    grid = Grid(axes(41, 41, 3), slice="c")
    for block in blocks_of(grid):
        assert not grid.finished
        grid.tell(block.number, {})
    assert grid.finished


def test_wrong_names_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"one of the axes \(a, b\)"):
        Grid(axes(2, 2), slice="alpha_w")
    with pytest.raises(ArgumentError, match=r"design variables \(a, b\), but is 'k'"):
        Grid(axes(2, 2), baseline={"k": 1.0})
    with pytest.raises(ArgumentError, match="must not name an axis"):
        Grid(axes(2, 2), fixed={"a": 1.0})
    with pytest.raises(ArgumentError, match="at least one"):
        Grid({})


def test_single_is_one_block_of_one_point() -> None:
    survey = Single({"a": 1.0, "b": 2.0})
    (block,) = survey.ask()
    assert (block.number, block.first_point, block.size) == (0, 0, 1)
    assert survey.ask() == []
    assert not survey.finished
    survey.tell(0, {})
    assert survey.finished
