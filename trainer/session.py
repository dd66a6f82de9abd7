"""This module is everything a training run has to remember, and how that goes into a checkpoint and comes back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from trainer import checkpoint as checkpoints
from trainer.actor import Actor
from trainer.bonus import Bonus
from trainer.checkpoint import Checkpoint, CheckpointMeta
from trainer.config import RESUMABLE_FIELDS, TrainConfig
from trainer.crew import Crew
from trainer.curricula import Leaves, Tutor, build_curriculum
from trainer.errors import CheckpointError
from trainer.nets import NetSpec, build_net
from trainer.rollout import Rollout, RolloutState, collect
from trainer.team import ALONE, Team

_ADAM = ("step", "exp_avg", "exp_avg_sq")


@dataclass
class Session:
    """A run between two updates; equal sessions have equal futures on the same CPU with the same number of threads.

    Attributes:
        update: updates made. frames: environment steps made.
        generator: the one source of the trainer's randomness, the same in every process.
        team: the processes that train together; environments, memory and bonus are this process's share.
    """

    config: TrainConfig
    envs: Any
    actor: Actor
    optimizer: torch.optim.Adam
    state: RolloutState
    generator: torch.Generator
    bonus: Bonus | None
    tutor: Tutor | None = None
    team: Team = ALONE
    update: int = 0

    @property
    def frames(self) -> int:
        """Environment steps made, all environments together."""
        return self.update * self.config.frames_per_update

    def play(self, crew: Crew) -> Rollout:
        """`collect` the next rollout; see there for errors."""
        return collect(
            self.actor,
            self.envs,
            self.state,
            self.config,
            self.generator,
            self.bonus,
            self.tutor,
            self.team,
            crew,
        )

    @classmethod
    def start(cls, config: TrainConfig, envs: Any, team: Team = ALONE) -> Session:
        """Begin a run: fresh weights, environments reset with the run's seed.

        Raises:
            ValueError: the environments do not fit the configuration, or are not of the form the trainer learns.
        """
        share = team.share(config.num_envs)
        if envs.num_envs != share:
            part = "" if team.size == 1 else f" / {team.size} processes = {share}"
            raise ValueError(
                f"envs: got {envs.num_envs} environments, expected num_envs = {config.num_envs}{part}"
            )
        spec = net_spec(envs)
        net = build_net(config.net, spec, config.seed, config.precision).to(config.device)
        if config.compile:
            net.compile_perception()
        if team.size > 1 and not net.distinct:
            raise ValueError(
                f"net: {config.net} normalises over the batch, which {team.size} processes do not share; "
                "train it with one"
            )
        if team.size > 1 and config.update == "chunks":
            raise ValueError(f"update: chunks are not shared by {team.size} processes; train with one")
        tutor = None
        if config.curriculum != "none":
            tutor = Tutor(build_curriculum(config.curriculum, Leaves.of(envs)), envs, team)
        seats = range(team.rank * share, (team.rank + 1) * share)
        observation, _ = envs.reset(seed=config.seed, options={"index": list(seats)})
        if tutor is not None:
            tutor.begin()
        return cls(
            config,
            envs,
            Actor(net, observation["tokens"].shape[1]),
            torch.optim.Adam(net.parameters(), lr=config.lr, eps=config.adam_eps, fused=True),
            RolloutState.initial(observation, net.memory.initial(share)),
            torch.Generator().manual_seed(config.seed),
            Bonus(config, share) if config.explo != "none" else None,
            tutor,
            team,
        )

    def checkpoint(self) -> Checkpoint:
        """Everything needed to continue exactly; of a team, complete on the process that writes.

        Raises:
            TrainingStopped: the processes of the team have come apart, or one is gone.
        """
        net = self.actor.net
        tensors: dict[str, Tensor] = {f"net.{name}": value for name, value in net.state_dict().items()}
        for name, parameter in net.named_parameters():
            for key, value in self.optimizer.state.get(parameter, {}).items():
                tensors[f"adam.{key}.{name}"] = value
        if self.tutor is not None:
            tensors["curriculum"] = torch.from_numpy(self.tutor.state())
        tensors["rng"] = self.generator.get_state()
        if self.team.size == 1:
            return Checkpoint(self._meta(), tensors | self._share())
        self.team.agree("weights, optimiser and random numbers are", checkpoints.pack(tensors))
        for rank, share in enumerate(self.team.gather_bytes(checkpoints.pack(self._share()))):
            tensors |= {_of_rank(rank) + name: value for name, value in checkpoints.unpack(share).items()}
        return Checkpoint(self._meta(), tensors)

    def _share(self) -> dict[str, Tensor]:
        """What this process alone remembers: its environments, and what goes with them."""
        tensors = {"state.memory": self.state.memory}
        for name in ("image", "tokens", "starts", "returns", "lengths"):
            tensors[f"state.{name}"] = torch.from_numpy(getattr(self.state, name))
        if self.bonus is not None:
            for name, array in self.bonus.state().items():
                tensors[f"bonus.{name}"] = torch.from_numpy(array)
        tensors["envs"] = torch.frombuffer(bytearray(self.envs.snapshot()), dtype=torch.uint8)
        return tensors

    def _meta(self) -> CheckpointMeta:
        spec, program = self.actor.net.spec, self.envs.program
        return CheckpointMeta(
            config=self.config,
            action_sizes=spec.action_sizes,
            image_shape=spec.image_shape,
            vocabulary=list(program.vocabulary),
            program_sha256=program.sha256,
            scenario=program.name,
            actions=list(program.actions),
            templates=list(program.templates),
            nouns=list(program.nouns),
            frames=self.frames,
            update=self.update,
            processes=self.team.size,
            torch_version=str(torch.__version__),
        )

    def load(self, checkpoint: Checkpoint) -> None:
        """Continue from a checkpoint of this very run, in a session begun with the same configuration.

        Raises:
            CheckpointError: it is of another scenario, of other hyper-parameters, or incomplete.
        """
        self._check_same_run(checkpoint.meta)
        net = checkpoints.restore_net(
            checkpoint, self.actor.net.spec, list(self.envs.program.vocabulary), self.config.net
        )
        try:
            self.actor.net.load_state_dict(net.state_dict())
            self._load_adam(checkpoint)
            mine = _of_rank(self.team.rank)
            self._load_state(checkpoint.part(mine + "state"))
            if self.bonus is not None:
                self.bonus.load_state(
                    {name: value.numpy() for name, value in checkpoint.part(mine + "bonus").items()}
                )
            self.generator.set_state(checkpoint.tensors["rng"])
            self.envs.restore(checkpoint.tensors[mine + "envs"].numpy().tobytes())
            if self.tutor is not None:
                self.tutor.load_state(checkpoint.tensors["curriculum"].numpy())
        except (KeyError, ValueError, TypeError, RuntimeError) as error:
            raise CheckpointError(f"checkpoint cannot continue this run: {error}") from error
        self.update = checkpoint.meta.update

    def _check_same_run(self, meta: CheckpointMeta) -> None:
        if meta.program_sha256 != self.envs.program.sha256:
            raise CheckpointError(
                "the scenario has changed since this checkpoint; a run resumes only on the same one"
            )
        if meta.processes != self.team.size:
            raise CheckpointError(
                f"the run was made by {meta.processes} processes and resumes only with as many, got "
                f"{self.team.size}: torchrun --nproc-per-node {meta.processes}"
            )
        old, new = meta.config.model_dump(), self.config.model_dump()
        changed = [name for name in new if name not in RESUMABLE_FIELDS and old[name] != new[name]]
        if changed:
            detail = ", ".join(f"{name}: {old[name]} -> {new[name]}" for name in changed)
            raise CheckpointError(f"a run resumes only with the same settings; changed: {detail}")

    @torch.no_grad()
    def _load_adam(self, checkpoint: Checkpoint) -> None:
        stored = checkpoint.part("adam")
        state: dict[int, dict[str, Tensor]] = {}
        for index, (name, parameter) in enumerate(self.actor.net.named_parameters()):
            if not stored:
                break
            values = {key: stored[f"{key}.{name}"] for key in _ADAM}
            if values["step"].ndim or any(values[key].shape != parameter.shape for key in _ADAM[1:]):
                raise ValueError(f"optimiser state of {name} has another shape")
            # Fused Adam walks all of them in the order they lie in memory, so they must lie like the parameter.
            state[index] = {
                key: value if key == "step" else torch.empty_like(parameter).copy_(value)
                for key, value in values.items()
            }
        self.optimizer.load_state_dict(
            {"state": state, "param_groups": self.optimizer.state_dict()["param_groups"]}
        )

    def _load_state(self, stored: dict[str, Tensor]) -> None:
        state = self.state
        for name in ("image", "tokens", "starts", "returns", "lengths"):
            present, value = getattr(state, name), stored[name].numpy()
            if value.shape != present.shape or value.dtype != present.dtype:
                raise ValueError(
                    f"state.{name}: got {value.shape} {value.dtype}, expected {present.shape} {present.dtype}"
                )
            setattr(state, name, np.array(value))
        if stored["memory"].shape != state.memory.shape:
            raise ValueError(
                f"state.memory: got {tuple(stored['memory'].shape)}, expected {tuple(state.memory.shape)}"
            )
        state.memory = stored["memory"].to(state.memory)


def _of_rank(rank: int) -> str:
    """What the names of a process's own tensors begin with in a checkpoint."""
    return f"rank{rank}." if rank else ""


def net_spec(envs: Any) -> NetSpec:
    """Shapes a network must have for this environment, single or vector."""
    many = hasattr(envs, "single_action_space")
    actions = envs.single_action_space if many else envs.action_space
    observations = envs.single_observation_space if many else envs.observation_space
    return NetSpec.of(actions, observations, envs.program.vocabulary)
