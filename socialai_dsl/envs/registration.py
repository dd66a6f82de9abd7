"""The ids for Gymnasium: one for each shipped scenario, and one for any scenario by name or path."""

from __future__ import annotations

import gymnasium

from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.loader.shipped import IDS

_ENTRY = "socialai_dsl.envs.factory:make_env"
_VECTOR_ENTRY = "socialai_dsl.envs.factory:make_vector_env"


def register_all() -> None:
    """Register `SocialAI/<Name>-v1` for every shipped scenario that is there, and `SocialAI/Scenario-v1`."""
    shipped = shipped_folder()
    ids = {name: scenario for name, scenario in IDS.items() if (shipped / f"{scenario}.yaml").is_file()}
    for name, scenario in [*ids.items(), ("Scenario", None)]:
        full = f"SocialAI/{name}-v1"
        if full not in gymnasium.registry:
            kwargs = {} if scenario is None else {"scenario": scenario}
            gymnasium.register(full, entry_point=_ENTRY, vector_entry_point=_VECTOR_ENTRY, kwargs=kwargs)
