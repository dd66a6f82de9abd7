"""A snapshot whose registers no episode can have is refused before the engine sees it."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

import socialai_dsl
from socialai_dsl.envs import ScenarioVectorEnv
from socialai_dsl.envs.audit import first_unsound
from socialai_dsl.program import FIRST_ENTITY, Field, Header, Register
from tests.quick import one_in

SAMPLES = sorted(str(path) for path in (Path(__file__).parents[2] / "data" / "agreement").glob("*.yaml"))


def played(steps: int, seed: int = 0, name: str = "talkitout") -> ScenarioVectorEnv:
    envs = socialai_dsl.make_vec(name, num_envs=32)
    envs.reset(seed=seed)
    generator = np.random.default_rng(seed)
    for _ in range(steps):
        envs.step(generator.integers(0, envs.single_action_space.nvec, (32, 4)))
    return envs


@pytest.mark.parametrize("name", ["talkitout", *SAMPLES], ids=lambda name: Path(name).stem)
@pytest.mark.parametrize("steps", one_in(4, [60, 0, 1, 7], "plays every sample once more"))
def test_every_state_of_an_episode_is_sound(name: str, steps: int) -> None:
    envs = played(steps, name=name)
    assert first_unsound(envs.program, envs._table.state.registers) is None


def spoilt(envs: ScenarioVectorEnv, register: int, value: int) -> bytes:
    """A snapshot with one register of row 3 replaced and a digest that fits."""
    envs._table.state.registers[3, register] = value
    return envs.snapshot()


@pytest.mark.parametrize(
    ("register", "value"),
    [
        (FIRST_ENTITY + Field.X, 8),
        (FIRST_ENTITY + Field.Y, -2),
        (FIRST_ENTITY + Field.DIR, 4),
        (Register.LOGGED, 20_000),
        (Register.TOKENS, -1),
        (Register.ROOM, 15),
        (Register.WIDTH, 99),
        (Register.T, -1),
        (Register.OUTCOME, 77),
    ],
)
def test_registers_out_of_range_are_refused(register: int, value: int) -> None:
    data = spoilt(played(5), register, value)
    envs = played(5)
    before = envs.snapshot()
    with pytest.raises(ValueError, match="the snapshot is damaged"):
        envs.restore(data)
    assert envs.snapshot() == before, "a refused snapshot changes nothing"


def test_lines_and_frame_states_are_bounded() -> None:
    envs = played(5)
    program = envs.program
    frame = next(name for name in program.registers if name.path == "wizard.frame")
    for register, value in (
        (program.header(Header.LOG), len(program.lines)),
        (frame.register, frame.high + 1),
    ):
        with pytest.raises(ValueError, match=f"register {register} of row 3"):
            played(5).restore(spoilt(played(5), register, value))


def test_counters_are_part_of_a_snapshot() -> None:
    one = played(60)
    two = socialai_dsl.make_vec("talkitout", num_envs=32)
    two.restore(one.snapshot())
    assert two.counters() == one.counters()
    assert one.counters()["episodes"] > 0


def test_the_digest_is_checked_first() -> None:
    data = bytearray(played(1).snapshot())
    data[len(data) // 2] ^= 1
    with pytest.raises(ValueError, match="digest"):
        played(1).restore(bytes(data))
    assert hashlib.sha256(bytes(data[:-32])).digest() != bytes(data[-32:])
