"""The state of a training run, into a checkpoint and back."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from torch import Tensor, nn

from socialai_dsl.trainer import checkpoint as checkpoints
from socialai_dsl.trainer.algorithm import Algorithm
from socialai_dsl.trainer.auxiliary import AuxiliaryLoss, build_auxiliary
from socialai_dsl.trainer.bonus import Bonus, build_bonus
from socialai_dsl.trainer.checkpoint import Checkpoint, CheckpointMeta, fitting, restore_net
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.curricula import Curriculum, Leaves, Tutor, build_curriculum
from socialai_dsl.trainer.errors import CheckpointError, ObservationError, TrainingStopped
from socialai_dsl.trainer.features import Actor, Int64
from socialai_dsl.trainer.files import CHECKPOINTS, checkpoint_files
from socialai_dsl.trainer.guides import Guide, build_guide
from socialai_dsl.trainer.nets import NetSpec, build_net

Mapper = Callable[..., Iterable[Any]]
"""`map`, or that of a pool of threads."""

_ADAM = ("step", "exp_avg", "exp_avg_sq")
_MOMENTS = {"net": "adam", "aux": "aux_adam"}  # where a checkpoint has them
_NEEDED = (
    "program",
    "counters",
    "image_ids",
    "history_ids",
    "utterance_ids",
    "scripted_actions",
    "snapshot",
    "restore",
)
_WORDS = ("actions", "templates", "nouns", "vocabulary")


def _seats_of(envs: Any) -> int:
    """How many rows of a vector environment play one game."""
    return int(envs.num_envs) // int(getattr(envs, "num_games", envs.num_envs))


def session_of(envs: Any) -> int:
    """The number of successive episodes that share draws, which an agent remembers."""
    return int(getattr(envs.program, "session", 1))


def _partners_in(envs: Any) -> Mapping[str, Any]:
    """The policies that fill other seats of a vector environment than those that learn."""
    found: Mapping[str, Any] = getattr(envs, "partners", {})
    return found


@dataclass
class State:
    """The environments as the agent last met them: what one rollout hands to the next.

    Attributes:
        image: uint8 (E, *sight.shape), tokens: int16 (E, L): the current observation, the image as the net sees it.
        starts: bool (E,), whether the current observation begins an episode.
        trials: int64 (E,), how many episodes of the running session have ended.
        memory: float32 (E, *shape), before the current observation.
        seen: int64 (E, sight.size), what the network's sight keeps of the running episodes.
        returns: float64 (E,), lengths: int64 (E,) of the running episodes.
        led: bool (E,), whether a guide took part in the running episode.
    """

    image: NDArray[np.uint8]
    tokens: NDArray[np.int16]
    starts: NDArray[np.bool_]
    trials: Int64
    memory: Tensor
    seen: Int64
    returns: NDArray[np.float64]
    lengths: Int64
    led: NDArray[np.bool_]

    @property
    def forgets(self) -> NDArray[np.bool_]:
        """Which memories are emptied before the current observation: where a session begins; bool (E,)."""
        forgets: NDArray[np.bool_] = self.starts & (self.trials == 0)
        return forgets


@dataclass
class Session:
    """A run between two updates; equal sessions have equal futures on the same CPU with the same number of threads.

    Attributes:
        program: of the scenario that the agent is for.
        update: updates made.
        step_scale: factor of the learning rate; below 1 after updates that left the trust region.
        generator: the one source of the trainer's randomness.
        algorithm: plays and learns, once the run has begun.
        mapper: does the work of threads; `map` where there is one.
    """

    config: RunConfig
    envs: Any
    program: Any
    actor: Actor
    optimizer: torch.optim.Adam
    state: State
    generator: torch.Generator
    bonus: Bonus | None = None
    tutor: Tutor | None = None
    guide: Guide | None = None
    aux: AuxiliaryLoss | None = None
    algorithm: Algorithm | None = None
    update: int = 0
    step_scale: float = 1.0
    mapper: Mapper = map

    @property
    def frames(self) -> int:
        """Environment steps made, all environments together."""
        return self.update * self.config.frames_per_update

    @property
    def seats(self) -> int:
        """How many environments play one game, each of them from another seat."""
        return _seats_of(self.envs)

    @property
    def progress(self) -> float:
        """Share of the run's frames made so far, 0 to 1."""
        return min(self.frames / self.config.frames, 1.0)

    @property
    def now(self) -> RunConfig:
        """The configuration with the present values of the options that change during the run."""
        return self.config.at(self.update)

    @classmethod
    def start(cls, config: RunConfig, envs: Any, program: Any = None) -> Session:
        """Begin a run: fresh weights, environments reset with the run's seed.

        Raises:
            ValueError: the environments do not fit the configuration or the program, or are not of the form the
                trainer learns.
        """
        _check_options(config)
        _check_form(config, envs)
        if program is not None:
            _check_alike(program, envs.program)
        folder = config.code_folder
        net = build_net(config.net, NetSpec.of(envs), config.seed, config.precision, folder).to(config.device)
        tutor = None
        if config.curriculum != "none":
            tutor = Tutor(build_curriculum(config.curriculum, Leaves.of(envs), folder), envs)
        bonus = build_bonus(config, config.envs)
        games = config.envs // _seats_of(envs)
        observation, _ = envs.reset(seed=config.seed, options={"index": list(range(games))})
        guide = build_guide(config, envs)
        if tutor is not None:
            tutor.begin()
        seen = np.zeros((config.envs, net.sight.size), np.int64)
        image, seen = net.sight.look(observation["image"].copy(), observation["tokens"], seen)
        state = State(
            image=image,
            tokens=observation["tokens"].copy(),
            starts=np.ones(config.envs, np.bool_),
            trials=np.zeros(config.envs, np.int64),
            memory=net.memory.initial(config.envs),
            seen=seen,
            returns=np.zeros(config.envs),
            lengths=np.zeros(config.envs, np.int64),
            led=np.zeros(config.envs, np.bool_),
        )
        aux = build_auxiliary(config, net)
        learnt = [*net.parameters(), *(() if aux is None else aux.parameters())]
        optimizer = torch.optim.Adam(learnt, config.lr, (0.9, config.adam_beta2), config.adam_eps, fused=True)
        generator = torch.Generator().manual_seed(config.seed)
        actor = Actor(net, state.tokens.shape[1])
        program = envs.program if program is None else program
        return cls(config, envs, program, actor, optimizer, state, generator, bonus, tutor, guide, aux)

    def checkpoint(self) -> Checkpoint:
        """Everything needed to continue exactly."""
        net, program = self.actor.net, self.program
        tensors: dict[str, Tensor] = {}
        for trained, module in self.modules.items():
            tensors |= {f"{trained}.{name}": value for name, value in module.state_dict().items()}
            for name, parameter in module.named_parameters():
                for key, value in self.optimizer.state.get(parameter, {}).items():
                    tensors[f"{_MOMENTS[trained]}.{key}.{name}"] = value
        for name, part in self._parts_in_json():
            tensors[name] = _json_tensor(name, part.state())
        if self.bonus is not None:
            tensors |= _array_tensors("bonus", self.bonus.state())
        if self.algorithm is not None:
            tensors |= _array_tensors("algorithm", self.algorithm.state())
        for name, value in vars(self.state).items():
            tensors[f"state.{name}"] = torch.as_tensor(value)
        tensors["step_scale"] = torch.tensor(self.step_scale, dtype=torch.float64)
        for name, partner in self._partners():
            tensors |= _array_tensors(name, partner.state())
        tensors["rng"] = self.generator.get_state()
        tensors["envs"] = _as_tensor(self.envs.snapshot())
        meta = CheckpointMeta(
            config=self.config,
            action_sizes=net.spec.action_sizes,
            image_shape=net.spec.image_shape,
            program_sha256=program.sha256,
            scenario=program.name,
            **{name: list(getattr(program, name)) for name in _WORDS},
            frames=self.frames,
            update=self.update,
            torch_version=str(torch.__version__),
        )
        return Checkpoint(meta, tensors)

    @property
    def modules(self) -> dict[str, nn.Module]:
        """What the optimizer trains, by the names under which a checkpoint has it: the network, an auxiliary loss."""
        return {"net": self.actor.net} | ({} if self.aux is None else {"aux": self.aux})

    def _partners(self) -> list[tuple[str, Any]]:
        """The policies on other seats, by the names that their states have in a checkpoint."""
        return [(f"partners.{name}", policy) for name, policy in _partners_in(self.envs).items()]

    def begin_update(self) -> None:
        """Let partners go on from their states, as they do in a resumed run.

        What they keep besides, such as features of earlier frames, decides how later ones are rounded.
        """
        for _, partner in self._partners():
            partner.load_state(partner.state())

    def _parts_in_json(self) -> list[tuple[str, Curriculum | Guide]]:
        """Curriculum and guide, if there are any, by the names that their states have in a checkpoint."""
        parts = (("curriculum", getattr(self.tutor, "curriculum", None)), ("guide", self.guide))
        return [(name, part) for name, part in parts if part is not None]

    def save(self, run_dir: Path) -> Path:
        """Write a checkpoint into a run's folder and return its path."""
        return checkpoints.write(run_dir / CHECKPOINTS, self.checkpoint(), self.config.keep_checkpoints)

    def resume(self, run_dir: Path) -> None:
        """Continue from the newest intact checkpoint in a run's folder; see `load`."""
        folder = run_dir / CHECKPOINTS
        if not folder.is_dir():
            raise CheckpointError(f"{run_dir}: nothing to resume, there are no checkpoints")
        self.load(checkpoints.read(folder))

    def load(self, checkpoint: Checkpoint) -> None:
        """Continue from a checkpoint of this very run, in a session begun with the same configuration.

        Raises:
            CheckpointError: it is of another scenario, of other options, or incomplete.
        """
        self._check_same_run(checkpoint.meta)
        spec, config = self.actor.net.spec, self.config
        net = restore_net(checkpoint, spec, config.net, config.code_folder)
        try:
            self.actor.net.load_state_dict(net.state_dict())
            if self.aux is not None:
                self._load_auxiliary(self.aux, checkpoint.part("aux"))
            for trained, module in self.modules.items():
                self._load_adam(module, checkpoint.part(_MOMENTS[trained]))
            self._load_state(checkpoint.part("state"))
            self.step_scale = float(
                fitting(checkpoint.tensors, "step_scale", torch.zeros((), dtype=torch.float64))
            )
            self.generator.set_state(checkpoint.tensors["rng"])
            if self.bonus is not None:
                self.bonus.load_state({k: v.numpy() for k, v in checkpoint.part("bonus").items()})
            if self.algorithm is not None:
                self.algorithm.load_state(checkpoint.part("algorithm"))
            self.envs.restore(checkpoint.tensors["envs"].numpy().tobytes())
            for name, partner in self._partners():
                partner.load_state({k: v.numpy() for k, v in checkpoint.part(name).items()})
            for name, part in self._parts_in_json():
                part.load_state(json.loads(checkpoint.tensors[name].numpy().tobytes()))
            if self.tutor is not None:
                self.tutor.begin()
        except (KeyError, ValueError, RuntimeError, TypeError) as error:
            raise CheckpointError(f"checkpoint cannot continue this run: {error}") from error
        self.update = checkpoint.meta.update

    def _check_same_run(self, meta: CheckpointMeta) -> None:
        if meta.program_sha256 != self.program.sha256:
            raise CheckpointError(
                "the scenario has changed since this checkpoint; a run resumes only on the same one"
            )
        old, new = meta.config, self.config
        if changed := new.differences(old):
            detail = ", ".join(f"{name}: {getattr(old, name)} -> {getattr(new, name)}" for name in changed)
            if changed == ["frames"]:
                detail += (
                    " (a guide, a schedule, or your own bonus or algorithm depends on the number of frames)"
                )
            raise CheckpointError(f"a run resumes only with the same settings; changed: {detail}")

    def _load_auxiliary(self, aux: AuxiliaryLoss, stored: dict[str, Tensor]) -> None:
        parameters = dict(aux.named_parameters())
        for name, present in aux.state_dict(keep_vars=True).items():
            # Buffers may have grown.
            found = fitting(stored, name, present) if name in parameters else stored[name]
            present.data = found.to(present.device, copy=True)

    def _load_adam(self, module: nn.Module, stored: dict[str, Tensor]) -> None:
        for name, parameter in module.named_parameters():
            if not any(f"{key}.{name}" in stored for key in _ADAM):
                continue  # it had no gradient yet, as an encoder of words before the first word
            # Fused Adam walks all of them in the order they lie in memory, so they must lie like the parameter.
            step = fitting(stored, f"step.{name}", torch.zeros(())).to(parameter.device)
            averages = [fitting(stored, f"{key}.{name}", parameter) for key in _ADAM[1:]]
            like = [torch.empty_like(parameter.detach()).copy_(average) for average in averages]
            self.optimizer.state[parameter] = dict(zip(_ADAM, (step, *like), strict=True))

    def _load_state(self, stored: dict[str, Tensor]) -> None:
        if not self.state.seen.size:
            stored.setdefault("seen", torch.from_numpy(self.state.seen))  # runs of before have nothing there
        if session_of(self.envs) == 1:
            stored.setdefault("trials", torch.from_numpy(self.state.trials))  # nor there
        for name, present in vars(self.state).items():
            value = fitting(stored, name, torch.as_tensor(present))
            is_tensor = isinstance(present, Tensor)
            setattr(self.state, name, value.to(present) if is_tensor else value.numpy().copy())


@contextlib.contextmanager
def threads_of(session: Session) -> Iterator[Mapper]:
    """Threads that each differentiate a share of a minibatch.

    A recurrent network is thousands of small operations. Split inside each operation, as PyTorch does, threads spend
    their time meeting at barriers; whole shares meet once a step. So each thread runs PyTorch on one core. Networks
    whose frames depend on the rest of their batch, and GPUs, are left to PyTorch.
    """
    threads, before = session.config.threads, torch.get_num_threads()
    shared = session.actor.net.distinct and session.actor.device.type == "cpu"
    torch.set_num_threads(1 if shared else threads)
    try:
        if not shared or threads == 1:
            yield map
            return
        with ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as pool:
            yield pool.map
    finally:
        torch.set_num_threads(before)


@contextlib.contextmanager
def explained_stops(session: Session, run_dir: Path) -> Iterator[None]:
    """Say where a run stopped, why, and what is left of it."""
    try:
        yield
    except BrokenPipeError:  # of the terminal that progress is shown on, not of a file
        raise
    except (TrainingStopped, ObservationError, OSError) as error:
        saved = max(checkpoint_files(run_dir / CHECKPOINTS), default=None)
        kept = f"the last good checkpoint is {saved}" if saved else "there is no checkpoint yet"
        reason = f"cannot write: {error}" if isinstance(error, OSError) else str(error)
        where = f"training stopped after {session.frames} frames (update {session.update})"
        raise TrainingStopped(f"{where}: {reason}; {kept}") from error


def _check_options(config: RunConfig) -> None:
    """Refuse options that are good for other runs than a training, or not on this machine."""
    if not config.trains:
        raise ValueError(f"agent: got {config.agent}, expected ppo, which is the agent that is trained")
    try:
        torch.zeros(1).to(config.device).cpu()
    except (RuntimeError, AssertionError) as error:  # as PyTorch reports devices that there are not
        reason = str(error).partition("\n")[0]
        raise ValueError(f"device: got {config.device}, expected cpu or cuda: {reason}") from error


def _check_form(config: RunConfig, envs: Any) -> None:
    """Refuse environments that are not a vector of the configured number, restarted as the trainer expects."""
    needed = 'expected socialai_dsl.make_vec(..., autoreset_mode="SameStep")'
    if not isinstance(envs, VectorEnv) or not all(hasattr(envs, name) for name in _NEEDED):
        raise ValueError(f"envs: got {type(envs).__name__}, {needed}")
    if envs.num_envs != config.envs:
        raise ValueError(f"envs: got {envs.num_envs} environments, expected envs = {config.envs}")
    for name, partner in _partners_in(envs).items():
        if not (hasattr(partner, "state") and hasattr(partner, "load_state")):
            raise ValueError(
                f"seats: {name} is a policy without `state` and `load_state`, so the run could not be resumed; "
                "expected script, random or an agent of PPO"
            )
    mode = envs.metadata.get("autoreset_mode")
    if mode != AutoresetMode.SAME_STEP:
        raise ValueError(f"envs: got the autoreset mode {getattr(mode, 'value', mode)}, {needed}")


def _check_alike(program: Any, played: Any) -> None:
    """Refuse a variant, played for its script, that says or does other things than the scenario itself."""
    for name in _WORDS:
        own, others = list(getattr(program, name)), list(getattr(played, name))
        if own != others:
            strange = ", ".join(sorted(set(own) ^ set(others))) or "the same in another order"
            raise ValueError(
                f"guide: {played.name} with its script has other {name} than without it: {strange}; let both have "
                "the same, or train without a guide"
            )


def _json_tensor(part: str, state: Any) -> Tensor:
    try:
        return _as_tensor(json.dumps(state).encode())
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{part}: state returned what is no JSON data: {error}") from error


def _array_tensors(part: str, state: Any) -> dict[str, Tensor]:
    try:
        return {f"{part}.{name}": torch.from_numpy(np.asarray(array)) for name, array in state.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{part}: state returned what are no arrays by name: {error}") from error


def _as_tensor(data: bytes) -> Tensor:
    return torch.frombuffer(bytearray(data), dtype=torch.uint8)
