"""Model cards: an agent's training, its results, and how to load it."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

import yaml

from socialai_dsl.evaluation.summary import ending_rows, summary_rows
from socialai_dsl.runs.folder import scenario_folder_name
from socialai_dsl.trainer.config import FLAGS, WITHOUT_EFFECT, RunConfig, configure
from socialai_dsl.trainer.shipped import PREFIX

# Options that change where and how a run is made, not what it learns.
_NOT_REPEATED: Final = ("agent", "device", "eval_episodes", "wandb", "checkpoint_every", "keep_checkpoints")
# Options with a row of their own in the card, or that say nothing about the agent.
_NOT_HYPER: Final = {
    "scenario",
    "agent",
    "seed",
    "device",
    "threads",
    "eval_episodes",
    "seats",
    *WITHOUT_EFFECT,
}


def model_card(
    config: RunConfig,
    result: Mapping[str, Any],
    about: str,
    agent: str,
    weights: str,
) -> str:
    """The card of a trained agent, as Markdown with the front matter of the Hugging Face Hub.

    Args:
        config: of the run.
        result: content of the run's `result.json`.
        about: what the scenario says about itself.
        agent: what `CheckpointPolicy.load` finds it by: a run's folder, `.` for the card's own, or `shipped:NAME`.
        weights: the checkpoint, as seen from its folder.
    """
    name = f"{scenario_folder_name(config.scenario)}-{config.net}-s{config.seed}"
    trained_on = result.get("trained_on", config.scenario)
    parts = [
        f"---\n{yaml.safe_dump(_front_matter(name, config, result), sort_keys=False, allow_unicode=True)}---",
        f"# {name}",
        f"{_kind(config)} for the social grid-world `{config.scenario}`: {about.strip()} "
        f"It was trained for {result['frames']:,} frames with the network `{config.net}`.",
        "## Evaluation",
        _evaluation(result["eval"]),
        *_forms(result.get("forms", {})),
        "## How to load it",
        f"{_place(agent)}, with `pip install 'socialai-dsl[train]'`:",
        f"```python\n{_snippet(config, agent)}```",
        "## Training",
        _table(("", ""), _facts(config, result, weights)),
        f"Trained again by `{_command(config, trained_on)}`. The hyper-parameters:",
        _table(
            ("name", "value"),
            [
                (f"`{key}`", f"`{value}`")
                for key, value in config.model_dump().items()
                if key not in _NOT_HYPER
            ],
        ),
        "## Limits",
        _LIMITS.format(
            rooms=_ROOMS_OF_ONE if trained_on == config.scenario else _ROOMS_OF_MANY.format(trained_on),
            partners=_partners_tested(config, result["eval"]),
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _kind(config: RunConfig) -> str:
    return (
        "A recurrent PPO agent"
        if config.algorithm == "ppo"
        else f"An agent of the algorithm `{config.algorithm}`"
    )


_LIMITS: Final = """\
* One agent, trained with one seed. The interval says how exactly its own success rate is known, not how other seeds do.
* {rooms} Elsewhere it plays only where actions, utterances and
  pictures have the same sizes, and words it never met mean nothing to it.
* {partners}
* Its figures hold for the way of choosing actions that is named above."""


_ROOMS_OF_ONE: Final = "It was trained and tested on rooms drawn from this one program."
_ROOMS_OF_MANY: Final = (
    "It was trained on the forms that `{}` draws, and tested on rooms of the scenario itself."
)


def _partners_tested(config: RunConfig, evaluation: Mapping[str, Any]) -> str:
    """What its partners were, and so what its success says nothing about."""
    if config.seats:
        return (
            "It was trained and tested with the partners named above. What it does with others is not known."
        )
    if "seats" in evaluation:
        return (
            "It was trained and tested with itself on the other seats. What it does with other partners, "
            "`socialai crossplay` tells."
        )
    return "Its partners are scripted. Success says something about the scenario's rules, and nothing about people."


def _front_matter(name: str, config: RunConfig, result: Mapping[str, Any]) -> dict[str, Any]:
    evaluation = result["eval"]
    low, high = evaluation["success_interval"]
    metrics = [
        {
            "type": "success_rate",
            "value": round(evaluation["success_rate"], 4),
            "name": f"success rate, 95% interval {low:.3f} to {high:.3f} (Wilson)",
        },
        {"type": "mean_return", "value": round(evaluation["mean_return"], 4), "name": "mean return"},
    ]
    scenario = scenario_folder_name(config.scenario)
    return {
        "library_name": "socialai-dsl",
        "pipeline_tag": "reinforcement-learning",
        "tags": ["reinforcement-learning", "gymnasium", config.algorithm, "socialai", scenario],
        "model-index": [
            {
                "name": name,
                "results": [
                    {
                        "task": {"type": "reinforcement-learning", "name": "reinforcement learning"},
                        "dataset": {"type": "socialai-dsl", "name": scenario},
                        "metrics": metrics,
                    }
                ],
            }
        ],
    }


def _evaluation(figures: Mapping[str, Any]) -> str:
    endings = [(share, f"`{text}`", place) for share, text, place in ending_rows(figures)]
    return "\n\n".join(
        (
            _table(("on the test set", ""), summary_rows(figures)),
            _table(("of the episodes", "ended by", "where"), endings),
        )
    )


def _forms(forms: Mapping[str, Any]) -> list[str]:
    """Success in other forms of the scenario, where it was measured."""
    rows = []
    for form, figures in forms.items():
        low, high = figures["success_interval"]
        rows.append((f"`{form}`", f"{figures['success_rate']:.1%}, 95% interval {low:.1%} to {high:.1%}"))
    return [_table(("in other forms", "success"), rows)] if rows else []


def _facts(config: RunConfig, result: Mapping[str, Any], weights: str) -> list[tuple[str, str]]:
    versions = ", ".join(f"{package} {version}" for package, version in result["versions"].items())
    trained_on = result.get("trained_on")
    rows = [
        ("scenario", f"`{config.scenario}`"),
        *([("trained on", f"`{trained_on}`")] if trained_on else []),
        ("program (SHA-256)", f"`{result['program_sha256']}`"),
        ("weights", f"`{weights}`" + _precision(result.get("half_precision"))),
        ("frames", f"{result['frames']:,}"),
        ("seed", str(config.seed)),
    ]
    rows += [
        (f"on the seat {seat}", ", ".join(f"`{n}`" for n in names)) for seat, names in config.seats.items()
    ]
    if "train_seconds" in result:
        rows.append(("time", f"{result['train_seconds']:.0f} s on `{config.device}`"))
    if "trained" in result:
        rows.append(("trained", f"{result['trained']['date']}, with commit `{result['trained']['commit']}`"))
    return [*rows, ("versions", versions)]


def _precision(compared: Mapping[str, Any] | None) -> str:
    """What half precision changed, where the weights were reduced to it."""
    if compared is None:
        return ""
    return (
        ", in half precision: of the {episodes} test episodes {identical} are played with the same actions as in "
        "single precision, {only_single} are lost and {only_half} won".format(**compared)
    )


def _place(agent: str) -> str:
    if agent.startswith(PREFIX):
        return "Anywhere"
    return "From this folder" if agent == "." else "From the folder in which it was trained"


def _snippet(config: RunConfig, agent: str) -> str:
    """Code that plays one episode; a test runs it."""
    own = {option: name for option, name in config.own_classes.items() if option in ("net", "algorithm")}
    code = "".join(f", {option}={_quoted(name)}" for option, name in own.items())
    code += f", folder=Path({_quoted(config.code_folder.as_posix())})" if own else ""
    return f"""\
{"from pathlib import Path" + chr(10) * 2 if own else ""}import socialai_dsl as sd
from socialai_dsl.trainer.play import CheckpointPolicy

env = sd.make({_quoted(config.scenario)})
agent = CheckpointPolicy.load({_quoted(agent)}, env{code})
observation, info = env.reset(seed=0)
agent.reset()
ended = False
while not ended:
    observation, reward, terminated, truncated, info = env.step(agent.act(observation))
    ended = terminated or truncated
print(info["outcome"])
"""


def _quoted(text: str) -> str:
    """A text in Python, between double quotes."""
    return json.dumps(text)


def _command(config: RunConfig, scenario: str) -> str:
    """The command that trains the same agent, also where recipe and machine would choose frames and threads."""
    usual = configure(config.recipe, net=config.net, scenario=config.scenario).model_dump()
    always = ("frames", "threads")
    asked = {
        name: value for name, value in config.model_dump().items() if value != usual[name] or name in always
    }
    flags = {name: asked[name] for name in FLAGS if name in asked and name not in _NOT_REPEATED}
    if config.net != "fast":
        flags["net"] = config.net
    hyper = {
        name: value
        for name, value in asked.items()
        if name not in FLAGS and name not in ("scenario", "recipe", "seats")
    }
    given = {"recipe": config.recipe, **flags, "hyper": hyper}
    partners = [f"--seat {seat}={name}" for seat, names in config.seats.items() for name in names]
    return " ".join(
        [
            *("socialai-run", scenario, *partners),
            *(word for name, value in given.items() for word in _typed(name, value)),
        ]
    )


def _typed(name: str, value: Any) -> list[str]:
    """The words by which an option is given: a switch alone, a mapping's option once for each of its keys."""
    option = f"--{name.replace('_', '-')}"
    if isinstance(value, Mapping):
        given = (
            f"{key}={each if isinstance(each, str) else json.dumps(each)}" for key, each in value.items()
        )
        return [word for pair in given for word in (option, pair)]
    return [option] if value is True else [option, str(value)]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(text) for text in line) + " |" for line in lines)


def _cell(text: str) -> str:
    return text.strip().replace("|", "\\|").replace("\n", " ")
