"""Text from files and other processes reaches the terminal as plain letters, in every command."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from common import signals
from common.recording.schema import message_class, schema_file
from common.terminal import cli
from common.terminal.printable import ACTING, ANYWHERE, all_shown, escaping, shown
from diagnosis.report.read import report as read_report
from diagnosis.report.records import Report
from report.run import drawing
from report.text.progress import Progress as Working
from report.text.terminal import RunProgress, table
from rths.__main__ import VERBS
from rths.perform.follow import tell
from rths.perform.processes import TEXT, ProcessReport
from tests.rths.diagnosis_report.pieces import bare

READABLE = "µ²λ–Ωé"
HOSTILE = (
    "a\x1b]8;;http:\\\\x\x1b\\b\x1b[2Kc\x9b31md\u202ee\u2066f\x07g\x08h\rFORGED i\nFORGED j\u2028FORGED k"
    + READABLE
)


@pytest.mark.parametrize(
    "text", [READABLE, "Ω \u00a0 × 10³ m/s² – „Müller“ 中文 שלום عربي 👩\u200d🔬", "plain\ttext\n"]
)
def test_ordinary_text_stays_readable(text: str) -> None:
    assert ANYWHERE.sub("", text) == text
    assert shown(text.strip()).replace("\\t", "\t") == text.strip()


def test_characters_that_act_on_a_terminal_are_escaped() -> None:
    assert shown("\x1b[2K\r\n\x9b\u202e\udc80") == r"\x1b[2K\r\n\x9b\u202e\udc80"
    assert all_shown({"\x07": ["\n", 1, {"a": "\x1b"}]}) == {r"\x07": [r"\n", 1, {"a": r"\x1b"}]}
    assert shown(HOSTILE).isprintable()
    assert READABLE in shown(HOSTILE)


def test_everything_that_a_command_prints_is_escaped(capsys: Any) -> None:
    with escaping():
        print("\x1b[31m", end="\n")  # as a rig may do
        print("\x9b", file=sys.stderr)
        assert cli.guarded(lambda: print("\u202e") or 0) == 0
    said = capsys.readouterr()
    assert (said.out, said.err) == ("\\x1b[31m\n\\u202e\n", "\\x9b\n")


def test_a_message_of_a_process_stays_on_one_line() -> None:
    stream = io.StringIO()
    progress = RunProgress(1.0, stream)
    for data in (
        {"kind": "event", "lab": HOSTILE, "level": "error", "code": HOSTILE, "text": HOSTILE},
        {"kind": TEXT, "text": HOSTILE},  # of a rig
        {"kind": "mode", "lab": HOSTILE, "mode": HOSTILE},
    ):
        tell(ProcessReport("slave", data), progress)
    assert_harmless(stream.getvalue())
    assert stream.getvalue().count("\n") == 2


def test_the_terminal_display_keeps_its_own_sequences_and_escapes_those_in_texts(monkeypatch: Any) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: True)
    progress = RunProgress(1.0, stream)
    progress.mode(HOSTILE, HOSTILE)
    progress.show({"t": 0.5, "missed": 1.0})
    drawn = stream.getvalue()
    assert "\x1b[33mlate 1" in drawn
    assert "\x1b]8" not in drawn
    assert r"a\x1b]8" in drawn


def test_links_tables_and_progress_are_escaped(capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("report.text.progress.UNSAID", 0.0)
    with escaping():
        cli.text_report("event", {"lab": HOSTILE, "text": HOSTILE})
        cli.text_report("state", {"lab": HOSTILE, "state": HOSTILE})
        table([["name", HOSTILE], [HOSTILE, "x"]])
        working = Working(HOSTILE, began=0.0)
        working.tell(HOSTILE)
        working.look(1e12)
    said = capsys.readouterr()
    assert_harmless(said.out + said.err)
    assert (said.out + said.err).count("\n") == 5


def assert_harmless(said: str) -> None:
    """Asserts that nothing in a text acts on a terminal and that no line of it is forged."""
    assert not ANYWHERE.search(said), said
    assert not any(line.startswith("FORGED") for line in said.split("\n")), said


@pytest.fixture(scope="module")
def hostile(virtual_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of a test, whose every text is hostile."""
    path = tmp_path_factory.mktemp("hostile") / "hostile.mcap"
    file = schema_file("event", signals.EVENT, 1)
    event = message_class(file, "rths.Event")
    text = dict.fromkeys(("lab", "text"), HOSTILE) | {"values": {HOSTILE: 1.0}}
    told = [event(**text, level="error", code="limit"), event(**text, level="warning", code="rejected")]
    with virtual_recording.open("rb") as stream, path.open("wb") as sink:
        reader, writer = make_reader(stream), Writer(sink)
        writer.start(library=HOSTILE)
        channels = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                topic = f"rths/{HOSTILE}/{channel.topic.split('/')[-1]}"
                channels[channel.id] = writer.register_channel(
                    topic, channel.message_encoding, number, channel.metadata
                )
            data = message.data
            if channel.topic.endswith("/event") and told:
                data = told.pop().SerializeToString()
            writer.add_message(
                channels[channel.id], message.log_time, data, message.publish_time, message.sequence
            )
        for metadata in reader.iter_metadata():
            kept = metadata.name == "plan"
            values = {key: value if kept else HOSTILE for key, value in metadata.metadata.items()}
            writer.add_metadata(metadata.name, values if kept else values | {HOSTILE: HOSTILE})
        for attachment in reader.iter_attachments():
            writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
        writer.add_metadata(HOSTILE, {HOSTILE: HOSTILE})
        writer.finish()  # type: ignore[no-untyped-call]
    return path


PRINTING: dict[str, tuple[str, ...]] = {
    "inspect": (),
    "report": ("-o", "{tmp}/a.html"),
    "plot": ("tracking", "-o", "{tmp}/a.svg"),
    "budget": (),
    "replay": (),
    "compare": ("{file}",),
    "identify": ("--part", "table"),
    "layout": ("-o", "{tmp}/a.json"),
    "export": ("-o", "{tmp}/a.csv", "--events"),
    "recover": ("-o", "{tmp}/a.mcap"),
    "diagnose": (),
}
SHOWN_BY = (
    "inspect",
    "report",
    "compare",
    "layout",
    "identify",
    "diagnose",
)  # which say some of the hostile text
SILENT = ("live",)  # which prints the address of its page alone


def test_every_command_that_reads_a_recording_is_tested() -> None:
    from rths.__main__ import parser_for

    reading = {verb for verb in VERBS if any(item.dest == "file" for item in parser_for(verb)._actions)}
    assert {*PRINTING, *SILENT} == {*reading, "compare"}


@pytest.mark.parametrize("verb", PRINTING)
def test_a_command_prints_the_text_of_a_recording_escaped(
    verb: str, call: Any, capsys: Any, hostile: Path, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr(drawing, "PICTURES", {})
    if verb == "diagnose":  # its search takes a minute and prints nothing of the recording
        monkeypatch.setattr("rths.examine.diagnose.diagnosed", lambda *_, **__: (hostile_reports(), None))
    if verb == "identify":
        monkeypatch.setattr("report.facts.identification.identify", identified)
    call(verb, hostile, *(word.format(tmp=tmp_path, file=hostile) for word in PRINTING[verb]))
    said = capsys.readouterr()
    assert_harmless(said.out)
    assert_harmless(said.err)
    assert READABLE in said.out or verb not in SHOWN_BY


def identified(*_: Any) -> dict[str, Any]:
    """The identified parameters of a part, with hostile texts."""
    parameters = {HOSTILE: {"value": 1.0, "low": 0.5, "high": 2.0, "unit": HOSTILE}}
    return {"part": HOSTILE, "parameters": parameters, "model": HOSTILE}


def hostile_reports(*_: Any, **__: Any) -> dict[str, Report]:
    """The report on a test with one slave, which has the hostile text wherever one of a recording has text."""
    gap = {"nrmse": 0.1, "noise_floor": 0.01, "peak_error": None, "unit": HOSTILE}
    report = read_report(
        bare("unknown_effect")
        | {
            "next_test": HOSTILE,
            "warnings": [HOSTILE],
            "gap": {"signals": {HOSTILE: gap}, "overall": None, "overall_noise_floor": None},
            "details": {"test": {"name": HOSTILE}},
        }
    )
    return {"": report}


@pytest.mark.parametrize("verb", ["inspect", "replay", "budget", "diagnose"])
def test_an_error_message_contains_no_escape_sequence(
    verb: str, call: Any, capsys: Any, tmp_path: Path
) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as sink:
        writer = Writer(sink)
        writer.start()
        number = writer.register_schema(HOSTILE, "protobuf", b"none")
        channel = writer.register_channel(f"rths/{HOSTILE}/master", "protobuf", number, {})
        writer.add_message(channel, 0, b"none", 0, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    assert call(verb, path) == 2
    said = capsys.readouterr().err
    assert_harmless(said)
    assert said.count("\n") == 1
    assert READABLE in said


def test_the_escaped_characters_are_those_that_act_on_a_terminal() -> None:
    """The range is written with the characters themselves, so that it is compared with what Unicode says of them."""
    import unicodedata

    missed = [
        code
        for code in range(sys.maxunicode + 1)
        if unicodedata.category(chr(code)) in ("Cc", "Zl", "Zp")
        or unicodedata.bidirectional(chr(code))
        in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
        if not ANYWHERE.match(chr(code)) and chr(code) not in "\t\n"
    ]
    assert missed == []
    assert "\x1b" not in ACTING  # within a range
