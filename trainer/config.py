"""This module holds every hyper-parameter of the trainer, with its meaning, unit and the source of its default."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class TrainConfig(BaseModel):
    """What a training run depends on besides the environments and the code.

    Defaults marked "measured" are the settings that learned to ask and to heed on small rooms within two
    million frames; `paper_preset` gives the published ones (SocialAI 1.0, appendix on the baselines).

    Raises:
        pydantic.ValidationError: (a ValueError) a value is out of range or two values contradict each other.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    frames: int = Field(
        1_000_000, ge=1, description="frames (environment steps, all environments together) to train for"
    )
    seed: int = Field(
        0, ge=0, lt=2**63, description="seeds weights, sampling, shuffling and environment episodes"
    )
    num_envs: int = Field(256, ge=1, description="environments stepped together (measured)")
    horizon: int = Field(32, ge=1, description="steps per environment in one rollout (measured)")
    bptt: int = Field(
        0, ge=0, description="steps back-propagation goes back through the memory; 0 = the whole rollout"
    )
    update: Literal["environments", "chunks"] = Field(
        "environments",
        description="environments: minibatches of whole environments, each distinct frame computed once; chunks: of "
        "stretches of `bptt` steps, one step of all of them at a time (paper)",
    )
    epochs: int = Field(4, ge=1, description="passes over each rollout (paper)")
    minibatches: int = Field(
        4, ge=1, description="parts a rollout is cut into, of whole environments or of chunks (measured)"
    )
    lr: float = Field(7e-4, gt=0, description="Adam's learning rate (measured; paper 1e-4)")
    adam_eps: float = Field(1e-5, gt=0, description="Adam's epsilon (paper)")
    gamma: float = Field(0.99, ge=0, le=1, description="discount per step (paper)")
    gae_lambda: float = Field(
        0.95, ge=0, le=1, description="lambda of generalised advantage estimation (measured; paper .99)"
    )
    clip: float = Field(0.2, gt=0, description="PPO's clipping range of the probability ratio (paper)")
    clip_value: bool = Field(
        False, description="clip the value's change by `clip` as well (paper: yes; measured: no)"
    )
    value_coef: float = Field(0.5, ge=0, description="weight of the squared value error (paper)")
    entropy_coef: float = Field(
        0.01, ge=0, description="weight of each head's entropy, nats (paper; .03 was worse)"
    )
    max_grad_norm: float = Field(0.5, gt=0, description="global L2 norm gradients are clipped to (paper)")
    normalize_advantages: bool = Field(
        True, description="scale a rollout's advantages to mean 0, deviation 1 (paper: no)"
    )
    loss: Literal["joint", "per_head"] = Field(
        "joint",
        description="joint: one ratio of the whole action; per_head: a ratio, clip, entropy and value term per "
        "head, averaged over the four heads (paper)",
    )
    bootstrap_timeouts: bool = Field(
        False, description="continue the value through a time-out; False: a time-out is terminal (paper)"
    )
    explo: Literal["none", "lang", "cell"] = Field(
        "none", description="episodic count-based bonus: on what is heard, or on kinds of cells seen"
    )
    explo_c: float = Field(7.0, ge=0, description="C of the bonus; the paper sets it per scenario")
    explo_m: float = Field(50.0, ge=0, description="M of the bonus: 50 pays first visits only (paper)")
    explo_t: float = Field(0.6, gt=0, description="T of the bonus, as coded its upper bound per step (paper)")
    explo_formula: Literal["as_coded", "as_printed"] = Field(
        "as_coded", description="the bonus of the code the paper's figures come from, or that of its text"
    )
    net: str = Field(
        "fast", min_length=1, description="fast, paper, paper-reference, or my.module:MyNet of the user's"
    )
    precision: Literal["float32", "bfloat16"] = Field(
        "float32",
        description="number type of the network's bulk of arithmetic; bfloat16 only for networks that can (paper). "
        "What is stored stays float32",
    )
    curriculum: str = Field(
        "none",
        min_length=1,
        description="who chooses members of a suite: none, expert, progress, reverse, a .yaml file of phases, or "
        "my.module:MyCurriculum",
    )
    compile: bool = Field(
        False, description="let torch.compile make the part of the network that reads images and dialogue"
    )
    device: str = Field("cpu", min_length=1, description="torch device the network runs on")
    threads: int = Field(
        0,
        ge=0,
        description="CPU threads that share each minibatch; 0 = one per core, at most 4. Part of what makes two runs "
        "equal to the bit",
    )
    checkpoint_every: int = Field(50, ge=1, description="updates between checkpoints")
    tensorboard: bool = Field(True, description="also write TensorBoard events")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.minibatches > self.num_envs:
            raise ValueError(
                f"minibatches: got {self.minibatches}, expected at most num_envs = {self.num_envs}, because a "
                "minibatch holds whole environments"
            )
        if self.bptt and self.horizon % self.bptt:
            raise ValueError(f"bptt: got {self.bptt}, expected a divisor of horizon = {self.horizon}, or 0")
        if self.update == "chunks" and not 0 < self.bptt < self.horizon:
            raise ValueError(
                f"bptt: got {self.bptt}, expected less than horizon = {self.horizon} and not 0, because the update "
                "shifts chunks of so many steps"
            )
        return self

    @property
    def frames_per_update(self) -> int:
        """Frames collected before each update."""
        return self.num_envs * self.horizon

    @property
    def updates(self) -> int:
        """Updates needed to reach `frames`, the last one rounded up."""
        return -(-self.frames // self.frames_per_update)


# Fields that may change when a run is resumed, because they change where or how long it runs but not what is learnt.
RESUMABLE_FIELDS = frozenset({"frames", "device", "threads", "checkpoint_every", "tensorboard"})


def paper_preset(**overrides: Any) -> TrainConfig:
    """Return what the paper's agents learn with (16 environments, recurrence 10, batches of 1280 frames).

    Network, reading of the dialogue and update are those of the released code, the numbers those of the paper's table.

    One rollout of 640 frames is one minibatch, as it was with the released code, whose batch of 1280 exceeds the
    640 frames it collects.
    """
    values: dict[str, Any] = {
        "frames": 30_000_000,
        "num_envs": 16,
        "horizon": 40,
        "bptt": 10,
        "minibatches": 1,
        "lr": 1e-4,
        "adam_eps": 1e-5,
        "gae_lambda": 0.99,
        "clip_value": True,
        "normalize_advantages": False,
        "update": "chunks",
        "loss": "per_head",
        "net": "paper-reference",
    }
    return TrainConfig(**(values | overrides))


def paper_tuned_preset(**overrides: Any) -> TrainConfig:
    """Return the released run scripts' tuned variant of `paper_preset`: recurrence 5, Adam epsilon 1e-8."""
    return paper_preset(**({"bptt": 5, "adam_eps": 1e-8} | overrides))


PRESETS: Mapping[str, Callable[..., TrainConfig]] = {
    "paper-reference": paper_preset,
    "paper-reference-tuned": paper_tuned_preset,
}
"""Agents that are more than a network: named where a network can be, they bring all of their numbers with them."""


def configure(net: str, **overrides: Any) -> TrainConfig:
    """The configuration of a preset by its name, or that of a network with the default numbers.

    Raises:
        pydantic.ValidationError: see `TrainConfig`.
    """
    return PRESETS[net](**overrides) if net in PRESETS else TrainConfig(net=net, **overrides)
