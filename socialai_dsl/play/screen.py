"""The screen of a person's game: the room, the view, the dialogue, and a line to type."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Final

from rich.markup import escape
from rich.terminal_theme import TerminalTheme
from rich.text import Text
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.suggester import Suggester
from textual.widgets import Input, OptionList, Static

from socialai_dsl.diagnostics import printable
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs.view import ahead
from socialai_dsl.play.game import FinishedEpisode, Game, Sight
from socialai_dsl.render.canvas import INK
from socialai_dsl.render.panel import DialogueLine
from socialai_dsl.render.tiles import PALETTE
from socialai_dsl.semantics.typed import Phrases

Episodes = Callable[[int], tuple[str, dict[str, Any]] | None]
"""Number, counted from 0 -> title and arguments of `env.reset`; None after the last one."""

_KEYS: Final = {
    "left": ("left", "a"),
    "right": ("right", "d"),
    "forward": ("up", "w"),
    "toggle": ("t",),
    "pickup": ("p",),
    "drop": ("o",),
    "done": ("x",),
}
# In the same six colours as films and pictures.
_TERMINAL: Final = TerminalTheme(
    (18, 18, 18),
    (220, 220, 220),
    [INK, *(PALETTE[k] for k in (0, 1, 4, 2, 3)), (80, 180, 190), (170, 174, 182)],
)
_STAND: Final = ("full_stop", "space")
_NAMES: Final = {"left": "←", "right": "→", "up": "↑", "full_stop": "."}


class PlayApp(App[list[FinishedEpisode]]):
    """A person's play, episode after episode.

    Args:
        game: what is played; its first episode has begun.
        episodes: which ones there are.
        practice: whether steps may be taken back, episodes begun again, and states of frames looked at.
        view: whether the player sees what its seat sees, or the whole room.

    Returns, from `run`, the episodes that were played to their end.

    Attributes:
        failure: what went wrong in here, after which the screen was left; None if nothing did.
    """

    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = None
    CSS = """
    Screen { layout: vertical; }
    #title { height: 1; padding: 0 1; background: $primary-background; text-style: bold; }
    #middle { height: 1fr; }
    #left { width: auto; max-width: 60%; min-width: 24; height: 100%; border: round $foreground 40%; padding: 0 1; }
    #room { width: auto; height: auto; }
    #right { width: 1fr; height: 100%; }
    #sight { height: 9; border: round $foreground 40%; padding: 0 1; }
    .behind #sight { display: none; }
    .seat #left, .seat #view { display: none; }
    .seat #right { layout: horizontal; }
    .seat #sight { width: 3fr; height: 100%; }
    .seat #told { width: 2fr; height: 100%; }
    .seat #facts { height: 100%; padding: 0; }
    #view { width: 15; height: 7; }
    #facts { width: 1fr; height: 7; padding-left: 1; }
    #told { height: 1fr; border: round $foreground 40%; }
    #backstage { height: 3fr; border: round $warning; display: none; }
    #told, #backstage { padding: 0 1; scrollbar-size-vertical: 1; }
    .behind #backstage { display: block; }
    .behind #told { height: 2fr; }
    #message { height: auto; max-height: 3; padding: 0 1; }
    #message.bad { color: $text-error; }
    #message.won { background: $success; color: $text; text-style: bold; }
    #message.lost { background: $error; color: $text; text-style: bold; }
    #typed { height: 1; border: none; padding: 0 1; background: $surface; }
    #typed:focus { border: none; background: $primary-background; }
    #keys { height: 1; padding: 0 1; color: $text-muted; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        # With priority, so that what is typed fast behind it finds the line ready.
        Binding("slash,enter", "type", show=False, priority=True),
        Binding("c", "choose", show=False),
        Binding("u,backspace", "undo", show=False),
        Binding("r", "again", show=False),
        Binding("n", "next", show=False),
        Binding("s", "backstage", show=False),
        Binding("question_mark,h", "explain", show=False),
        Binding("pageup", "scroll_told(-1)", show=False),
        Binding("pagedown", "scroll_told(1)", show=False),
        Binding("q", "quit", show=False),
        Binding("ctrl+c", "quit", show=False, priority=True),
    ]

    def __init__(self, game: Game, episodes: Episodes, practice: bool = True, view: Sight = "room") -> None:
        super().__init__()
        self.ansi_theme_dark = _TERMINAL
        self._game, self._episodes, self._practice = game, episodes, practice
        self._is_seated = view == "seat"
        self._number = 0
        self._done: list[FinishedEpisode] = []
        self.failure: Exception | None = None

    def compose(self) -> ComposeResult:
        """The parts of the screen."""
        yield Static(id="title")
        with Horizontal(id="middle"):
            with VerticalScroll(id="left", can_focus=False):
                yield Static(id="room")
            with Vertical(id="right"):
                with Horizontal(id="sight"):
                    yield Static(id="view")
                    with VerticalScroll(id="facts", can_focus=False):
                        yield Static(id="fact")
                with VerticalScroll(id="backstage", can_focus=False):
                    yield Static(id="states")
                with VerticalScroll(id="told", can_focus=False):
                    yield Static(id="lines")
        yield Static(id="message")
        yield _Line(self._game.phrases, id="typed")
        yield Static(_keys(self._game.phrases.actions, self._practice), id="keys")

    def on_mount(self) -> None:
        """Bind the movements that there are, and show where the game stands."""
        self.query_one("#middle").set_class(self._is_seated, "seat")
        self.query_one("#left").border_title = "room"
        self.query_one("#sight").border_title = "in view"
        self.query_one("#told").border_title = "told, said and heard"
        self.query_one("#backstage").border_title = "behind the scenes"
        self.show()

    def on_key(self, event: events.Key) -> None:
        """Move, unless a line is being typed or something lies over the room."""
        if not self._walks:
            return
        for movement in self._game.phrases.actions:
            if event.key in _KEYS.get(movement, ()):
                event.stop()
                self.play(movement, None)
                return
        if event.key in _STAND:
            event.stop()
            self.play(None, None)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Do and say what was typed."""
        line = event.value.strip()
        if line:
            self.play(*self._game.phrases.act(line))
        else:
            self.set_focus(None)

    def play(self, movement: str | None, sentence: str | None) -> None:
        """Play a step, or say why it cannot be."""
        if self._game.now.ended is not None:
            self.show()
            return
        try:
            self._game.act(movement, sentence)
        except ValueError:
            phrases, said = self._game.phrases, sentence or ""
            hint = " Tab puts it in" if phrases.corrected(said) is not None else ""
            self.tell(phrases.problem(said) + hint, "bad")
            return
        line = self.query_one(_Line)
        line.value = ""
        self.set_focus(None)
        self.show()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Whether a key means this now: one that begins a line is a letter within it."""
        return self._walks if action == "type" else super().check_action(action, parameters)

    @property
    def _walks(self) -> bool:
        """Whether keys move the player."""
        return self.focused is None and len(self.screen_stack) == 1

    def action_type(self) -> None:
        """Go to the line."""
        self.screen.set_focus(self.query_one(_Line))

    def action_choose(self) -> None:
        """Choose what to say from lists."""
        self.push_screen(_Chooser(self._game.phrases), self._say)

    def _say(self, sentence: str | None) -> None:
        if sentence is not None:
            self.play(None, sentence)

    def action_undo(self) -> None:
        """Take the last step back."""
        if not self._practice:
            self.tell("a step cannot be taken back in an evaluation", "bad")
        elif self._game.undo():
            self.show("one step back")
        else:
            self.tell("there is no step to take back", "bad")

    def action_again(self) -> None:
        """Begin the episode again."""
        if self._practice:
            self._begin(self._number)
        else:
            self.tell("an episode is played once in an evaluation", "bad")

    def action_next(self) -> None:
        """Go on to the next episode."""
        if self._practice or self._game.now.ended is not None:
            self._keep()
            self._begin(self._number + 1)
        else:
            self.tell("an evaluation goes on when the episode has ended", "bad")

    def _begin(self, number: int) -> None:
        chosen = self._episodes(number)
        if chosen is None:
            self.exit(self._done)
            return
        try:
            self._game.begin(*chosen)
        except RoomError as error:
            self.tell(str(error), "bad")
            return
        self._number = number
        self.show()

    def _keep(self) -> None:
        played = self._game.played()
        if played is not None:
            self._done.append(played)

    def action_backstage(self) -> None:
        """Show or hide the states of frames."""
        if not self._practice:
            self.tell("states are not shown in an evaluation", "bad")
            return
        self.query_one("#right").toggle_class("behind")
        self.show()

    def action_scroll_told(self, pages: int) -> None:
        """Look at what was said before and at more of what is seen, or at more of what is behind the scenes."""
        behind = self.query_one("#right").has_class("behind")
        for part in self.query("#backstage" if behind else "#told, #facts"):
            part.scroll_relative(y=pages * (part.size.height - 1), animate=False)

    def action_explain(self) -> None:
        """Show what the keys do and what the letters mean."""
        reading = self._game.explanation if self._is_seated else _ROOM
        self.push_screen(_Help(_help(self._game.phrases.actions, self._practice, reading)))

    def _handle_exception(self, error: Exception) -> None:
        """Leave the screen; whoever started it says what happened, as for every command."""
        self.failure = error
        self.exit(return_code=1)

    async def action_quit(self) -> None:
        """Stop playing."""
        self._keep()
        self.exit(self._done)

    def show(self, message: str = "") -> None:
        """Show where the game stands."""
        game, now = self._game, self._game.now
        named = [] if game.name is None else [f"you are {game.name}"]
        parts = [game.title, *named, f"step {game.steps}"]
        if not self._is_seated:
            parts[1:1] = [now.member] if now.member is not None else []
            parts.append(f"reward {now.reward:.3f}")
        self.query_one("#title", Static).update(Text(printable(" · ".join(parts))))
        if self._is_seated:
            self.query_one("#fact", Static).update(Text.from_ansi(now.seen))
        else:
            self._show_room()
        self._show_told()
        if self.query_one("#right").has_class("behind"):
            self.query_one("#states", Static).update(Text("\n".join(map(printable, game.backstage()))))
        if now.ended is None:
            self.tell(message or ("" if game.place() else "you have left the room; . lets the others go on"))
            return
        verdict = "success" if now.ended.success else "no success"
        after = f"after {game.steps} steps"
        if not self._is_seated:
            verdict, after = f"{verdict}: {now.ended.text}", f"{after}, reward {now.reward:.3f}"
        more = "n next · r again · u undo · q quit" if self._practice else "n next · q quit"
        self.tell(
            f"{verdict}\n{after}   {more}",
            "won" if now.ended.success else "lost",
        )

    def _show_room(self) -> None:
        """The whole room, and beside it what is seen from the seat."""
        game, view = self._game, self._game.view()
        self.query_one("#room", Static).update(Text.from_ansi(game.room()))
        self.query_one("#view", Static).update(Text.from_ansi(view.text))
        shown = "".join(f"\n{line}" for line in view.figures)
        self.query_one("#fact", Static).update(
            Text.assemble("ahead: ", (ahead(game.now.view), "bold"), shown)
        )
        self._follow()

    def _show_told(self) -> None:
        """What the player was told of the task, then what was said and heard."""
        lines, told = self._game.now.lines, self.query_one("#told")
        task = Text("\n".join(map(printable, self._game.task.split("\n"))), "italic")
        self.query_one("#lines", Static).update(Text("\n").join([task, *map(self._line, lines)]))
        self.call_after_refresh(told.scroll_end if lines else told.scroll_home, animate=False)

    def _line(self, line: DialogueLine) -> Text:
        name = printable(line.speaker) or "somebody"
        style = "bold cyan" if line.own else "bold yellow"
        current = "" if line.t == self._game.steps else "dim"
        return Text.assemble((f"{line.t:>3} ", "dim"), (f"{name}: ", style), (printable(line.text), current))

    def _follow(self) -> None:
        """Keep the player in sight where the room is larger than its panel."""
        place = self._game.place()
        if place is not None:
            left = self.query_one("#left")
            left.scroll_to(
                2 * place[0] - left.size.width // 2, place[1] - left.size.height // 2, animate=False
            )

    def tell(self, message: str, kind: str = "") -> None:
        """Show a message of one or two lines under the room; `kind` is bad, won, lost or nothing special."""
        place = self.query_one("#message", Static)
        place.set_classes(kind)
        place.update(Text("\n".join(map(printable, message.split("\n")))))


class _Line(Input):
    """Where the player types; Tab completes or corrects, Escape goes back to moving."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", show=False),
        Binding("escape", "away", show=False),
    ]

    def __init__(self, phrases: Phrases, id: str) -> None:
        super().__init__(
            placeholder="Enter or / to type, c to choose from lists",
            suggester=_Suggestions(phrases),
            select_on_focus=False,
            id=id,
        )
        self._phrases = phrases

    def action_complete(self) -> None:
        """Write out what was begun, or what was probably meant."""
        found = self._phrases.completed(self.value) or self._phrases.corrected(self.value)
        if found is not None:
            self.value = found
            self.cursor_position = len(found)

    def action_away(self) -> None:
        """Leave the line."""
        self.value = ""
        self.screen.set_focus(None)


class _Suggestions(Suggester):
    """Shows the rest of the first sentence that begins like what is typed."""

    def __init__(self, phrases: Phrases) -> None:
        super().__init__(case_sensitive=True)
        self._phrases = phrases

    async def get_suggestion(self, value: str) -> str | None:
        """The whole line; None if nothing fits."""
        return self._phrases.completed(value)


class _Chooser(ModalScreen[str | None]):
    """A list of templates, then one of words for each slot. Gives the sentence, or None."""

    CSS = """
    _Chooser { align: center middle; }
    #box { width: 72; max-width: 95%; height: auto; max-height: 20; border: round $primary; background: $surface; }
    #lists { height: auto; max-height: 15; }
    OptionList { width: 1fr; min-width: 12; height: auto; max-height: 15; }
    #sentence { padding: 0 1; text-style: bold; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "back", show=False),
        Binding("left", "back", show=False),
        Binding("right", "into", show=False),
    ]

    def __init__(self, phrases: Phrases) -> None:
        super().__init__()
        self._phrases = phrases
        self._slots = phrases.grammar.slots

    def compose(self) -> ComposeResult:
        """The lists, and the sentence as it stands."""
        with Container(id="box"):
            yield Static(id="sentence")
            with Horizontal(id="lists"):
                yield OptionList(*map(_option, self._phrases.grammar.templates), id="templates")
                for slot in self._slots:
                    yield OptionList(*map(_option, slot.words), id=f"slot-{slot.name}")
            yield Static("  ↑↓ move · Enter choose · ← back · Esc leave", classes="hint")

    def on_mount(self) -> None:
        """Begin with the first of each."""
        for words in self.query(OptionList):
            words.highlighted = 0
        self.query_one("#templates").focus()

    def on_option_list_option_highlighted(self) -> None:
        """Show the sentence that would be said."""
        self.query_one("#sentence", Static).update(Text(printable(f'"{self._sentence()}"')))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Go from the template to the words of its slots, one after the other, and from the last back to the game."""
        lists = self._lists()
        place = lists.index(event.option_list) + 1 if event.option_list in lists else len(lists)
        if place < len(lists):
            lists[place].focus()
        else:
            self.dismiss(self._sentence())

    def action_into(self) -> None:
        """Go to the words of the next slot."""
        lists = self._lists()
        lists[min(self._place(lists) + 1, len(lists) - 1)].focus()

    def action_back(self) -> None:
        """Go back to the list before, and from the templates to the game."""
        lists = self._lists()
        if place := self._place(lists):
            lists[place - 1].focus()
        else:
            self.dismiss(None)

    def _lists(self) -> list[OptionList]:
        """The lists that the template takes notice of, which begin with that of templates."""
        used = zip(self._slots, self._phrases.grammar.used[self._template()], strict=True)
        names = ["templates", *(f"slot-{slot.name}" for slot, is_used in used if is_used)]
        return [self.query_one(f"#{name}", OptionList) for name in names]

    @staticmethod
    def _place(lists: list[OptionList]) -> int:
        """Which of the lists is chosen from."""
        return next((i for i, one in enumerate(lists) if one.has_focus), 0)

    def _template(self) -> int:
        return self.query_one("#templates", OptionList).highlighted or 0

    def _sentence(self) -> str:
        words = [self.query_one(f"#slot-{slot.name}", OptionList).highlighted or 0 for slot in self._slots]
        return self._phrases.grammar.text(self._template(), words)


class _Help(ModalScreen[None]):
    """What the keys do; any key closes it."""

    CSS = """
    _Help { align: center middle; }
    #help { width: 76; height: auto; max-height: 22; border: round $primary; background: $surface; padding: 0 1; }
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self._text = text

    def compose(self) -> ComposeResult:
        """The text."""
        yield Static(self._text, id="help")

    def on_key(self, event: events.Key) -> None:
        """Close."""
        event.stop()
        self.dismiss(None)


def _option(text: str) -> Text:
    return Text(printable(text))


def _keys(actions: Sequence[str], practice: bool) -> str:
    """The most important keys, for the last line."""
    arrows = "".join(_key(name) for name in actions if _key(name) in "←→↑")
    others = [f"{_key(name)} {name}" for name in actions if _key(name) not in "←→↑"]
    rest = ["u undo", "s states"] if practice else []
    return escape("  ".join([f"{arrows} move", *others, *rest, "? help", "q quit"]))


def _key(movement: str) -> str:
    first = _KEYS[movement][0]
    return _NAMES.get(first, first)


_ROOM: Final = (
    "In the room you are an arrow alone. Av is an NPC of kind A that looks down. Other things begin with their "
    "colour, e for grey: gD is a closed green door, gL a locked one, g/ an open one. The lighter cells can be in view; "
    "what you are given of them as a player is on the right."
)


def _help(actions: Sequence[str], practice: bool, reading: str) -> str:
    """What the keys do, and how to read the picture."""
    moves = [f"{' '.join(_NAMES.get(key, key) for key in _KEYS[name])} {name}" for name in actions]
    lines = [
        ", ".join([*moves, ". stand still"]),
        "",
        "/ or Enter   type a sentence, a movement, or both: forward How are you;",
        "             . or none stands still",
        "             Tab completes what is begun, or puts in what was meant",
        "c            choose a sentence from lists",
        "PgUp PgDn    what you were told, what was said before, more in view",
    ]
    if practice:
        lines += [
            "u            take a step back, as often as you like",
            "r            the same episode again",
            "s            the states of everybody's frames, and what was drawn",
        ]
    lines += [
        "n            the next episode",
        "q            quit",
        "",
        reading,
    ]
    return escape("\n".join(lines))
