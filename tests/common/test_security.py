"""Certificates are made and checked, and those that cannot be used are refused with the reason."""

from __future__ import annotations

import shutil
import stat
import sys
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID

from common.errors import InputError
from common.lab.process import join
from common.link import security
from common.link.access import access_control
from common.link.address import dialled, loopback, place, secured
from common.link.transport import heard, said
from common.link.zenoh_link import key
from common.plan import read as plans
from common.plan.plan import Plan
from rths.__main__ import main
from tests.certificates import DAY, NOW, ROLES, again, made

TEXT = "[test]\nduration = 2.0\n[link.security]\nfolder = 'keys'\n"


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that has the plan's folder `keys`."""
    folder = tmp_path_factory.mktemp("base")
    made(folder / "keys")
    return folder


@pytest.fixture
def copy(base: Path, tmp_path: Path) -> Path:
    """A copy of the folder that a test may damage."""
    shutil.copytree(base / "keys", tmp_path / "keys")
    return tmp_path


def secure_plan(folder: Path) -> Plan:
    return plans.parse(TEXT, folder)


def made_by(*words: str | Path) -> int:
    sys.argv = ["rths", "keys", *map(str, words)]
    return main()


def purposes(path: Path) -> list[Any]:
    found = x509.load_pem_x509_certificate(path.read_bytes())
    return list(found.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value)


# -- making ------------------------------------------------------------------------------------------


def test_keys_are_made_for_every_role_and_only_their_owner_reads_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "keys"
    assert made_by(folder, "--host", "lab-a.example", "192.0.2.1", "--days", "3") == 0
    assert "authority.key away from the laboratories" in capsys.readouterr().out
    assert {path.name for path in folder.iterdir()} == {
        f"{name}.{end}" for name in ("authority", *ROLES) for end in ("pem", "key")
    }
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.glob("*.key")} == {0o600}
    master = x509.load_pem_x509_certificate((folder / "master.pem").read_bytes())
    names = master.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "lab-a.example"]
    assert [*map(str, names.get_values_for_type(x509.IPAddress))] == ["127.0.0.1", "::1", "192.0.2.1"]
    assert timedelta(days=3) < master.not_valid_after_utc - master.not_valid_before_utc < timedelta(days=4)


def test_only_the_masters_certificate_is_for_servers_and_it_is_for_nothing_else(base: Path) -> None:
    assert purposes(base / "keys/master.pem") == [ExtendedKeyUsageOID.SERVER_AUTH]
    for role in ROLES[1:]:
        assert purposes(base / f"keys/{role}.pem") == [ExtendedKeyUsageOID.CLIENT_AUTH]


def test_the_slaves_of_a_plan_get_a_certificate_each(tmp_path: Path) -> None:
    assert made_by(tmp_path / "a", "--plan", "two_dampers") == 0
    assert made_by(tmp_path / "b", "--slaves", "roof", "middle") == 0
    for folder in ("a", "b"):
        found = {path.stem for path in (tmp_path / folder).glob("*.pem")} - {"authority"}
        assert found == {"master", "slave.roof", "slave.middle", "recorder", "operator", "observer"}


def test_existing_certificates_are_not_overwritten(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (copy / "keys/master.key").read_bytes()
    assert made_by(copy / "keys") == 2
    assert "keys are never overwritten: name a new folder" in capsys.readouterr().err
    assert (copy / "keys/master.key").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--days", "0"), "--days 0 cannot be used: give 1 to 3650."),
        (("--host", "tcp/192.0.2.1:7447"), "is neither a host's name nor its address"),
        (("--slaves", "Roof"), "begin with a lower-case letter"),
        (("--slaves", "a" * 70), "is too long for a certificate"),
        (("--slaves", "a", "a"), "has a name twice"),
        (("--plan", "nowhere.toml"), "Cannot read the plan nowhere.toml"),
    ],
)
def test_a_failure_to_make_certificates_is_reported_and_leaves_no_files(
    words: tuple[str, ...], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert made_by(tmp_path / "keys", *words) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "keys").exists()


# -- checking ----------------------------------------------------------------------------------------


def test_a_role_reads_only_its_own_files_and_the_authoritys_certificate(copy: Path) -> None:
    for path in (copy / "keys").iterdir():
        if path.name not in ("authority.pem", "slave.pem", "slave.key"):
            path.unlink()
    found = security.identity(secure_plan(copy), "slave")
    assert {found.authority.name, found.certificate.name, found.key.name} == {
        path.name for path in (copy / "keys").iterdir()
    }
    assert "PRIVATE" not in repr(found) + repr(found.settings())


def test_a_message_about_a_missing_certificate_file_names_the_file(copy: Path) -> None:
    for name in ("slave.key", "slave.pem", "authority.pem"):
        (copy / "keys" / name).unlink()
        with pytest.raises(InputError, match=rf"Cannot read .*{name}, .*No such file .*rths keys"):
            security.identity(secure_plan(copy), "slave")


def test_a_message_about_an_invalid_certificate_file_names_it(copy: Path) -> None:
    (copy / "keys/slave.key").write_text("nothing")
    with pytest.raises(InputError, match=r"slave.key is not a private key"):
        security.identity(secure_plan(copy), "slave")
    (copy / "keys/slave.pem").write_text("nothing")
    with pytest.raises(InputError, match=r"slave.pem is not a certificate"):
        security.identity(secure_plan(copy), "slave")


def test_the_certificate_of_another_role_is_refused(copy: Path) -> None:
    for end in ("pem", "key"):
        shutil.copy(copy / f"keys/recorder.{end}", copy / f"keys/slave.{end}")
    with pytest.raises(InputError, match=r"is a certificate of 'recorder', but this is the slave"):
        security.identity(secure_plan(copy), "slave")


def test_the_key_of_another_role_is_refused(copy: Path) -> None:
    shutil.copy(copy / "keys/recorder.key", copy / "keys/slave.key")
    with pytest.raises(InputError, match=r"slave.key is not the key of .*slave.pem"):
        security.identity(secure_plan(copy), "slave")


def test_the_certificate_of_another_authority_is_refused(copy: Path, tmp_path: Path) -> None:
    made(tmp_path / "other")
    shutil.copy(tmp_path / "other/authority.pem", copy / "keys/authority.pem")
    with pytest.raises(InputError, match=r"slave.pem was not issued by the authority in .*authority.pem"):
        security.identity(secure_plan(copy), "slave")


def test_a_certificate_must_be_valid_until_the_end_of_the_test(base: Path) -> None:
    test = secure_plan(base)  # 30 s for the others to come, 2 s of test
    assert security.identity(test, "slave", NOW + DAY - timedelta(seconds=40))
    for now, sentence in (
        (NOW - 2 * DAY, r"is valid from .* UTC only: set this machine's clock"),
        (NOW + 2 * DAY, r"authority.pem expired on .* UTC: make new ones with `rths keys`"),
        (NOW + DAY - timedelta(seconds=20), r"expires on .* UTC, before the test can be over"),
    ):
        with pytest.raises(InputError, match=sentence):
            security.identity(test, "slave", now)


def test_a_certificate_that_expired_before_its_authority_is_named(base: Path, tmp_path: Path) -> None:
    owners = made(tmp_path / "fresh")
    again(tmp_path / "keys", owners, "slave", NOW - 2 * DAY, NOW - DAY)
    with pytest.raises(InputError, match=r"slave.pem expired on"):
        security.identity(secure_plan(tmp_path), "slave")


# -- endpoints ---------------------------------------------------------------------------------------


def test_with_security_every_endpoint_uses_tls() -> None:
    assert secured("tcp/127.0.0.1:7447") == secured("tls/127.0.0.1:7447") == "tls/127.0.0.1:7447"
    assert secured("") == ""
    with pytest.raises(InputError, match=r"'udp/127.0.0.1:7447' cannot be used with \[link.security\]"):
        secured("udp/127.0.0.1:7447")
    with pytest.raises(InputError, match=r"'somewhere' is not an endpoint"):
        secured("somewhere")


def test_an_address_that_zenoh_cannot_verify_is_refused() -> None:
    assert dialled("tcp/lab-a:7447") == "tls/lab-a:7447"
    with pytest.raises(InputError, match=r"cannot be dialled with \[link.security\]: give the master's name"):
        dialled("tcp/[::1]:7447")


def test_an_endpoint_on_loopback_is_recognized() -> None:
    assert all(map(loopback, ("", "tcp/127.0.0.1:1", "tcp/127.1.2.3:1", "tls/localhost:1", "tcp/[::1]:1")))
    assert not any(map(loopback, ("tcp/0.0.0.0:1", "tcp/192.0.2.1:1", "tcp/[::]:1", "tcp/lab-a:1")))
    assert place("tcp/[::1]:7447") == ("::1", 7447)


@pytest.mark.parametrize(("endpoint", "warned"), [("tcp/127.0.0.1:0", False), ("tcp/0.0.0.0:0", True)])
def test_an_unencrypted_link_that_others_can_reach_gives_a_warning(
    endpoint: str, warned: bool, default_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Link:
        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def watch(self, _: Any) -> None:
            pass

    monkeypatch.setattr("common.link.zenoh_link.ZenohLink", Link)
    told: list[Any] = []
    join(default_plan, "master", str, lambda *words: told.append(words), listen=endpoint)
    assert [data["code"] for _, data in told if "code" in data] == ["open_link"] * warned


# -- access ------------------------------------------------------------------------------------------


def allowed(control: Any, role: str, flow: str, message: str) -> set[str]:
    """The key expressions that a role may use."""
    ids = {name for policy in control["policies"] if policy["subjects"] == [role] for name in policy["rules"]}
    rules = [rule for rule in control["rules"] if rule["id"] in ids]
    assert {rule["permission"] for rule in rules} == {"allow"}
    return {
        one
        for rule in rules
        if (rule["flows"], rule["messages"]) == ([flow], [message])
        for one in rule["key_exprs"]
    }


def test_a_role_may_use_only_its_own_routes() -> None:
    slaves = ("slave.roof", "slave.middle")
    name = partial(key, "test")
    control: Any = access_control(slaves, name)
    assert control["enabled"]
    assert control["default_permission"] == "deny"
    for role in (*slaves, *ROLES[2:]):
        says, hears = ({name(route) for route in routes(role, slaves)} for routes in (said, heard))
        assert allowed(control, role, "ingress", "put") == says
        assert allowed(control, role, "ingress", "declare_subscriber") == hears
        assert allowed(control, role, "egress", "put") == hears
        assert allowed(control, role, "egress", "declare_subscriber") == says
    assert allowed(control, "observer", "ingress", "put") == set()
    assert allowed(control, "operator", "ingress", "put") == {"rths/test/operator/control"}
    assert not any("*" in one for rule in control["rules"] for one in rule["key_exprs"])
    assert [subject["cert_common_names"] for subject in control["subjects"]] == [
        [role] for role in (*slaves, *ROLES[2:])
    ]
