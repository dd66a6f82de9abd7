"""An agent that plays something else than it was trained on says what differs."""

import warnings
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.trainer.checkpoint import CheckpointMeta, write
from socialai_dsl.trainer.play import CheckpointPolicy, TransferWarning, warn_of_differences
from socialai_dsl.trainer.session import Session
from tests.trainer.fake_envs import EchoEnvs


def meta_of(small_config: Any, **changes: Any) -> CheckpointMeta:
    meta = Session.start(small_config(), EchoEnvs(8)).checkpoint().meta
    return meta.model_copy(update=changes)


def test_at_home_nothing_is_said(small_config: Any, tmp_path: Path) -> None:
    path = write(tmp_path, Session.start(small_config(), EchoEnvs(8)).checkpoint())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        CheckpointPolicy.load(path, EchoEnvs(3))


def test_what_differs_is_listed(small_config: Any) -> None:
    meta = meta_of(small_config, program_sha256="1" * 64, templates=["ask <noun>", "shout <noun>"])
    with pytest.warns(TransferWarning) as caught:
        warn_of_differences(meta, EchoEnvs(1).program)
    assert [str(warning.message) for warning in caught] == [
        "the agent was trained on echo (program 11111111) and plays echo (00000000); "
        'templates: 1: "shout <noun>" is now "say <noun>"'
    ]


def test_long_lists_are_cut(small_config: Any) -> None:
    old = [f"old{i}" for i in range(9)]
    meta = meta_of(small_config, program_sha256="1" * 64, nouns=old)
    with pytest.warns(TransferWarning, match=r'0: "old0" is now "word0".* 9 are now 4'):
        warn_of_differences(meta, EchoEnvs(1).program)
    many = EchoEnvs(1, nouns=9).program
    with pytest.warns(TransferWarning, match=r'5: "old5" is now "word5" and 3 more$'):
        warn_of_differences(meta, many)
