"""A program that looks like `socialai run` and `socialai evaluate` from outside, and learns nothing, quickly.

Its weights are a chain of digests, one for each update, so they tell whether an update was left out or made twice.
"""

import argparse
import hashlib
import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

FRAMES_OF_AN_UPDATE = 100


def run(words: list[str]) -> None:
    parser = argparse.ArgumentParser()
    for option in ("out", "resume", "config"):
        parser.add_argument(f"--{option}", type=Path)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args(words)
    folder = given.resume or given.out
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / "config.json"
    if given.out:
        assert not config.exists(), "--out: the folder holds a run already"
        asked = {"frames": 0, "checkpoint_every": 0, "envs": 0} | json.loads(given.config.read_text())
        config.write_text(json.dumps(asked))
    settings = json.loads(config.read_text())
    if settings["envs"] == 13:
        print("thirteen environments bring bad luck", file=sys.stderr)
        sys.exit(1)
    digest = train(folder, settings) if settings["agent"] == "ppo" else settings["agent"]
    rate = int(hashlib.sha256(digest.encode()).hexdigest()[:4], 16) / 0xFFFF
    result = {"frames": settings["frames"], "frames_per_second": 1000.0, "digest": digest}
    (folder / "result.json").write_text(json.dumps(result | {"eval": {"success_rate": rate}}))


def train(folder: Path, settings: dict) -> str:
    """Weights after all updates, from the newest checkpoint on; SIGTERM ends it with one more."""
    wishes: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, frame: wishes.append(number))
    checkpoints = folder / "checkpoints"
    checkpoints.mkdir(exist_ok=True)
    found = sorted(checkpoints.glob("*.safetensors"))
    frames, digest = (
        (int(found[-1].stem), found[-1].read_text()) if found else (0, f"seed {settings['seed']}")
    )
    rows = (folder / "metrics.jsonl").read_text().splitlines() if frames else []
    rows = [row for row in rows if json.loads(row)["frames"] <= frames]
    (folder / "metrics.jsonl").write_text("".join(row + "\n" for row in rows))
    while frames < settings["frames"]:
        time.sleep(float(os.environ.get("PRETEND_SECONDS", "0")))
        frames += FRAMES_OF_AN_UPDATE
        digest = hashlib.sha256(digest.encode()).hexdigest()
        with open(folder / "metrics.jsonl", "a") as file:
            file.write(json.dumps({"frames": frames, "frames_per_second": 1000.0}) + "\n")
        if wishes or frames // FRAMES_OF_AN_UPDATE % settings["checkpoint_every"] == 0:
            temporary = checkpoints / "new"
            temporary.write_text(digest)
            temporary.rename(checkpoints / f"{frames:015d}.safetensors")
        if wishes:
            sys.exit(128 + wishes[0])
    return digest


def perform(folder: Path, run_id: str) -> Any:
    """`work.perform` in the worker of an engine, which is a process that does not know of a test's patches."""
    from socialai_dsl.experiments import work

    work.PROGRAM = "pretend"
    return work.perform(folder, run_id)


def evaluate(words: list[str]) -> None:
    scenarios = [words[i + 1] for i, word in enumerate(words) if word == "--on"]
    print(
        json.dumps(
            [{"scenario": name, "eval": {"success_rate": 0.5}, "program_sha256": None} for name in scenarios]
        )
    )


if __name__ == "__main__":
    (run if sys.argv[1] == "run" else evaluate)(sys.argv[2:])
