"""The command ``tetralod``, which the package contains: ``python -m tetralod --help``."""

import sys

from . import _native


def main() -> None:
    """Runs the command with the arguments of this process, and ends it with its exit code."""
    sys.exit(_native.run(["tetralod", *sys.argv[1:]], [sys.executable, "-m", "tetralod"]))


if __name__ == "__main__":
    main()
