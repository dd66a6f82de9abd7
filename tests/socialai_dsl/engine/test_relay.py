"""Threads make the calls that are posted to them, each once, awake or asleep, until they are let go."""

import ctypes
import functools
import gc
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.engine.machine import Call
from socialai_dsl.engine.relay import Relay, order_of

ENTRY = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)


def call_of(function: Callable[[], int]) -> Call:
    """A call of a Python function as the engine's are prepared, which has an address."""
    return functools.partial(ENTRY(lambda _arguments: function()), None)


@pytest.mark.parametrize(
    "pause", [0.0, 5e-5, 2e-4, 3e-3], ids=["awake", "dozing", "falling asleep", "asleep"]
)
def test_every_call_is_made_once_in_a_thread_of_its_own(pause: float) -> None:
    made: list[list[int]] = [[], [], []]

    def work(number: int) -> int:
        made[number].append(threading.get_ident())
        return 10**number

    relay = Relay(2)
    calls = [call_of(lambda number=number: work(number)) for number in range(3)]
    rounds = 30 if pause > 1e-3 else 400
    order = order_of(calls)
    for _ in range(rounds):
        assert relay.make(order) == 111
        time.sleep(pause)
    relay.close()
    assert [len(threads) for threads in made] == [rounds] * 3
    assert [len(set(threads)) for threads in made] == [1, 1, 1]
    assert len({threads[0] for threads in made}) == 3


@pytest.mark.parametrize("pause", [0.0, 2e-4, 3e-3], ids=["awake", "falling asleep", "asleep"])
def test_calls_that_depend_on_others_are_made_if_these_return_0(pause: float) -> None:
    answers = [0, 0, 0]
    made = [0, 0, 0]

    def work(number: int) -> int:
        made[number] += 1
        return 10**number

    relay = Relay(2)
    first = [call_of(lambda number=number: answers[number]) for number in range(3)]
    second = [call_of(lambda number=number: work(number)) for number in range(3)]
    orders = order_of(first), order_of(second)
    for round_number in range(60):
        answers[:] = [0, 0, 0]
        assert relay.make_both(*orders) == 111
        time.sleep(pause)
        answers[round_number % 3] = -1
        assert relay.make_both(*orders) is None
        time.sleep(pause)
    relay.close()
    assert made == [60] * 3


def test_what_others_depend_on_is_waited_for() -> None:
    relay = Relay(1)

    def slow(answer: int) -> int:
        time.sleep(0.03)
        return answer

    quick = call_of(lambda: 0)
    second = [call_of(lambda: slow(2)), call_of(lambda: 3)]
    for answer, found in ((0, 5), (-1, None)):
        late = call_of(lambda answer=answer: slow(answer))
        assert relay.make_both(order_of([quick, late]), order_of(second)) == found
    relay.close()


def test_a_slow_call_is_waited_for() -> None:
    relay = Relay(1)

    def slow() -> int:
        time.sleep(0.05)
        return 7

    for own, other in ((call_of(lambda: 1), call_of(slow)), (call_of(slow), call_of(lambda: 1))):
        assert relay.make(order_of([own, other])) == 8
    relay.close()


def number_of_threads() -> int:
    """How many there are, once those that end have had time to."""
    gc.collect()
    time.sleep(0.05)
    return threading.active_count()


def test_threads_end_when_they_are_let_go_or_forgotten() -> None:
    before = number_of_threads()
    relay = Relay(3)
    assert number_of_threads() == before + 3
    relay.close()
    relay.close()
    assert number_of_threads() == before
    relay = Relay(2)
    del relay
    assert number_of_threads() == before
    envs = sd.make_vec("talkitout", num_envs=256, num_threads=2)
    envs.reset(seed=0)
    assert number_of_threads() == before + 1
    del envs
    assert number_of_threads() == before


def test_pauses_between_steps_change_nothing() -> None:
    found = []
    for threads, pause in ((1, 0.0), (2, 0.0), (2, 1e-3)):
        envs = sd.make_vec("talkitout", num_envs=256, num_threads=threads)
        envs.action_space.seed(3)
        envs.reset(seed=3)
        digests = []
        for _ in range(60):
            observation, reward, *_ = envs.step(envs.action_space.sample())
            digests.append((observation["image"].tobytes(), np.asarray(reward).tobytes()))
            time.sleep(pause)
        envs.close()
        found.append(digests)
    assert found[0] == found[1] == found[2]


def test_a_process_that_was_forked_is_told_that_it_has_no_threads() -> None:
    program = """
import os
import socialai_dsl as sd
envs = sd.make_vec("talkitout", num_envs=256, num_threads=2)
envs.reset(seed=0)
child = os.fork()
if child == 0:
    try:
        envs.step(envs.action_space.sample())
    except RuntimeError as error:
        print(error, flush=True)
    os._exit(0)
os.waitpid(child, 0)
envs.step(envs.action_space.sample())
print("the parent goes on")
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True
    )
    assert "made before this process was forked" in done.stdout
    assert "the parent goes on" in done.stdout
