"""Settings shared by all tests."""

import gc
import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

from tests import once

# Tests promise nothing about speed, and a busy machine is no failure.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

once.install()

# A shell lets what it starts in the background ignore it, and so would every process that a test interrupts.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Small tensors gain nothing from threads, and test machines have few cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-goldens", action="store_true", help="rewrite golden files instead of comparing with them"
    )
    parser.addoption(
        "--guards",
        action="store_true",
        help="put guard cells around every array of the engine, and watch them",
    )


def pytest_xdist_auto_num_workers() -> int:
    """One process more than cores, of which it uses four: tests of terminals and servers wait a third of the time."""
    return min(4, os.cpu_count() or 1) + 1


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """What is collected stays to the end: nobody looks through it for garbage."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test that `make test` leaves out says why."""
    for item in items:
        for mark in item.iter_markers("thorough"):
            if not mark.args:
                raise pytest.UsageError(f"{item.nodeid}: write @pytest.mark.thorough(why)")


@pytest.fixture(autouse=True)
def guards(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """With --guards every array of a batch lies between cells that nobody may write to."""
    if not request.config.getoption("--guards"):
        yield
        return
    from tests.guards import Guards

    watched = Guards(monkeypatch)
    yield
    assert watched.broken() == []


@pytest.fixture
def update_goldens(request: pytest.FixtureRequest) -> bool:
    """Whether golden files are to be rewritten instead of compared."""
    return bool(request.config.getoption("--update-goldens"))
