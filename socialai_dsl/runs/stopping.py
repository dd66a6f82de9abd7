"""Ctrl-C and SIGTERM that wait until the work can be left."""

import contextlib
import os
import signal
import threading
from types import FrameType, TracebackType
from typing import Final, Self

_STANDARD_ERROR: Final = 2
_MESSAGE: Final = b"\nstopping after this update, with a checkpoint; once more stops at once\n"


class Stop:
    """Remembers Ctrl-C or SIGTERM while a `with` statement lasts; a second one acts at once.

    Only the main thread gets signals: in others nothing is remembered.

    A signal that the process ignores, as one in the background of a shell ignores Ctrl-C, stays ignored.
    """

    def __init__(self) -> None:
        """Remember nothing yet."""
        self._number: int | None = None
        here = threading.current_thread() is threading.main_thread()
        numbers = (signal.SIGINT, signal.SIGTERM) if here else ()
        self._before = {number: signal.getsignal(number) for number in numbers}

    def __enter__(self) -> Self:
        for number, before in self._before.items():
            if before is not signal.SIG_IGN:
                signal.signal(number, self._remember)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)

    def wished(self) -> bool:
        """Whether a signal came."""
        return self._number is not None

    def heed(self) -> None:
        """Do now what the signal does by itself, if one came."""
        if self._number is not None:
            signal.raise_signal(self._number)

    def _remember(self, number: int, frame: FrameType | None) -> None:
        self._number = number
        self.__exit__(None, None, None)
        with contextlib.suppress(OSError):
            os.write(_STANDARD_ERROR, _MESSAGE)  # `print` may be what the signal interrupted
