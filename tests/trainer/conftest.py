"""Settings and helpers shared by the trainer's tests."""

from collections.abc import Iterator
from typing import Any

import pytest
import torch

from socialai_dsl.trainer.config import RunConfig


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture
def small_config() -> Any:
    """Makes configurations small enough for a unit test."""

    def make(**changes: Any) -> RunConfig:
        values: dict[str, Any] = {
            "envs": 8,
            "horizon": 8,
            "minibatches": 2,
            "epochs": 2,
            "frames": 8 * 8 * 6,
            "threads": 1,
            "checkpoint_every": 2,
            "tensorboard": False,
        }
        return RunConfig(**(values | changes))

    return make
