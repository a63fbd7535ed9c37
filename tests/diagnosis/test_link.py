"""Effects on the link, found from the messages in a recording; none is found on an undisturbed link."""

from __future__ import annotations

import dataclasses
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.link.mailbox import LinkModel
from common.plan.laboratory_tables import RigTable
from common.plan.plan import Plan
from common.reality import reality
from common.recording.imported import IMPORT, ImportedData
from common.recording.reader import read
from common.recording.run import Run
from diagnosis.recorded.link.effects import findings
from diagnosis.recorded.link.exchange import LinkFinding, account, exchange_of
from loop.closed_loop import on_time
from loop.exchange import exchange
from models.link.impaired import ImpairedLink
from simulation import virtual

DT = 0.002
TICKS = 15_000
NETWORK = "models.link.impaired:ImpairedLink"


def recorded(link: LinkModel, ticks: int = TICKS, *, stamps: bool = True) -> Run:
    """The link's part of a recording in virtual time, without the laboratories."""
    found, seq = exchange(ticks, DT, link), np.arange(ticks)
    run = Run(Path("x"))
    run.columns = {"master": {"damper_force_seq": found.feedback}, "slave": {"command_seq": found.command}}
    run.sequences = {"master": seq, "slave": seq}
    if stamps:
        run.columns["latency"] = rows(found.command, link)
        run.sequences["latency"] = seq
    return run


def rows(command: Any, link: LinkModel) -> dict[str, Any]:
    """The latency topic: row k follows command k and the first feedback that names it."""
    ticks = command.size
    there, back, whole = np.full((3, ticks), np.nan)
    received = np.zeros(ticks, dtype=np.int64)
    for m in np.flatnonzero(np.diff(command, prepend=-1) > 0).tolist():
        k = int(command[m])
        out, home = link.fate("command", k, k * DT), link.fate("feedback", m, m * DT)
        if out is not None and home is not None:
            there[k], back[k] = min(out, (m - k) * DT), home
            whole[k] = (m - k) * DT + home
            received[k] = round((m * DT + home) * 1e9)
    return {
        "wake_lateness": np.zeros(ticks),
        "command_one_way": there,
        "feedback_one_way": back,
        "round_trip": whole,
        "clock_offset_bound": np.zeros(ticks),
        "command_sent_ns": np.ones(ticks, dtype=np.int64),
        "feedback_received_ns": received,
    }


def found_in(run: Run) -> dict[str, LinkFinding]:
    return {item.effect: item for item in findings(account(run, DT), DT)}


def values(run: Run) -> dict[str, tuple[float, tuple[float, float]]]:
    return {key: value for item in found_in(run).values() for key, value in item.parameters.items()}


def played(plan: Plan, path: Path, **options: float) -> Run:
    """The short test in virtual time over an impaired link."""
    real = dataclasses.replace(
        reality.as_planned(plan), link=RigTable(NETWORK, options) if options else RigTable()
    )
    assert virtual.run(virtual.assemble(plan, real, path), lambda: "") is None
    return read(path)


# -- what is found --------------------------------------------------------------------------------


@pytest.mark.long
def test_the_parameters_of_an_impaired_link_are_found_over_a_grid() -> None:
    errors: dict[str, list[float]] = {}
    inside: dict[str, list[bool]] = {}
    grid = product((0.0, 0.001, 0.0037, 0.02), (0.0, 0.0002, 0.001, 0.005), ((0, 1), (0.05, 1), (0.05, 8)))
    for number, (delay, jitter, (loss, burst)) in enumerate(grid):
        truth = {"delay": delay, "std": jitter, "probability": loss, "burst": burst if loss else 0.0}
        found = values(recorded(ImpairedLink(number, delay, jitter, loss, burst)))
        assert found.keys() == {name for name, value in truth.items() if value}, truth
        for name, (value, (low, high)) in found.items():
            errors.setdefault(name, []).append(abs(value / truth[name] - 1.0))
            inside.setdefault(name, []).append(low - 1e-9 <= truth[name] <= high + 1e-9)
    assert {name: np.median(error) < 0.05 for name, error in errors.items()} == dict.fromkeys(errors, True)
    assert max(errors["delay"]) < 0.01
    assert max(errors["std"]) < 0.10
    assert min(np.mean(hits) for hits in inside.values()) >= 0.85


@pytest.mark.long
@pytest.mark.parametrize("burst", [1.0, 8.0])
def test_rare_losses_are_found_with_intervals_that_cover_them(burst: float) -> None:
    hits = []
    for seed in range(20):
        found = values(recorded(ImpairedLink(seed, 0.003, 0.0005, 0.004, burst)))
        low, high = found["probability"][1]
        hits.append(low <= 0.004 <= high)
    assert np.mean(hits) >= 0.8


def test_nothing_is_found_on_a_clean_link() -> None:
    for stamps in (True, False):
        run = recorded(ImpairedLink(1), stamps=stamps)
        assert found_in(run) == {}
        told = account(run, DT)
        assert told.late == 0
        assert [item.old_share for item in told.directions] == [0.0, 0.0]


def test_without_time_stamps_a_delay_is_found_to_within_a_tick() -> None:
    found = values(recorded(ImpairedLink(2, delay=0.0051), stamps=False))
    assert found.keys() == {"delay"}
    assert found["delay"][0] == pytest.approx(0.005)
    assert found["delay"][1] == pytest.approx((0.004, 0.006))


@pytest.mark.parametrize(
    ("delay", "jitter", "loss", "burst"),
    [(0.0037, 0.001, 0.05, 8.0), (0.01, 0.005, 0.0, 1.0), (0.0, 0.002, 0.0, 1.0)],
)
def test_without_time_stamps_jitter_and_loss_are_found_from_the_ages_of_messages(
    delay: float, jitter: float, loss: float, burst: float
) -> None:
    found = values(recorded(ImpairedLink(4, delay, jitter, loss, burst), stamps=False))
    truth = {"delay": delay, "std": jitter, "probability": loss, "burst": burst if loss else 0.0}
    assert found.keys() == {name for name, value in truth.items() if value}
    for name, (value, _) in found.items():
        assert value == pytest.approx(truth[name], rel=0.3 if name in ("probability", "burst") else 0.08)


class HalfNormal:
    """A link whose delays are the magnitudes of normal numbers."""

    SCALE = 0.0025  # s

    def __init__(self) -> None:
        random = np.random.default_rng(3)
        self.delays = {
            name: np.abs(random.normal(0.0, self.SCALE, TICKS)) for name in ("command", "feedback")
        }

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        return float(self.delays[direction][seq])


def test_jitter_of_another_shape_is_no_delay_beside_jitter() -> None:
    found = values(recorded(HalfNormal(), stamps=False))
    assert found.keys() == {"std", "shape"}
    assert found["std"][0] == pytest.approx(HalfNormal.SCALE * np.sqrt(1.0 - 2.0 / np.pi), rel=0.1)
    # (mean over standard deviation)² of half of a normal distribution, which is no Gamma distribution
    assert found["shape"][0] == pytest.approx(2.0 / (np.pi - 2.0), rel=0.2)


class Normal:
    """A link whose delays are normal about a mean."""

    MEAN, SCATTER = 0.007, 0.001  # s

    def __init__(self) -> None:
        random = np.random.default_rng(1)
        self.delays = {
            name: random.normal(self.MEAN, self.SCATTER, TICKS) for name in ("command", "feedback")
        }

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        return float(self.delays[direction][seq])


def test_times_that_scatter_little_about_their_mean_are_a_delay() -> None:
    assert values(recorded(Normal(), stamps=False)).keys() == {"std", "delay"}


def test_a_delay_that_ages_hardly_tell_from_the_shape_of_jitter_is_not_named() -> None:
    found = values(recorded(ImpairedLink(4, delay=0.001, jitter=0.002), stamps=False))
    assert found.keys() == {"std", "shape"}
    assert found["std"][0] == pytest.approx(0.002, rel=0.08)


class Symmetric:
    """A link with delays that scatter symmetrically about their mean."""

    def __init__(self) -> None:
        random = np.random.default_rng(1)
        self.delays = {name: random.normal(0.008, 0.0005, TICKS) for name in ("command", "feedback")}

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        return float(self.delays[direction][seq])


def test_without_time_stamps_few_messages_that_were_lost_in_bursts_are_found() -> None:
    link = ImpairedLink(loss=0.002, burst=3.0, seed=8)
    (found,) = findings(account(recorded(link, stamps=False), DT), DT)
    assert found.effect == "link.loss"
    assert "late ones look like lost ones" in found.evidence
    probability, burst = found.parameters["probability"], found.parameters["burst"]
    assert probability[1][0] <= 0.002 <= probability[1][1]
    assert burst[1][0] <= 3.0 <= burst[1][1]
    single = ImpairedLink(loss=0.002, burst=1.0, seed=8)
    assert findings(account(recorded(single, stamps=False), DT), DT) == []


def test_the_constant_delay_of_a_symmetric_scatter_is_its_mean() -> None:
    found = values(recorded(Symmetric()))
    assert found["delay"][0] == pytest.approx(0.008, rel=0.02)
    assert found["std"][0] == pytest.approx(0.0005, rel=0.05)


def test_gaps_in_a_recording_do_not_count_as_lost_messages() -> None:
    run = recorded(ImpairedLink(1, delay=0.003))
    kept = np.random.default_rng(1).random(TICKS) > 0.02
    for topic in ("master", "slave", "latency"):
        run.columns[topic] = {name: column[kept] for name, column in run.columns[topic].items()}
        run.sequences[topic] = run.sequences[topic][kept]
    assert values(run).keys() == {"delay"}


def test_late_ticks_are_counted_separately_and_are_not_an_effect() -> None:
    run = recorded(ImpairedLink(1), 3000)
    latency, used = run.columns["latency"], run.columns["master"]["damper_force_seq"]
    latency["wake_lateness"] = np.full(3000, 3e-5)
    for name in ("command_one_way", "feedback_one_way", "round_trip"):
        latency[name] = latency[name] + np.random.default_rng(2).exponential(3e-5, 3000)
    for tick in range(100, 3000, 150):  # two feedbacks late at once: of the first nothing more is heard
        latency["wake_lateness"][tick : tick + 2] = 5e-4
        latency["command_sent_ns"][tick + 1] = 0
        latency["feedback_one_way"][tick] = latency["round_trip"][tick] = np.nan
        used[tick + 1] = used[tick]
    told = account(run, DT)
    assert told.late == 40
    assert findings(told, DT) == []


def test_rows_that_an_import_lacks_are_no_lost_messages() -> None:
    run = recorded(ImpairedLink(1), stamps=False)
    gone = (1.0, 1.4)
    for topic, name in (("slave", "command_seq"), ("master", "damper_force_seq")):
        times, used = DT * run.sequences[topic], run.columns[topic][name]
        used[(times > gone[0]) & (times < gone[1])] = used[times <= gone[0]][-1]
    assert findings(account(run, DT), DT)
    run.metadata = {IMPORT: ImportedData("log.csv", gaps=(gone,)).metadata()}
    assert findings(account(run, DT), DT) == []
    for found, wanted in zip(exchange_of(run, TICKS, DT), on_time(TICKS), strict=True):
        assert np.array_equal(found, wanted)


# -- recordings -----------------------------------------------------------------------------------


def test_a_clean_recording_gives_no_effect_on_the_link(virtual_recording: Path) -> None:
    run = read(virtual_recording)
    assert findings(account(run, DT), DT) == []
    ticks = run.ticks("master")
    for found, wanted in zip(exchange_of(run, ticks, DT), on_time(ticks), strict=True):
        assert np.array_equal(found, wanted)


@pytest.mark.parametrize(
    "options",
    [
        {"delay": 0.005},
        {"delay": 0.003, "jitter": 0.001, "loss": 0.02, "burst": 3.0},
        {"jitter": 0.004},
        {"loss": 0.02},
    ],
)
def test_the_exchange_and_time_stamps_in_a_recording_are_those_of_its_network(
    options: dict[str, float], short_plan: Plan, tmp_path: Path
) -> None:
    run = played(short_plan, tmp_path / "impaired.mcap", **options)
    network = ImpairedLink(short_plan.test.seed, **options)
    ticks = short_plan.ticks
    for found, wanted in zip(exchange_of(run, ticks, DT), exchange(ticks, DT, network), strict=True):
        assert np.array_equal(found, wanted)
    wanted_rows = recorded(network, ticks).columns["latency"]
    for name in ("command_one_way", "feedback_one_way", "round_trip"):
        assert np.allclose(run.columns["latency"][name], wanted_rows[name], atol=2e-9, equal_nan=True), name
    assert run.sequences["latency"].tolist() == list(range(ticks))
    assert np.all(run.columns["latency"]["clock_offset"] == 0.0)
    key = {"delay": "delay", "jitter": "std", "loss": "probability"}
    found_values = values(run)
    for option, value in options.items():
        if option in key:
            low, high = found_values[key[option]][1]
            assert low - 1e-6 <= value <= high + 1e-6
    assert len(found_in(run)) == len(set(options) & set(key))
