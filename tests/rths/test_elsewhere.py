"""Recordings read by other programs: independent readers in Python and JavaScript, and the viewers' layout."""

from __future__ import annotations

import functools
import hashlib
import json
import os
import shutil
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from common import signals
from common.plan.read import from_tables
from common.reality import reality
from common.recording.checksums import CHECKSUMS
from common.recording.reader import read
from common.recording.recover.recovery import recover
from common.recording.run import Run
from common.recording.writer import Recording
from common.roles import kind_of, latency_topic, ramp_topic
from common.signals import FieldType
from rths.examine import layout
from simulation import virtual
from tests.helpers import ROOT
from tests.processes import finished
from tests.rths import extremes

SCRIPTS = ROOT / "tests/javascript"
INSTALL_S = 240.0
KINDS = ("one slave", "two slaves", "extremes", "killed and recovered")


class HeardMessage(NamedTuple):
    """A message as an independent reader gives it; doubles are hex digits of their bits."""

    sequence: int
    log_ns: int
    publish_ns: int
    fields: dict[str, Any]


class Read(NamedTuple):
    """A recording as an independent reader gives it."""

    messages: dict[str, list[HeardMessage]]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]


@pytest.fixture(scope="module")
def recordings(virtual_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Recordings of tests in virtual time, one that was cut off and recovered, one of extreme values."""
    folder = tmp_path_factory.mktemp("elsewhere")
    plan = from_tables(
        {"test": {"duration": 1.0, "name": "two"}, "slave": {"roof": {}, "cellar": {}}}, folder
    )
    two = folder / "two.mcap"
    assert virtual.run(virtual.assemble(plan, reality.as_planned(plan), two), str) is None
    whole = two.read_bytes()
    (folder / "killed.mcap").write_bytes(whole[: len(whole) * 6 // 10])
    recover(folder / "killed.mcap", folder / "recovered.mcap")
    made = (virtual_recording, two, extremes.write(folder / "extremes.mcap"), folder / "recovered.mcap")
    return dict(zip(KINDS, made, strict=True))


def bits(number: float) -> str:
    return struct.pack(">d", number).hex()


@functools.cache
def by_python(path: Path) -> Read:
    """A recording as the MCAP project's Python libraries read it."""
    messages: dict[str, list[HeardMessage]] = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            told = HeardMessage(message.sequence, message.log_time, message.publish_time, fields(decoded))
            messages.setdefault(channel.topic, []).append(told)
        metadata = {item.name: item.metadata for item in reader.iter_metadata()}
        attachments = {item.name: item.data for item in reader.iter_attachments()}
    return Read(messages, metadata, attachments)


def fields(message: Any) -> dict[str, Any]:
    return {
        field.name: plain(field, getattr(message, field.name))
        if not field.is_repeated or field.message_type
        else [plain(field, item) for item in getattr(message, field.name)]
        for field in message.DESCRIPTOR.fields
    }


def plain(field: Any, value: Any) -> Any:
    if field.message_type:
        return {name: bits(number) for name, number in value.items()}
    return bits(value) if field.type == field.TYPE_DOUBLE else value


@pytest.fixture(scope="session")
def javascript(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., list[Any]]:
    """Runs a script of tests/javascript and gives its lines; its packages are installed once per lock file."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if not node or not npm:
        pytest.skip("there is no node and npm on this machine")
    folder = tmp_path_factory.mktemp("javascript")
    for script in SCRIPTS.glob("*.mjs"):
        shutil.copy(script, folder)
    (folder / "node_modules").symlink_to(installed(npm) / "node_modules")

    def run(script: str, *words: Path) -> list[Any]:
        done = finished(node, folder / script, *words, seconds=120.0)
        assert done.returncode == 0, done.stderr[-2000:]
        return [json.loads(line) for line in done.stdout.splitlines()]

    return run


def installed(npm: str) -> Path:
    """The folder with the packages of the lock file; skips where they cannot be had."""
    lock = hashlib.sha256((SCRIPTS / "package-lock.json").read_bytes()).hexdigest()[:16]
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "rths-tests"
    target, growing = cache / lock, cache / f"{lock}-{os.getpid()}"
    if target.is_dir():
        return target
    growing.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copy(SCRIPTS / name, growing)
    try:
        done = finished(npm, "ci", seconds=INSTALL_S, cwd=growing)
    except subprocess.TimeoutExpired:
        shutil.rmtree(growing)
        pytest.skip(f"npm has not got its packages within {INSTALL_S:g} s")
    assert "EUSAGE" not in done.stderr, done.stderr  # the lock does not fit the package file
    if done.returncode:
        shutil.rmtree(growing)
        pytest.skip(f"npm cannot get its packages: {done.stderr.strip().splitlines()[0]}")
    try:
        growing.rename(target)
    except OSError:  # another process was faster
        shutil.rmtree(growing)
    return target


def by_javascript(run: Callable[..., list[Any]], path: Path) -> Read:
    """A recording as the MCAP project's JavaScript libraries read it, in order and by its index."""
    *lines, index = run("read.mjs", path)
    found = Read({}, {}, {})
    for line in lines:
        match line["kind"]:
            case "message":
                told = HeardMessage(
                    line["sequence"], int(line["logTime"]), int(line["publishTime"]), line["fields"]
                )
                found.messages.setdefault(line["topic"], []).append(joined(told))
            case "metadata":
                found.metadata[line["name"]] = line["values"]
            case "attachment":
                found.attachments[line["name"]] = bytes.fromhex(line["data"])
    assert index["messages"] == int(index["counted"]) == sum(map(len, found.messages.values()))
    return found


def joined(told: HeardMessage) -> HeardMessage:
    """A message with the types of Python: a map is a list of pairs, a 64-bit number a text."""
    rows = {row.name: row.kind for rows in signals.TOPICS.values() for row in rows}
    for name, value in told.fields.items():
        if rows[name] is FieldType.VALUES:
            told.fields[name] = {pair["key"]: pair["value"] for pair in value}
        elif rows[name] is FieldType.STAMP:
            told.fields[name] = int(value)
    return told


def by_rths(run: Run) -> dict[str, list[dict[str, Any]]]:
    """The fields of every message as our own reader has them."""
    ramps = {ramp_topic(role): columns for role, columns in run.ramps.items()}
    found = {topic: rows_of(topic, columns) for topic, columns in (run.columns | ramps).items()}
    found["event"] = [
        event | {"t": bits(event["t"]), "values": {name: bits(x) for name, x in event["values"].items()}}
        for event in run.events
    ]
    return {f"rths/{run.test}/{topic}": rows for topic, rows in found.items() if rows}


def rows_of(topic: str, columns: dict[str, Any]) -> list[dict[str, Any]]:
    kinds = {row.name: row.kind for row in signals.TOPICS[kind_of(topic)]}
    cells = {
        name: [cell(kinds[name], value) for value in column.tolist()] for name, column in columns.items()
    }
    return [dict(zip(cells, row, strict=True)) for row in zip(*cells.values(), strict=True)]


def cell(kind: FieldType, value: Any) -> Any:
    if isinstance(value, list):
        return [cell(kind, item) for item in value]
    return bits(value) if kind in (FieldType.NUMBER, FieldType.STOREYS) else value


@pytest.mark.parametrize("kind", KINDS)
def test_an_independent_reader_in_python_reads_every_field_of_every_message(
    kind: str, recordings: dict[str, Path]
) -> None:
    ours, theirs = read(recordings[kind]), by_python(recordings[kind])
    assert {topic: [told.fields for told in rows] for topic, rows in theirs.messages.items()} == by_rths(ours)
    for topic, sequences in ours.sequences.items():
        rows = theirs.messages.get(f"rths/{ours.test}/{topic}", [])
        assert [told.sequence for told in rows] == sequences.tolist()
        assert [told.log_ns for told in rows] == ours.log_ns[topic].tolist()
    assert theirs.metadata.keys() - {CHECKSUMS} == ours.metadata.keys()
    assert all(theirs.metadata[name] == values for name, values in ours.metadata.items())
    assert theirs.attachments == ours.attachments


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_an_independent_reader_in_javascript_reads_every_field_of_every_message(
    kind: str, recordings: dict[str, Path], javascript: Any
) -> None:
    assert by_javascript(javascript, recordings[kind]) == by_python(recordings[kind])


def test_the_compared_recordings_contain_every_case(recordings: dict[str, Path]) -> None:
    for kind, path in recordings.items():
        found = by_python(path)
        assert "killed" in kind or found.messages.keys() == {
            f"rths/{read(path).test}/{topic}" for topic in signals.default_topics(read(path).roles)
        }
        assert "plan" in found.metadata or kind == "extremes"
        assert "ground_motion" in found.attachments
    whole, cut = (by_python(recordings[kind]).messages for kind in ("two slaves", "killed and recovered"))
    for topic, rows in cut.items():
        assert rows == whole[topic][: len(rows)]
    assert 100 < len(cut["rths/two/master"]) < len(whole["rths/two/master"])


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    """A recording of two slaves with drawn latencies, some beyond the last bin and some missing."""
    path, draw = tmp_path / "drawn.mcap", np.random.default_rng(1)
    topics = signals.default_topics(extremes.SLAVES)
    recording = Recording(path, "drawn", 1, topics, extremes.SLAVES)
    zero = {FieldType.COUNT: 0, FieldType.INDEX: 0, FieldType.STAMP: 0, FieldType.FLAG: False}
    for tick in range(500):
        for role in extremes.SLAVES:
            topic = latency_topic(role)
            row = {item.name: zero.get(item.kind, 0.0) for item in topics[topic]} | {"seq": tick}
            row["round_trip"] = draw.choice(
                [draw.gamma(4.0, 4e-4), 0.002, np.nan, 1.0], p=[0.9, 0.04, 0.04, 0.02]
            )
            recording.add(topic, tick * 2_000_000, tick * 2_000_000, list(row.values()))
    recording.add("event", 0, 0, (0.0, "master", "error", "limit", "beyond", {}))
    recording.close({})
    return path


def leaves(tree: Any) -> list[str]:
    if isinstance(tree, str):
        return [tree]
    assert tree.keys() == {"direction", "first", "second", "splitPercentage"}
    assert tree["direction"] in ("row", "column")
    assert 0 < tree["splitPercentage"] < 100
    return leaves(tree["first"]) + leaves(tree["second"])


PLOT = {"paths", "xAxisVal", "isSynced", "showLegend", "legendDisplay", "showPlotValuesInLegend"} | {
    "showXAxisLabels",
    "showYAxisLabels",
    "sidebarDimension",
}
NEEDED = {  # of a panel's settings, by its type
    "Plot": PLOT,
    "StateTransitions": {"paths", "isSynced"},
    "RawMessages": {"topicPath", "diffEnabled", "diffMethod", "diffTopicPath", "showFullMessageForDiff"},
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_layout_has_the_form_that_the_viewers_read(
    kind: str, call: Any, capsys: Any, recordings: dict[str, Path], tmp_path: Path
) -> None:
    out = tmp_path / "layout.json"
    assert call("layout", recordings[kind], "-o", out) == 0
    assert "9 panels" in capsys.readouterr().out
    made = json.loads(out.read_text(encoding="utf-8"))
    assert made.keys() == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert sorted(leaves(made["layout"])) == sorted(made["configById"])
    for name, panel in made["configById"].items():
        assert panel.keys() >= NEEDED[name.partition("!")[0]]
        for path in panel.get("paths", []):
            assert path["timestampMethod"] == "receiveTime"
            assert path["enabled"]
        assert panel.get("xAxisVal", "timestamp") in ("timestamp", "custom")
        assert ("xAxisPath" in panel) == (panel.get("xAxisVal") == "custom")
    assert len(made["userNodes"]) == len(read(recordings[kind]).roles)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["one slave", "two slaves", "extremes"])
def test_every_path_of_a_layout_exists_in_the_recording(
    kind: str, recordings: dict[str, Path], javascript: Any, tmp_path: Path
) -> None:
    out = tmp_path / "layout.json"
    out.write_text(json.dumps(layout.layout(layout.of_recording(recordings[kind]))), encoding="utf-8")
    [found] = javascript("layout.mjs", out, recordings[kind])
    for path, count in found["paths"].items():
        assert count["messages"] > 0, path
        assert count["values"] > 0 or "{level==" in path or kind == "extremes", path
    shown = {path.rpartition(".")[2] for path in found["paths"]}
    assert shown >= {
        "column_target",
        "column_displacement",
        "table_target",
        "table_displacement",
        "column_force",
    }
    assert shown >= {
        "damper_stroke",
        "damper_force",
        "round_trip",
        "deadline_missed",
        "time[:]",
        "ticks[:]",
        "text",
    }


@pytest.mark.slow
def test_the_script_in_the_layout_counts_the_histogram(drawn: Path, javascript: Any, tmp_path: Path) -> None:
    subject = layout.of_recording(drawn)
    (tmp_path / "layout.json").write_text(json.dumps(layout.layout(subject)), encoding="utf-8")
    [found] = javascript("layout.mjs", tmp_path / "layout.json", drawn)
    assert subject.last == 499
    for name in ("roof", "cellar"):
        [made] = found["made"][f"/studio_script/rths_latency_{name}"]
        times = read(drawn).columns[f"latency.{name}"]["round_trip"]
        bins = np.minimum(np.floor(times[~np.isnan(times)] / (subject.interval / 100)), 199).astype(int)
        counts = np.bincount(bins, minlength=200)
        assert made["ticks"] == np.repeat(counts, 2).tolist()
        assert counts[-1] > 0
        assert counts.sum() < 500
        assert np.allclose(made["time"], np.repeat(np.arange(201), 2)[1:-1] * 2e-5, rtol=1e-12)


def test_the_layout_without_a_recording_equals_that_of_the_default_test(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    assert call("layout", "-o", tmp_path / "layout.json", "--json") == 0
    made = json.loads((tmp_path / "layout.json").read_text(encoding="utf-8"))
    assert json.loads(capsys.readouterr().out)["panels"] == list(made["configById"])
    assert made["configById"] == layout.layout(layout.of_recording(virtual_recording))["configById"]


def test_a_layout_has_no_panel_for_signals_that_are_not_recorded(drawn: Path) -> None:
    panels = layout.layout(layout.of_recording(drawn))["configById"]
    assert set(panels) == {
        "Plot!histogram",
        "Plot!round_trip",
        "StateTransitions!states",
        "RawMessages!events",
    }


def test_a_file_without_a_layout_is_refused_in_one_sentence(
    call: Any, capsys: Any, recordings: dict[str, Path], tmp_path: Path
) -> None:
    bare = Recording(tmp_path / "bare.mcap", "bare", 1, {"master": (signals.SEQ, signals.TIME)})
    bare.add("master", 0, 0, (0, 0.0))
    bare.close({})
    wrong = {
        (tmp_path / "bare.mcap", tmp_path / "a.json"): "holds no signal for any panel of a layout",
        (tmp_path / "none.mcap", tmp_path / "a.json"): "Cannot read the recording",
        (recordings["one slave"], tmp_path): "it is a folder; give the name of a file",
    }
    for (file, out), sentence in wrong.items():
        assert call("layout", file, "-o", out) == 2
        said = capsys.readouterr().err
        assert sentence in said
        assert said.count("\n") == 1
