"""Numba's settings as far as they shape the engine's code, read without loading Numba where none is set."""

import os
import sys
from pathlib import Path
from typing import Final

SHIPPED: Final = {
    "DISABLE_JIT": "0",
    "CPU_NAME": "None",
    "CPU_FEATURES": "None",
    "OPT": "_OptLevel(3)",
    "BOUNDSCHECK": "None",
    "DEBUGINFO_DEFAULT": "0",
    "LOOP_VECTORIZE": "1",
    "SLP_VECTORIZE": "0",
    "ENABLE_AVX": "True",
}
"""What they are where nobody changed them. Were one wrong, the code would be compiled more often than it need be."""


def settings() -> dict[str, str]:
    """The settings, written out, by Numba's names for them."""
    touched = any(name.startswith("NUMBA_") for name in os.environ) or Path(".numba_config.yaml").exists()
    if not touched and "numba" not in sys.modules:
        return SHIPPED
    from numba.core import config

    return {name: str(getattr(config, name)) for name in SHIPPED}


def is_interpreted() -> bool:
    """Whether the engine is to run as plain Python."""
    return settings()["DISABLE_JIT"] != SHIPPED["DISABLE_JIT"]
