"""The compose files, as far as they can be checked without a container engine."""

from __future__ import annotations

from typing import Any

import yaml  # type: ignore[import-untyped]

from tests.helpers import ROOT

RIGHTS = {"SYS_NICE", "IPC_LOCK"}


def services(name: str) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))["services"]
    return found


def test_the_services_ask_for_no_right_that_an_engine_may_lack() -> None:
    found = services("docker-compose.yml")
    assert set(found) == {"master", "slave", "recorder"}
    for service in found.values():
        assert "ulimits" not in service
        assert not RIGHTS & set(service.get("cap_add", []))
        assert service["cap_drop"] == ["ALL"]


def test_the_second_file_gives_the_laboratories_real_time_rights() -> None:
    found = services("docker-compose.realtime.yml")
    assert set(found) == {"master", "slave"}
    for service in found.values():
        assert set(service["cap_add"]) == RIGHTS
        assert service["ulimits"] == {"rtprio": 95, "memlock": -1}
    assert "docker-compose.realtime.yml" in (ROOT / "docs/how-to/real-time-machine.md").read_text(
        encoding="utf-8"
    )
