"""The equations of all effects for the reference, from what stands at the top of their files."""

from __future__ import annotations

from typing import Any

from laboratories.effects import FILES
from laboratories.effects.sites import SITES


def equations() -> str:
    """Every effect with its equation and source, by site; those on readings once, as they exist for every signal."""
    found: dict[str, list[str]] = {site: [] for site in (*SITES, "sensors") if "." not in site}
    for file in FILES:
        site, name = place(file)
        summary, _, rest = str(file["__doc__"]).strip().partition("\n")
        found[site].append(f"### `{name}`\n\n{summary}\n{rest}\n")
    return "\n".join(
        f"## {site.capitalize()}\n\n" + "\n".join(texts) for site, texts in found.items() if texts
    )


def place(file: dict[str, Any]) -> tuple[str, str]:
    """The site and the name of a file's effect."""
    if "FAULT" in file:
        return "sensors", f"sensor.<signal>.{file['FAULT'].name}"
    return file["EFFECT"].site, file["EFFECT"].name
