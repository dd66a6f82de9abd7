"""Measure the server of a study with many participants who act every few seconds: `python -m benchmarks.study_load`."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Final

from websockets.asyncio.client import connect
from websockets.typing import Origin

_STUDY: Final = """\
study: load
consent: I agree.
blocks:
- {scenario: talkitout, episodes: 100}
"""


async def _taking(
    at: str, link: str, every: float, until: float, waits: list[float], first: list[float]
) -> None:
    """Act at about every `every` seconds, and record how long each picture takes to come."""
    came, rng, asked = time.perf_counter(), random.Random(link), 0.0
    uri = f"ws://{at}/seat/{link.rpartition('/')[2]}"
    async with connect(uri, origin=Origin(f"http://{at}"), compression=None, open_timeout=60) as line:
        async for text in line:
            screen = json.loads(text)
            now = time.perf_counter()
            if asked:
                waits.append(now - asked)
            elif screen["do"] == "play":
                first.append(now - came)
            if now > until:
                return
            asked = 0.0
            answer = {"do": "go", "on": screen["on"]}
            if screen["do"] == "play" and not screen.get("ended"):
                await asyncio.sleep(every * rng.uniform(0.5, 1.5))
                move = rng.choice(["left", "right", "forward"])
                answer |= {"do": "act", "movement": move, "said": None, "shown": 0.0, "acted": 1.0}
                asked = time.perf_counter()
            await line.send(json.dumps(answer))


async def _all(
    at: str, links: list[str], every: float, seconds: float, over: float, pid: int
) -> tuple[list[float], list[float], float]:
    """Waits of those who are all there, times to the first picture, and processor time of the server for an act."""
    waits: list[float] = []
    first: list[float] = []
    until = time.perf_counter() + over + seconds

    async def one(number: int, link: str) -> None:
        await asyncio.sleep(over * number / len(links))
        await _taking(at, link, every, until, waits, first)

    everybody = asyncio.gather(*(one(number, link) for number, link in enumerate(links)))
    await asyncio.sleep(over + every)
    waits.clear()
    used = _processor(pid)
    await asyncio.sleep(until - time.perf_counter())
    used = _processor(pid) - used
    await everybody
    return waits, first, used / len(waits)


def _memory(pid: int) -> float:
    """GiB of memory that a process has had at most."""
    for row in Path(f"/proc/{pid}/status").read_text().splitlines():
        if row.startswith("VmHWM"):
            return int(row.split()[1]) / (1 << 20)
    return float("nan")


def _processor(pid: int) -> float:
    """Seconds of processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Start a server, let participants take part, and print what was measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--participants", type=int, default=1000)
    parser.add_argument("--every", type=float, default=2.0, help="seconds between the acts of a participant")
    parser.add_argument("--seconds", type=float, default=60.0, help="for how long")
    parser.add_argument("--over", type=float, default=20.0, help="seconds over which they come")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "study.yaml").write_text(_STUDY, encoding="utf-8")
        command = [
            "study",
            "run",
            "study.yaml",
            "--port",
            "0",
            "--out",
            "out",
            "--links",
            str(given.participants),
        ]
        process = subprocess.Popen(
            [sys.executable, "-m", "socialai_dsl", *command], cwd=folder, stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None, "internal: it was asked for"
        at = process.stdout.readline().strip().rpartition("http://")[2].removesuffix("/join")
        process.stdout.readline()
        process.stdout.readline()
        links = [process.stdout.readline().strip() for _ in range(given.participants)]
        time.sleep(5)  # until it is warm
        waits, first, used = asyncio.run(_all(at, links, given.every, given.seconds, given.over, process.pid))
        memory = _memory(process.pid)
        process.terminate()
        process.wait()
    waits.sort()
    first.sort()
    share = int(0.95 * len(waits))
    print(f"{given.participants} participants, an act every {given.every:g} s: {len(waits)} acts")
    print(
        f"from an act to the picture: {1000 * median(waits):.0f} ms (median), {1000 * waits[share]:.0f} ms (95 %)"
    )
    print(f"from coming to the first picture: {median(first):.2f} s (median), {first[-1]:.2f} s at most")
    print(f"the server: {memory:.2f} GiB of memory, {1000 * used:.2f} ms of processor time for an act")


if __name__ == "__main__":
    main()
