"""`python -m socialai_dsl COMMAND ...`, the same as `socialai COMMAND ...`."""

import sys

from socialai_dsl.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
