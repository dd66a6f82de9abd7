"""Every option of a run: its meaning, default, bounds and source, declared once.

The command line, the schema of experiments, `config.json` and the model card are made from `RunConfig`.
This module imports neither PyTorch nor Gymnasium, so that checking an experiment file stays quick.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, create_model, model_validator

Role = Literal["flag", "hyper", "kept"]
"""Where an option is given: by a flag of its own, by `--hyper NAME=VALUE`, or nowhere (it follows from others)."""


def _option(
    default: Any,
    about: str,
    *,
    role: Role = "hyper",
    result: bool = True,
    scheduled: bool = False,
    **bounds: Any,
) -> Any:
    """Declare an option.

    Args:
        default: its default.
        about: its help text.
        role: see `Role`.
        result: whether it decides what a run computes; False for options that say where, how long or how it is kept.
        scheduled: whether it may change linearly during the run, to the option `NAME_end`, which is then made from it.
        bounds: pydantic's (`ge`, `gt`, `le`, `lt`).
    """
    extra: dict[str, Any] = {"role": role, "result": result, "scheduled": scheduled}
    return Field(default, description=about, json_schema_extra=extra, **bounds)


_flag = partial(_option, role="flag")
_coefficient = partial(_option, scheduled=True)
Name = Annotated[str, Field(min_length=1)]


MOST_FRAMES: Final = 10**15 - 1
"""Names of checkpoints have fifteen digits."""
_MOST_IN_UPDATE: Final = 2**24
BONUS_SCALES: Final = {"lang": 7.0, "cell": 3.0, "lines": 0.1}
"""The bonuses that ship, and what their scale C is where the paper says nothing of the scenario."""


class _Starts(BaseModel):
    """Every option of a run but the ends of schedules, `RunConfig`'s other half."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    scenario: str = _option("", "path or name of what is played, with +variants and ?parameters", role="kept")
    agent: Name = _flag(
        "ppo",
        "ppo, random, oracle, human, shipped (the trained agent that comes with the scenario), shipped:NAME, or a "
        "checkpoint or run folder; only ppo is trained",
    )
    frames: int = _flag(
        600_000, "frames to train for: steps of all environments together", result=False, ge=0, le=MOST_FRAMES
    )
    seed: int = _flag(0, "seed of weights, sampling, shuffling and episodes", ge=0, lt=2**63)
    envs: int = _flag(256, "environments that are stepped together", ge=1, le=65_536)
    net: Name = _flag(
        "fast",
        "fast, relations, speakers, paper or mine:Net; paper-reference and paper-reference-tuned are presets: the "
        "paper's network, update and numbers",
    )
    algorithm: Name = _flag("ppo", "how the network learns: ppo or mine:Algorithm")
    precision: Literal["float32", "bfloat16"] = _flag(
        "float32", "number format of the convolutions of the network paper"
    )
    bonus: Name = _flag(
        "none",
        "exploration bonus: none, lang (new utterances), cell (new kinds of cells), lines (new lines of a speaker) or "
        "mine:Bonus; on the command line also auto, the paper's choice for the scenario",
    )
    curriculum: Name = _flag(
        "none",
        "which members of a suite are played: none, even, expert, ladder, progress, reverse, a .yaml file of phases or "
        "mine:Curriculum",
    )
    guide: Name = _flag(
        "none",
        "the guide that shows the task: none, script (the scenario's own script plays, the agent imitates it) or "
        "mine:Guide",
    )
    aux: Name = _flag("none", "an auxiliary loss besides the agent's own: none or mine:Loss")
    guide_share: float = _option(
        0.5, "share of the frames, from the first on, that the guide leads (measured)", ge=0, le=1
    )
    imitation_coef: float = _coefficient(
        1.0, "weight of the cross-entropy to a guide's actions (measured)", ge=0
    )
    aux_coef: float = _coefficient(1.0, "weight of the auxiliary loss", ge=0)

    horizon: int = _option(32, "steps of each environment in one rollout (measured)", ge=1, le=65_536)
    bptt: int = _option(0, "steps of back-propagation through time; 0: the whole rollout", ge=0)
    update: Literal["environments", "chunks"] = _option(
        "environments",
        "what a minibatch is made of. environments: whole environments, each distinct frame computed once; chunks: "
        "stretches of `bptt` steps, one step of all of them at a time (paper)",
    )
    epochs: int = _option(4, "passes over each rollout (paper)", ge=1, le=1_000)
    minibatches: int = _option(4, "parts a rollout is cut into (measured)", ge=1)
    lr: float = _coefficient(7e-4, "Adam's learning rate (measured; paper 1e-4)", gt=0)
    adam_eps: float = _option(1e-5, "Adam's epsilon (paper)", gt=0)
    adam_beta2: float = _option(0.999, "Adam's beta2, the decay of its mean of squared gradients", ge=0, lt=1)
    gamma: float = _coefficient(0.99, "discount per step (paper)", ge=0, le=1)
    gae_lambda: float = _coefficient(
        0.95, "lambda of the advantage estimates (measured; paper .99)", ge=0, le=1
    )
    clip: float = _coefficient(0.2, "PPO's clipping range of the probability ratio (paper)", gt=0)
    clip_value: bool = _option(False, "clip the value's change by `clip` as well (paper: yes; measured: no)")
    value_coef: float = _coefficient(0.5, "weight of the squared value error (paper)", ge=0)
    entropy_coef: float = _coefficient(0.01, "weight of the entropy, nats (paper)", ge=0)
    max_grad_norm: float = _coefficient(0.5, "global L2 norm that gradients are clipped to (paper)", gt=0)
    target_kl: float | None = _option(
        None,
        "KL divergence in the agent's own frames, nats, beyond which a gradient step is undone; null: no limit",
        gt=0,
    )
    normalize_advantages: bool = _option(True, "scale advantages to mean 0, deviation 1 (paper: no)")
    loss: Literal["joint", "per_head"] = _option(
        "joint",
        "joint: one ratio of the whole action; per_head: a ratio, clip, entropy and value term for each head, "
        "averaged over the four (paper)",
    )
    bootstrap_timeouts: bool = _option(
        False, "bootstrap from the value after a time-out (paper: a time-out is terminal)"
    )
    returns: Literal["session", "episode"] = _option(
        "session",
        "what a return adds up where a scenario has sessions: the session, so that finding out for later pays, or "
        "the episode alone",
    )
    bonus_c: float = _coefficient(
        7.0,
        "C of the bonus (default: the paper's for the scenario, else 7 for lang, 3 for cell and 0.1 for lines)",
        ge=0,
    )
    bonus_m: float = _option(50.0, "M of the bonus; 50 pays for first visits only (paper)", ge=0)
    bonus_t: float = _option(
        0.6, "T of the bonus; in the formula as_coded the largest bonus of a step (paper)", gt=0
    )
    bonus_formula: Literal["as_coded", "as_printed"] = _option(
        "as_coded", "formula of the bonus: that of the code behind the paper's figures, or that of its text"
    )
    seats: dict[str, list[Name]] = _option(
        {},
        "who plays members of the cast while the agent learns on the other seats, by member; several take turns from "
        "game to game",
        role="kept",
    )
    recipe: Literal["plain", "guided", "paper"] = _option(
        "plain",
        "plain: PPO from the reward alone; guided: imitation of the script, then PPO; paper: as plain, for runs to be "
        "compared with the paper",
        role="kept",
    )

    device: Name = _flag("cpu", "where the network runs: cpu or cuda")
    threads: int = _flag(
        1,
        "CPU threads that share each minibatch; results are equal, bit for bit, only for an equal number",
        ge=1,
        le=64,
    )
    checkpoint_every: int = _flag(50, "updates between checkpoints", result=False, ge=1, le=MOST_FRAMES)
    keep_checkpoints: int = _flag(
        2, "how many of the newest checkpoints are kept", result=False, ge=1, le=MOST_FRAMES
    )
    eval_episodes: int = _flag(500, "episodes of the test set", ge=1, le=1_000_000)
    tensorboard: bool = _option(True, "also write TensorBoard events", result=False)
    wandb: Name | None = _flag(
        None,
        "also send the figures to this project of Weights & Biases (needs the extra `wandb`)",
        result=False,
    )


OWN: Final = ("net", "bonus", "curriculum", "guide", "aux", "algorithm")
"""Options that may name a class of the user's own, such as `mine:Net`."""

SCHEDULED: Final = tuple(
    name
    for name, field in _Starts.model_fields.items()
    if field.json_schema_extra["scheduled"]  # type: ignore[index]
)
"""Options that may change during a run: linearly, from their own value to that of `NAME_end`."""


def _end(name: str) -> Any:
    """The option at which the schedule of another ends: of the same bounds, by default absent."""
    bounds = Annotated[float, *_Starts.model_fields[name].metadata]
    return bounds | None, _option(None, f"`{name}` after the last update, reached linearly; null: unchanged")


if TYPE_CHECKING:
    _Options = _Starts
else:
    _Options = create_model("_Options", __base__=_Starts, **{f"{name}_end": _end(name) for name in SCHEDULED})


class RunConfig(_Options):
    """Every option of a run, resolved: there is no `auto`. Equal configurations and code compute equal runs.

    Defaults marked "measured" were chosen by runs of this trainer. Those marked "paper" are in the appendix of the
    SocialAI 1.0 paper on its baselines, or in the code released with it.

    Raises:
        ValueError: a value is out of bounds, or two values contradict each other (pydantic's ValidationError).
    """

    _place: Path = PrivateAttr(default_factory=Path)
    """The run's folder, from which what it keeps is named; it is not part of the configuration, so it may move."""
    _code: Path | None = PrivateAttr(None)
    """Where code of one's own is loaded from, if not from the run's folder."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.trains and self.frames == 0:
            raise ValueError("frames: got 0, expected at least 1, because this agent is trained")
        if self.frames_per_update > _MOST_IN_UPDATE:
            raise ValueError(
                f"envs: got {self.envs} times a horizon of {self.horizon}, expected a product of at most "
                f"{_MOST_IN_UPDATE}, because an update holds all these frames in memory"
            )
        if self.minibatches > self.envs:
            raise ValueError(
                f"minibatches: got {self.minibatches}, expected at most envs = {self.envs}, because a minibatch "
                "holds whole environments"
            )
        if self.bptt and self.horizon % self.bptt:
            raise ValueError(f"bptt: got {self.bptt}, expected a divisor of horizon = {self.horizon}, or 0")
        if self.update == "chunks" and not 0 < self.bptt < self.horizon:
            raise ValueError(
                f"bptt: got {self.bptt}, expected less than horizon = {self.horizon} and not 0, because the update "
                "shifts chunks of that many steps"
            )
        for option in ("guide", "aux"):
            if self.update == "chunks" and getattr(self, option) != "none":
                raise ValueError(
                    f"{option}: the update `chunks` is the paper's and learns from the reward alone"
                )
        return self

    @property
    def trains(self) -> bool:
        """Whether the agent is trained by this run."""
        return self.agent == LEARNS

    @property
    def player(self) -> str:
        """Who plays: the algorithm that trains an agent, or the agent that is not trained."""
        return self.algorithm if self.trains else self.agent

    @property
    def frames_per_update(self) -> int:
        """Frames collected before each update."""
        return self.envs * self.horizon

    @property
    def updates(self) -> int:
        """Updates needed to reach `frames`, the last one rounded up."""
        return -(-self.frames // self.frames_per_update)

    @property
    def ends(self) -> dict[str, float]:
        """The options that change during the run, each with its value after the last update."""
        ends = {name: getattr(self, f"{name}_end") for name in SCHEDULED}
        return {name: end for name, end in ends.items() if end is not None}

    def at(self, update: int) -> Self:
        """The configuration with the values that scheduled options have after so many updates of the run."""

        def now(start: float, end: float) -> float:
            return start + (end - start) * update / self.updates

        values = {name: now(getattr(self, name), end) for name, end in self.ends.items()}
        return self.model_copy(update=values) if values else self

    @property
    def depends_on_frames(self) -> bool:
        """Whether an update depends on how many frames the run will have, so that more of them are another run."""
        return bool(self.ends) or self.guide != "none" or ":" in self.bonus or ":" in self.algorithm

    def differences(self, other: RunConfig) -> list[str]:
        """The options that keep a run with these from going on with the other ones."""
        free = WITHOUT_EFFECT - {"frames"} if self.depends_on_frames else WITHOUT_EFFECT
        free |= {"device", "threads", "eval_episodes"}
        fixed = [name for name in type(self).model_fields if name not in free]
        return [name for name in fixed if getattr(self, name) != getattr(other, name)]

    def within(self, folder: Path, code: Path | None = None) -> Self:
        """The same configuration of a run in this folder, wherever that is now.

        Args:
            folder: the run's.
            code: where code of one's own is loaded from, if not from there.
        """
        copy = self.model_copy()
        copy._place, copy._code = folder, code
        return copy

    @property
    def played(self) -> str:
        """The scenario as it is loaded from here: the copy in the run's folder, if it keeps one."""
        return scenario_in(self._place, self.scenario)

    @property
    def partners(self) -> dict[str, list[str]]:
        """Who plays on which seats while the agent learns on the others, as they are found from here."""

        def found(name: str) -> str:
            kept = Path(name).parts[:1] == (PARTNERS_FOLDER,) and (self._place / name).is_file()
            return str(self._place / name) if kept else name

        return {seat: [found(name) for name in names] for seat, names in self.seats.items()}

    @property
    def code_folder(self) -> Path:
        """Where `mine:Net` is looked for first: the folder of the scenario's file; for a name the run's folder."""
        if self._code is not None:
            return self._code
        file = scenario_file(self.played)
        return file.parent if file.suffix in (".yaml", ".yml") else self._place

    @property
    def own_files(self) -> dict[str, Path]:
        """The files of the user's own classes beside the scenario, by the option that names them."""
        files = {option: code_file(name, self.code_folder) for option, name in self.own_classes.items()}
        return {option: file for option, file in files.items() if file.is_file()}

    @property
    def own_classes(self) -> dict[str, str]:
        """The user's own classes, such as `mine:Net`, by the option that names them."""
        named = {option: getattr(self, option) for option in OWN}
        return {option: name for option, name in named.items() if ":" in name}


LEARNS: Final = "ppo"
"""The agent that its run trains."""

UNTRAINED: Final = ("random", "oracle", "human")
"""Agents without a network: chance, the scenario's script, a person."""

MODEL_PREFIX: Final = "llm:"
"""How the names of language models begin."""

RIVAL_PREFIX: Final = "rival:"
"""How the names of a scenario's rivals begin."""

PARTNERS_FOLDER: Final = "partners"
"""Where a run keeps the networks that played with its agent."""

SCENARIO_FOLDER: Final = "scenario"
"""Where a folder keeps the files of the scenario that it is about."""


def scenario_file(spec: str) -> Path:
    """`a+b/c.yaml+variant?x=1` -> `a+b/c.yaml`."""
    path = Path(spec.partition("?")[0])
    return path.parent / path.name.partition("+")[0]


def scenario_in(folder: Path, spec: str) -> str:
    """A scenario that a file in the folder names, as it is loaded from here: the copy in there, if there is one."""
    file = scenario_file(spec)
    kept = file.parts[:1] == (SCENARIO_FOLDER,) and (folder / file).is_file()
    return f"{folder.as_posix()}/{spec}" if kept else spec


def code_file(name: str, folder: Path) -> Path:
    """Where the class `module:Class` is looked for first."""
    return folder.resolve() / (name.partition(":")[0].replace(".", "/") + ".py")


def _options(key: str, value: Any) -> tuple[str, ...]:
    fields = RunConfig.model_fields.items()
    return tuple(name for name, field in fields if field.json_schema_extra[key] == value)  # type: ignore[index]


FLAGS: Final = _options("role", "flag")
"""Options with a flag of their own, under its name with `_` for `-`."""

HYPER: Final = _options("role", "hyper")
"""Options given by `--hyper`."""

WITHOUT_EFFECT: Final = frozenset(_options("result", False))
"""Options that do not change what is computed in an update; a resumed run may have others."""


class Preset(NamedTuple):
    """Values of several options under one name, and where they come from."""

    values: Mapping[str, Any]
    source: str


_PAPER: Final[Mapping[str, Any]] = {
    "frames": 30_000_000,
    "envs": 16,
    "horizon": 40,
    "bptt": 10,
    # One rollout of 640 frames is one minibatch: the released code's batch of 1280 exceeds what it collects.
    "minibatches": 1,
    "lr": 1e-4,
    "adam_eps": 1e-5,
    "gae_lambda": 0.99,
    "clip_value": True,
    "normalize_advantages": False,
    "update": "chunks",
    "loss": "per_head",
}

NET_PRESETS: Final[Mapping[str, Preset]] = {
    "paper-reference": Preset(_PAPER, "SocialAI 1.0, table of hyper-parameters; update of the released code"),
    "paper-reference-tuned": Preset(
        {**_PAPER, "bptt": 5, "adam_eps": 1e-8}, "SocialAI 1.0, the released run scripts' tuned variant"
    ),
}
"""Networks that bring numbers of their own."""

_ALONE: Final = Preset({}, "PPO from the reward alone, which is what the paper's experiments compare")

RECIPES: Final[Mapping[str, Preset]] = {
    "plain": _ALONE,
    "paper": _ALONE,
    "guided": Preset(
        {
            "guide": "script",
            "guide_share": 0.7,
            "epochs": 2,
            "minibatches": 16,
            "lr": 3e-3,
            "lr_end": 1e-4,
            # The rest keeps what was imitated. Scaled to deviation 1, advantages are noise where the policy succeeds.
            "normalize_advantages": False,
            "entropy_coef": 0.0,
            # Remembered for longer, imitation's tiny gradients make PPO's first steps up to six times too long.
            "adam_beta2": 0.95,
            "target_kl": 0.02,
        },
        "docs/mastery.md: behaviour cloning of the scenario's script (Pomerleau 1991), then PPO",
    ),
}
"""Ways of training: which numbers `--recipe` stands for."""


def configure(recipe: str = "plain", **given: Any) -> RunConfig:
    """Make a configuration from a recipe, the preset of a network, and single options; later ones override.

    Args:
        recipe: `plain`, `paper` or `guided`.
        given: options of `RunConfig` by name. Where `envs` is below the preset's minibatches, the number of minibatches
            is `envs`.

    Raises:
        ValueError: there is no such recipe or option, or a value is out of bounds (pydantic's ValidationError).
    """
    if recipe not in RECIPES:
        raise ValueError(f"recipe: got {recipe!r}, expected one of {', '.join(RECIPES)}")
    preset = NET_PRESETS.get(given.get("net", ""), Preset({}, ""))
    values = {"recipe": recipe, **RECIPES[recipe].values, **preset.values, **given}
    if "minibatches" not in given and isinstance(values.get("envs"), int):
        usual = values.get("minibatches", RunConfig.model_fields["minibatches"].default)
        values["minibatches"] = max(1, min(usual, values["envs"]))
    return RunConfig(**values)
