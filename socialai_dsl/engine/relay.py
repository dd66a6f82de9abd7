"""Hands calls to threads that wait for them awake, since waking a thread takes as long as a step of a thousand rows.

A waiting thread asks one word of memory over and over. After a tenth of a millisecond without work it goes to sleep, so
that whoever steps now and then, as a trainer does, has its core back. The machine code is written out here,
because it needs atomic loads and stores, which neither Python nor Numba has.
"""

import ctypes
import threading
import time
import weakref
from collections.abc import Sequence
from enum import IntEnum
from functools import cache
from typing import Any, Final

import llvmlite.binding as llvm

from socialai_dsl.engine.machine import Call, addresses_of, load_assembly

_SPINS: Final = 5_000
"""How often a thread asks before it sleeps: about a tenth of a millisecond, two on processors that pause longer."""

_NAP: Final = 50e-6
"""Seconds between two looks at a thread that had to be woken."""


class _Word(IntEnum):
    """What two threads tell each other, int64 each; those written by one and the other lie in lines of their own."""

    POSTED = 0  # how many calls were posted
    FUNCTION = 1  # address of the one to make
    ARGUMENTS = 2  # address of its arguments
    DONE = 8  # how many calls were made
    RESULT = 9  # of the last
    ASLEEP = 10  # 1: the thread sleeps, or is about to
    END = 16


_CODE: Final = f"""
declare void @llvm.PAUSE()

define i64 @socialai_dsl_post(ptr %words, i64 %function, ptr %arguments) {{
  %function_at = getelementptr i64, ptr %words, i64 {_Word.FUNCTION.value}
  store i64 %function, ptr %function_at
  %arguments_at = getelementptr i64, ptr %words, i64 {_Word.ARGUMENTS.value}
  store ptr %arguments, ptr %arguments_at
  %before = load i64, ptr %words
  %posted = add i64 %before, 1
  store atomic i64 %posted, ptr %words seq_cst, align 8
  %asleep_at = getelementptr i64, ptr %words, i64 {_Word.ASLEEP.value}
  %asleep = load atomic i64, ptr %asleep_at seq_cst, align 8
  ret i64 %asleep
}}

define i64 @socialai_dsl_is_done(ptr %words, i64 %spins) {{
entry:
  %posted = load i64, ptr %words
  %done_at = getelementptr i64, ptr %words, i64 {_Word.DONE.value}
  br label %ask
ask:
  %spin = phi i64 [ 0, %entry ], [ %next, %again ]
  %done = load atomic i64, ptr %done_at acquire, align 8
  %over = icmp eq i64 %done, %posted
  br i1 %over, label %yes, label %no
no:
  %next = add i64 %spin, 1
  %patient = icmp ult i64 %next, %spins
  br i1 %patient, label %again, label %late
again:
  call void @llvm.PAUSE()
  br label %ask
yes:
  ret i64 1
late:
  ret i64 0
}}

define i64 @socialai_dsl_stand_by(ptr %words, i64 %spins) {{
entry:
  %function_at = getelementptr i64, ptr %words, i64 {_Word.FUNCTION.value}
  %arguments_at = getelementptr i64, ptr %words, i64 {_Word.ARGUMENTS.value}
  %done_at = getelementptr i64, ptr %words, i64 {_Word.DONE.value}
  %result_at = getelementptr i64, ptr %words, i64 {_Word.RESULT.value}
  %asleep_at = getelementptr i64, ptr %words, i64 {_Word.ASLEEP.value}
  store atomic i64 0, ptr %asleep_at seq_cst, align 8
  br label %ask
ask:
  %spin = phi i64 [ 0, %entry ], [ %next, %again ], [ 0, %work ], [ 0, %stay ]
  %done = load i64, ptr %done_at
  %posted = load atomic i64, ptr %words acquire, align 8
  %idle = icmp eq i64 %posted, %done
  br i1 %idle, label %rest, label %work
work:
  %address = load i64, ptr %function_at
  %function = inttoptr i64 %address to ptr
  %arguments = load ptr, ptr %arguments_at
  %result = call i64 %function(ptr %arguments)
  store i64 %result, ptr %result_at
  store atomic i64 %posted, ptr %done_at release, align 8
  br label %ask
rest:
  %next = add i64 %spin, 1
  %patient = icmp ult i64 %next, %spins
  br i1 %patient, label %again, label %tired
again:
  call void @llvm.PAUSE()
  br label %ask
tired:
  store atomic i64 1, ptr %asleep_at seq_cst, align 8
  %last = load atomic i64, ptr %words seq_cst, align 8
  %nothing = icmp eq i64 %last, %done
  br i1 %nothing, label %sleep, label %stay
stay:
  store atomic i64 0, ptr %asleep_at seq_cst, align 8
  br label %ask
sleep:
  ret i64 0
}}
"""


@cache
def _functions() -> tuple[Any, Any, Any]:
    """`post`, which keeps the interpreter's lock, and `is_done` and `stand_by`, which let other threads run."""
    pause = "x86.sse2.pause" if llvm.get_process_triple().startswith("x86_64") else "donothing"
    names = ("socialai_dsl_post", "socialai_dsl_is_done", "socialai_dsl_stand_by")
    post, is_done, stand_by = load_assembly(_CODE.replace("llvm.PAUSE", f"llvm.{pause}"), names)
    word, pointer = ctypes.c_int64, ctypes.c_void_p
    waits = ctypes.CFUNCTYPE(word, pointer, word)
    return ctypes.PYFUNCTYPE(word, pointer, word, pointer)(post), waits(is_done), waits(stand_by)


Posts = Sequence[tuple[int, Any]]
"""For each thread the address of a function, and of its arguments."""


def posts_of(calls: Sequence[Call]) -> Posts:
    """Prepared calls as they are posted."""
    return [addresses_of(call) for call in calls]


class _Desk:
    """What a thread and those who post to it share."""

    def __init__(self) -> None:
        # One line of the cache more than is needed, so that the words can begin with a line.
        memory = (ctypes.c_int64 * (_Word.END + 8))()
        start = ctypes.addressof(memory)
        self._memory = memory
        self.words = start + -start % 64
        self.wake = threading.Event()
        self.closed = False

    def serve(self) -> None:
        """Make the calls that are posted, until the desk is closed."""
        stand_by = _functions()[2]
        while not self.closed:
            stand_by(self.words, _SPINS)
            self.wake.wait()
            self.wake.clear()

    def result(self) -> int:
        """What the last call returned."""
        return int(ctypes.c_int64.from_address(self.words + 8 * _Word.RESULT).value)


class Relay:
    """Threads that each make a call while the caller makes one itself.

    A thread lives until the relay is closed or forgotten.
    """

    def __init__(self, threads: int) -> None:
        """Start this many threads beside the caller's."""
        self._desks = [_Desk() for _ in range(threads)]
        self._threads = [threading.Thread(target=desk.serve, daemon=True) for desk in self._desks]
        for thread in self._threads:
            thread.start()
        self._finish = weakref.finalize(self, _close, self._desks, self._threads)

    def make(self, own: Call, others: Posts) -> int:
        """Make a call, and let each thread make one; the sum of what they return."""
        post, is_done, _ = _functions()
        for desk, (function, arguments) in zip(self._desks, others, strict=True):
            if post(desk.words, function, arguments):
                desk.wake.set()
        total = own()
        for desk, thread in zip(self._desks, self._threads, strict=True):
            while not is_done(desk.words, _SPINS):
                if not thread.is_alive():  # this process was forked from the one that has the thread
                    raise RuntimeError(_FORKED)
                time.sleep(_NAP)
            total += desk.result()
        return total

    def close(self) -> None:
        """Let the threads go."""
        self._finish()


def _close(desks: Sequence[_Desk], threads: Sequence[threading.Thread]) -> None:
    for desk in desks:
        desk.closed = True
        desk.wake.set()
    for thread in threads:
        if thread is not threading.current_thread():
            thread.join()


_FORKED: Final = (
    "environments with threads of their own were made before this process was forked and have no threads in it; make "
    "them in the process that steps them"
)
