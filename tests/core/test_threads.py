# SPDX-License-Identifier: GPL-3.0-or-later
"""Loops on several cores."""

import threading

import pytest

from liquid_splash_addon.core.threads import in_parts


@pytest.mark.parametrize("count", [0, 1, 3, 4, 1001])
def test_the_parts_are_the_whole_in_order(count):
    numbers = [n for part in in_parts(count, lambda a, b: list(range(a, b))) for n in part]
    assert numbers == list(range(count))


def test_work_is_done_in_other_threads_and_errors_come_back():
    names = in_parts(8, lambda a, b: threading.current_thread().name)
    assert threading.current_thread().name not in names
    with pytest.raises(ZeroDivisionError):
        in_parts(8, lambda a, b: 1 // 0)
