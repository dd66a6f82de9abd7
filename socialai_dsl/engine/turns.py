"""Turns: the body actions of players and NPCs, and how an NPC follows its frames."""

import numpy as np

from socialai_dsl.engine.boards import (
    draw_cell,
    draw_npc,
    is_deadly_under,
    is_solid,
    npcs_are_hidden,
    type_row,
)
from socialai_dsl.engine.carrying import pick_up, put_down
from socialai_dsl.engine.entities import (
    field,
    is_at,
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
from socialai_dsl.engine.seats import seat_register, seat_value, seat_word, seats_played, taken_seat_of
from socialai_dsl.engine.speech import (
    deliver,
    empty_inbox,
    hear,
    hear_on_seat,
    inbox_class,
    reach_seats,
    speak,
)
from socialai_dsl.engine.state import AGENT, NOTHING, ONE, STILL, ZERO, Row, Trait
from socialai_dsl.engine.vm import answer, past_tests, run
from socialai_dsl.program import (
    Body,
    Field,
    Flag,
    FrameColumn,
    Header,
    Op,
    Register,
    SeatColumn,
    SeatRegister,
    TypeColumn,
)


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
    if not is_present(row, AGENT):
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


@inline
def _may_enter(row: Row, x: int, y: int, is_player: bool) -> bool:
    """Whether a member of the cast other than the agent goes to a cell that is not solid."""
    if not is_player:
        return is_free(row, x, y)
    return npcs_are_hidden(row) or (npc_at(row, x, y) == 0 and not is_at(row, AGENT, x, y))


@inline
def _use_ahead(row: Row, npc: int, x: int, y: int, is_player: bool) -> int:
    """Toggle the object in a cell, or if a player moves the body poke another member there; its number or 0."""
    poked = npc_at(row, x, y) if is_player else ZERO
    if poked == 0:
        return _toggle_object(row, x, y)
    set_field(row, poked, Field.POKED, ONE)
    return poked


@outline
def move_npc(row: Row, npc: int, action: int, is_player: bool) -> None:
    """The body action of an NPC, which never enters a cell that is solid, deadly or taken; or of a player on a seat."""
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
        elif _may_enter(row, ahead_x, ahead_y, is_player):
            set_field(row, npc, Field.X, ahead_x)
            set_field(row, npc, Field.Y, ahead_y)
            draw_cell(row, x, y)
            if is_player:
                draw_cell(row, ahead_x, ahead_y)  # another hidden one may be there
            else:
                draw_npc(row, npc)
        elif row.program[Header.FLAGS] & Trait.PUSHED:
            push_aside(row, ahead_x, ahead_y, direction)
    elif action == Body.TOGGLE:
        set_field(row, npc, Field.TOGGLED, _use_ahead(row, npc, ahead_x, ahead_y, is_player))
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
def _follow(row: Row, frame: int, npc: int, flags: int, begins: np.bool_) -> None:
    """One turn of one frame of an NPC; it ends at once if the NPC makes itself vanish before it moves.

    In the first of its frames, what it did last is that of its last turn until it moves.
    """
    heard = inbox_class(row, row.program[frame + FrameColumn.INBOX])
    perceive(row, frame, flags)
    table = state_table(row, frame)
    pc = row.program[table + 1 + heard]
    chosen = notice(row, pc)
    if begins:
        set_field(row, npc, Field.LAST, STILL)
    if pc != 0 or row.program[table] != 0 or flags & Trait.APART:
        if not is_present(row, npc):
            return
        action = row.registers[Register.LAST_TURN]
        if not chosen:
            action = act(row, frame)
        if action != Body.NONE:
            move_npc(row, npc, action, np.bool_(False))
            set_field(row, npc, Field.LAST, action)
        table = state_table(row, frame)
    settle(row)
    conclude(row, frame, table, heard, chosen, flags)


@outline
def _accompany(row: Row, frame: int, npc: int, seat: int, flags: int) -> None:
    """One turn of a frame of a member whose seat is taken: without body and voice, which are the player's.

    What the frame chose is the seat's wish.
    """
    stay_outline()
    registers = row.registers
    pointing = field(row, npc, Field.POINTING)
    heard = inbox_class(row, row.program[frame + FrameColumn.INBOX])
    perceive(row, frame, flags)
    chosen = notice(row, row.program[state_table(row, frame) + 1 + heard])
    if is_present(row, npc):
        wish = registers[Register.LAST_TURN] if chosen else act(row, frame)
        set_field(row, npc, Field.POINTING, pointing)
        settle(row)
        conclude(row, frame, state_table(row, frame), heard, chosen, flags)
        registers[seat_register(row, seat, SeatRegister.WISH)] = wish
        registers[seat_register(row, seat, SeatRegister.WISH_LINE)] = registers[Register.SAID_LINE]
    registers[Register.SAID_LINE] = 0


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
        seat = taken_seat_of(row, npc)
        begins = npc != last
        last = npc
        if begins and seat == 0:
            set_field(row, npc, Field.TOGGLED, ZERO)
        if is_present(row, npc):
            if seat == 0:
                _follow(row, frame, npc, flags, begins)
            else:
                _accompany(row, frame, npc, seat, flags)
        elif begins and seat == 0:
            set_field(row, npc, Field.LAST, STILL)
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
    if utterance == 0 or not is_present(row, AGENT):  # out of the room nobody hears it
        return
    deliver(row, AGENT, utterance, row.registers[Register.NOUN])
    if row.program[Header.FLAGS] & (Flag.OWN_VOICE | Flag.SEATS) and row.program[Header.AGENT_SAYS] > 0:
        pair = row.registers[Register.TEMPLATE] * row.program[Header.NOUNS]
        line = row.program[Header.AGENT_SAYS] - 1 + pair + row.registers[Register.NOUN]
        if row.program[Header.FLAGS] & Flag.OWN_VOICE:
            hear(row, line)
        if row.program[Header.FLAGS] & Flag.SEATS:
            reach_seats(row, AGENT, line)


# -- players on other seats ----------------------------------------------------------------------------------


@outline
def move_players(row: Row) -> None:
    """The body actions of the players on seats other than the agent's, one after the other."""
    stay_outline()
    for seat in range(1, seats_played(row)):
        if seat_value(row, seat, SeatRegister.TAKEN) == 0:
            continue
        npc = seat_word(row, seat, SeatColumn.ENTITY)
        action = seat_value(row, seat, SeatRegister.ACTION)
        if is_present(row, npc) and action != Body.NONE:
            move_npc(row, npc, action, np.bool_(True))


@outline
def speak_as_players(row: Row) -> None:
    """What the players on seats other than the agent's say is heard, one after the other."""
    stay_outline()
    for seat in range(1, seats_played(row)):
        line = seat_value(row, seat, SeatRegister.LINE) - 1
        npc = seat_word(row, seat, SeatColumn.ENTITY)
        if line >= 0 and is_present(row, npc):
            if row.program[Header.FLAGS] & Flag.OWN_VOICE:
                hear_on_seat(row, seat, line)
            speak(row, npc, line)


@outline
def bury(row: Row) -> bool:
    """Let members die whose seats are taken and who stand on a deadly cell; whether that leaves none in the room."""
    stay_outline()
    somebody_died = _dies(row, AGENT)
    somebody_lives = is_present(row, AGENT)
    for seat in range(1, seats_played(row)):
        npc = seat_word(row, seat, SeatColumn.ENTITY)
        if seat_value(row, seat, SeatRegister.TAKEN) != 0:
            somebody_died |= _dies(row, npc)
            somebody_lives |= is_present(row, npc)
    return somebody_died and not somebody_lives


@inline
def _dies(row: Row, who: int) -> bool:
    """Whether a member of the cast stands on a deadly cell; then it is no longer in the room."""
    x = field(row, who, Field.X)
    y = field(row, who, Field.Y)
    if not is_present(row, who) or not is_deadly_under(row, x, y):
        return False
    set_field(row, who, Field.GONE, ONE)
    row.registers[Register.CHANGED] = 1
    draw_cell(row, x, y)
    return True
