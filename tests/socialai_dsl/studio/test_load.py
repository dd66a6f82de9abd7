"""Twenty windows at once, each with ten actions a second, as a class that tries a scenario together would have."""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="no test of the studio without the extra `studio`")
client = pytest.importorskip("websockets.asyncio.client", reason="no test of the studio without websockets")

SCENARIO = Path(__file__).parents[3] / "scenarios" / "talkitout.yaml"
WINDOWS, PER_SECOND, SECONDS = 20, 10, 15


async def play(address: str, token: str, number: int, all_drawn: asyncio.Barrier) -> list[float]:
    """The seconds that each action of a window took."""
    own = f"ws://{address}/session?token={token}"
    async with client.connect(own, origin=f"http://{address}", max_size=None, open_timeout=120) as socket:

        async def ask(do: str, **more: Any) -> dict[str, Any]:
            await socket.send(json.dumps({"id": 1, "do": do, **more}))
            answer: dict[str, Any] = json.loads(await socket.recv())
            assert "refused" not in answer
            return answer

        await ask(
            "draw", path=SCENARIO.name, text=SCENARIO.read_text(encoding="utf-8"), room={"seed": number}
        )
        await ask("act", movement="left")
        await all_drawn.wait()
        await asyncio.sleep(
            number / WINDOWS / PER_SECOND
        )  # people do not press their keys at the same moment
        took = []
        for k in range(SECONDS * PER_SECOND):
            begun = time.perf_counter()
            more = (await ask("act", movement=("left", "right")[k % 2]))["more"]
            took.append(time.perf_counter() - begun)
            if "ended" in more["moments"][-1]:
                await ask("begin", room={"seed": k})
            await asyncio.sleep(max(0.0, begun + 1 / PER_SECOND - time.perf_counter()))
        return took


@pytest.mark.slow
def test_twenty_windows_are_answered_at_once(tmp_path: Path) -> None:
    (tmp_path / SCENARIO.name).write_bytes(SCENARIO.read_bytes())
    command = [sys.executable, "-m", "socialai_dsl", "studio", str(tmp_path), "--no-browser", "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        found = re.search(r"http://([^/]+)/\?token=(\S+)", process.stdout.readline())
        assert found is not None
        address, token = found.groups()
        begun = time.perf_counter()
        drawn = 0.0

        async def windows() -> list[list[float]]:
            nonlocal drawn
            all_drawn = asyncio.Barrier(WINDOWS + 1)
            playing = [asyncio.create_task(play(address, token, k, all_drawn)) for k in range(WINDOWS)]
            await all_drawn.wait()
            drawn = time.perf_counter() - begun
            return await asyncio.gather(*playing)

        took = np.concatenate(asyncio.run(windows()))
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()
    late = float(np.quantile(took, 0.95))
    print(
        f"{WINDOWS} rooms drawn after {drawn:.1f} s; answers: median {np.median(took):.4f} s, p95 {late:.4f} s"
    )
    assert late <= 0.05
    assert drawn <= 30
