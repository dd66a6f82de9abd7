"""Counter-based randomness: every random number of an episode is a pure function of where and when it is drawn.

A draw is keyed by (seed, index, episode, step, site, number). There is no stream to advance, so results do not depend
on batch size, threads, or on what anybody else drew.

* `episode_key(seed, index, episode)` names an episode; the test set lives in a domain of keys that no seed reaches.
* A **site** is a hash of the place in the resolved scenario that asks for the draw:

  ======================================  ============================================================  ==============
  what is drawn                           site                                                          number
  ======================================  ============================================================  ==============
  width, height of the room               `room.width`, `room.height`                                   0
  a `pick` in an expression               the path of the value that holds it: `let.exit`,              its ordinal
                                          `cast.liar.name`, `cast.liar.with.answer`; inside a frame     among the
                                          prefixed by who plays it:                                     picks of that
                                          `wizard/frames.courtesy.states.acquainted.then[0].say`;       value, from 0,
                                          a rule or step with an id (or state name) is addressed by it  in source order
  the cell of an entity                   `cast.NAME.cell`, `objects.NAME.cell`                         member index
  a random colour                         `cast.NAME.color`, `objects.NAME.color`                       member index
  a random direction                      `cast.NAME.facing`                                            0
  left or right when a goal is behind     `cast.NAME.turn`                                              0
  `chance` of a rule                      `NAME/...path of the rule....chance`                          0
  `choose(a | b)` of a `do:`              like a `pick`                                                 its ordinal
  ======================================  ============================================================  ==============

  An expression that comes from `define` counts as written where it is used; keys that come from `npc_defaults` count
  as written in the cast member.
* `step` is t when the value is computed; 0 at reset.
* A room that is not as required is drawn again: every draw of the next attempt, but that of a suite's member, takes
  `attempt_key(key, attempt)` in place of the episode's key until the reset is over. Attempt 0 has the key itself.
* Act k of an episode in acts (`draw: in_sequence`) has `act_key(key, k)` in place of the episode's key. Act 0 has the
  key itself, and no member is drawn.
* What stays the same in a session of n episodes (`session`) has `episode_key(seed, index, first)`, `first` being the
  number of the session's first episode, `episode - episode % n`; in act k the `act_key` of that. No attempt changes it.
* A suite's member is drawn at site `member`, number 0: `choose(u, weights)`, by default with weight 1 for each, which
  is `below(u, n)`.
* A choice among n things takes the `below(u, n)`-th of them: members of a group by index, alternatives as written,
  colours by code, cells row by row, numbers ascending. `distinct` colours are drawn one after another, each among those
  not yet taken, in order of code.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b

MASK = (1 << 64) - 1
GOLDEN = 0x9E3779B97F4A7C15
TEST_DOMAIN = 1 << 63
MAX_SEED = (1 << 63) - 1


def mix(value: int) -> int:
    """The finaliser of splitmix64 (Steele, Lea, Flood 2014): a bijection of 64-bit numbers."""
    value &= MASK
    value = ((value ^ (value >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    value = ((value ^ (value >> 27)) * 0x94D049BB133111EB) & MASK
    return value ^ (value >> 31)


def episode_key(seed: int, index: int, episode: int) -> int:
    """The 64-bit key of an episode. `seed` is below 2**63, or TEST_DOMAIN for the fixed test set."""
    key = mix(seed + GOLDEN)
    key = mix(key + (index + 1) * GOLDEN)
    return mix(key + (episode + 1) * GOLDEN)


def attempt_key(key: int, attempt: int) -> int:
    """The key of the draws at reset of an episode of which `attempt` rooms were not as required."""
    # Sites are below 2**31, so no draw has this word.
    return mix(key + ((1 << 63) | attempt) * GOLDEN) if attempt else key


def act_key(key: int, act: int) -> int:
    """The key of an act of an episode in acts."""
    # Neither a draw nor an attempt, of which there are few, has this word.
    return mix(key + ((1 << 63) | (1 << 32) | act) * GOLDEN) if act else key


def site(path: str) -> int:
    """The 31-bit number of a place in the resolved scenario."""
    return int.from_bytes(blake2b(path.encode(), digest_size=4).digest(), "big") >> 1


def draw(key: int, place: int, step: int, number: int) -> int:
    """64 random bits for the `number`-th draw at site `place` in step `step` (both below 2**16)."""
    word = (place << 32) | (step << 16) | number
    return mix(key + word * GOLDEN)


def below(bits: int, n: int) -> int:
    """A number from 0 to n - 1 (n < 2**32), by multiply and shift."""
    return ((bits >> 32) * n) >> 32


def choose(bits: int, weights: Sequence[int]) -> int:
    """A number from 0 to len(weights) - 1, each as likely as it weighs; the weights add up to 1 to 2**32 - 1."""
    left = below(bits, sum(weights))
    for number, weight in enumerate(weights):
        if left < weight:
            return number
        left -= weight
    raise ValueError("choose: got weights that add up to nothing; expected a positive sum")


def holds_with_chance(bits: int, chance: float) -> bool:
    """Whether an event of this probability (resolution 1/65536) happens."""
    return (bits >> 48) < round(chance * 65536)
