"""Environments written in JAX, run as they are meant to be: a rollout is one compiled loop.

Nothing crosses from Python between the steps of a rollout. Observations, rewards and ends are summed up, so that the
compiler cannot leave them out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

STEPS = 64

_Run = Callable[[int], None]


def navix(name: str) -> Callable[[int], _Run]:
    """NAVIX: MiniGrid in JAX, with its symbolic view of 7 x 7 from where the agent stands."""

    def start(count: int) -> _Run:
        import jax
        import navix

        env = navix.make(f"Navix-{name}-v0", observation_fn=navix.observations.symbolic_first_person)
        choices = len(env.action_set)
        return _scanned(jax.vmap(env.reset), jax.vmap(env.step), choices, count)

    return start


def xland(name: str) -> Callable[[int], _Run]:
    """XLand-MiniGrid, with its symbolic observation of 7 x 7."""

    def start(count: int) -> _Run:
        import jax
        import xminigrid
        from xminigrid.wrappers import GymAutoResetWrapper

        env, params = xminigrid.make(name)
        env = GymAutoResetWrapper(env)
        if name.startswith("XLand"):
            params = params.replace(ruleset=_rules())
        return _scanned(
            jax.vmap(lambda key: env.reset(params, key)),
            jax.vmap(lambda state, action: env.step(params, state, action)),
            int(env.num_actions(params)),
            count,
        )

    return start


def _rules() -> Any:
    """Goal and rules of the game that `xminigrid` keeps as its example; nothing is downloaded."""
    import jax.numpy as jnp
    from xminigrid.core.constants import Colors, Tiles
    from xminigrid.core.goals import AgentNearGoal
    from xminigrid.core.rules import EmptyRule
    from xminigrid.types import RuleSet

    ball, square = (
        jnp.array((tile, color)) for tile, color in ((Tiles.BALL, Colors.RED), (Tiles.SQUARE, Colors.GREEN))
    )
    return RuleSet(
        goal=AgentNearGoal(tile=ball).encode(),
        rules=EmptyRule().encode()[None, ...],
        init_tiles=jnp.stack([ball, square]),
    )


def _scanned(reset: Any, step: Any, choices: int, count: int) -> _Run:
    import jax
    import jax.numpy as jnp

    actions = jax.random.randint(jax.random.key(1), (STEPS, count), 0, choices)

    def play(state: Any) -> Any:
        def one(carried: Any, action: Any) -> Any:
            state, total = carried
            state = step(state, action)
            told = (state.observation, state.reward, state.step_type)
            return (state, total + sum(jnp.sum(part.astype(jnp.float32)) for part in told)), None

        return jax.lax.scan(one, (state, jnp.float32(0)), actions)[0]

    rollout = jax.jit(play)
    state = jax.jit(reset)(jax.random.split(jax.random.PRNGKey(1), count))
    latest = [rollout(state)[0]]  # compiles

    def run(steps: int) -> None:
        for _ in range(-(-steps // STEPS)):
            latest[0], total = rollout(latest[0])
        total.block_until_ready()

    return run
