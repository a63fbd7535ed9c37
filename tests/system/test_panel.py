"""The operator's panel in a real browser: a thousand stops, use by keyboard, a phone's width, a screen reader."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.plan.plan import Plan
from common.plan.read import with_test
from common.recording.reader import read
from report.panel.words import WORDS
from tests.browser import chromium, open_page
from tests.helpers import PATIENT
from tests.processes import HANG_S
from tests.rths.panel.stand_in import StandIn, elsewhere
from tests.system.panels import ENABLED, LINKED, ORDERS, Panels, press

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine (Debian: chromium)"),
]

PRESSES = 1000
NARROW = 390  # of a telephone's screen, CSS pixels
PRESS = """(count) => { const button = document.querySelector("button[data-word=stop]");
  for (let press = 0; press < count; press++) button.click(); }"""
# what becomes of every order of the page, from the answers that its requests get
WATCH = """() => { window.outcomes = {}; const fetched = window.fetch;
  window.fetch = async (...words) => { const answer = await fetched(...words);
    if (words[0] === "order") {
      const { state } = await answer.clone().json();
      outcomes[state] = (outcomes[state] || 0) + 1;
    }
    return answer; }; }"""


@pytest.fixture
def panels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Panels]:
    monkeypatch.setenv("RTHS_RUNNING", str(tmp_path))
    found = Panels(tmp_path)
    yield found
    for process in found.running:
        process.kill()
        process.communicate()


def test_a_thousand_stops_reach_the_laboratories_and_none_is_lost(panels: Panels, short_plan: Plan) -> None:
    plan = with_test(short_plan, seed=5)
    labs = StandIn(plan)
    labs.lossy = 50
    with labs.there(), open_page(panels.start()) as page:
        page.wait(LINKED, HANG_S)
        page.evaluate(WATCH)
        page._page.evaluate(PRESS, PRESSES)
        page.wait(f"Object.values(outcomes).reduce((one, other) => one + other, 0) >= {PRESSES}", HANG_S)
        assert page.evaluate("outcomes") == {"done": PRESSES}
        assert page.errors == []
    for role in ("master", "slave"):
        assert len({press for press, _ in labs.presses[role]}) == len(labs.presses[role]) == PRESSES
    panels.end()


def test_an_operator_without_a_mouse_stops_a_test_with_a_reason(panels: Panels, short_plan: Plan) -> None:
    labs = StandIn(with_test(short_plan, seed=6))
    with labs.there(), open_page(panels.start(), NARROW, 844) as page:
        page.wait(LINKED, HANG_S)
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW
        keyboard, walked = page._page.keyboard, []
        for _ in range(len(WORDS) + 3):
            keyboard.press("Tab")
            walked.append(page.evaluate("document.activeElement.dataset.word || document.activeElement.id"))
            if walked[-1] == "reason":
                break
        assert walked == [*WORDS, "reason"]
        keyboard.type("door open")
        for _ in range(walked.index("reason") - walked.index("emergency")):
            keyboard.press("Shift+Tab")
        keyboard.press("Enter")
        page.wait(f"{ORDERS}.some((one) => one.startsWith('Emergency stop: done'))", HANG_S)
        keyboard.press("Shift+Tab")
        keyboard.press("Space")
        page.wait(f"{ORDERS}.some((one) => one.startsWith('Stop: done'))", HANG_S)
        assert [word for _, word in labs.presses["slave"]] == ["emergency", "stop"]
        page.screenshot(panels.folder / "narrow.png")
    panels.end()


def test_a_screen_reader_finds_names_roles_and_announcements(panels: Panels, short_plan: Plan) -> None:
    labs = StandIn(with_test(short_plan, seed=7))
    url = panels.start()
    with labs.there(), open_page(url) as page:
        page.wait(LINKED, HANG_S)
        for word in WORDS.values():
            button = page._page.get_by_role("button", name=word.label, exact=True)
            assert button.count() == 1, word
            assert button.get_attribute("aria-describedby") == f"says-{word.word}"
        by_role = page._page.get_by_role
        assert by_role("region", name="operator's panel").count() == 1
        assert by_role("group", name="orders").count() == 1
        assert by_role("log", name="Orders, the newest first").count() == 1
        assert by_role("status", name="state of the test").count() == 1
        assert by_role("textbox", name="Reason, which is recorded").count() == 1
        assert by_role("table", name="Laboratories").get_by_role("rowheader", name="slave").count() == 1
        assert by_role("alert").count() == 0  # nothing is wrong
        start, stop = (by_role("button", name=name, exact=True) for name in ("Arm", "Stop"))
        assert (start.is_disabled(), stop.is_disabled()) == (True, False)
        assert "is its own hardware" in page._page.inner_text("#panel")
        panels.running[0].kill()  # the page is alone
        panels.running[0].wait()
        by_role("alert").filter(has_text="The panel is not heard").wait_for(timeout=HANG_S * 1e3)
        assert by_role("button", name="Start", exact=True).is_disabled()
        assert not by_role("button", name="Emergency stop", exact=True).is_disabled()
        page.wait("document.getElementById('phase-age').textContent.endsWith(' ago')", HANG_S)


def test_two_browsers_see_each_others_orders_and_a_page_of_an_ended_panel_gives_none(
    panels: Panels, short_plan: Plan
) -> None:
    labs = StandIn(with_test(short_plan, seed=8))
    with labs.there(), open_page(panels.start()) as page:
        page.wait(LINKED, HANG_S)
        other = page._page.context.browser.new_page()
        other.goto(page._page.url)
        other.wait_for_function(LINKED, timeout=HANG_S * 1e3)
        page._page.click("button[data-word=stop]")
        other.wait_for_function(f"{ORDERS}.some((one) => one.startsWith('Stop, page 1: done'))")
        request = page._page.context.request
        replayed = {"session": "guessed", "number": 1, "word": "stop", "test": "", "digest": "", "seen": 0}
        answer = request.post(
            f"{page._page.url}order", data=replayed | {"reason": ""}, headers={"Origin": page._page.url[:-1]}
        )
        assert answer.json()["state"] == "refused"
        assert request.post(f"{page._page.url}order", data=replayed).status == 403  # it comes from no page
        assert len(labs.presses["master"]) == 1
    panels.end()


def test_a_stop_pressed_during_an_outage_arrives_once_after_it(panels: Panels, short_plan: Plan) -> None:
    labs = StandIn(with_test(short_plan, seed=9))
    with labs.there(), open_page(panels.start()) as page:
        page.wait(LINKED, HANG_S)
        page._page.context.set_offline(True)
        press(page, "stop")
        page.wait("document.getElementById('unheard').textContent !== ''", HANG_S)
        assert page.evaluate(ORDERS)[0].startswith("Stop: sent")
        assert labs.presses["master"] == []
        page._page.context.set_offline(False)
        page.wait(f"{ORDERS}.some((one) => one.startsWith('Stop: done'))", HANG_S)
        page.wait("document.getElementById('unheard').textContent === ''", HANG_S)
        assert [word for _, word in labs.presses["master"]] == ["stop"]
    panels.end()


def test_a_cut_link_to_the_laboratories_is_shown_until_it_is_back(panels: Panels, short_plan: Plan) -> None:
    alert = "document.getElementById('unheard').textContent"
    with (
        elsewhere(with_test(short_plan, seed=10), panels.folder) as labs,
        open_page(panels.start(), NARROW, 844) as page,
    ):
        page.wait(LINKED, HANG_S)
        assert page.evaluate(alert) == ""
        labs.send_signal(signal.SIGSTOP)
        page.wait(f"{alert}.startsWith('The link to the laboratories is cut')", HANG_S)
        page.wait("document.getElementById('test').textContent.includes(', not linked for ')", HANG_S)
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW
        page.screenshot(panels.folder / "cut.png")
        press(page, "stop")
        page.wait(f"{ORDERS}.some((one) => one.startsWith('Stop: not heard'))", HANG_S)
        labs.send_signal(signal.SIGCONT)
        page.wait(f"{alert} === ''", HANG_S)
        press(page, "stop")
        page.wait(f"{ORDERS}.some((one) => one.startsWith('Stop: done'))", HANG_S)
        assert page.errors == []
    panels.end()


def test_a_complete_test_is_operated_from_the_page_and_continues_without_its_panel(panels: Panels) -> None:
    (panels.folder / "plan.toml").write_text(f"[test]\nname = 'operated'\nduration = 300.0\n{PATIENT}")
    with open_page(panels.start("plan.toml")) as page:
        press(page, "check")
        page.wait(ENABLED % "arm", HANG_S)
        press(page, "arm")
        page.wait(ENABLED % "start", HANG_S)
        press(page, "start")
        page.wait("document.getElementById('phase').textContent === 'running'", HANG_S)
        page.wait("document.querySelectorAll('#bars [role=meter]').length > 10", HANG_S)
        panels.running[0].kill()
        panels.running[0].communicate()
        panels.running = []
    with open_page(panels.start("plan.toml")) as page:
        page.wait(LINKED, HANG_S)
        page.wait("document.getElementById('test').textContent.includes('started elsewhere')", HANG_S)
        press(page, "stop")
        page.wait(
            "document.getElementById('phase').textContent.startsWith('No test runs. The last one ended')",
            HANG_S,
        )
        assert "stopped by the operator" in page.evaluate("document.getElementById('phase').textContent")
    panels.end()
    recordings = list((panels.folder / "runs").glob("operated-*.mcap"))
    assert len(recordings) == 1
    run = read(recordings[0])
    assert run.finished
    said = [event["text"] for event in run.events if event["code"] == "operator" and event["lab"] == "master"]
    assert said[0] == "start: The test begins."
    assert said[1].startswith("stop: ")
