"""This module writes a model card: what an agent is, how well it does, and how to load it, beside its weights."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import yaml

from socialai_dsl.cli import run
from socialai_dsl.cli.evaluation_report import ending_rows, summary_rows
from socialai_dsl.cli.run_folder import scenario_folder_name
from socialai_dsl.cli.settings import Settings
from socialai_dsl.experiments.arguments import typed

FILE: Final = "model_card.md"
# Options that do not change what is learnt.
_NOT_REPEATED: Final = ("scenario", "agent", "device", "eval_episodes", "wandb")
# Settings that have a row of their own in the card, or say nothing about the agent.
_NOT_HYPER: Final = ("frames", "seed", "device", "threads", "checkpoint_every", "tensorboard")


def model_card(
    settings: Settings,
    hyper: Mapping[str, Any],
    result: Mapping[str, Any],
    about: str,
    folder: Path,
    weights: Path,
) -> str:
    """The card of a trained agent, as Markdown with the front matter of the Hugging Face Hub.

    Args:
        settings: what the run was asked for.
        hyper: every number of the trainer.
        result: content of the run's `result.json`.
        about: what the scenario says about itself.
        folder: of the run.
        weights: the checkpoint in it.
    """
    name = f"{scenario_folder_name(settings.scenario)}-{settings.net}-s{settings.seed}"
    parts = [
        f"---\n{yaml.safe_dump(_front_matter(name, settings, result), sort_keys=False, allow_unicode=True)}---",
        f"# {name}",
        f"A recurrent PPO agent for the social grid-world `{settings.scenario}`: {about.strip()} "
        f"It was trained for {result['frames']:,} frames with the network `{settings.net}`.",
        "## Evaluation",
        _evaluation(result["eval"]),
        "## How to load it",
        f"{_place(folder)}, with `pip install 'socialai-dsl[train]'`:",
        f"```python\n{_snippet(settings, folder)}```",
        "## Training",
        _table(("", ""), _facts(settings, result, weights.relative_to(folder))),
        f"Trained again by `{_command(settings)}`. The hyper-parameters:",
        _table(
            ("name", "value"),
            [(f"`{key}`", f"`{value}`") for key, value in hyper.items() if key not in _NOT_HYPER],
        ),
        "## Limits",
        _LIMITS,
    ]
    return "\n\n".join(parts) + "\n"


_LIMITS: Final = """\
* One agent, trained with one seed. The interval says how exactly its own success rate is known, not how other seeds do.
* It was trained and tested on rooms drawn from this one program. Elsewhere it plays only where actions, utterances and
  pictures have the same sizes, and words it never met mean nothing to it.
* Its partners are scripted. Success says something about the scenario's rules, and nothing about people.
* Its figures hold for the way of choosing actions that is named above."""


def _front_matter(name: str, settings: Settings, result: Mapping[str, Any]) -> dict[str, Any]:
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
    scenario = scenario_folder_name(settings.scenario)
    return {
        "library_name": "socialai-dsl",
        "pipeline_tag": "reinforcement-learning",
        "tags": ["reinforcement-learning", "gymnasium", "ppo", "socialai", scenario],
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


def _facts(settings: Settings, result: Mapping[str, Any], weights: Path) -> list[tuple[str, str]]:
    versions = ", ".join(f"{package} {version}" for package, version in result["versions"].items())
    return [
        ("scenario", f"`{settings.scenario}`"),
        ("program (SHA-256)", f"`{result['program_sha256']}`"),
        ("weights", f"`{weights.as_posix()}`"),
        ("frames", f"{result['frames']:,}"),
        ("seed", str(settings.seed)),
        ("time", f"{result['train_seconds']:.0f} s on `{settings.device}`"),
        ("versions", versions),
    ]


def _place(folder: Path) -> str:
    return "From this folder" if folder == Path() else "From the folder in which it was trained"


def _snippet(settings: Settings, folder: Path) -> str:
    """Code that plays one episode; a test runs it."""
    net = f", net={settings.net!r}" if ":" in settings.net else ""
    return f"""\
import socialai_dsl as sd
from trainer.policies import CheckpointPolicy

env = sd.make({settings.scenario!r})
agent = CheckpointPolicy.load({folder.as_posix()!r}, env{net})
observation, info = env.reset(seed=0)
agent.reset()
ended = False
while not ended:
    observation, reward, terminated, truncated, info = env.step(agent.act(observation))
    ended = terminated or truncated
print(info["outcome"])
"""


def _command(settings: Settings) -> str:
    """The command that trains the same agent: what was asked for beyond the defaults."""
    parser = argparse.ArgumentParser()
    run.add_arguments(parser)
    usual, asked = vars(parser.parse_args([])), asdict(settings)
    names = [name for name in asked if name in usual and name not in _NOT_REPEATED]
    words = [word for name in names if asked[name] != usual[name] for word in typed(name, asked[name])]
    return " ".join(["socialai-run", settings.scenario, *words])


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(text) for text in line) + " |" for line in lines)


def _cell(text: str) -> str:
    return text.strip().replace("|", "\\|").replace("\n", " ")
