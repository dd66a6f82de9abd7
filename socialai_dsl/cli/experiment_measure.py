"""Short measurements of how fast networks learn on this machine, for estimates."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Final

from socialai_dsl.errors import RunFailed
from socialai_dsl.experiments.arguments import typed
from socialai_dsl.experiments.estimate import Speeds, remember
from socialai_dsl.experiments.folder import PlannedRun
from socialai_dsl.runs.folder import METRICS

# A few updates of either kind of network: 8,192 frames each for `fast`, 640 for the paper's presets.
_FRAMES: Final = {"paper-reference": 2_560, "paper-reference-tuned": 2_560}
_USUAL_FRAMES: Final = 24_576


def measure_unknown(runs: Sequence[PlannedRun], speeds: Speeds, stream: IO[str]) -> None:
    """Measure every network of which no run tells the speed, and remember it for this machine.

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
        print(f"measuring {net} on {condition['scenario']} ...", file=stream, flush=True)
        remember(net, _measured(run))
    speeds.look_again()


def _measured(run: PlannedRun) -> float:
    """Frames per second after the first update, in which code is compiled and memory is found."""
    options = run.condition["options"]
    frames = _FRAMES.get(str(options["net"]), _USUAL_FRAMES)
    with tempfile.TemporaryDirectory() as place:
        command = [
            sys.executable,
            "-m",
            "socialai_dsl",
            "run",
            run.condition["scenario"],
            "--frames",
            str(frames),
        ]
        for key in ("net", "envs", "threads", "device", "precision", "hyper"):
            if key in options:
                command += typed(key, options[key])
        command += ["--eval-episodes", "1", "--out", place + "/run"]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            raise RunFailed(f"the measurement broke down: {done.stderr.strip()}")
        lines = (Path(place) / "run" / METRICS).read_text(encoding="utf-8").splitlines()
    rows = [json.loads(line) for line in lines]
    later = rows[1:] or rows
    return len(later) / sum(1 / float(row["frames_per_second"]) for row in later)
