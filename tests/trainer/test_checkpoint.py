"""Checkpoints survive what may happen to files, and refuse what is not theirs without running any of it."""

import errno
import hashlib
import io
import json
import os
import pickle
import stat
import subprocess
import sys
import zipfile
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.torch
import torch

from socialai_dsl.cli.main import main
from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.checkpoint import Checkpoint, read, restore_net, write
from socialai_dsl.trainer.errors import CheckpointError
from socialai_dsl.trainer.nets import NetSpec
from socialai_dsl.trainer.play import CheckpointPolicy
from socialai_dsl.trainer.ppo import update
from socialai_dsl.trainer.rollout import collect
from socialai_dsl.trainer.session import Session
from tests.trainer.fake_envs import EchoEnvs

ROOT = Path(__file__).parents[2]


@pytest.fixture
def session(small_config: Any) -> Session:
    session = Session.start(small_config(bonus="lang"), EchoEnvs(8))
    update(session, collect(session))
    session.update = 1
    return session


def restored(path: Path, envs: Any) -> Any:
    return restore_net(read(path), NetSpec.of(envs))


def test_reading_gives_back_what_was_written(session: Session, tmp_path: Path) -> None:
    written = session.checkpoint()
    loaded = read(write(tmp_path, written))
    assert loaded.meta == written.meta
    assert loaded.tensors.keys() == written.tensors.keys()
    for name, value in written.tensors.items():
        assert torch.equal(loaded.tensors[name], value), name
        assert loaded.tensors[name].dtype == value.dtype, name


def test_agents_have_one_digest_if_they_have_the_same_weights(session: Session, tmp_path: Path) -> None:
    """Whatever else their files hold, such as what further training needs, and wherever they are."""
    written = session.checkpoint()
    file = write(tmp_path, written)
    checkpoints.write_file(tmp_path / "copy.safetensors", written.network)
    other = dict(written.tensors)
    name = next(name for name in other if name.startswith("net."))
    other[name] = other[name] + 1
    checkpoints.write_file(tmp_path / "other.safetensors", replace(written, tensors=other))
    own = checkpoints.network_digest(file)
    assert own == checkpoints.network_digest(tmp_path / "copy.safetensors")
    assert own != checkpoints.network_digest(str(tmp_path / "other.safetensors"))


def test_everything_a_run_has_to_remember_is_in_it(session: Session) -> None:
    parts = {name.split(".")[0] for name in session.checkpoint().tensors}
    assert parts == {"net", "adam", "state", "step_scale", "bonus", "rng", "envs"}
    adam = session.checkpoint().part("adam")
    assert len(adam) == 3 * len(list(session.actor.net.parameters()))


@pytest.mark.parametrize("keep", [1, 2, 3])
def test_only_the_newest_are_kept_and_leftovers_swept(keep: int, session: Session, tmp_path: Path) -> None:
    for number in range(4):
        (tmp_path / "000000000000007.tmp").write_bytes(b"left by a killed process")
        session.update = number
        write(tmp_path, session.checkpoint(), keep)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [f"{64 * number:015d}.safetensors" for number in range(4 - keep, 4)]
    assert read(tmp_path).meta.update == 3


@pytest.mark.parametrize("keep", [1, 2])
def test_what_was_just_written_stays_beside_a_damaged_newer_file(
    keep: int, session: Session, tmp_path: Path
) -> None:
    newer = [tmp_path / f"{frames:015d}.safetensors" for frames in (500, 10**14)]
    for file in newer:
        file.write_bytes(b"cut")
    for number in range(3):
        session.update = number
        path = write(tmp_path, session.checkpoint(), keep)
        with pytest.warns(UserWarning, match=f"using {path.name} instead"):
            assert read(tmp_path).meta.frames == session.frames
    assert len(list(tmp_path.iterdir())) == keep + len(newer)
    with pytest.raises(ValueError, match="keep: got 0"):
        write(tmp_path, session.checkpoint(), 0)


def test_a_write_is_synced_before_it_is_renamed(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    monkeypatch.setattr(checkpoints.os, "fsync", lambda _: calls.append("fsync"))
    replace = Path.replace

    def note(path: Path, target: Path) -> Path:
        calls.append("rename")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", note)
    write(tmp_path, session.checkpoint())
    assert calls == ["fsync", "rename", "fsync"]


@pytest.mark.parametrize("trials", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_mutated_files_are_refused(trials: int, session: Session, tmp_path: Path) -> None:
    path = write(tmp_path, session.checkpoint())
    good = path.read_bytes()
    rng = np.random.default_rng(0)
    header = int.from_bytes(good[:8], "little")
    for trial in range(trials):
        data = bytearray(good)
        where = int(rng.integers(0, 8 + header if trial % 2 else len(good)))
        kind = trial % 5
        if kind == 0:
            data[where] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            del data[where:]
        elif kind == 2:
            del data[where : where + 1 + int(rng.integers(0, 40))]
        elif kind == 3:
            data[where:where] = rng.bytes(1 + int(rng.integers(0, 40)))
        else:
            data[where : where + 8] = rng.bytes(8)
        if bytes(data) == good:
            continue
        path.write_bytes(data)
        with pytest.raises(CheckpointError) as caught:
            read(path)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


def signed(tensors: dict[str, torch.Tensor], metadata: dict[str, str]) -> bytes:
    """A file by somebody who knows how the digest is made."""
    blank = safetensors.torch.save(tensors, {"sha256": "0" * 64, **metadata})
    place = b'"sha256":"'
    return blank.replace(place + b"0" * 64, place + hashlib.sha256(blank).hexdigest().encode(), 1)


def meta_of(session: Session, **changes: Any) -> dict[str, str]:
    return {"meta": json.dumps(json.loads(session.checkpoint().meta.model_dump_json()) | changes)}


@pytest.mark.parametrize(
    "changes",
    [
        {"format": 3},
        {"surprise": 1},
        {"frames": -1},
        {"vocabulary": 3},
        {"action_sizes": [4, 2]},
        {"config": {"lr": "fast"}},
    ],
)
def test_well_signed_files_of_another_form_are_refused(
    session: Session, tmp_path: Path, changes: Any
) -> None:
    path = tmp_path / "x.safetensors"
    path.write_bytes(signed(dict(session.checkpoint().tensors), meta_of(session, **changes)))
    with pytest.raises(CheckpointError, match=r"x\.safetensors: made by another version"):
        read(path)


def test_a_checkpoint_of_an_earlier_version_says_what_to_do(session: Session, tmp_path: Path) -> None:
    path = tmp_path / "x.safetensors"
    old = {"format": 1, "net": "fast", "config": {"num_envs": 256, "explo": "none"}}
    path.write_bytes(signed(dict(session.checkpoint().tensors), {"meta": json.dumps(old)}))
    with pytest.raises(CheckpointError) as caught:
        read(path)
    assert str(caught.value) == (
        f"{path}: made by another version (format 1, this version reads 2); "
        "train again, or use the version that made it"
    )


def tampered(session: Session, **changes: torch.Tensor | None) -> Checkpoint:
    good = session.checkpoint()
    tensors = {**good.tensors, **{name: value for name, value in changes.items() if value is not None}}
    return Checkpoint(
        good.meta, {name: value for name, value in tensors.items() if changes.get(name, value) is not None}
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"net.cells.bias": torch.zeros(3)}, r"cells.bias: got \(\(3,\)"),
        ({"net.cells.bias": torch.zeros(128, dtype=torch.float64)}, "float64"),
        ({"net.cells.bias": torch.full((128,), torch.nan)}, "not finite"),
        ({"net.cells.bias": None}, "first difference: cells.bias"),
        ({"net.backdoor": torch.zeros(1)}, "first difference: backdoor"),
    ],
)
def test_weights_that_do_not_fit_are_refused(session: Session, changes: Any, message: str) -> None:
    envs = session.envs
    with pytest.raises(CheckpointError, match=message):
        restore_net(tampered(session, **changes), NetSpec.of(envs))


def test_weights_in_half_precision_are_played_in_single(session: Session, tmp_path: Path) -> None:
    written = session.checkpoint()
    halves = {name: value.half() for name, value in written.tensors.items() if name.startswith("net.")}
    path = write(tmp_path, Checkpoint(written.meta, halves))
    for name, value in restored(path, session.envs).state_dict().items():
        assert value.dtype == torch.float32, name
        assert torch.equal(value, written.tensors[f"net.{name}"].half().float()), name


def test_an_agent_plays_what_it_was_trained_on_only_if_it_says_what_that_is(
    session: Session, tmp_path: Path
) -> None:
    path = write(tmp_path, session.checkpoint())
    with pytest.raises(CheckpointError, match="does not say which scenario it is for, expected envs"):
        CheckpointPolicy.load(path)


@pytest.mark.parametrize(
    "name",
    [
        "rng",
        "envs",
        "state.memory",
        "state.image",
        "bonus.keys",
        "adam.step.cells.bias",
        "adam.exp_avg.cells.bias",
    ],
)
@pytest.mark.parametrize("value", [None, torch.zeros(3, 5)])
def test_a_run_does_not_resume_from_incomplete_or_odd_state(
    session: Session, small_config: Any, name: str, value: torch.Tensor | None
) -> None:
    fresh = Session.start(small_config(bonus="lang"), EchoEnvs(8))
    with pytest.raises(CheckpointError, match="cannot continue this run"):
        fresh.load(tampered(session, **{name: value}))


class Payload:
    """Unpickling it writes a file."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return exec, (f"open({str(self.mark)!r}, 'w').close()",)


def write_bombs(folder: Path, mark: Path) -> list[Path]:
    """Files that run code when they are unpickled, and others that are not what they are called."""
    bomb = pickle.dumps(Payload(mark))
    files = {
        "plain.safetensors": bomb,
        "plain.pt": bomb,
        "old_protocol.safetensors": pickle.dumps(Payload(mark), 0),
        "behind_a_header.safetensors": (2).to_bytes(8, "little") + b"{}" + bomb,
        "in_the_header.safetensors": len(bomb).to_bytes(8, "little") + bomb,
        "nothing.safetensors": b"",
        "json.safetensors": b"{}",
        "deep.safetensors": b"[" * 100_000,
        "lies.safetensors": (2**60).to_bytes(8, "little") + b"{}",
    }
    nested = b'{"__metadata__":' + b"[" * 200_000 + b"}"
    files["nested.safetensors"] = len(nested).to_bytes(8, "little") + nested
    for name, data in files.items():
        (folder / name).write_bytes(data)
    torch.save({"weights": Payload(mark)}, folder / "zip.pt")
    torch.save({"weights": Payload(mark)}, folder / "zip.safetensors")
    torch.save(Payload(mark), folder / "legacy.safetensors", _use_new_zipfile_serialization=False)
    with zipfile.ZipFile(folder / "archive.safetensors", "w") as archive:
        archive.writestr("data.pkl", bomb)
    return sorted(folder.iterdir())


def test_pickles_are_never_opened(tmp_path: Path) -> None:
    opened: list[str] = []
    watching = False

    def audit(event: str, args: tuple[Any, ...]) -> None:
        if watching and event in ("pickle.find_class", "exec", "compile", "os.system", "subprocess.Popen"):
            opened.append(event)

    sys.addaudithook(audit)
    folder, mark = tmp_path / "bombs", tmp_path / "mark"
    folder.mkdir()
    bombs = write_bombs(folder, mark)
    watching = True
    try:
        for bomb in bombs:
            with pytest.raises(CheckpointError) as caught:
                read(bomb)
            assert str(bomb) in str(caught.value)
        with pytest.raises(CheckpointError):
            read(folder)
    finally:
        watching = False
    assert opened == []
    assert not mark.exists()
    pickle.loads((folder / "plain.pt").read_bytes())
    assert mark.exists(), "the bombs are live"


def test_the_command_line_refuses_a_bomb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, mark = tmp_path / "bombs", tmp_path / "mark"
    folder.mkdir()
    write_bombs(folder, mark)
    for name in ("plain.pt", "zip.safetensors"):
        assert main(["run", "help", "--agent", str(folder / name), "--out", str(tmp_path / name)]) == 2
        said = capsys.readouterr().err
        assert str(folder / name) in said
        assert "Traceback" not in said
    assert not mark.exists()


# --- writing ---


KILLED_WHILE_WRITING = f"""
import json, os, random, signal, sys, time, warnings
sys.path.insert(0, {str(ROOT)!r})
from pathlib import Path
from tests.trainer.fake_envs import EchoEnvs
from socialai_dsl.trainer.checkpoint import Checkpoint, read, write
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.session import Session

folder, kills = Path(sys.argv[1]), int(sys.argv[2])
config = RunConfig(envs=8, horizon=8, minibatches=2, threads=1)
good = Session.start(config, EchoEnvs(8)).checkpoint()
rng = random.Random(0)
warnings.simplefilter("error")  # to fall back to an older file is only a warning

def numbered(number):
    changes = {{"frames": number, "update": number}}
    return Checkpoint(good.meta.model_copy(update=changes), good.tensors)

def whole(number):
    return (folder / f"{{number:015d}}.safetensors").exists()

last, hit = 0, 0
write(folder, numbered(last))
for _ in range(kills):
    child = os.fork()
    if child == 0:
        number = last
        while True:
            number += 1
            write(folder, numbered(number))
    # By what has been written, not by time, because a busy machine may take long: in the first or second file.
    wanted, begun = last + rng.randrange(2), time.monotonic()
    while not (whole(wanted) and any(folder.glob("*.tmp"))) and time.monotonic() < begun + 60:
        time.sleep(0.0005)
    time.sleep(rng.random() * 0.01)
    os.kill(child, signal.SIGKILL)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    hit += any(folder.glob("*.tmp"))
    newest = read(folder)
    assert newest.meta.frames >= last, "what was there is still there"
    assert all((value == good.tensors[name]).all() for name, value in newest.tensors.items())
    last = newest.meta.frames
write(folder, numbered(last + 1))
print(json.dumps({{"hit": hit, "written": last, "files": sorted(path.name for path in folder.iterdir())}}))
"""


@pytest.mark.thorough("starts or kills many writers")
def test_kills_while_writing_leave_no_unreadable_file(tmp_path: Path) -> None:
    """A process that does nothing but write is killed 50 times, many of them in the middle of a file."""
    result = subprocess.run(
        [sys.executable, "-c", KILLED_WHILE_WRITING, str(tmp_path), "50"],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["hit"] >= 10, "the kills landed in the middle of writing"
    assert found["written"] >= 10, "whole files were written between the kills"
    assert found["files"] == [f"{found['written'] + n:015d}.safetensors" for n in (0, 1)]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EROFS, errno.EDQUOT])
@pytest.mark.parametrize("operation", ["open", "write", "fsync", "rename", "fsync of the folder"])
@pytest.mark.thorough("starts or kills many writers")
def test_a_write_that_fails_leaves_the_last_one_valid(
    operation: str, number: int, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, session.checkpoint())
    session.update = 2

    def fail(*_: Any, **__: Any) -> Any:
        raise OSError(number, os.strerror(number))

    class Full(io.BytesIO):
        write = fail

    def fail_on_folders(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            fail()

    with monkeypatch.context() as broken:
        if operation in ("open", "write"):
            broken.setattr(Path, "open", fail if operation == "open" else lambda *_, **__: Full())
        elif operation == "rename":
            broken.setattr(Path, "replace", fail)
        else:
            broken.setattr(checkpoints.os, "fsync", fail if operation == "fsync" else fail_on_folders)
        with pytest.raises(OSError, match=os.strerror(number)):
            write(tmp_path, session.checkpoint())
    kept = read(tmp_path)
    assert kept.meta.update == (2 if operation == "fsync of the folder" else 1)
    assert not list(tmp_path.glob("*.tmp"))
    write(tmp_path, session.checkpoint())
    assert read(tmp_path).meta.update == 2


def test_missing_files_and_empty_folders_are_checkpoint_errors(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="cannot be read"):
        read(tmp_path / "nowhere.safetensors")
    with pytest.raises(CheckpointError, match="no checkpoint in this directory"):
        read(tmp_path)


def test_a_damaged_newest_file_falls_back_to_the_one_before(session: Session, tmp_path: Path) -> None:
    older = write(tmp_path, session.checkpoint())
    session.update = 2
    newer = write(tmp_path, session.checkpoint())
    newer.write_bytes(newer.read_bytes()[:-1])
    with pytest.warns(UserWarning, match=f"damaged.*using {older.name} instead"):
        assert read(tmp_path).meta.update == 1


def test_words_are_moved_by_spelling(session: Session, tmp_path: Path) -> None:
    path = write(tmp_path, session.checkpoint())
    envs = EchoEnvs(2)
    envs.program.vocabulary = ["<pad>", "<unk>", "say", "novel", "voice", *envs.vocabulary[4:-1]]
    old = session.actor.net.dialogue.embedding.weight
    with pytest.warns(UserWarning, match=r"never met: novel\)"):
        net = restored(path, envs)
    new = net.dialogue.embedding.weight
    assert torch.equal(new[2], old[3])
    assert torch.equal(new[4], old[2])
    assert torch.equal(new[5], old[4])


def test_words_of_letters_are_moved_by_their_own_spelling(small_config: Any, tmp_path: Path) -> None:
    """The embedding of the paper's network has a row for each run of letters, not for each word of the scenario."""
    envs = EchoEnvs(8)
    envs.program.vocabulary = ["<pad>", "<unk>", "voice", "say", "it's", "2", "two2", "you", "la", "di"]
    session = Session.start(small_config(net="paper-reference"), envs)
    path = write(tmp_path, session.checkpoint())
    other = EchoEnvs(2)
    other.program.vocabulary = ["<pad>", "<unk>", "two", "5", "la", "it", "novel", "voice", "s"]
    with pytest.warns(UserWarning, match="vocabulary differs"):
        net = restored(path, other)
    old, new = rows_by_word(session.actor.net), rows_by_word(net)
    shared = {"", "this", "is", "what", "you", "hear", "two", "la", "it", "voice", "s"}
    assert set(new) == shared | {"novel"}
    for word in shared:
        assert torch.equal(new[word], old[word]), word
    assert net.reader.words.index("two") != session.actor.net.reader.words.index("two")


def rows_by_word(net: Any) -> dict[str, torch.Tensor]:
    return dict(zip(net.reader.words, net.dialogue.embedding.weight.detach(), strict=False))


@pytest.mark.parametrize(
    ("speakers", "whose"),
    [
        ("bob ann", {"ann": "ann", "bob": "bob"}),
        ("ann cid", {"ann": "ann", "cid": "bob"}),
        ("ann cid dee", {"ann": "ann", "cid": "bob", "dee": "bob"}),
        ("cid ann bob", {"ann": "ann", "bob": "bob", "cid": "ann bob"}),
        ("bob", {"bob": "bob"}),
    ],
)
@pytest.mark.parametrize("net", ["speakers", "relations"])
def test_what_belongs_to_speakers_follows_their_names(
    net: str, speakers: str, whose: dict[str, str], small_config: Any, tmp_path: Path
) -> None:
    """One whom the agent never heard is the mean of those who are gone, or, if nobody is, of all."""

    def heard(*names: str) -> EchoEnvs:
        envs = EchoEnvs(8)
        envs.program.vocabulary = ["<pad>", "<unk>", *(f"<{name}>" for name in names), *names, "red", "yes"]
        return envs

    session = Session.start(small_config(net=net), heard("ann", "bob"))
    path, names = write(tmp_path, session.checkpoint()), speakers.split()
    with pytest.warns(UserWarning, match="vocabulary differs") if "cid" in names else nullcontext():
        made = restored(path, heard(*names))
    old, word = session.actor.net, {"ann": 0, "bob": 1}
    assert made.speaker_axes
    for name, axis in made.speaker_axes.items():
        before = old.get_parameter(name).detach().unbind(axis)
        for place, after in enumerate(made.get_parameter(name).detach().unbind(axis)):
            wanted = torch.stack([before[word[one]] for one in whose[names[place]].split()]).mean(0)
            rows = slice(-2, None) if name in made.word_rows else slice(None)  # the words that both have
            assert torch.equal(after[rows], wanted[rows]), (name, names[place])


def test_a_vocabulary_that_the_network_has_no_room_for_is_refused(small_config: Any) -> None:
    session = Session.start(small_config(net="paper-reference"), EchoEnvs(8))
    good = session.checkpoint()
    many = ["<pad>", "<unk>", *(a + b for a in "bcdfgjklmn" for b in "opqrstuvwx")]
    meta = good.meta.model_copy(update={"vocabulary": many})
    with (
        pytest.warns(UserWarning, match="vocabulary differs"),
        pytest.raises(CheckpointError, match="vocabulary does not fit its network"),
    ):
        restore_net(Checkpoint(meta, good.tensors), NetSpec.of(session.envs))


def test_images_of_another_shape_are_refused(session: Session, tmp_path: Path) -> None:
    path = write(tmp_path, session.checkpoint())
    spec = replace(NetSpec.of(session.envs), image_shape=(7, 7, 6), image_high=(12, 5, 3, 3, 1, 1))
    with pytest.raises(CheckpointError, match=r"images \(7, 7, 4\).*has \(7, 7, 6\)"):
        restore_net(read(path), spec)


def test_another_order_of_the_same_words_changes_nothing_but_the_rows(
    session: Session, tmp_path: Path
) -> None:
    path = write(tmp_path, session.checkpoint())
    envs = EchoEnvs(2)
    envs.program.vocabulary = [*envs.vocabulary[:2], *reversed(envs.vocabulary[2:])]
    net = restored(path, envs)
    old = session.actor.net.dialogue.embedding.weight
    assert torch.equal(net.dialogue.embedding.weight[2:], old[2:].flip(0))


def test_other_actions_or_images_are_refused(session: Session, tmp_path: Path) -> None:
    path = write(tmp_path, session.checkpoint())
    with pytest.raises(CheckpointError, match=r"actions \(4, 2, 2, 4\).*has \(4, 2, 2, 5\)"):
        restored(path, EchoEnvs(2, nouns=5))


def test_a_file_does_not_choose_what_is_imported(session: Session) -> None:
    good = session.checkpoint()
    meta = good.meta.model_copy(update={"config": good.meta.config.model_copy(update={"net": "this:That"})})
    envs = session.envs
    with pytest.raises(CheckpointError, match="name it"):
        restore_net(Checkpoint(meta, good.tensors), NetSpec.of(envs))
    assert "this" not in sys.modules


def test_a_run_resumes_only_with_the_same_settings_and_scenario(session: Session, small_config: Any) -> None:
    good = session.checkpoint()
    other = Session.start(small_config(bonus="lang", lr=1e-3), EchoEnvs(8))
    with pytest.raises(CheckpointError, match=r"changed: lr: 0\.0007 -> 0\.001"):
        other.load(good)
    envs = EchoEnvs(8)
    envs.program.sha256 = "1" * 64
    with pytest.raises(CheckpointError, match="scenario has changed"):
        Session.start(small_config(bonus="lang"), envs).load(good)
    free = small_config(bonus="lang", frames=10_000, checkpoint_every=9, keep_checkpoints=5)
    Session.start(free, EchoEnvs(8)).load(good)


@pytest.mark.parametrize("schedule", [{"lr_end": 1e-4}, {"clip_end": 0.1}, {"guide": "script"}])
def test_more_frames_are_another_run_where_schedules_reach_to_the_last(
    schedule: Any, small_config: Any
) -> None:
    good = Session.start(small_config(frames=640, **schedule), EchoEnvs(8)).checkpoint()
    with pytest.raises(
        CheckpointError, match=r"changed: frames: 640 -> 704 \(a guide, a schedule, or your own"
    ):
        Session.start(small_config(frames=704, **schedule), EchoEnvs(8)).load(good)
