"""This module sends a run's figures to Weights & Biases, if it is installed and asked for."""

from __future__ import annotations

import importlib
import uuid
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_ID_FILE = "wandb_id.txt"


class TrackingWarning(UserWarning):
    """Figures are not sent any more; the run goes on."""


class WandbTracker:
    """Sends figures to a project of Weights & Biases, where they are drawn over frames.

    A resumed run goes on where it was: what it does again is not sent twice. Once begun, nothing that goes wrong
    stops the training; it is said once, and the figures stay in `metrics.jsonl`.
    """

    def __init__(self, project: str, run_dir: Path, config: Mapping[str, Any], name: str) -> None:
        """Send to `project`.

        Args:
            project: its name.
            run_dir: folder of the run, where W&B keeps its own files as well.
            config: what the run was asked for, shown beside its curves.
            name: what the run is called there.

        Raises:
            ValueError: the package is not installed.
        """
        try:
            self._wandb = importlib.import_module("wandb")
        except ImportError:
            raise ValueError(
                "W&B is not installed: pip install 'socialai-dsl[wandb]', or leave out --wandb"
            ) from None
        self._project, self._run_dir, self._config, self._name = project, run_dir, dict(config), name
        self._run: Any = None

    def open(self) -> None:
        """See `Tracker.open`."""
        try:
            self._run = self._wandb.init(
                project=self._project,
                name=self._name,
                id=self._identity(),
                dir=str(self._run_dir),
                config=self._config,
                resume="allow",
                # The terminal shows the progress; W&B is not to copy what is printed.
                settings=self._wandb.Settings(console="off"),
            )
        except Exception as error:
            raise ValueError(f"W&B cannot begin: {type(error).__name__}: {error}") from error

    def write(self, scalars: Mapping[str, float], frames: int) -> None:
        """See `Tracker.write`."""
        if self._run is None:
            return
        try:
            # A resumed run makes again what came after its checkpoint.
            if frames >= self._run.step:
                self._run.log(dict(scalars), step=frames)
        except Exception as error:
            self._give_up(error)

    def close(self) -> None:
        """See `Tracker.close`."""
        if self._run is None:
            return
        try:
            self._run.finish()
        except Exception as error:
            self._give_up(error)
        self._run = None

    def _give_up(self, error: Exception) -> None:
        self._run = None
        warnings.warn(
            f"W&B gets no more figures ({type(error).__name__}: {error}); training goes on, and they are all in "
            f"{self._run_dir / 'metrics.jsonl'}",
            TrackingWarning,
            stacklevel=2,
        )

    def _identity(self) -> str:
        """The run's name for machines, made once and kept in its folder."""
        path = self._run_dir / _ID_FILE
        if path.exists():
            return path.read_text(encoding="utf-8").strip()
        made = uuid.uuid4().hex[:12]
        path.write_text(made + "\n", encoding="utf-8")
        return made
