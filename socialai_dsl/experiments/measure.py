"""Short measurements of how fast networks learn on this machine, for estimates."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from socialai_dsl.atomic import write_json
from socialai_dsl.errors import RunFailed
from socialai_dsl.experiments.estimate import Speeds, remember
from socialai_dsl.experiments.folder import PlannedRun
from socialai_dsl.runs.folder import METRICS, OPTIONS

# A few updates of either kind of network: 8,192 frames each for `fast`, 640 for the paper's presets.
_FRAMES: Final = {"paper-reference": 2_560, "paper-reference-tuned": 2_560}
_USUAL_FRAMES: Final = 24_576


def measure_unknown(runs: Sequence[PlannedRun], speeds: Speeds, say: Callable[[str], None]) -> None:
    """Measure every network of which no run tells the speed, and remember it for this machine.

    Args:
        runs: of the experiment.
        speeds: what is known, which takes note.
        say: told what is measured.

    Raises:
        RunFailed: such a run broke down.
    """
    measured: set[str] = set()
    for run in runs:
        condition = run.condition
        net = str(condition["options"].get("net"))
        if condition["frames"] is None or net in measured or speeds.is_from_runs(condition):
            continue
        measured.add(net)
        say(f"measuring {net} on {condition['scenario']} ...")
        remember(net, _measured(run))
    speeds.look_again()


def _measured(run: PlannedRun) -> float:
    """Frames per second after the first update, in which code is compiled and memory is found."""
    asked = run.options
    asked |= {"frames": _FRAMES.get(str(asked["net"]), _USUAL_FRAMES), "eval_episodes": 1, "wandb": None}
    with tempfile.TemporaryDirectory() as place:
        file, folder = Path(place, OPTIONS), Path(place, "run")
        write_json(file, asked)
        command = [sys.executable, "-m", "socialai_dsl", "run", "--config", str(file), "--out", str(folder)]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            raise RunFailed(f"the measurement broke down: {done.stderr.strip()}")
        rows = [json.loads(line) for line in (folder / METRICS).read_text(encoding="utf-8").splitlines()]
    later = rows[1:] or rows
    return len(later) / sum(1 / float(row["frames_per_second"]) for row in later)
