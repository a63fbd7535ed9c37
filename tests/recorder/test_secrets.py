"""The session's number and key appear in no recording, no report and no command line."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
import zstandard
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from common.link.zenoh_link import listenable
from common.plan import read as plans
from common.plan.plan import Plan
from common.reality import reality
from simulation import virtual
from tests.helpers import PATIENT, ROOT
from tests.processes import HANG_S, environment, tied

SESSION = 0x1D3A_57C9_E2B4_6F81  # no run of its bytes comes about by chance


def varint(number: int) -> bytes:
    """A number as protobuf has it."""
    digits = []
    while number:
        digits.append(number & 0x7F | (0x80 if number > 0x7F else 0))
        number >>= 7
    return bytes(digits)


def secrets_of(plan: Plan) -> list[bytes]:
    """Session and key in every form in which they could have been written."""
    key = hashlib.blake2b(f"{SESSION}:{plan.digest()}".encode(), digest_size=32).digest()
    whole = [str(SESSION).encode(), f"{SESSION:x}".encode(), f"{SESSION:X}".encode(), key.hex().encode()]
    return [*whole, SESSION.to_bytes(8, "big"), SESSION.to_bytes(8, "little"), varint(SESSION), key[:8]]


def content(path: Path) -> bytes:
    """A recording's bytes, and those of its chunks unpacked."""
    parts = [path.read_bytes()]
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                parts.append(zstandard.decompress(record.data, record.uncompressed_size))
    return b"".join(parts)


def test_a_recording_contains_neither_number_nor_key_of_its_session(
    short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(virtual, "SESSION", SESSION)
    reports: list[str] = []
    bench = virtual.assemble(
        short_plan,
        reality.as_planned(short_plan),
        tmp_path / "a.mcap",
        lambda kind, data: reports.append(json.dumps([kind, *data.items()])),
    )
    assert virtual.run(bench, lambda: "") is None
    assert bench.slave.lab.exchange.session == SESSION
    written = content(tmp_path / "a.mcap")
    assert b"Frames" not in written
    assert b"table_displacement" in written
    for secret in secrets_of(short_plan):
        assert secret not in written
        assert secret.decode("latin-1") not in "".join(reports)


DRAWN = "import runpy, secrets, sys; secrets.randbelow = lambda _: {}; sys.argv = sys.argv[1:]; "
MODULE = "runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)"


@pytest.mark.parametrize("as_json", [True, False], ids=["json", "text"])
def test_the_processes_print_neither_number_nor_key_of_their_session(tmp_path: Path, as_json: bool) -> None:
    path, recorded, endpoint = tmp_path / "plan.toml", tmp_path / "a.mcap", listenable()
    path.write_text(PATIENT + "[test]\nduration = 0.2\n", encoding="utf-8")
    options = ["--json"] if as_json else []
    (tmp_path / "draw.py").write_text(DRAWN.format(SESSION - 1) + MODULE, encoding="utf-8")
    words = {
        "master": ["--listen", endpoint, "--rt", "off"],
        "slave": ["--connect", endpoint, "--rt", "off"],
        "recorder": ["--connect", endpoint, "-o", str(recorded)],
    }
    processes = [
        subprocess.Popen(
            tied(sys.executable, tmp_path / "draw.py", module, path, *more, *options),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment(),
            cwd=ROOT,
        )
        for module, more in words.items()
    ]
    try:
        said = b"".join(part for process in processes for part in process.communicate(timeout=HANG_S))
        assert [process.returncode for process in processes] == [0, 0, 0], said.decode()
    finally:
        for process in processes:
            process.kill()
            process.wait()
    written = content(recorded)
    for secret in secrets_of(plans.load(path)):
        assert secret not in said
        assert secret not in written
