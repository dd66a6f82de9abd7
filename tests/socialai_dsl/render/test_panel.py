"""The picture of an episode: room, dialogue, caption."""

from collections.abc import Iterator

import numpy as np
import pytest

from socialai_dsl.render import panel
from socialai_dsl.render.panel import DialogueLine, Face, compose_frame, draw_dialogue

LINES = [DialogueLine(t, "You" if t % 2 else "Ann", f"utterance number {t}") for t in range(1, 60)]


def test_size_and_dtype() -> None:
    frame = compose_frame(np.zeros((256, 256, 3), np.uint8), LINES, ["step 3", "none"], now=3)
    assert frame.shape == (360, 640, 3)
    assert frame.dtype == np.uint8


@pytest.mark.parametrize("shape", [(2000, 100, 3), (100, 2000, 3), (8, 8, 3)])
def test_any_room_fits(shape: tuple[int, int, int]) -> None:
    frame = compose_frame(np.full(shape, 7, np.uint8), [], [], size=(320, 200))
    assert frame.shape == (200, 320, 3)
    assert (frame == 7).all(axis=2).any()


def test_the_latest_line_is_always_shown() -> None:
    long = draw_dialogue(LINES, 240, 120)
    assert (long == draw_dialogue(LINES[-20:], 240, 120)).all()
    assert (long != draw_dialogue(LINES[:-1], 240, 120)).any()


def test_lines_of_this_step_stand_out() -> None:
    plain = draw_dialogue(LINES[:3], 240, 120)
    marked = draw_dialogue(LINES[:3], 240, 120, now=2)
    rows = np.nonzero((plain != marked).any(axis=(1, 2)))[0]
    assert 0 < len(rows) < 30, "one line of the three is highlighted"


def test_a_long_line_is_wrapped_and_a_long_word_is_cut() -> None:
    one = draw_dialogue([DialogueLine(1, "Ann", "word " * 20)], 200, 400)
    inked = (one.min(axis=2) < 200).any(axis=1)
    assert inked[100:].any(), "twenty words take several rows"
    word = draw_dialogue([DialogueLine(1, "", "w" * 400)], 200, 60)
    assert (word[:, -6:] == 255).all(), "nothing is drawn over the edge"


def test_silence_is_said() -> None:
    assert (draw_dialogue([], 240, 60) < 255).any()


def test_the_cast_is_shown_above_the_dialogue() -> None:
    green = np.full((32, 32, 3), (10, 200, 10), np.uint8)
    room = np.zeros((64, 64, 3), np.uint8)

    def shown(count: int) -> np.ndarray:
        faces = [Face(f"guide {number}", green) for number in range(count)]
        return compose_frame(room, LINES, ["step 3"], now=3, cast=faces)

    def faces(frame: np.ndarray) -> np.ndarray:
        return (frame == (10, 200, 10)).all(axis=2)

    assert not faces(shown(0)).any()
    one, two, three = (faces(shown(count)).sum() for count in (1, 2, 3))
    assert (two, three) == (2 * one, 3 * one)
    assert faces(shown(20)).sum() == 6 * one, "of many the first"
    below = [np.nonzero(faces(shown(count)))[0].max() for count in (2, 3)]
    assert below[0] < below[1], "two in a row"


@pytest.fixture
def no_other_font(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A machine without the fonts that are tried."""
    monkeypatch.setattr(panel, "_FALLBACKS", ())
    for cached in (panel._fonts, panel._has, panel._warn_of):
        cached.cache_clear()
    yield
    for cached in (panel._fonts, panel._has, panel._warn_of):
        cached.cache_clear()


def test_letters_that_no_font_has_are_warned_of_once(no_other_font: None) -> None:
    lines = [DialogueLine(1, "Ann", "\u4f60\u597d"), DialogueLine(2, "Ann", "\u597d\u4f60")]
    with pytest.warns(UserWarning, match="no font of this machine has '\u4f60\u597d'") as told:
        first = draw_dialogue(lines, 300, 200)
    assert len(told) == 1
    assert (draw_dialogue(lines, 300, 200) == first).all(), "warnings are errors here"


def test_letters_of_english_are_drawn_in_one_font_and_without_a_warning() -> None:
    assert panel._font(14, "Where is the exit? It's \u2026") is panel._font(14)


def test_a_font_that_has_the_letters_is_taken() -> None:
    """Where this machine has one of the fallbacks."""
    if len(panel._fonts(14)) > 1 and panel._has(14, 1, "\u0436"):
        assert panel._font(14, "\u0436\u0443\u043a") is panel._fonts(14)[1]
    assert not panel._has(14, 0, "\u0436")
