"""Everything a training run has to remember, and how that goes into a checkpoint and comes back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from trainer import checkpoint as checkpoints
from trainer.bonus import Bonus, build_bonus
from trainer.checkpoint import Checkpoint, CheckpointMeta
from trainer.config import WITHOUT_EFFECT, RunConfig
from trainer.curricula import Leaves, Tutor, build_curriculum
from trainer.errors import CheckpointError
from trainer.features import Actor
from trainer.guides import Guide, build_guide
from trainer.nets import NetSpec, build_net
from trainer.rollout import RolloutState

_ADAM = ("step", "exp_avg", "exp_avg_sq")


@dataclass
class Session:
    """A run between two updates; equal sessions have equal futures on the same CPU with the same number of threads.

    Attributes:
        program: of the scenario that the agent is for.
        update: updates made.
        generator: the one source of the trainer's randomness.
    """

    config: RunConfig
    envs: Any
    program: Any
    actor: Actor
    optimizer: torch.optim.Adam
    state: RolloutState
    generator: torch.Generator
    bonus: Bonus | None = None
    tutor: Tutor | None = None
    guide: Guide | None = None
    update: int = 0

    @property
    def frames(self) -> int:
        """Environment steps made, all environments together."""
        return self.update * self.config.frames_per_update

    @property
    def learning_rate(self) -> float:
        """Adam's, now."""
        return self._scheduled(self.config.lr, self.config.lr_end)

    @property
    def entropy_coef(self) -> float:
        """Weight of the entropy, now."""
        return self._scheduled(self.config.entropy_coef, self.config.entropy_coef_end)

    def _scheduled(self, start: float, end: float | None) -> float:
        """Linear over the run's updates, from `start` before the first to `end` after the last."""
        return start if end is None else start + (end - start) * self.update / self.config.updates

    @classmethod
    def start(cls, config: RunConfig, envs: Any, program: Any = None) -> Session:
        """Begin a run: fresh weights, environments reset with the run's seed.

        Raises:
            ValueError: the environments do not fit the configuration or the program, or are not of the form the
                trainer learns.
        """
        if envs.num_envs != config.envs:
            raise ValueError(f"envs: got {envs.num_envs} environments, expected envs = {config.envs}")
        if program is not None:
            _check_alike(program, envs.program)
        folder = config.code_folder
        net = build_net(config.net, net_spec(envs), config.seed, config.precision, folder).to(config.device)
        tutor = None
        if config.curriculum != "none":
            tutor = Tutor(build_curriculum(config.curriculum, Leaves.of(envs), folder), envs)
        bonus = build_bonus(config, config.envs)
        observation, _ = envs.reset(seed=config.seed, options={"index": list(range(config.envs))})
        guide = build_guide(config, envs)
        if tutor is not None:
            tutor.begin()
        return cls(
            config,
            envs,
            envs.program if program is None else program,
            Actor(net, observation["tokens"].shape[1]),
            torch.optim.Adam(net.parameters(), lr=config.lr, eps=config.adam_eps, fused=True),
            RolloutState.initial(observation, net.memory.initial(config.envs)),
            torch.Generator().manual_seed(config.seed),
            bonus,
            tutor,
            guide,
        )

    def checkpoint(self) -> Checkpoint:
        """Everything needed to continue exactly."""
        net = self.actor.net
        tensors: dict[str, Tensor] = {f"net.{name}": value for name, value in net.state_dict().items()}
        for name, parameter in net.named_parameters():
            for key, value in self.optimizer.state.get(parameter, {}).items():
                tensors[f"adam.{key}.{name}"] = value
        if self.tutor is not None:
            tensors["curriculum"] = torch.from_numpy(self.tutor.state())
        if self.guide is not None:
            tensors["guide"] = _as_tensor(json.dumps(self.guide.state()).encode())
        if self.bonus is not None:
            for name, array in self.bonus.state().items():
                tensors[f"bonus.{name}"] = torch.from_numpy(np.asarray(array))
        tensors["rng"] = self.generator.get_state()
        tensors["state.memory"] = self.state.memory
        for name in _STATE:
            tensors[f"state.{name}"] = torch.from_numpy(getattr(self.state, name))
        tensors["envs"] = _as_tensor(self.envs.snapshot())
        return Checkpoint(self._meta(), tensors)

    def _meta(self) -> CheckpointMeta:
        spec, program = self.actor.net.spec, self.program
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
            torch_version=str(torch.__version__),
        )

    def load(self, checkpoint: Checkpoint) -> None:
        """Continue from a checkpoint of this very run, in a session begun with the same configuration.

        Raises:
            CheckpointError: it is of another scenario, of other options, or incomplete.
        """
        self._check_same_run(checkpoint.meta)
        net = checkpoints.restore_net(
            checkpoint,
            self.actor.net.spec,
            list(self.program.vocabulary),
            self.config.net,
            self.config.code_folder,
        )
        try:
            self.actor.net.load_state_dict(net.state_dict())
            self._load_adam(checkpoint)
            self._load_state(checkpoint.part("state"))
            self.generator.set_state(checkpoint.tensors["rng"])
            if self.bonus is not None:
                self.bonus.load_state({k: v.numpy() for k, v in checkpoint.part("bonus").items()})
            self.envs.restore(checkpoint.tensors["envs"].numpy().tobytes())
            if self.tutor is not None:
                self.tutor.load_state(checkpoint.tensors["curriculum"].numpy())
            if self.guide is not None:
                self.guide.load_state(json.loads(checkpoint.tensors["guide"].numpy().tobytes()))
        except (KeyError, ValueError, RuntimeError, TypeError) as error:
            raise CheckpointError(f"checkpoint cannot continue this run: {error}") from error
        self.update = checkpoint.meta.update

    def _check_same_run(self, meta: CheckpointMeta) -> None:
        if meta.program_sha256 != self.program.sha256:
            raise CheckpointError(
                "the scenario has changed since this checkpoint; a run resumes only on the same one"
            )
        old, new = meta.config.model_dump(), self.config.model_dump()
        free = WITHOUT_EFFECT - {"frames"} if self.config.depends_on_frames else WITHOUT_EFFECT
        free = free | {"device", "threads", "eval_episodes"}
        changed = [name for name in new if name not in free and old[name] != new[name]]
        if changed:
            detail = ", ".join(f"{name}: {old[name]} -> {new[name]}" for name in changed)
            why = (
                " (guide and schedules reach from the first frame to the last)"
                if changed == ["frames"]
                else ""
            )
            raise CheckpointError(f"a run resumes only with the same settings; changed: {detail}{why}")

    @torch.no_grad()
    def _load_adam(self, checkpoint: Checkpoint) -> None:
        stored = checkpoint.part("adam")
        state: dict[int, dict[str, Tensor]] = {}
        for index, (name, parameter) in enumerate(self.actor.net.named_parameters()):
            if not any(f"{key}.{name}" in stored for key in _ADAM):
                continue  # it had no gradient yet, as an encoder of words before the first word
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
        for name in _STATE:
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


def _check_alike(program: Any, played: Any) -> None:
    """Refuse a variant, played for its script, that says or does other things than the scenario itself."""
    for name in ("actions", "templates", "nouns", "vocabulary"):
        own, others = list(getattr(program, name)), list(getattr(played, name))
        if own != others:
            strange = sorted(set(own) ^ set(others))
            raise ValueError(
                f"guide: {played.name} with its script has other {name} than without it"
                f"{': ' + ', '.join(strange) if strange else ', in another order'}; let both have the same, or train "
                "without a guide"
            )


_STATE = ("image", "tokens", "starts", "returns", "lengths", "led")


def _as_tensor(data: bytes) -> Tensor:
    return torch.frombuffer(bytearray(data), dtype=torch.uint8)


def net_spec(envs: Any) -> NetSpec:
    """Shapes a network must have for this environment, single or vector."""
    many = hasattr(envs, "single_action_space")
    actions = envs.single_action_space if many else envs.action_space
    observations = envs.single_observation_space if many else envs.observation_space
    return NetSpec.of(actions, observations, envs.program.vocabulary)
