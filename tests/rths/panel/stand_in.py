"""Stand-ins for the laboratories of a test, which answer an operator over zenoh as they do, and count the presses.

`python -m tests.rths.panel.stand_in PLAN` keeps them in a process of its own, until that is ended.
"""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

from common.host import running
from common.lab.operation import ORDERS
from common.link.endpoint import FrameEndpoint
from common.link.zenoh_link import ZenohLink, listenable
from common.plan.plan import Plan
from common.plan.read import load
from common.protocol.messages import Answer, Operator
from common.roles import MASTER
from tests.processes import environment, tied


class StandIn:
    """Master and slaves of a test that is announced on this machine: `presses` holds every new press in turn."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.presses: dict[str, list[tuple[int, str]]] = {role: [] for role in (MASTER, *plan.roles)}
        self.deaf: set[str] = set()  # roles that answer nothing
        self.lossy = 0  # of how many frames of an operator the first is lost, by role; 0 for none
        self._ending = threading.Event()
        self._threads: list[threading.Thread] = []

    def attend(self, role: str, endpoint: FrameEndpoint) -> None:
        """Answer for a role until the end."""
        heard = 0
        seen = set()
        while not self._ending.is_set():
            received = endpoint.receive(0.05)
            if received is None or not isinstance(received.message, Operator) or role in self.deaf:
                continue
            heard += 1
            wish = received.message
            if role not in ORDERS[wish.word].answered_by(self.plan.roles):
                continue
            if self.lossy and heard % self.lossy == 1:
                continue
            if wish.press not in seen:
                seen.add(wish.press)
                self.presses[role].append((wish.press, wish.word))
            endpoint.send(Answer(0, wish.press, 1, "running."))

    @contextlib.contextmanager
    def there(self, recording: Path | None = None) -> Iterator[StandIn]:
        """The test while the context lasts."""
        place, digest = listenable(), self.plan.digest()
        with contextlib.ExitStack() as links:
            for role in self.presses:
                where = {"listen": place} if role == MASTER else {"connect": place, "patience": 200.0}
                link = ZenohLink(role, self.plan.test.name, slaves=self.plan.roles, **where)
                links.callback(link.close)
                endpoint = FrameEndpoint(link, digest)
                self._threads.append(threading.Thread(target=self.attend, args=(role, endpoint)))
            for thread in self._threads:
                thread.start()
            try:
                with running.announced(self.plan, place, recording=recording):
                    yield self
            finally:
                self._ending.set()
                for thread in self._threads:
                    thread.join()


@contextlib.contextmanager
def elsewhere(plan: Plan, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The test in a process of its own while the context lasts, which is killed then; `folder` takes its plan."""
    path = folder / "stand_in.toml"
    path.write_text(plan.toml())
    with subprocess.Popen(tied(sys.executable, "-m", __name__, path), env=environment()) as process:
        try:
            yield process
        finally:
            process.kill()


if __name__ == "__main__":
    with StandIn(load(Path(sys.argv[1]))).there():
        signal.pause()
