"""How large and how deep files may be: checked before anything that could suffer sees them."""

from typing import Final

MAX_FILE_BYTES: Final = 1 << 20
MAX_DEPTH: Final = 32
MAX_EVENTS: Final = 50_000
MAX_SCALAR: Final = 10_000
MAX_INT_DIGITS: Final = 10
MAX_FLOAT_LENGTH: Final = 30

MAX_FILES: Final = 64
MAX_TOTAL_BYTES: Final = 4 << 20
MAX_CHAIN: Final = 8
MAX_NAME: Final = 4_000
MAX_PATCH_PATH: Final = 500
