"""What `make bench` prints: its rows and what they are compared with, as JSON and as a table."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from benchmarks.timing import Speed

_BUSY: Final = 0.5


@dataclass(frozen=True)
class Row:
    """One measurement, in environment steps per second.

    Attributes:
        what: the scenario, or what it is compared with.
        kind: ours; peer, an engine of another project; limit, hand-written code for one scenario.
        mix: how the agent's actions were generated.
        batch: environments stepped together; 0 is a single environment.
        speed: steps per second.
        resets: episodes ended per second of CPU time; None where it was not counted.
    """

    what: str
    kind: str
    mix: str
    batch: int
    speed: Speed
    resets: float | None


@dataclass(frozen=True)
class Memory:
    """Bytes of one environment.

    Attributes:
        what: the scenario.
        state: what persists from step to step besides the observation.
        observation: picture and tokens, which persist in place.
        call: what goes in and out of each step: actions, reward, how it ended.
    """

    what: str
    state: int
    observation: int
    call: int


@dataclass(frozen=True)
class Wait:
    """Seconds on the clock that a user waits for something.

    Attributes:
        what: for what.
        seconds, low, high: the median of some repetitions, the shortest and the longest.
    """

    what: str
    seconds: float
    low: float
    high: float


@dataclass
class Report:
    """Everything measured in one run.

    Attributes:
        load: threads that wanted a core in the minute before; None where the system does not tell.
        reference: iterations per CPU second of the reference loop.
        versions: release of each peer that was measured.
        missing: peer or limit -> why it was not measured.
    """

    machine: str
    load: float | None
    repetitions: int
    reference: float
    rows: list[Row] = field(default_factory=list)
    memory: list[Memory] = field(default_factory=list)
    waits: list[Wait] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)

    def ours_in(self, row: Row) -> float | None:
        """The first scenario's speed per CPU second in parts of a peer's or limit's, in as large a batch.

        Beside a limit it is that under the same actions, beside a peer that of walking, or else of any.
        """
        if row.kind == "ours":
            return None
        own = {
            other.mix: other.speed.cpu
            for other in reversed(self.rows)
            if other.kind == "ours" and other.batch == row.batch
        }
        wanted = (row.mix,) if row.kind == "limit" else ("walk", "random")
        return next((own[mix] / row.speed.cpu for mix in wanted if mix in own), None)

    def as_json(self) -> dict[str, Any]:
        """The report as a JSON-able object; `ratio` compares machines, `ours` engines."""
        rows = []
        for row in self.rows:
            content = asdict(row)
            content |= content.pop("speed")
            rows.append(content | {"ratio": row.speed.cpu / self.reference, "ours": self.ours_in(row)})
        return {
            "machine": self.machine,
            "load": self.load,
            "repetitions": self.repetitions,
            "reference_iterations_per_second": self.reference,
            "rows": rows,
            "memory": [asdict(memory) for memory in self.memory],
            "waits": [asdict(wait) for wait in self.waits],
            "versions": self.versions,
            "missing": self.missing,
        }

    def table(self) -> str:
        """The report as text."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.machine}; one core; medians of {self.repetitions}"
        yield f"reference loop: {self.reference / 1e6:.0f} M iterations per CPU second"
        if self.load is not None and self.load >= _BUSY:
            yield f"other work was running (load {self.load:.1f} before): trust the times per CPU second"
        yield ""
        yield (
            f"{'what':<44} {'mix':<7} {'batch':>6} {'steps/s cpu':>12} {'slowest':>12} {'fastest':>12} "
            f"{'steps/s wall':>13} {'resets/s':>10} {'ratio':>8} {'ours':>8}"
        )
        for row in self.rows:
            yield self._line(row)
        yield ""
        yield "ratio: steps for every 1,000 iterations of the reference loop; compare machines by it"
        if any(row.kind != "ours" for row in self.rows):
            yield "ours: the first scenario's speed in parts of this one's, in as large a batch; walking beside a peer"
        if self.memory:
            yield ""
            yield f"{'bytes of one environment':<44} {'state':>7} {'observation':>12} {'in and out':>11} {'touched':>8}"
            for memory in self.memory:
                touched = memory.state + memory.observation + memory.call
                yield (
                    f"{memory.what[:44]:<44} {memory.state:>7} {memory.observation:>12} {memory.call:>11} "
                    f"{touched:>8}"
                )
            yield "touched: the most that a step reads or writes, all of it together"
        if self.waits:
            yield ""
            yield f"{'seconds on the clock, any core':<60} {'median':>8} {'shortest':>9} {'longest':>8}"
            for wait in self.waits:
                yield f"{wait.what[:60]:<60} {wait.seconds:>8.3f} {wait.low:>9.3f} {wait.high:>8.3f}"
        if self.missing:
            yield ""
            yield from (f"not measured: {name} ({why})" for name, why in self.missing.items())

    def _line(self, row: Row) -> str:
        batch = "Env" if row.batch == 0 else str(row.batch)
        resets = "" if row.resets is None else f"{row.resets:,.0f}"
        share = self.ours_in(row)
        ours = "" if share is None else f"{share:,.0f}x" if share >= 10 else f"{share:.2f}x"
        return (
            f"{row.what[:44]:<44} {row.mix:<7} {batch:>6} {row.speed.cpu:>12,.0f} {row.speed.cpu_low:>12,.0f} "
            f"{row.speed.cpu_high:>12,.0f} {row.speed.wall:>13,.0f} {resets:>10} "
            f"{1000 * row.speed.cpu / self.reference:>8.2f} {ours:>8}"
        )
