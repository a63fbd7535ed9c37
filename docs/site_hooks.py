"""Where the site differs from the pages: a diagram that needs a script is replaced by a picture of it."""

from __future__ import annotations

import re
from typing import Any

DIAGRAM = re.compile(r"```mermaid\nstateDiagram-v2\n.*?```\n", flags=re.DOTALL)
PICTURE = "![Modes of the safety machine and the turns between them](../pictures/modes.svg)\n"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """A page with the safety machine as a picture."""
    return DIAGRAM.sub(PICTURE, markdown)
