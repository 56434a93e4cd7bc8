"""Blocks that are done in any order are handed on in that of their numbers, and few wait in memory."""

from __future__ import annotations

import random
import weakref

import pyarrow as pa
import pytest

from fracctl.execution.in_order import _HELD, InOrder


def table(number: int) -> pa.Table:
    return pa.table({"number": [number]})


@pytest.mark.parametrize("seed", range(5))
def test_any_order_becomes_that_of_the_numbers(seed: int) -> None:
    numbers = list(range(50))
    random.Random(seed).shuffle(numbers)
    taken: list[int] = []
    ordered = InOrder(table, lambda one: taken.extend(one["number"].to_pylist()))
    for place, number in enumerate(numbers):
        ordered.add(number, table(number) if number % 3 else None)
        done = set(numbers[: place + 1])
        assert taken == list(range(next(n for n in range(51) if n not in done)))
    ordered.finish()
    assert taken == list(range(50))


def test_a_number_that_never_comes_keeps_none_back() -> None:
    taken: list[int] = []
    ordered = InOrder(table, lambda one: taken.extend(one["number"].to_pylist()))
    for number in (4, 2, 0):
        ordered.add(number, table(number))
    assert taken == [0]
    ordered.finish()
    assert taken == [0, 2, 4]


def test_few_tables_wait_in_memory_however_late_the_first_is() -> None:
    read: list[int] = []
    ordered = InOrder(lambda number: read.append(number) or table(number), lambda one: None)
    held = []
    for number in range(1, 101):
        one = table(number)
        held.append(weakref.ref(one))
        ordered.add(number, one)
        del one
    assert sum(reference() is not None for reference in held) == _HELD
    assert not read
    ordered.add(0, table(0))
    assert read == list(range(_HELD + 1, 101))
