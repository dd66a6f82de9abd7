"""Work is shared between threads without changing its result or hiding its errors."""

import subprocess
import sys
import textwrap
import threading
from typing import Any

import numpy as np
import pytest
import torch

from tests.trainer.fake_envs import EchoEnvs
from trainer.actor import Actor
from trainer.crew import Crew, available_cores, keep_freed_memory
from trainer.nets import build_net
from trainer.ppo import update
from trainer.rollout import collect
from trainer.session import Session, net_spec


def test_results_come_in_order_from_as_many_threads_as_items() -> None:
    meet = threading.Barrier(3, timeout=20)

    def work(item: int) -> tuple[int, int, int]:
        meet.wait()
        return item, threading.get_ident(), torch.get_num_threads()

    with Crew(3) as crew:
        results = crew.map(work, [5, 6, 7])
    assert [item for item, _, _ in results] == [5, 6, 7]
    assert len({thread for _, thread, _ in results}) == 3
    assert results[0][1] == threading.get_ident()
    assert {inside for _, _, inside in results} == {1}


@pytest.mark.parametrize("bad", [0, 1])
def test_an_error_in_any_thread_is_the_caller_s(bad: int) -> None:
    def work(item: int) -> int:
        if item == bad:
            raise KeyError(item)
        return item

    with Crew(2) as crew, pytest.raises(KeyError):
        crew.map(work, [0, 1])


def test_torch_s_threads_are_as_before() -> None:
    torch.set_num_threads(2)
    with Crew(1):
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == 2
    with Crew(3, divisible=False) as crew:
        assert torch.get_num_threads() == 3, "work that cannot be shared uses torch's own threads"
        assert crew.threads == 1
    assert torch.get_num_threads() == 2


def test_shares_cover_everything_and_none_is_empty() -> None:
    with Crew(4) as crew:
        assert [share.tolist() for share in crew.shares(torch.arange(6))] == [[0, 1], [2, 3], [4], [5]]
        assert [share.tolist() for share in crew.shares(torch.arange(2))] == [[0], [1]]


def test_the_automatic_number_of_threads_is_that_of_the_cores() -> None:
    with Crew(0) as crew:
        assert crew.threads == min(available_cores(), 4)


@pytest.mark.parametrize("net", ["fast", "paper"])
@pytest.mark.parametrize("loss", ["joint", "per_head"])
def test_shared_updates_are_those_of_one_thread(net: str, loss: str, small_config: Any) -> None:
    config = small_config(net=net, loss=loss, num_envs=9, epochs=1, minibatches=1)
    gradients, statistics = [], []
    for threads in (1, 2, 2):
        session = Session.start(config, EchoEnvs(9))
        rollout = collect(session.actor, session.envs, session.state, config, session.generator, None)
        with Crew(threads) as crew:
            statistics.append(
                update(session.actor, session.optimizer, rollout, config, session.generator, crew)
            )
        gradients.append(torch.cat([p.grad.flatten() for p in session.actor.net.parameters()]))
    one, two, again = gradients
    assert (one - two).norm() < 1e-3 * one.norm()
    assert torch.equal(two, again), "the result depends on the threads' timing"
    assert statistics[0] == pytest.approx(statistics[1], rel=1e-3, abs=1e-5)


def test_threads_that_share_a_step_see_what_one_sees() -> None:
    envs = EchoEnvs(96, chatter=0.5, length=8)
    net = build_net("paper", net_spec(envs), 0)
    alone, shared = Actor(net, 8), Actor(net, 8)
    observation, _ = envs.reset(seed=0)
    generator = np.random.default_rng(0)
    images = generator.integers(0, 2, observation["image"].shape).astype(np.uint8)
    with Crew(2) as crew:
        rows, features = alone.see(images, observation["tokens"])
        same_rows, same = shared.see(images, observation["tokens"], crew=crew)
    assert alone.pairs.size >= (net.shared_from or 0)
    assert (rows == same_rows).all()
    torch.testing.assert_close(features, same, rtol=1e-3, atol=1e-4)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks Linux for its count of page faults")
def test_memory_of_the_last_update_serves_the_next() -> None:
    script = """
        import resource, torch
        from trainer.crew import Crew

        def update():
            blocks = [torch.ones(1 << 20) for _ in range(20)]  # 4 MB each

        with Crew(1):
            for _ in range(4):  # until the heap is large enough
                update()
            before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            for _ in range(5):
                update()
        print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
    """
    told = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=True
    )
    if not keep_freed_memory():
        pytest.skip("this C library has no such setting")
    assert int(told.stdout) < 2000, "5 * 80 MB are 102,400 pages of 4 kB"
