"""What an expression of the language means: a walk over its tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from socialai_dsl.grammar import ast
from tests.reference import chance, geometry, speech
from tests.reference.source import Value
from tests.reference.world import (
    COLORS,
    DIRECTIONS,
    NO_CELL,
    NOTHING,
    TYPES,
    Entity,
    Kept,
    Performance,
    Recall,
    World,
    as_list,
    turned,
    where,
)

if TYPE_CHECKING:
    from tests.reference.room import Setup


class NothingFoundError(Exception):
    """`pick`, `first` or `nearest` found nothing: whatever needed it does not happen."""


@dataclass
class Context:
    """Who asks, where the question is written, and what its variables stand for."""

    world: World
    me: Entity | None = None
    in_frame: bool = False  # whether slots, registers and one's own conditions can be named
    variables: dict[str, Any] = field(default_factory=dict)
    take_first: bool = False  # a let, a slot or a colour takes the first member where a pick finds nothing
    setup: Setup | None = None  # while the room is being drawn
    value: Value | None = None

    def knowing(self, **variables: Any) -> Context:
        """The same with more variables."""
        return replace(self, variables={**self.variables, **variables})


def evaluate(value: Value, context: Context) -> Any:
    """The value now. Words are strings, things are entities, groups are lists, cells are pairs."""
    return of(value.tree, replace(context, value=value))


def holds(value: Value | None, context: Context) -> bool:
    """Whether a condition holds; nothing written always does."""
    return value is None or bool(there(evaluate(value, context)))


def of(node: Any, context: Context) -> Any:
    """The value of a node."""
    return HANDLERS[type(node)](node, context)


def drawn(context: Context, node: ast.Node, size: int) -> int:
    """A choice among `size` things by a node that draws: its site is the value's path, its number the node's."""
    assert context.value is not None, "internal: a draw outside any value"
    number = context.value.ordinals[id(node)]
    site = context.value.site
    return chance.choose(context.world.key_at(site), site, context.world.t, number, size)


# -- plain nodes -------------------------------------------------------------------------------------------


def _text(node: ast.Text, context: Context) -> str:
    return "".join(part if isinstance(part, str) else spelled_part(part, context) for part in node.parts)


def spelled_part(part: Any, context: Context) -> str:
    """A value inside a text; of what stood in a slot the word, whatever it stands for."""
    value, slots = of(part, context), context.world.fillers
    slot = part.id if isinstance(part, ast.Name) else part.name if isinstance(part, ast.Attribute) else ""
    of_agent = isinstance(part, ast.Attribute) and getattr(part.subject, "id", "") == "agent"
    if slot in slots and slot != "noun" and (of_agent or isinstance(part, ast.Name)):
        return speech.spelled_in(context.world, slot, there(value))
    return spelled(value)


def spelled(value: Any) -> str:
    """A value inside a text. While somebody is silent his noun is not there to be said."""
    value = there(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Entity):
        return str(value.name or value.key)
    return str(value)


def pattern(node: Any, context: Context) -> list[str | speech.AnyOf]:
    """What an utterance is compared with: literal pieces, and whatever can stand in a slot."""
    if not isinstance(node, ast.Text):
        return [spelled(of(node, context))]
    return [
        part
        if isinstance(part, str)
        else speech.AnyOf(part.id)
        if isinstance(part, ast.Name) and part.id in context.world.fillers
        else spelled_part(part, context)
        for part in node.parts
    ]


def _name(node: ast.Name, context: Context) -> Any:
    """Names: the nearest declaration wins, then the words of the language, else the word itself."""
    word, world, me = node.id, context.world, context.me
    if word in context.variables:
        return context.variables[word]
    if context.in_frame and me is not None:
        if word in me.registers:
            return me.registers[word]
        found, slot = _slot(word, context)
        if found:
            return slot
    if me is not None and word in world.look_names:
        return attribute(me, word, context)
    if word in context_lets(context):
        return _let(word, context)
    if word in world.registers:
        return world.registers[word]
    if word in world.groups:
        return world.groups[word]
    if word in world.memories:
        return world.memories[word]
    word = world.roles.get(word, word)
    if word in world.objects:
        return world.objects[word]
    if word in world.cast:
        return world.cast[word]
    words: dict[str, Callable[[], Any]] = {
        "t": lambda: world.t,
        "W": lambda: world.width,
        "H": lambda: world.height,
        "self": lambda: me,
        "objects": world.things,
        "cells": lambda: [cell for cell in world.interior() if cell not in world.terrain],
        "cast": lambda: world.members,
        "colors": lambda: list(COLORS),
        "directions": lambda: list(DIRECTIONS),
        "nouns": lambda: speech.noun_values(world),
    }
    if word in words:
        return words[word]()
    if word in world.fillers and context.in_frame:
        return world.agent.filled.get(word)
    if me is not None and word in (
        "poked",
        "was_poked",
        "gone",
        "spoke",
        "action",
        "pointing",
        "turns_in_state",
        "carried",
        "empty_handed",
    ):
        return attribute(me, word, context)
    if me is not None and context.in_frame and word in ("facing", "cell", "x", "y"):
        return attribute(me, word, context)
    return word


def context_lets(context: Context) -> Any:
    """The names in `let`."""
    return context.setup.scenario.let if context.setup else context.world.lets


def _let(word: str, context: Context) -> Any:
    # "Scenario `let`: once, at reset." While the room is drawn, one is computed when it is first asked for.
    if word not in context.world.lets and context.setup:
        context.setup.compute_let(word)
    return context.world.lets[word]


def _slot(word: str, context: Context) -> tuple[bool, Any]:
    # "Slots of type text and bool: at every use; all other slots: once, at reset."
    me = context.me
    assert me is not None
    if word not in me.slots and context.setup:
        context.setup.compute_slots(me)
    if word not in me.slots:
        return False, None
    slot = me.slots[word]
    if isinstance(slot, Value):
        return True, evaluate(slot, replace(context, in_frame=False, variables={}))
    return True, slot


def _attribute(node: ast.Attribute, context: Context) -> Any:
    if isinstance(node.subject, ast.Attribute) and node.subject.name == "believes":
        holder = of(node.subject.subject, context)
        if context.setup:
            context.setup.compute_beliefs(holder)
        return holder.believes[node.name]
    if (
        isinstance(node.subject, ast.Name)
        and node.name == "words"
        and node.subject.id in context.world.fillers
    ):
        return [speech.noun_value(filler.word) for filler in context.world.fillers[node.subject.id]]
    subject = there(of(node.subject, context))
    if isinstance(subject, list):
        return [attribute(item, node.name, context) for item in subject]
    return attribute(subject, node.name, context)


def attribute(subject: Any, name: str, context: Context) -> Any:
    """`subject.name`: what is known about an entity or a cell."""
    if name in ("x", "y"):
        cell = where(subject)
        return -1 if cell is None else cell["xy".index(name)]
    assert isinstance(subject, Entity), f"{subject!r}.{name}"
    if context.setup and name in context.setup.scenario.looks:
        context.setup.compute_look(name)
    if name in context.world.look_names:
        if name not in subject.looks:
            raise NothingFoundError
        return subject.looks[name]
    if name == "color":
        if subject.color is None and context.setup:
            context.setup.compute_colors(subject)
        return subject.color
    if name == "name":
        if subject.name is None and context.setup:
            context.setup.compute_name(subject)
        return subject.name
    if name == "facing":
        if context.setup:
            context.setup.compute_facing(subject)
        return subject.facing
    if name == "pointing":
        return subject.pointing is not None
    if name == "empty_handed":
        return context.world.carried_by(subject) is None
    if name == "carried":
        thing = context.world.carried_by(subject)
        if thing is None:
            raise NothingFoundError
        return thing
    if name == "inside":
        if context.setup:
            context.setup.compute_inside(subject)
        if subject.inside is None:
            raise NothingFoundError
        return subject.inside
    if name == "spoke":
        return subject.utterance is not None
    if name == "toggled":
        return bool(subject.toggled_by)
    if name == "turns_in_state":
        return subject.clock
    if name in context.world.fillers:
        return subject.filled.get(name)
    if name == "cell":
        return NO_CELL if subject.cell is None else subject.cell
    if name == "kind" and subject.sort == "object":
        return subject.type
    if name in ("kind", "index", "gone", "poked", "was_poked", "action", "type"):
        return getattr(subject, name)
    if name == "unlocked_by":
        for thing in context.world.things() if context.setup else ():
            context.setup.compute_links(thing)
        found = [thing for thing in context.world.things() if subject in thing.unlocks]
        return found[0] if len(found) == 1 else found
    if subject.sort == "object":
        if context.setup:
            context.setup.compute_status(subject)
        assert name in TYPES[subject.type].states, f"{subject.type} has no {name}"
        return subject.status == name
    if name in subject.registers:
        return subject.registers[name]
    found, slot = _slot(name, replace(context, me=subject))
    assert found, f"{subject.key} has no {name}"
    return slot


def _logic(node: ast.Logic, context: Context) -> bool:
    test = all if node.op == "and" else any
    return test(bool(there(of(operand, context))) for operand in node.operands)


def same(a: Any, b: Any) -> bool:
    """Equality. A value fits a noun if their texts are equal, so 3 is "3"; an entity in a cell is not the cell."""
    if any(one is None or one is NOTHING for one in (a, b)):
        return False  # what is not there equals no value, and nothing else that is not there
    if isinstance(a, Entity) or isinstance(b, Entity):
        return a is b
    if isinstance(a, Recall) and isinstance(b, Recall | Performance):
        return a.equals(b)
    if isinstance(b, Recall) and isinstance(a, Performance):
        return b.equals(a)
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if isinstance(a, str) != isinstance(b, str):
        return str(a) == str(b)
    return bool(a == b)


def there(value: Any) -> Any:
    """A value that is needed. The noun of somebody who is silent can be compared, and nothing else."""
    if value is None or value is NOTHING:
        raise NothingFoundError
    return value


def _ordered(node: ast.Compare, context: Context) -> tuple[str, ...] | None:
    """The values of the look that a comparison is about, from the least to the greatest; None if it is about none."""
    for side in (node.left, node.right):
        name = side.name if isinstance(side, ast.Attribute) else side.id if isinstance(side, ast.Name) else ""
        if name in context.world.look_names:
            return context.world.look_names[name]
    return None


def _compare(node: ast.Compare, context: Context) -> bool:
    left, right = of(node.left, context), of(node.right, context)
    sides = ((left, node.right), (right, node.left))
    if any(value is NOTHING and isinstance(word, ast.Name) and word.id == "none" for value, word in sides):
        return bool(node.op == "==")
    if node.op in ("==", "!="):
        equal = any(same(a, b) for a in as_list(left) for b in as_list(right))
        return equal == (node.op == "==")
    left, right = there(left), there(right)
    if (words := _ordered(node, context)) is not None:
        left, right = words.index(left), words.index(right)
    if not isinstance(left, int) or not isinstance(right, int):
        return False  # a noun that is no number is neither more nor less than anything
    return {"<": left < right, "<=": left <= right, ">": left > right, ">=": left >= right}[node.op]


def _member(node: ast.Member, context: Context) -> bool:
    left, group = of(node.left, context), as_list(of(node.right, context))
    if isinstance(node.right, ast.Interval):
        left = there(left)
    return any(same(left, item) for item in group) != node.negated


def _conditional(node: ast.Conditional, context: Context) -> Any:
    """Nothing is asked of the value that is not taken; of the other more than what it is like."""
    return there(of(node.value if of(node.condition, context) else node.other, context))


def _alternatives(node: ast.Alternatives, context: Context) -> list[Any]:
    """`a | b | 2 * c`: a list; a weight multiplies; a group among the alternatives gives its members."""
    items: list[Any] = []
    for option, weight in weighed(node):
        items += as_list(of(option, context)) * weight
    return items


def weighed(node: Any) -> list[tuple[Any, int]]:
    """The alternatives of a node, each with its weight."""
    options = node.options if isinstance(node, ast.Alternatives) else (node,)
    return [
        (option.right, option.left.value)
        if isinstance(option, ast.Arithmetic) and option.op == "*" and isinstance(option.left, ast.Number)
        else (option, 1)
        for option in options
    ]


_MOST_LISTED = 1000
"""Of a wider interval it is only asked where it ends and what lies within."""


def _interval(node: ast.Interval, context: Context) -> list[int] | range:
    numbers = range(of(node.low, context), of(node.high, context) + 1)
    return list(numbers) if len(numbers) <= _MOST_LISTED else numbers


def _arithmetic(node: ast.Arithmetic, context: Context) -> Any:
    left, right = there(of(node.left, context)), there(of(node.right, context))
    if isinstance(left, str):
        # "A direction plus a turn is modulo 4 (left -1, right +1)."
        quarter = {"left": -1, "right": 1}[right]
        return turned(left, quarter if node.op == "+" else -quarter)
    if node.op in ("//", "%") and right == 0:
        return 0
    results: dict[str, Callable[[], int]] = {
        "+": lambda: left + right,
        "-": lambda: left - right,
        "*": lambda: left * right,
        "//": lambda: left // right,
        "%": lambda: left % right,
    }
    return results[node.op]()


# -- groups ------------------------------------------------------------------------------------------------


def _quantifier(node: ast.Quantifier, context: Context) -> Any:
    """any, all, count, first, pick, nearest, those over a group; ties go to the lowest index."""
    group = as_list(of(node.group, context))
    condition, variable = node.where, node.var

    def true_of(item: Any) -> bool:
        return condition is None or bool(there(of(condition, context.knowing(**{variable: item}))))

    if node.name == "those":
        return [item for item in group if _is_one_of_those(condition, variable, item, context)]
    if node.name == "any":
        return any(true_of(item) for item in group)
    if node.name == "all":
        return all(true_of(item) for item in group)
    found = [item for item in group if true_of(item)]
    if node.name == "count":
        return len(found)
    if node.name == "nearest":
        goal = where(there(of(node.to, context)))
        found = [item for item in found if where(item) is not None and goal is not None]
        found.sort(key=lambda item: geometry.apart(item, goal))
    if not found and context.take_first and group:
        return group[0]
    if not found:
        raise NothingFoundError
    return found[drawn(context, node, len(found))] if node.name == "pick" else found[0]


def _is_one_of_those(condition: Any, variable: str, item: Any, context: Context) -> bool:
    """A member about whom something is not found is not one of those."""
    try:
        return bool(there(of(condition, context.knowing(**{variable: item}))))
    except NothingFoundError:
        return False


# -- calls -------------------------------------------------------------------------------------------------


def _call(node: ast.Call, context: Context) -> Any:
    if node.subject is None and node.name in FUNCTIONS:
        return FUNCTIONS[node.name](node, context)
    if node.subject is None and (node.name in context.world.tables or in_tables(node.name, context)):
        return _table(node, context)
    kept = _kept(node, context)
    if kept is not None:
        return _of_key(kept, node.args[0], context)
    # "In a frame a verb without a subject is the NPC's own."
    subject = context.me if node.subject is None else of(node.subject, context)
    if isinstance(subject, list):
        return any(_verb(one, node, context) for one in subject)
    return _verb(subject, node, context)


DIRECTED = {"in_front_of", "faces", "faces_toward", "looks_at", "eye_contact", "sees"}
"""Relations that depend on where somebody looks."""


def know_facing(context: Context, *things: Any) -> None:
    """While a room is set up: those whose direction is asked for are turned first."""
    for thing in things:
        if context.setup and isinstance(thing, Entity):
            context.setup.compute_facing(thing)


def _verb(subject: Any, node: ast.Call, context: Context) -> Any:
    name, world = node.name, context.world
    if name == "is":
        return any(_in_state(subject, option, context) for option, _ in weighed(node.args[0]))
    if name == "did":
        return subject.action in as_list(of(node.args[0], context))
    if name == "heard" and isinstance(node.args[0], ast.Name) and node.args[0].id == "any":
        return bool(subject.inbox)
    if name in ("said", "heard"):
        patterns = [pattern(option, context) for option, _ in weighed(node.args[0])]
        texts = [heard.text for heard in subject.inbox] if name == "heard" else [subject.utterance]
        return any(
            text is not None and speech.match(asked, text, world) is not None
            for text in texts
            for asked in patterns
        )
    there(subject)
    arguments = [there(of(argument, context)) for argument in node.args]
    if name == "carries":
        return any(thing.carrier is subject for thing in as_list(arguments[0]))
    if name == "toggled_by":
        return any(user in subject.toggled_by for user in as_list(arguments[0]))
    if name in DIRECTED:
        know_facing(context, subject, *arguments)
    return getattr(geometry, name)(world, subject, *arguments)


def _kept(node: ast.Call, context: Context) -> Kept | None:
    """The registers of a name that there are for each of a group; None if it names none."""
    if node.subject is None:
        own = context.me.registers if context.me is not None and context.in_frame else {}
        found = own.get(node.name, context.world.registers.get(node.name))
        return found if isinstance(found, Kept) else None
    if not any(node.name in member.registers for member in context.world.cast.values()):
        return None
    found = there(of(node.subject, context)).registers[node.name]
    assert isinstance(found, Kept), f"{node.name} is one register"
    return found


def key_of(value: Any) -> Any:
    """A key: an entity is itself, anything else is known by its text."""
    return value if isinstance(value, Entity) else str(value)


def _of_key(kept: Kept, node: ast.Node, context: Context) -> Any:
    key = key_of(there(of(node, context)))
    if key not in kept.values:
        raise NothingFoundError
    return kept.values[key]


def in_tables(name: str, context: Context) -> bool:
    """Whether a table of this name will be drawn."""
    return context.setup is not None and name in context.setup.scenario.tables


def _table(node: ast.Call, context: Context) -> Any:
    """What a table holds for a key; keys are known by their texts."""
    if context.setup:
        context.setup.compute_table(node.name)
    return context.world.tables[node.name][spelled(of(node.args[0], context))]


def _in_state(member: Entity, node: Any, context: Context) -> bool:
    """`npc.is(state)`: the name of a state, of an entry of `steps`, or `finished` after the last one."""
    assert isinstance(node, ast.Name), "internal: a state is named by a word"
    if isinstance(member.state, int):
        names = context.world.step_names[str(member.frame)]
        return (names[member.state] if member.state < len(names) else "finished") == node.id
    return member.state == node.id


def _pick(node: ast.Call, context: Context) -> Any:
    group = [item for argument in node.args for item in as_list(of(argument, context))]
    if not group:
        raise NothingFoundError
    return group[drawn(context, node, len(group))]


def _first(node: ast.Call, context: Context) -> Any:
    group = as_list(of(node.args[0], context))
    if not group:
        raise NothingFoundError
    return group[0]


def _prev(node: ast.Call, context: Context) -> Any:
    """An expression as it was at the start of the step, before the agent acted."""
    before = context.world.before
    if before is None:
        return there(of(node.args[0], context))
    earlier = replace(
        context,
        world=before,
        me=moved(context.me, before),
        variables={name: moved(value, before) for name, value in context.variables.items()},
    )
    return moved(there(of(node.args[0], earlier)), context.world)


def moved(value: Any, world: World) -> Any:
    """The same value with every entity replaced by what it is in another moment of its world."""
    if isinstance(value, list):
        return [moved(item, world) for item in value]
    if not isinstance(value, Entity):
        return value
    return as_list(world.objects[value.key])[value.index] if value.sort == "object" else world.cast[value.key]


FUNCTIONS: dict[str, Callable[[ast.Call, Context], Any]] = {
    "pick": _pick,
    "prev": _prev,
    "first": _first,
    "count": lambda node, context: len(as_list(of(node.args[0], context))),
    "min": lambda node, context: min(there(of(argument, context)) for argument in node.args),
    "max": lambda node, context: max(there(of(argument, context)) for argument in node.args),
    "abs": lambda node, context: abs(there(of(node.args[0], context))),
    "opposite": lambda node, context: turned(of(node.args[0], context), 2),
}

HANDLERS: dict[type, Callable[[Any, Context], Any]] = {
    ast.Number: lambda node, context: node.value,
    ast.Truth: lambda node, context: node.value,
    ast.Text: _text,
    ast.Name: _name,
    ast.Attribute: _attribute,
    ast.Call: _call,
    ast.Quantifier: _quantifier,
    ast.Not: lambda node, context: not there(of(node.operand, context)),
    ast.Logic: _logic,
    ast.Compare: _compare,
    ast.Member: _member,
    ast.Alternatives: _alternatives,
    ast.Interval: _interval,
    ast.Arithmetic: _arithmetic,
    ast.Negative: lambda node, context: -there(of(node.operand, context)),
    ast.Conditional: _conditional,
}
