"""`python -m simrecon`: the same as the command `simrecon`."""

import sys

from simrecon.cli import main

if __name__ == "__main__":
    sys.exit(main())
