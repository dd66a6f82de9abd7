"""Checkpoints: safetensors with JSON metadata and a digest, replaced atomically."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import safetensors.torch
import torch
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from safetensors import SafetensorError
from torch import Tensor

from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.errors import CheckpointError
from socialai_dsl.trainer.files import CHECKPOINTS, SUFFIX, checkpoint_files
from socialai_dsl.trainer.nets import ActorCritic, NetSpec, build_net
from socialai_dsl.trainer.nets.lines import marks
from socialai_dsl.trainer.shipped import located

FORMAT = 2
_HEADER_LIMIT = 1_000_000
_FILE_LIMIT = 8_000_000_000
_NO_DIGEST = "0" * 64


class CheckpointMeta(BaseModel):
    """The metadata of a checkpoint.

    Attributes:
        format: version of this layout.
        config: the run's options, its network's name among them.
        action_sizes, image_shape: what the weights were made for.
        vocabulary: words by token id.
        program_sha256: digest of the compiled scenario.
        scenario: its name. actions, templates, nouns: what the choices of the agent's action mean in it.
        frames, update: how far the run had come.
        torch_version: version that wrote it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: Literal[2] = 2
    config: RunConfig
    action_sizes: tuple[int, ...] = Field(min_length=3, max_length=16)
    image_shape: tuple[int, int, int]
    vocabulary: list[str] = Field(max_length=100_000)
    program_sha256: str = Field(max_length=64)
    scenario: str = Field(max_length=10_000)
    actions: list[str] = Field(max_length=1_000)
    templates: list[str] = Field(max_length=10_000)
    nouns: list[str] = Field(max_length=10_000)
    frames: int = Field(ge=0)
    update: int = Field(ge=0)
    torch_version: str = Field(max_length=100)


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint in memory: metadata, and tensors by dotted name.

    Names: `net.*`, `adam.*`, `state.*`, `step_scale`, `rng`, `envs`, and where there is one `curriculum`, `guide`,
    `bonus.*`, `aux.*` with `aux_adam.*`, `algorithm.*`, `partners.*`.
    """

    meta: CheckpointMeta
    tensors: dict[str, Tensor]

    @property
    def network(self) -> Checkpoint:
        """The same without what only further training needs."""
        return Checkpoint(self.meta, {n: value for n, value in self.tensors.items() if n.startswith("net.")})

    def has_network_of(self, other: Checkpoint) -> bool:
        """Whether both have the same weights."""
        own, others = self.part("net"), other.part("net")
        return own.keys() == others.keys() and all(torch.equal(own[name], others[name]) for name in own)

    def part(self, prefix: str) -> dict[str, Tensor]:
        """The tensors under `prefix.`, without it."""
        start = prefix + "."
        return {name[len(start) :]: value for name, value in self.tensors.items() if name.startswith(start)}


def write(directory: Path, checkpoint: Checkpoint, keep: int = 2) -> Path:
    """Write `directory/<frames>.safetensors`, and sweep leftovers of writes that were killed.

    Kept are this checkpoint, the `keep - 1` before it, and any with more frames: a damaged one from before, say, which
    the run writes again when it gets there. The file appears under its name only when all of it is on the disk.

    Raises:
        OSError: it cannot be written, for example because the disk is full; earlier checkpoints are untouched.
        ValueError: `keep` is less than 1.
    """
    if keep < 1:
        raise ValueError(f"keep: got {keep}, expected at least 1")
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / f"{checkpoint.meta.frames:015d}{SUFFIX}"
    write_file(path, checkpoint)
    written = [file for file in checkpoint_files(directory) if file <= path]
    for old in [*written[:-keep], *directory.glob("*.tmp")]:
        old.unlink(missing_ok=True)
    return path


def write_file(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint to a file of any name, which appears only when all of it is on the disk.

    Raises:
        OSError: it cannot be written.
    """
    temporary = path.with_suffix(".tmp")
    try:
        with temporary.open("wb") as file:
            file.write(_encode(checkpoint))
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)  # of the new name
    finally:
        os.close(descriptor)


def _encode(checkpoint: Checkpoint) -> bytes:
    """The file's bytes; the digest is that of the same bytes with zeros in its place."""
    tensors = {name: value.detach().cpu().contiguous() for name, value in checkpoint.tensors.items()}
    metadata = {"meta": checkpoint.meta.model_dump_json(), "sha256": _NO_DIGEST}
    blank = safetensors.torch.save(tensors, metadata)
    return _with_digest(blank, hashlib.sha256(blank).hexdigest())


def _with_digest(data: bytes, digest: str) -> bytes:
    """Replace the digest in the header."""
    start = data.index(b'"sha256":"') + len(b'"sha256":"')
    return data[:start] + digest.encode() + data[start + len(digest) :]


def read(path: Path) -> Checkpoint:
    """Read a checkpoint file, or the newest intact one of a directory.

    Raises:
        CheckpointError: there is none, it is damaged, or it is not one of ours.
    """
    if not path.is_dir():
        return _read_file(path)
    failures = []
    for candidate in reversed(checkpoint_files(path)):
        try:
            checkpoint = _read_file(candidate)
        except CheckpointError as error:
            failures.append(str(error))
            continue
        for failure in failures:
            warnings.warn(f"{failure}; using {candidate.name} instead", stacklevel=2)
        return checkpoint
    raise CheckpointError("; ".join(failures) or f"{path}: there is no checkpoint in this directory")


def read_agent(agent: Path | str) -> Checkpoint:
    """Read the newest checkpoint of an agent: `shipped:NAME`, a run's folder, or what `read` takes.

    Raises:
        CheckpointError: see `read`.
        ValueError: no agent of this name ships.
    """
    path = located(agent)
    saved = path / CHECKPOINTS
    return read(saved if saved.is_dir() else path)


def network_digest(agent: Path | str) -> str:
    """SHA-256 of an agent's weights, which its copies share.

    Raises:
        CheckpointError, ValueError: see `read_agent`.
    """
    weights = {name: value.contiguous() for name, value in read_agent(agent).part("net").items()}
    return hashlib.sha256(safetensors.torch.save(weights)).hexdigest()


def _read_file(path: Path) -> Checkpoint:
    try:
        if path.stat().st_size > _FILE_LIMIT:
            raise CheckpointError(f"{path}: larger than a checkpoint can be")
        data = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error.strerror}") from error
    try:
        size = int.from_bytes(data[:8], "little")
        if not 2 <= size <= min(_HEADER_LIMIT, len(data) - 8):
            raise CheckpointError(f"{path}: not a checkpoint (no safetensors header)")
        metadata = json.loads(data[8 : 8 + size])["__metadata__"]
        digest, described = metadata["sha256"], metadata["meta"]
        # The digest must be where the writer puts it: the first match in the bytes, inside the header.
        blank = _with_digest(data, _NO_DIGEST)
        if hashlib.sha256(blank).hexdigest() != digest or _with_digest(blank, digest) != data:
            raise CheckpointError(f"{path}: damaged (its SHA-256 digest does not match)")
        made_by = json.loads(described).get("format")
        if made_by != FORMAT:
            raise CheckpointError(
                f"{path}: made by another version (format {made_by}, this version reads {FORMAT}); train again, or use "
                "the version that made it"
            )
        meta = CheckpointMeta.model_validate_json(described)
        return Checkpoint(meta, safetensors.torch.load(data))
    except CheckpointError:
        raise
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise CheckpointError(f"{path}: made by another version ({where}: {first['msg']})") from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, SafetensorError) as error:
        raise CheckpointError(f"{path}: not a checkpoint of this trainer, or damaged") from error


def restore_net(
    checkpoint: Checkpoint, spec: NetSpec, net: str | None = None, folder: Path = Path()
) -> ActorCritic:
    """Build the checkpoint's network for environments described by `spec`.

    Word embeddings follow the spelling; words the checkpoint never met keep fresh ones, and a warning lists
    them.

    Args:
        checkpoint: result of `read`.
        spec: spaces and words of the environments it is to play.
        net: name of the network, needed if it is not a shipped one, because a file must not choose what is imported.
        folder: where the file of such a network is looked for first.

    Raises:
        CheckpointError: actions or images have another shape, or the weights are not those of the network.
    """
    meta = checkpoint.meta
    for what, made, wanted in (
        ("actions", meta.action_sizes, spec.action_sizes),
        ("images", meta.image_shape, spec.image_shape),
    ):
        if made != wanted:
            raise CheckpointError(f"checkpoint is for {what} {made}, but the scenario has {wanted}")
    name = meta.config.net
    if ":" in name and net != name:
        raise CheckpointError(
            f"checkpoint was made with the network {name}; name it (--net {name}) to load that code"
        )
    model = build_net(name, spec, meta.config.seed, meta.config.precision, folder)
    weights = _widened(checkpoint.part("net"), model.state_dict())
    if list(spec.vocabulary) != meta.vocabulary:
        _warn_of_words(set(spec.vocabulary) - set(meta.vocabulary))
        _move_words(weights, model, meta.vocabulary)
    _check_weights(weights, model.state_dict())
    model.load_state_dict(weights)
    return model


def _warn_of_words(new: set[str]) -> None:
    """Warn of words that the agent never met; those that it knows are moved, and those it does not need do no harm."""
    if new:
        said = f"the checkpoint's vocabulary differs (new words it never met: {', '.join(sorted(new))})"
        warnings.warn(said, stacklevel=4)


def _move_words(weights: dict[str, Tensor], model: ActorCritic, vocabulary: list[str]) -> None:
    """Rearrange the rows that belong to words from the checkpoint's vocabulary to that of the model."""
    try:
        old = model.reader_class(vocabulary).words
    except ValueError as error:
        raise CheckpointError(f"checkpoint's vocabulary does not fit its network: {error}") from error
    _move_speakers(weights, model, old)
    position = {word: index for index, word in enumerate(old)}
    for name in model.word_rows:
        source, fresh = weights.get(name), model.state_dict()[name].clone()
        if source is None or source.shape[1:] != fresh.shape[1:] or len(source) < len(old):
            raise CheckpointError(f"checkpoint's {name} does not fit its vocabulary")
        for index, word in enumerate(model.reader.words):
            if word in position:
                fresh[index] = source[position[word]]
        weights[name] = fresh


def _move_speakers(weights: dict[str, Tensor], model: ActorCritic, old: Sequence[str]) -> None:
    """Rearrange the slices that belong to speakers.

    One whom the agent never heard is the mean of those that are gone, whose place it may have, or, if none is, of all.
    """
    words = model.reader.words
    known, there = [old[mark] for mark in marks(old)], [words[mark] for mark in marks(words)]
    gone = [speaker for speaker in known if speaker not in there] or known
    for name, axis in model.speaker_axes.items():
        source = weights.get(name)
        if not known or source is None or source.dim() <= axis or source.shape[axis] != len(known):
            raise CheckpointError(f"checkpoint's {name} does not fit its speakers")
        own = dict(zip(known, source.unbind(axis), strict=True))
        stranger = torch.stack([own[speaker] for speaker in gone]).mean(0)
        weights[name] = torch.stack([own.get(speaker, stranger) for speaker in there], axis)


def _widened(weights: dict[str, Tensor], expected: dict[str, Tensor]) -> dict[str, Tensor]:
    """Weights that are kept in half precision, as those of shipped agents are, as float32 where that is expected."""
    wide = {name for name, value in expected.items() if value.dtype == torch.float32}
    return {
        name: value.float() if value.dtype == torch.float16 and name in wide else value
        for name, value in weights.items()
    }


def _check_weights(weights: dict[str, Tensor], expected: dict[str, Tensor]) -> None:
    """Refuse tensors that are missing, unknown, of another shape or type, or not finite."""
    unlike = sorted(weights.keys() ^ expected.keys())
    if unlike:
        raise CheckpointError(
            f"checkpoint's weights are not those of its network (first difference: {unlike[0]})"
        )
    for name, wanted in expected.items():
        if not bool(torch.isfinite(fitting(weights, name, wanted)).all()):
            raise CheckpointError(f"checkpoint's {name} holds numbers that are not finite")


def fitting(tensors: dict[str, Tensor], name: str, wanted: Tensor) -> Tensor:
    """The tensor of this name. Raises CheckpointError unless it has the shape and type of the one wanted."""
    value = tensors[name]
    got, needed = ((tuple(one.shape), one.dtype) for one in (value, wanted))
    if got != needed:
        raise CheckpointError(f"checkpoint's {name}: got {got}, expected {needed}")
    return value
