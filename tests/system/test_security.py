"""The link with certificates over real sessions: which roles may send which frames, and the messages otherwise."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from threading import Event

import pytest
import zenoh
from mcap.reader import make_reader

from common.errors import InputError, LostError
from common.link.security import Identity
from common.link.transport import CHANNELS, CONTROL, SAMPLES, TICK, Route
from common.link.zenoh_link import key, listenable
from rths.prepare import keys
from tests.certificates import DAY, NOW, again, identity, made
from tests.faults.rows import passed
from tests.helpers import PATIENT, ROOT
from tests.processes import HANG_S
from tests.system.certified import TEST, Ear, acquaint, bare, ears

SHORT_S = 0.3  # for what must not come
name = partial(key, TEST)


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, keys.Owner]]:
    """A folder of certificates, and what is in it."""
    folder = tmp_path_factory.mktemp("secure") / "keys"
    return folder, made(folder)


@pytest.fixture(scope="module")
def folder(authority: tuple[Path, dict[str, keys.Owner]]) -> Path:
    return authority[0]


def test_the_roles_of_a_test_reach_each_other_as_on_an_open_link(folder: Path) -> None:
    with ears(folder, "slave", "recorder", "operator") as found:
        found["master"].link.send(TICK, b"command")
        assert found["slave"].next() == ("master", TICK, b"command")
        found["slave"].link.send(TICK, b"feedback")
        assert found["master"].next() == ("slave", TICK, b"feedback")
        found["slave"].link.send(SAMPLES, b"samples")
        assert found["recorder"].next() == ("slave", SAMPLES, b"samples")
        found["recorder"].link.send(CONTROL, b"recorder")
        assert found["operator"].next() == ("recorder", CONTROL, b"recorder")
        found["operator"].link.send(CONTROL, b"reset")
        for role in ("master", "slave"):
            assert found[role].until(b"reset") in ([], [b"recorder"])


def test_named_slaves_receive_only_their_own_commands(tmp_path: Path) -> None:
    slaves = ("slave.roof", "slave.middle")
    owners = keys.certificates(("master", *slaves), (), NOW - DAY, NOW + DAY)
    keys.write(tmp_path / "keys", owners)
    endpoint = listenable()
    with ExitStack() as stack:
        master = Ear("master", identity(tmp_path / "keys", "master"), slaves=slaves, listen=endpoint)
        stack.callback(master.link.close)
        for slave in slaves:
            ear = Ear(slave, identity(tmp_path / "keys", slave), slaves=slaves, connect=endpoint)
            stack.callback(ear.link.close)
            for _ in range(200):
                master.link.send(TICK, slave.encode(), slave)
                if (heard := ear.next(0.05)) is not None:
                    break
            assert heard == ("master", TICK, slave.encode())


def test_an_observer_receives_everything_and_can_send_nothing(folder: Path) -> None:
    with ears(folder, "slave", "recorder", "observer") as found:
        for role, channel in (("master", TICK), ("slave", TICK), ("slave", SAMPLES), ("recorder", CONTROL)):
            found[role].link.send(channel, b"said")
            assert found["observer"].next() == (role, channel, b"said")
        endpoint = found["master"].endpoint  # type: ignore[attr-defined]
        for ear in found.values():
            while ear.next(0.1) is not None:
                pass
        with bare(endpoint, identity(folder, "observer")) as session:
            for role in ("master", "slave", "recorder", "operator", "observer"):
                for channel in CHANNELS:
                    session.put(name(Route(role, channel)), b"forged")
            assert [ear.next(SHORT_S) for ear in found.values()] == [None] * 4


# -- those who have not --------------------------------------------------------------------------------


@pytest.fixture
def master(folder: Path) -> Iterator[tuple[Ear, str, list[str]]]:
    """A master that listens, where, and what it has noticed."""
    noticed: list[str] = []
    endpoint = listenable()
    ear = Ear("master", identity(folder, "master"), listen=endpoint)
    ear.link.watch(noticed.append)
    yield ear, endpoint, noticed
    ear.link.close()


def test_nobody_connects_without_a_certificate(master: tuple[Ear, str, list[str]], folder: Path) -> None:
    with pytest.raises(LostError, match=r"asks for a certificate, but this plan has none: name the folder"):
        Ear("slave", None, connect=master[1], patience=0.1)
    with pytest.raises(zenoh.ZError), bare(master[1], None):
        pass


def test_a_slave_with_certificates_reports_that_the_master_has_none(folder: Path) -> None:
    endpoint = listenable()
    ear = Ear("master", None, listen=endpoint)
    try:
        with pytest.raises(LostError, match=r"does not use TLS, but this plan asks for it"):
            Ear("slave", identity(folder, "slave"), connect=endpoint, patience=0.1)
    finally:
        ear.link.close()
    with pytest.raises(LostError, match=r"No master was reached at tls/127.0.0.1:\d+ within 0.1 s"):
        Ear("slave", identity(folder, "slave"), connect=endpoint, patience=0.1)


def test_a_link_ends_when_a_certificate_expires(
    authority: tuple[Path, dict[str, keys.Owner]], tmp_path: Path
) -> None:
    folder, owners = authority
    end = datetime.now(UTC) + timedelta(seconds=5)
    soon = identity(again(tmp_path / "soon", owners, "slave", NOW - DAY, end), "slave")
    endpoint = listenable()
    with ExitStack() as stack:
        ears = {
            "master": Ear("master", identity(folder, "master"), listen=endpoint),
            "slave": Ear("slave", soon, connect=endpoint),
        }
        for ear in ears.values():
            stack.callback(ear.link.close)
        acquaint(ears)
        ears["master"].link.send(TICK, b"command")
        assert ears["slave"].until(b"command") == []
        while datetime.now(UTC) < end + timedelta(seconds=1):
            ears["slave"].next(0.1)
        ears["master"].link.send(TICK, b"command")
        assert ears["slave"].next(SHORT_S) is None


def test_nobody_connects_with_certificates_of_another_authority(
    master: tuple[Ear, str, list[str]], folder: Path, tmp_path: Path
) -> None:
    made(tmp_path / "foreign")
    foreign = identity(tmp_path / "foreign", "slave")
    with pytest.raises(InputError, match=r"was issued by another authority than .*foreign/authority.pem"):
        Ear("slave", foreign, connect=master[1])
    forged = identity(tmp_path / "foreign", "slave", authority=folder)
    with pytest.raises(
        InputError, match=r"refused the certificate in .*foreign: it was issued by another authority"
    ):
        Ear("slave", forged, connect=master[1])
    for who in (foreign, forged):
        with pytest.raises(zenoh.ZError), bare(master[1], who):
            pass


def test_nobody_connects_with_an_expired_certificate(
    master: tuple[Ear, str, list[str]], authority: tuple[Path, dict[str, keys.Owner]], tmp_path: Path
) -> None:
    old = identity(again(tmp_path / "old", authority[1], "slave", NOW - 2 * DAY, NOW - DAY), "slave")
    with pytest.raises(
        InputError, match=r"refused the certificate in .*old: it has expired by the master's clock"
    ):
        Ear("slave", old, connect=master[1])
    with pytest.raises(zenoh.ZError), bare(master[1], old):
        pass


def test_a_master_whose_certificate_expired_or_is_a_slaves_is_refused(
    authority: tuple[Path, dict[str, keys.Owner]], tmp_path: Path
) -> None:
    folder, owners = authority
    old = identity(again(tmp_path / "old", owners, "master", NOW - 2 * DAY, NOW - DAY), "master")
    false = Identity("master", folder / "authority.pem", folder / "recorder.pem", folder / "recorder.key")
    for who, sentence in (
        (old, r"The master's certificate at .* has expired"),
        (false, r"shows another certificate than the master's"),
    ):
        endpoint = listenable()
        ear = Ear("master", who, listen=endpoint)
        try:
            with pytest.raises(InputError, match=sentence):
                Ear("slave", identity(folder, "slave"), connect=endpoint)
        finally:
            ear.link.close()


def test_a_master_is_reached_only_under_the_names_in_its_certificate(
    master: tuple[Ear, str, list[str]], folder: Path
) -> None:
    other = master[1].replace("127.0.0.1", "127.0.0.2")
    ear = Ear("master", identity(folder, "master"), listen=other)
    try:
        with pytest.raises(InputError, match=r"is not made for 127.0.0.2: .*--host 127.0.0.2"):
            Ear("slave", identity(folder, "slave"), connect=other)
    finally:
        ear.link.close()


@pytest.mark.parametrize("mode", ["client", "peer", "router"])
def test_a_recorders_certificate_cannot_command_the_slave(folder: Path, mode: str) -> None:
    """The check of the role is left out here: a session without our code puts commands on the master's keys."""
    with ears(folder, "slave", "recorder") as found:
        endpoint = found["master"].endpoint  # type: ignore[attr-defined]
        with bare(endpoint, identity(folder, "recorder"), mode) as session:
            for route in (Route("master", TICK), Route("master", CONTROL), Route("slave", TICK)):
                session.put(name(route), b"forged")
            session.put("rths/*/master/tick", b"forged")
            session.put("**", b"forged")
            session.delete(name(Route("master", TICK)))
            session.put(name(Route("recorder", CONTROL)), b"its own")  # comes after all the others
            assert found["slave"].until(b"its own") == []
            assert found["master"].until(b"its own") == []
    how = "no certificate, another's, an expired one; commands put under the recorder's"
    evidence = "the session is refused; of what a recorder puts on the master's keys nothing comes"
    passed("F52", "no credentials, or another role's", how, "refused", None, 0.0, evidence)


def test_a_slaves_certificate_receives_no_messages_for_others(folder: Path) -> None:
    with ears(folder, "slave", "recorder") as found:
        stolen: list[bytes] = []
        endpoint = found["master"].endpoint  # type: ignore[attr-defined]
        with bare(endpoint, identity(folder, "slave")) as session:
            hear = lambda sample: stolen.append(sample.payload.to_bytes())  # noqa: E731
            for what in ("**", "rths/**", name(Route("master", SAMPLES))):
                session.declare_subscriber(what, hear)
            for _ in range(20):
                found["master"].link.send(SAMPLES, b"secret")
                assert found["recorder"].next() == ("master", SAMPLES, b"secret")
        assert stolen == []


def test_a_visitor_whose_certificate_has_no_role_is_reported_and_sends_nothing(folder: Path) -> None:
    noticed, told = Event(), []

    def notice(text: str) -> None:
        told.append(text)
        noticed.set()

    with ears(folder, "slave") as found:
        found["master"].link.watch(notice)
        endpoint = found["master"].endpoint  # type: ignore[attr-defined]
        with bare(endpoint, identity(folder, "visitor")) as session:
            for role in ("master", "operator", "visitor"):
                session.put(name(Route(role, CONTROL)), b"forged")
            assert noticed.wait(HANG_S)
            assert found["slave"].next(SHORT_S) is None
    assert told == [
        "'visitor' has joined with a certificate of no role in this test: its messages are blocked."
    ]


# -- whole tests -----------------------------------------------------------------------------------------

PLAN = (
    """
[test]
name = "secure"
duration = 2.0
[link]
connect_timeout = 150.0
loss_timeout = 60.0
[recording]
patience = 100.0
[link.security]
folder = "keys"
"""
    + PATIENT
)


def rths(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "rths", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=150,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    (tmp_path / "plan.toml").write_text(PLAN)
    made(tmp_path / "keys")
    return tmp_path / "plan.toml"


def everything(path: Path) -> bytes:
    """All that a recording holds, out of its compressed chunks."""
    with path.open("rb") as file:
        reader = make_reader(file)
        parts = [message.data for _, _, message in reader.iter_messages()]
        parts += [repr(record.metadata).encode() for record in reader.iter_metadata()]
        parts += [attachment.data for attachment in reader.iter_attachments()]
    return b"\n".join(parts)


def test_a_complete_test_runs_with_certificates_and_writes_no_key_to_any_file(planned: Path) -> None:
    output = planned.parent / "out.mcap"
    found = rths("run", planned, "--rt", "off", "-o", output)
    assert found.returncode == 0, found.stderr
    assert "outcome: completed" in found.stdout
    held = everything(output)
    assert b"[link.security]" in held
    for path in planned.parent.glob("keys/*.key"):
        secret = path.read_text().splitlines()[1]
        assert secret not in found.stdout + found.stderr
        assert secret.encode() not in held


def test_a_run_without_a_certificate_ends_before_any_process_starts(planned: Path) -> None:
    (planned.parent / "keys/slave.pem").unlink()
    found = rths("run", planned, "--rt", "off", "-o", planned.parent / "out.mcap")
    assert found.returncode == 2
    assert found.stderr.startswith("rths: Cannot read ")
    assert found.stderr.count("\n") == 1
    assert "slave.pem" in found.stderr


Spoil = Callable[[Path, Path], None]


def wrong_role(folder: Path, _: Path) -> None:
    for end in ("pem", "key"):
        (folder / f"recorder.{end}").replace(folder / f"slave.{end}")


def foreign_authority(folder: Path, other: Path) -> None:
    made(other)
    for file in ("slave.pem", "slave.key", "authority.pem"):
        (other / file).replace(folder / file)


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (wrong_role, "is a certificate of 'recorder', but this is the slave"),
        (foreign_authority, "was issued by another authority than"),
    ],
)
def test_a_slave_that_is_refused_states_the_reason_and_ends_with_exit_code_2(
    spoil: Spoil, sentence: str, planned: Path, tmp_path: Path, folder: Path
) -> None:
    endpoint = listenable()
    ear = Ear("master", identity(folder, "master"), listen=endpoint)
    try:
        spoil(planned.parent / "keys", tmp_path / "other")
        found = rths("slave", planned, "--rt", "off", "--connect", endpoint)
    finally:
        ear.link.close()
    assert found.returncode == 2, found.stderr
    assert sentence in found.stderr
    assert [line for line in found.stderr.splitlines() if not line.startswith("slave: looks for ")] == [
        found.stderr.splitlines()[-1]
    ]
