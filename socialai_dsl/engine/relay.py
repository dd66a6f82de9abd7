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
from itertools import chain
from typing import Any, Final, NamedTuple

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


class _Order(IntEnum):
    """The calls that are made side by side, int64 each: what they returned in all, the caller's, and the others."""

    SUM = 0
    FUNCTION = 1
    ARGUMENTS = 2
    OTHERS = 3  # function and arguments of each


class _Progress(IntEnum):
    """How far the calls are: made; not all of them are; or some thread has to be woken.

    Of calls that depend on others SECOND is added to it, or it is REFUSED: the others returned what forbids them.
    """

    DONE = 0
    LATE = 1
    ASLEEP = 2
    REFUSED = 3
    SECOND = 4


_BOTH: Final = int(_Progress.SECOND + _Progress.DONE)
_SUM: Final = int(_Order.SUM)

_CODE: Final = f"""
declare void @llvm.PAUSE()

define i64 @socialai_dsl_share(ptr %order, ptr %desks, i64 %count, i64 %spins) {{
entry:
  br label %post
post:
  %desk = phi i64 [ 0, %entry ], [ %next, %post ]
  %sleepers = phi i64 [ 0, %entry ], [ %asleep_now, %post ]
  %words_at = getelementptr ptr, ptr %desks, i64 %desk
  %words = load ptr, ptr %words_at
  %twice = shl i64 %desk, 1
  %call_number = add i64 %twice, {_Order.OTHERS.value}
  %call_at = getelementptr i64, ptr %order, i64 %call_number
  %function = load i64, ptr %call_at
  %function_at = getelementptr i64, ptr %words, i64 {_Word.FUNCTION.value}
  store i64 %function, ptr %function_at
  %given_at = getelementptr i64, ptr %call_at, i64 1
  %arguments = load i64, ptr %given_at
  %arguments_at = getelementptr i64, ptr %words, i64 {_Word.ARGUMENTS.value}
  store i64 %arguments, ptr %arguments_at
  %before = load i64, ptr %words
  %posted = add i64 %before, 1
  store atomic i64 %posted, ptr %words seq_cst, align 8
  %asleep_at = getelementptr i64, ptr %words, i64 {_Word.ASLEEP.value}
  %asleep = load atomic i64, ptr %asleep_at seq_cst, align 8
  %asleep_now = or i64 %sleepers, %asleep
  %next = add i64 %desk, 1
  %more = icmp ult i64 %next, %count
  br i1 %more, label %post, label %posted_all
posted_all:
  %awake = icmp eq i64 %asleep_now, 0
  br i1 %awake, label %go, label %wake
wake:
  ret i64 {_Progress.ASLEEP.value}
go:
  %progress = tail call i64 @socialai_dsl_finish(ptr %order, ptr %desks, i64 %count, i64 %spins)
  ret i64 %progress
}}

define i64 @socialai_dsl_share_both(ptr %first, ptr %second, ptr %desks, i64 %count, i64 %spins) {{
  %early = call i64 @socialai_dsl_share(ptr %first, ptr %desks, i64 %count, i64 %spins)
  %made = icmp eq i64 %early, {_Progress.DONE.value}
  br i1 %made, label %ask, label %not_yet
not_yet:
  ret i64 %early
ask:
  %sum = load i64, ptr %first
  %fine = icmp eq i64 %sum, 0
  br i1 %fine, label %go, label %refused
refused:
  ret i64 {_Progress.REFUSED.value}
go:
  %late = call i64 @socialai_dsl_share(ptr %second, ptr %desks, i64 %count, i64 %spins)
  %progress = add i64 %late, {_Progress.SECOND.value}
  ret i64 %progress
}}

define i64 @socialai_dsl_finish(ptr %order, ptr %desks, i64 %count, i64 %spins) {{
  %own_at = getelementptr i64, ptr %order, i64 {_Order.FUNCTION.value}
  %address = load i64, ptr %own_at
  %function = inttoptr i64 %address to ptr
  %arguments_at = getelementptr i64, ptr %order, i64 {_Order.ARGUMENTS.value}
  %arguments = load ptr, ptr %arguments_at
  %result = call i64 %function(ptr %arguments)
  store i64 %result, ptr %order
  %progress = tail call i64 @socialai_dsl_wait(ptr %order, ptr %desks, i64 %count, i64 %spins)
  ret i64 %progress
}}

define i64 @socialai_dsl_wait(ptr %order, ptr %desks, i64 %count, i64 %spins) {{
entry:
  %own = load i64, ptr %order
  br label %turn
turn:
  %desk = phi i64 [ 0, %entry ], [ %next, %done_one ]
  %total = phi i64 [ %own, %entry ], [ %sum, %done_one ]
  %words_at = getelementptr ptr, ptr %desks, i64 %desk
  %words = load ptr, ptr %words_at
  %posted = load i64, ptr %words
  %done_at = getelementptr i64, ptr %words, i64 {_Word.DONE.value}
  br label %ask
ask:
  %spin = phi i64 [ 0, %turn ], [ %again_number, %again ]
  %done = load atomic i64, ptr %done_at acquire, align 8
  %over = icmp eq i64 %done, %posted
  br i1 %over, label %done_one, label %no
no:
  %again_number = add i64 %spin, 1
  %patient = icmp ult i64 %again_number, %spins
  br i1 %patient, label %again, label %late
again:
  call void @llvm.PAUSE()
  br label %ask
late:
  ret i64 {_Progress.LATE.value}
done_one:
  %result_at = getelementptr i64, ptr %words, i64 {_Word.RESULT.value}
  %result = load i64, ptr %result_at
  %sum = add i64 %total, %result
  %next = add i64 %desk, 1
  %more = icmp ult i64 %next, %count
  br i1 %more, label %turn, label %finished
finished:
  store i64 %sum, ptr %order
  ret i64 {_Progress.DONE.value}
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


class _Functions(NamedTuple):
    """The machine code, which lets other threads run meanwhile."""

    share: Any
    share_both: Any
    finish: Any
    wait: Any
    stand_by: Any


@cache
def _functions() -> _Functions:
    pause = "x86.sse2.pause" if llvm.get_process_triple().startswith("x86_64") else "donothing"
    names = [f"socialai_dsl_{name}" for name in _Functions._fields]
    code = load_assembly(_CODE.replace("llvm.PAUSE", f"llvm.{pause}"), names)
    word, pointer = ctypes.c_int64, ctypes.c_void_p
    takes = {"share_both": (pointer, pointer, pointer, word, word), "stand_by": (pointer, word)}
    usual = (pointer, pointer, word, word)
    return _Functions(
        *(
            ctypes.CFUNCTYPE(word, *takes.get(name, usual))(address)
            for name, address in zip(_Functions._fields, code, strict=True)
        )
    )


def order_of(calls: Sequence[Call]) -> Any:
    """Prepared calls, which must live on, as `Relay.make` takes them, the caller's first."""
    numbers = [0, *chain.from_iterable(map(addresses_of, calls))]
    return (ctypes.c_int64 * len(numbers))(*numbers)


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
        stand_by = _functions().stand_by
        while not self.closed:
            stand_by(self.words, _SPINS)
            self.wake.wait()
            self.wake.clear()


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
        self._words = (ctypes.c_int64 * threads)(*(desk.words for desk in self._desks))
        self._to = ctypes.addressof(self._words), threads, _SPINS
        self._functions = _functions()

    def make(self, order: Any) -> int:
        """Make a call, and let each thread make one (`order_of`); the sum of what they return."""
        return self._made(order, self._functions.share(order, *self._to))

    def make_both(self, first: Any, second: Any) -> int | None:
        """Make calls as `make` does, then others if the first returned 0; None if they did not."""
        progress = self._functions.share_both(first, second, *self._to)
        if progress == _BOTH:  # the usual case, asked for first
            return int(second[_SUM])
        if progress >= _Progress.SECOND:
            return self._made(second, progress - _Progress.SECOND)
        if progress == _Progress.REFUSED or self._made(first, progress) != 0:
            return None
        return self.make(second)

    def _made(self, order: Any, progress: int) -> int:
        """See to it that calls which have come so far are made; the sum of what they return."""
        if progress == _Progress.ASLEEP:
            for desk in self._desks:
                desk.wake.set()
            progress = self._functions.finish(order, *self._to)
        while progress != _Progress.DONE:
            if not all(
                thread.is_alive() for thread in self._threads
            ):  # they are in the process that forked this one
                raise RuntimeError(_FORKED)
            time.sleep(_NAP)
            progress = self._functions.wait(order, *self._to)
        return int(order[_SUM])

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
