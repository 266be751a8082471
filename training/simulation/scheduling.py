# SPDX-License-Identifier: GPL-3.0-or-later
"""Run one function for many seeds: on this machine's cores, or on a Dask cluster's."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any

Result = tuple[int, bytes | None, str]
"""A seed, what the function returned for it (None if it failed), and what went wrong."""

Work = Callable[..., bytes]
"""A function of a seed and further arguments."""


class SchedulingError(RuntimeError):
    """The work cannot go on; the message says what to do."""


def run_everywhere(
    work: Work, seeds: Sequence[int], rest: tuple[Any, ...], workers: int, scheduler: str | None
) -> Iterator[Result]:
    """Yield ``work(seed, *rest)`` for each of ``seeds``, once each, in the order in which they end.

    workers : processes on this machine; scheduler : address of a Dask scheduler to use instead.
    Raises SchedulingError where workers or scheduler are lost.
    """
    if scheduler is None:
        return run_here(work, seeds, rest, workers)
    return run_on_dask(work, seeds, rest, scheduler)


def run_here(
    work: Work, seeds: Sequence[int], rest: tuple[Any, ...], workers: int
) -> Iterator[Result]:
    """Yield the results of a pool of processes, see :func:`run_everywhere`."""
    # An executor, not a Pool: a Pool waits for ever for the work of a process that was killed.
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=end_with_parent) as pool:
        waiting: dict[Future[bytes], int] = {pool.submit(work, seed, *rest): seed for seed in seeds}
        try:
            for future in as_completed(list(waiting)):
                yield outcome(waiting.pop(future), future)
        except BrokenProcessPool as error:
            raise SchedulingError(
                "a worker was killed (out of memory?): run the same command again to go on, "
                "with fewer --workers if it was"
            ) from error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def end_with_parent() -> None:
    """Let this process end when its parent does; one that is killed cannot tell its children."""
    parent = parent_process()
    if parent is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        Thread(target=watch, daemon=True).start()


def run_on_dask(
    work: Work, seeds: Sequence[int], rest: tuple[Any, ...], scheduler: str
) -> Iterator[Result]:
    """Yield the results of a Dask cluster, see :func:`run_everywhere`.

    Dask passes the work of a worker that dies on to another.
    """
    try:
        from distributed import Client
        from distributed import as_completed as dask_completed
    except ImportError as error:
        raise SchedulingError("--scheduler needs Dask: pip install distributed") from error
    try:
        client = Client(scheduler, timeout="10s")
    except (OSError, TimeoutError, ValueError) as error:
        raise SchedulingError(
            f"no Dask scheduler answers at {scheduler} ({error}): start one with "
            "`dask scheduler` and workers with `dask worker`, or leave out --scheduler"
        ) from error
    with client:
        waiting = {client.submit(work, seed, *rest, pure=False): seed for seed in seeds}
        for future in dask_completed(list(waiting)):
            yield outcome(waiting.pop(future), future)


def outcome(seed: int, future: Any) -> Result:
    """Return the result of one seed; a broken pool is raised, for it is not the seed's fault."""
    try:
        return seed, future.result(), ""
    except BrokenProcessPool:
        raise
    except Exception as error:  # one bad scene must not stop the others
        return seed, None, f"{type(error).__name__}: {error}"
