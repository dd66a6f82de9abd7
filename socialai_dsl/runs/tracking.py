"""A run's figures, sent to Weights & Biases."""

import contextlib
import importlib
import uuid
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from socialai_dsl.runs.folder import METRICS

_ID_FILE = "wandb_id.txt"


class TrackingWarning(UserWarning):
    """Figures are not sent any more; the run goes on."""


@dataclass
class WandbTracker:
    """Sends figures to a project of Weights & Biases, where they are drawn over frames.

    A resumed run goes on where it was: what it does again is not sent twice. Once begun, nothing that goes wrong
    stops the training; it is said once, and the figures stay in `metrics.jsonl`.

    Attributes:
        project: its name.
        run_dir: folder of the run, where W&B keeps its own files as well.
        config: what the run was asked for, shown beside its curves.
        name: what the run is called there.

    Raises:
        ValueError: the package is not installed.
    """

    project: str
    run_dir: Path
    config: Mapping[str, Any]
    name: str
    _run: Any = field(default=None, init=False)

    def __post_init__(self) -> None:
        try:
            self._wandb = importlib.import_module("wandb")
        except ImportError:
            raise ValueError(
                "W&B is not there: pip install 'socialai-dsl[wandb]', or leave out --wandb"
            ) from None

    def open(self) -> None:
        """Begin, or go on where the run was; ValueError says why it cannot."""
        path = self.run_dir / _ID_FILE
        if not path.exists():
            path.write_text(uuid.uuid4().hex[:12] + "\n", encoding="utf-8")
        try:
            self._run = self._wandb.init(
                project=self.project,
                name=self.name,
                config=dict(self.config),
                id=path.read_text(encoding="utf-8").strip(),
                dir=str(self.run_dir),
                resume="allow",
                # The terminal shows the progress; W&B is not to copy what is printed.
                settings=self._wandb.Settings(console="off"),
            )
        except Exception as error:
            raise ValueError(f"W&B cannot begin: {type(error).__name__}: {error}") from error

    def write(self, scalars: Mapping[str, float], frames: int) -> None:
        """Take the figures of the update that reached `frames`."""
        with self._forgiven():
            # A resumed run makes again what came after its checkpoint.
            if self._run is not None and frames >= self._run.step:
                self._run.log(dict(scalars), step=frames)

    def close(self) -> None:
        """End."""
        with self._forgiven():
            if self._run is not None:
                self._run.finish()
        self._run = None

    @contextlib.contextmanager
    def _forgiven(self) -> Iterator[None]:
        """Give up, with a warning, where sending fails."""
        try:
            yield
        except Exception as error:
            self._run = None
            warnings.warn(
                f"W&B gets no more figures ({type(error).__name__}: {error}); training goes on, and they are all in "
                f"{self.run_dir / METRICS}",
                TrackingWarning,
                stacklevel=2,
            )
