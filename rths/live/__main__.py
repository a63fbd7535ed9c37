"""`python -m rths.live FILE`: the live view as `rths run --live` starts it."""

from __future__ import annotations

import sys

from common import process
from rths.live import add_arguments, run

if __name__ == "__main__":
    sys.exit(process.enter("rths.live", __doc__, add_arguments, run))
