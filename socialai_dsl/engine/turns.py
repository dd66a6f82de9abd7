"""Turns: the body actions of agent and NPCs, and how an NPC follows its frames."""

from socialai_dsl.engine.boards import draw_cell, draw_npc, is_solid, npcs_are_hidden, type_row
from socialai_dsl.engine.carrying import pick_up, put_down
from socialai_dsl.engine.entities import (
    field,
    is_present,
    npc_at,
    object_at,
    set_field,
    step_x,
    step_y,
)
from socialai_dsl.engine.jit import inline, merged, outline, stay_outline
from socialai_dsl.engine.operands import draw_action, value
from socialai_dsl.engine.paths import face
from socialai_dsl.engine.pushing import is_free, push, push_aside, roll
from socialai_dsl.engine.speech import deliver, empty_inbox, hear, inbox_class, speak
from socialai_dsl.engine.state import AGENT, NOTHING, ONE, STILL, ZERO, Row, Trait
from socialai_dsl.engine.vm import answer, past_tests, run
from socialai_dsl.program import Body, Field, Flag, FrameColumn, Header, Op, Register, TypeColumn


@merged
def settle(row: Row) -> None:
    """Let statuses that follow from others follow, unless nothing that they depend on has changed."""
    if row.registers[Register.CHANGED] != 0:
        compute_statuses(row, follow_links(row))


@merged
def follow_links(row: Row) -> bool:
    """Let statuses have their direct consequences in others, if any has changed; whether one had.

    What changes from here on is settled next time, so to do nothing where nothing changed makes no difference.
    """
    changed = row.registers[Register.CHANGED] != 0
    row.registers[Register.CHANGED] = 0
    if changed and row.program[Header.LINKS_PC] != 0:
        run(row, row.program[Header.LINKS_PC])
    return changed


@merged
def compute_statuses(row: Row, changed: bool) -> None:
    """Let statuses follow from their conditions, if what these read may have changed.

    Where they read more than statuses this counts as changed again at once: a step then asks for one thing only.
    """
    if changed and row.program[Header.SETTLE_PC] != 0:
        run(row, row.program[Header.SETTLE_PC])
    if row.program[Header.FLAGS] & Flag.SETTLE_ALWAYS:
        row.registers[Register.CHANGED] = 1


@merged
def go_by_itself(row: Row) -> bool:
    """Count timers and move rolling objects, with direct consequences; whether a status has changed."""
    if row.program[Header.TICK_PC] != 0:
        run(row, row.program[Header.TICK_PC])
    if row.program[Header.FLAGS] & Flag.ROLLS:
        roll(row)
    return follow_links(row)


@inline
def _toggle_object(row: Row, x: int, y: int) -> int:
    """Toggle the object on top in this cell; its number, or 0 if there is none."""
    entity = object_at(row, x, y)
    if entity > 0 and field(row, entity, Field.POKED) == 0:
        status = row.program[type_row(row, entity) + TypeColumn.TOGGLED]
        if status != field(row, entity, Field.STATUS):
            set_field(row, entity, Field.STATUS, status)
            row.registers[Register.CHANGED] = 1
            draw_cell(row, x, y)
    return entity


@outline
def _toggle_ahead(row: Row) -> None:
    """The agent toggles at what is ahead: it pokes an NPC, hidden or not, or uses an object."""
    stay_outline()
    direction = field(row, AGENT, Field.DIR)
    x = field(row, AGENT, Field.X) + step_x(direction)
    y = field(row, AGENT, Field.Y) + step_y(direction)
    poked = npc_at(row, x, y)
    if poked > 0:
        set_field(row, poked, Field.POKED, ONE)
    else:
        poked = _toggle_object(row, x, y)
    if poked > 0:
        row.registers[Register.POKED] = poked


@inline
def use_hands(row: Row, who: int, action: int) -> None:
    """`pickup` and `drop`."""
    if action == Body.PICKUP:
        pick_up(row, who)
    elif action == Body.DROP:
        put_down(row, who)


@inline
def move_agent(row: Row, action: int) -> None:
    """The agent's body action; out of the room it has none to do."""
    direction = field(row, AGENT, Field.DIR)
    x = field(row, AGENT, Field.X)
    set_field(row, AGENT, Field.LAST, action)
    if x < 0:
        return
    if action == Body.FORWARD:
        x += step_x(direction)
        y = field(row, AGENT, Field.Y) + step_y(direction)
        if is_solid(row, x, y):
            if row.program[Header.FLAGS] & Trait.PUSHED:
                push(row, x, y, direction, ZERO)
        elif npcs_are_hidden(row) or npc_at(row, x, y) == 0:
            set_field(row, AGENT, Field.X, x)
            set_field(row, AGENT, Field.Y, y)
        elif row.program[Header.FLAGS] & Trait.PUSHED:
            push_aside(row, x, y, direction)
    elif action <= Body.RIGHT:
        set_field(row, AGENT, Field.DIR, (direction + 2 * action - 1) & 3)
    elif action == Body.TOGGLE:
        _toggle_ahead(row)
    elif row.program[Header.FLAGS] & Flag.CARRYING:
        use_hands(row, AGENT, action)


@outline
def move_npc(row: Row, npc: int, action: int) -> None:
    """The body action of an NPC. It never enters a cell that is solid, deadly or taken."""
    stay_outline()
    direction = field(row, npc, Field.DIR)
    x = field(row, npc, Field.X)
    y = field(row, npc, Field.Y)
    ahead_x = x + step_x(direction)
    ahead_y = y + step_y(direction)
    if action <= Body.RIGHT:
        set_field(row, npc, Field.DIR, (direction + 2 * action - 1) & 3)
        if npc_at(row, x, y) == npc:
            draw_npc(row, npc)
    elif action == Body.FORWARD:
        if is_solid(row, ahead_x, ahead_y):
            if row.program[Header.FLAGS] & Trait.PUSHED:
                push(row, ahead_x, ahead_y, direction, ZERO)
        elif is_free(row, ahead_x, ahead_y):
            set_field(row, npc, Field.X, ahead_x)
            set_field(row, npc, Field.Y, ahead_y)
            draw_cell(row, x, y)
            draw_npc(row, npc)
        elif row.program[Header.FLAGS] & Trait.PUSHED:
            push_aside(row, ahead_x, ahead_y, direction)
    elif action == Body.TOGGLE:
        set_field(row, npc, Field.TOGGLED, _toggle_object(row, ahead_x, ahead_y))
    elif action == Body.STOP_POINTING:
        set_field(row, npc, Field.POINTING, ZERO)
    elif row.program[Header.FLAGS] & Flag.CARRYING:
        use_hands(row, npc, action)


@inline
def state_table(row: Row, frame: int) -> int:
    """Offset of the row of the frame's current state in the state table."""
    columns = 1 + 2 * (row.program[Header.CLASSES] + 1)
    state = row.program[frame + FrameColumn.ROWS] + row.registers[row.program[frame + FrameColumn.STATE]]
    return row.program[Header.STATE_AT] + columns * state


@merged
def _do_the_rest(row: Row, frame: int) -> None:
    if row.program[frame + FrameColumn.DEFERRED] != 0:
        run(row, row.program[frame + FrameColumn.DEFERRED])


@merged
def perceive(row: Row, frame: int, flags: int) -> None:
    """The beliefs of a frame, before anything else in its turn."""
    if flags & Trait.APART and row.program[frame + FrameColumn.PERCEIVE] != 0:
        run(row, row.program[frame + FrameColumn.PERCEIVE])


@merged
def notice(row: Row, pc: int) -> bool:
    """Run the code of `first`, if there is any, before the body action; whether it has chosen that action."""
    row.registers[Register.LAST_TURN] = -1
    if pc != 0:
        pc = past_tests(row, pc)
    if pc != 0:
        run(row, pc)
    return row.registers[Register.LAST_TURN] >= 0


@merged
def act(row: Row, frame: int) -> int:
    """The body action that the activity of the current state chooses."""
    pc = row.program[state_table(row, frame)]
    if pc != 0:
        code = row.program[Header.CODE_AT] + 4 * pc
        if row.program[code + 4] == Op.HALT:
            # Fast path: these two are all there is to most activities.
            a = row.program[code + 1]
            b = row.program[code + 2]
            site = row.program[code + 3]
            if row.program[code] == Op.CHOOSE:
                return draw_action(row, a, b, site)
            if row.program[code] == Op.FACE:
                return face(row, value(row, a), value(row, b), site)
        run(row, pc)
    chosen = row.registers[Register.LAST_TURN]
    return chosen if chosen >= 0 else STILL


@merged
def conclude(row: Row, frame: int, table: int, heard: int, chosen: bool, flags: int) -> None:
    """The clock ticks, then what is done after the body action: `then`, or the rest of a rule of `first` that acted.

    `table` is what `state_table` gives now.
    """
    row.registers[row.program[frame + FrameColumn.CLOCK]] += 1
    if not chosen:
        pc = row.program[table + 2 + row.program[Header.CLASSES] + heard]
        if pc != 0:
            pc = past_tests(row, pc)
        if pc != 0:
            code = row.program[Header.CODE_AT] + 4 * pc
            if row.program[code] == Op.ANSWER and row.program[code + 4] == Op.HALT:
                # Fast path: this is all that most rules do.
                answer(row, row.program[code + 1], row.program[code + 2], row.program[code + 3])
            else:
                run(row, pc)
    elif flags & Trait.APART:
        _do_the_rest(row, frame)


@merged
def _follow(row: Row, frame: int, npc: int, flags: int) -> None:
    """One turn of one frame of an NPC; it ends at once if the NPC makes itself vanish before it moves."""
    heard = inbox_class(row, row.program[frame + FrameColumn.INBOX])
    perceive(row, frame, flags)
    table = state_table(row, frame)
    pc = row.program[table + 1 + heard]
    chosen = notice(row, pc)
    if pc != 0 or row.program[table] != 0 or flags & Trait.APART:
        if not is_present(row, npc):
            return
        action = row.registers[Register.LAST_TURN]
        if not chosen:
            action = act(row, frame)
        if action != Body.NONE:
            move_npc(row, npc, action)
            set_field(row, npc, Field.LAST, action)
        table = state_table(row, frame)
    settle(row)
    conclude(row, frame, table, heard, chosen, flags)


@merged
def take_turns(row: Row) -> None:
    """Every NPC takes its turn, in the order of the cast; what it says is heard when its turn ends."""
    flags = row.program[Header.FLAGS]
    frames = row.program[Header.FRAMES]
    frame = row.program[Header.FRAME_AT]
    number = 0
    if flags & Flag.AGENT_FRAME:
        number = 1
        frame += FrameColumn.COLUMNS
    last = NOTHING
    while number < frames:
        npc = row.program[frame + FrameColumn.ENTITY]
        if npc != last:
            set_field(row, npc, Field.LAST, STILL)
            set_field(row, npc, Field.TOGGLED, ZERO)
            last = npc
        if is_present(row, npc):
            _follow(row, frame, npc, flags)
        number += 1
        inbox = row.program[frame + FrameColumn.INBOX]
        frame += FrameColumn.COLUMNS
        if number == frames or row.program[frame + FrameColumn.ENTITY] != npc:
            if row.registers[inbox] > 0:
                empty_inbox(row, inbox)
            if row.registers[Register.SAID_LINE] > 0:
                speak(row, npc, row.registers[Register.SAID_LINE] - 1)
                row.registers[Register.SAID_LINE] = 0


@inline
def say_as_agent(row: Row) -> None:
    """The agent's utterance reaches the NPCs near it, and the agent itself where it hears its own voice."""
    utterance = row.registers[Register.CLASS]
    if utterance == 0 or field(row, AGENT, Field.X) < 0:  # out of the room nobody hears it
        return
    deliver(row, AGENT, utterance, row.registers[Register.NOUN])
    if row.program[Header.FLAGS] & Flag.OWN_VOICE and row.program[Header.AGENT_SAYS] > 0:
        pair = row.registers[Register.TEMPLATE] * row.program[Header.NOUNS]
        hear(row, row.program[Header.AGENT_SAYS] - 1 + pair + row.registers[Register.NOUN])
