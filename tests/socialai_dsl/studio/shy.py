"""A scenario with claims that fail, a rival that does well, and a test that fails."""

SHY = """scenario: shy
about: The guide answers those who come close and look at it.
horizon: 30
earshot: 3
grammar: {templates: [Where is <noun>], nouns: [the exit, the cat]}
room: {size: 7}
objects:
  door: {type: door, at: [3, 0], color: green, state: open}
frames:
  shy:
    states:
      waiting:
        do: face(agent)
        then: [{hears: Where is the exit, when: distance(agent) <= 2, say: Go to the <door.color> door., goto: helped}]
      helped: {}
rivals:
  hasty: {steps: [{do: go_to(door), for: ever}]}
cast:
  guide: {name: Ann, at: [5, 3], facing: up, frame: shy}
  agent: {at: [1, 3], facing: right}
outcome:
  - success: agent.at(door)
  - {id: gave_up, failure: agent.did(done)}
check: [{never: guide.is(helped)}, {reachable: guide.is(helped)}, {rival: hasty, at_most: 0.0}]
tests:
  told_from_afar:
    play:
      - {do: forward}
      - {do: Where is the exit, hears: "Ann: Go to the <door.color> door."}
      - {do: done}
  gives_up: {room: {seed: 7}, play: [{do: [left, done]}], ends: failure}
"""
