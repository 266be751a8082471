# SPDX-License-Identifier: GPL-3.0-or-later
"""Loops on several cores."""

import os
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from liquid_splash_addon.core.numeric.threads import in_parts


@pytest.mark.parametrize("count", [0, 1, 3, 4, 1001])
def test_the_parts_are_the_whole_in_order(count):
    numbers = [n for part in in_parts(count, lambda a, b: list(range(a, b))) for n in part]
    assert numbers == list(range(count))


def test_work_is_done_in_other_threads_and_errors_come_back():
    names = in_parts(8, lambda a, b: threading.current_thread().name)
    assert threading.current_thread().name not in names
    with pytest.raises(ZeroDivisionError):
        in_parts(8, lambda a, b: 1 // 0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system starts processes anew")
def test_a_process_that_is_forked_has_threads_of_its_own():
    """As the workers that load data for training are."""
    assert in_parts(4, lambda a, b: b - a) == [1] * 4
    with ProcessPoolExecutor(1, get_context("fork")) as pool:
        assert pool.submit(parts_of_four).result(timeout=600) == [1] * 4


def parts_of_four():
    return in_parts(4, lambda a, b: b - a)
