# SPDX-License-Identifier: GPL-3.0-or-later
"""Several processes that train one model, as ``torchrun`` starts them; alone, nothing to do."""

from __future__ import annotations

import os
from collections.abc import Iterable

import torch
import torch.distributed as dist
from torch import nn


def start() -> tuple[int, int]:
    """Join the other processes that ``torchrun`` started; return own rank and their number."""
    if "RANK" not in os.environ:
        return 0, 1
    if torch.cuda.is_available():  # each process on this machine has a GPU of its own
        torch.cuda.set_device(int(os.environ.get("LOCAL_RANK", "0")) % torch.cuda.device_count())
    dist.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    return dist.get_rank(), dist.get_world_size()


def meet() -> None:
    """Wait until all processes are here.

    To be called before the end: a thread of gloo that still holds a tensor of the last step while
    Python ends may abort the process.
    """
    if dist.is_initialized():
        dist.barrier()


def stop() -> None:
    """Leave the other processes."""
    if dist.is_initialized():
        dist.destroy_process_group()


def average_gradients(parameters: Iterable[nn.Parameter]) -> None:
    """Replace each gradient by its mean over all processes, as if their batches were one."""
    if not dist.is_initialized():
        return
    gradients = [p.grad for p in parameters if p.grad is not None]
    flat = torch.cat([g.flatten() for g in gradients])
    dist.all_reduce(flat)
    flat /= dist.get_world_size()
    start = 0
    for gradient in gradients:
        part = flat[start : start + gradient.numel()]
        gradient.copy_(part.view_as(gradient))
        start += gradient.numel()


def agree(value: float) -> float:
    """Return rank 0's ``value`` in every process: clocks differ, schedules must not."""
    if not dist.is_initialized():
        return value
    shared = torch.tensor([value], dtype=torch.float64)
    if torch.cuda.is_available():
        shared = shared.cuda()
    dist.broadcast(shared, 0)
    return float(shared)
