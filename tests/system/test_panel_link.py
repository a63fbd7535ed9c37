"""The operator's panel where a firewall cuts its link to the master, and where processes of the test are killed."""

from __future__ import annotations

import contextlib
import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from common.host import running
from common.recording.reader import read
from common.recording.run import Run
from tests.browser import Page, chromium, open_page
from tests.helpers import PATIENT
from tests.processes import HANG_S
from tests.system.faults.network import Network, inside, network, run
from tests.system.panels import ENABLED, LINKED, ORDERS, Panels, orders_that, press

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine (Debian: chromium)"),
]

PHASE = "document.getElementById('phase').textContent"
ALERT = "document.getElementById('unheard').textContent"
AGAIN = """async (body) => {
  const headers = { "Content-Type": "application/json" };
  return await (await fetch("order", { method: "POST", headers, body })).json();
}"""
SHORT_S = 0.5  # s of an outage within the link's lease and an operator's patience


class Firewalled:
    """A panel, its browser and its test in a network namespace whose firewall can cut the panel's link."""

    def __init__(self, found: Network, folder: Path) -> None:
        self._network = found
        into = inside(found.master)
        self.panels = Panels(folder, into)
        self.browser = folder / "browser"
        self.browser.write_text(f'#!/bin/sh\nexec {" ".join(into)} {chromium()} "$@"\n')
        self.browser.chmod(0o755)

    @property
    def _port(self) -> str:
        """Where the master listens."""
        return next(iter(running.by_process().values())).endpoint.rpartition(":")[2]

    def cut(self) -> None:
        """Drop what the panel and the master say to each other, and every attempt at a new connection."""
        master, panel = self._port, f"pid={self.panels.running[0].pid},"
        lines = run(*inside(self._network.master), "ss", "-tnpH").splitlines()
        mine = [one.split()[3] for one in lines if panel in one and one.split()[4].endswith(f":{master}")]
        port = mine[0].rpartition(":")[2]
        rule = f"th dport . th sport {{ {master} . {port}, {port} . {master} }}"
        self._network.drop(self._network.master, f"meta l4proto tcp {rule}")
        syn = f"tcp dport {master} tcp flags & (syn | ack) == syn drop"
        run(*inside(self._network.master), "nft", f"add rule inet fault in {syn}")

    def mend(self) -> None:
        """Let everything through again; something was dropped."""
        assert self._network.keep(self._network.master) > 0


@pytest.fixture
def firewalled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Firewalled]:
    monkeypatch.setenv("RTHS_RUNNING", str(tmp_path))
    (tmp_path / "plan.toml").write_text(f"[test]\nname = 'operated'\nduration = 120.0\n{PATIENT}")
    with network() as found:
        place = Firewalled(found, tmp_path)
        yield place
        for number in running.by_process():
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        for process in place.panels.running:
            process.kill()
            process.communicate()


def begun(page: Page) -> None:
    """Check the plan, arm and start, as an operator does."""
    for word in ("check", "arm", "start"):
        page.wait(ENABLED % word, HANG_S)
        press(page, word)
        page.wait(f"!{ORDERS}[0].endsWith(': sent')", HANG_S)
        assert ": done" in page.evaluate(ORDERS)[0]
    page.wait(f"{PHASE} === 'running'", HANG_S)


def carried_out(recorded: Run) -> list[tuple[str, str]]:
    """The orders that the laboratories have carried out: laboratory and word."""
    events = [one for one in recorded.events if one["code"] == "operator"]
    return [(one["lab"], one["text"].partition(":")[0]) for one in events]


def test_a_firewall_between_panel_and_master_loses_no_press_and_repeats_none(
    firewalled: Firewalled, tmp_path: Path
) -> None:
    panels = firewalled.panels
    with open_page(panels.start("plan.toml"), program=firewalled.browser) as page:
        sent: list[Any] = []
        page._page.on("request", lambda one: sent.append(one.post_data_json) if one.post_data else None)
        begun(page)
        firewalled.cut()
        press(page, "hold")
        page.wait(f"{ORDERS}[0].startsWith('Hold: not heard')", HANG_S)
        page.wait(f"{ALERT}.startsWith('The link to the laboratories is cut')", HANG_S)
        page.wait("document.getElementById('test').textContent.includes(', not linked for ')", HANG_S)
        firewalled.mend()
        page.wait(f"{ALERT} === '' && {LINKED}", HANG_S)
        other = page._page.context.browser.new_page()
        other.goto(page._page.url)
        other.wait_for_function(
            f"{PHASE} === 'running'", timeout=HANG_S * 1e3
        )  # what was not heard was not done
        press(page, "hold")
        page.wait(f"{PHASE} === 'held'", HANG_S)
        firewalled.cut()
        other.click("button[data-word=resume]")
        page._page.wait_for_timeout(SHORT_S * 1e3)
        firewalled.mend()
        page.wait(f"{ORDERS}[0].startsWith('Resume, page 2: done')", HANG_S)
        held = next(one for one in reversed(sent) if one["word"] == "hold")
        again = page._page.evaluate(AGAIN, json.dumps(held))
        assert again["state"] == "done"  # the outcome of the press, which is not repeated
        press(page, "stop")
        page.wait(f"{PHASE}.startsWith('No test runs. The last one ended: stopped by the operator')", HANG_S)
        assert len(orders_that(page, "Stop: done")) == 1
        assert page.errors == []
    panels.end()
    once = [("master", word) for word in ("start", "hold", "resume", "stop")]
    recorded = read(next((tmp_path / "runs").glob("operated-*.mcap")))
    assert sorted(carried_out(recorded)) == sorted([*once, ("slave", "stop")])


def child(role: str) -> int:
    """The process of a role of the test that runs."""
    command = next(iter(running.by_process()))
    found = Path(f"/proc/{command}/task/{command}/children").read_text(encoding="utf-8").split()
    words = {one: Path(f"/proc/{one}/cmdline").read_bytes().split(b"\0") for one in found}
    return int(next(one for one, said in words.items() if role.encode() in said))


@pytest.mark.parametrize("role", ["master", "slave", "recorder"])
def test_a_killed_process_is_named_and_the_page_can_arm_again(
    role: str, firewalled: Firewalled, tmp_path: Path
) -> None:
    panels = firewalled.panels
    with open_page(panels.start("plan.toml"), program=firewalled.browser) as page:
        begun(page)
        os.kill(child(role), signal.SIGKILL)
        row = f"document.querySelector('#labs [data-key={role}]')"
        page.wait(f"{row} && {row}.textContent.includes('no process')", HANG_S)
        page.wait(f"{PHASE}.includes('The {role} was killed (signal 9)')", HANG_S)
        page.wait(ENABLED % "arm", HANG_S)
        assert page.evaluate("document.getElementById('causes').children.length") >= 1
    panels.end()


def test_a_browser_that_is_killed_leaves_the_test_as_it_is(firewalled: Firewalled, tmp_path: Path) -> None:
    panels = firewalled.panels
    url = panels.start("plan.toml")
    with contextlib.suppress(Exception), open_page(url, program=firewalled.browser) as page:
        begun(page)
        page._page.context.browser.new_browser_cdp_session().send("Browser.crash")
    with open_page(url, program=firewalled.browser) as page:
        page.wait(f"{PHASE} === 'running'", HANG_S)
        press(page, "stop")
        page.wait(f"{PHASE}.startsWith('No test runs. The last one ended: stopped by the operator')", HANG_S)
    panels.end()
    recorded = read(next((tmp_path / "runs").glob("operated-*.mcap")))
    assert sorted(carried_out(recorded)) == [("master", "start"), ("master", "stop"), ("slave", "stop")]
