"""The answers of the element server to a client of OpenSees or OpenFresco, without sockets."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from common.opensees import wire
from common.opensees.element import ElementServer, Measurement, Phase, RevisedError
from common.opensees.wire import ClientHeader, MessageCode, Quantities, Sizes

HEADER = wire.element(1)
FRESCO = ClientHeader(Sizes(displacement=1), Sizes(displacement=1, force=1, time=1), 256)
K = 5e6


def client_message(code: MessageCode, x: float = 0.0, header: ClientHeader = HEADER) -> bytes:
    n = header.control
    return wire.message(
        header,
        code,
        Quantities((x,) * n.displacement, (0.0,) * n.velocity, (0.0,) * n.acceleration, (), (0.0,) * n.time),
    )


def server(header: ClientHeader = HEADER, stiffness: Sequence[float] = (K,)) -> ElementServer:
    found = ElementServer(stiffness)
    found.take(wire.header_bytes(header))
    return found


def complete_motion(one: ElementServer, force: float) -> None:
    x = one.impose().displacement
    one.measured(Measurement(x, (force,), 0.5))


def answers(one: ElementServer, header: ClientHeader = HEADER, count: int = 1) -> list[tuple[float, ...]]:
    data = one.outgoing()
    return [
        wire.numbers_in(header, data[place : place + header.size], count)
        for place in range(0, len(data), header.size)
    ]


def test_matrices_are_answered_from_memory() -> None:
    one = server(wire.element(2), (K, 3.0))
    for code in (MessageCode.INITIAL_STIFFNESS, MessageCode.STIFFNESS, MessageCode.DAMPING, MessageCode.MASS):
        one.take(client_message(code, header=wire.element(2)))
    diagonal, none = (K, 0.0, 0.0, 3.0), (0.0,) * 4
    assert answers(one, wire.element(2), 4) == [diagonal, diagonal, none, none]


def test_at_rest_the_answered_force_is_zero_and_no_measurement_is_requested() -> None:
    one = server()
    one.take(client_message(MessageCode.TRIAL) + client_message(MessageCode.FORCE))
    assert answers(one) == [(0.0,)]
    assert one.phase is Phase.MEASURED


def test_a_request_for_the_force_is_answered_once_it_is_measured() -> None:
    one = server()
    one.take(
        client_message(MessageCode.TRIAL, 1e-3)
        + client_message(MessageCode.DAMPING)
        + client_message(MessageCode.FORCE)
    )
    assert one.phase is Phase.WANTED
    assert one.waits
    assert answers(one) == [(0.0,)]  # of the damping
    assert one.impose().displacement == (1e-3,)
    assert not one.outgoing()
    one.measured(Measurement((1e-3,), (17.0,), 0.1))
    assert answers(one) == [(17.0,)]
    assert not one.waits


def test_a_step_of_newmark_explicit_imposes_one_displacement() -> None:
    """The trials after the solution repeat the displacement, with other velocities."""
    one = server()
    for step in range(1, 4):
        one.take(client_message(MessageCode.TRIAL, step * 1e-3) + client_message(MessageCode.FORCE))
        complete_motion(one, float(step))
        one.take(client_message(MessageCode.TRIAL, step * 1e-3) + client_message(MessageCode.COMMIT))
    assert answers(one) == [(1.0,), (2.0,), (3.0,)]
    assert (one.steps, one.commits) == (3, 3)


def test_a_step_of_central_difference_commits_before_it_asks_for_the_force() -> None:
    one = server()
    one.take(
        client_message(MessageCode.TRIAL, 1e-3)
        + client_message(MessageCode.COMMIT)
        + client_message(MessageCode.TRIAL, 1e-3)
        + client_message(MessageCode.FORCE)
    )
    complete_motion(one, 4.0)
    assert answers(one) == [(4.0,)]
    one.take(client_message(MessageCode.TRIAL, 2e-3) + client_message(MessageCode.COMMIT))
    assert one.phase is Phase.WANTED


def test_a_step_without_a_change_of_displacement_is_a_step_at_rest_from_its_commit_on() -> None:
    """Before the commit the integrator may still change it, so the force is that of the previous step."""
    one = server()
    for step in range(1, 4):
        one.take(
            client_message(MessageCode.TRIAL)
            + client_message(MessageCode.FORCE)
            + client_message(MessageCode.TRIAL)
        )
        assert one.steps == step - 1
        one.take(client_message(MessageCode.COMMIT))
        assert one.phase is Phase.WANTED
        complete_motion(one, float(step))
    assert answers(one) == [(0.0,), (1.0,), (2.0,)]
    assert (one.steps, one.commits) == (3, 3)


def test_a_step_that_changes_the_displacement_after_its_force_counts_as_one_step() -> None:
    """Newmark with algorithm('Linear'): the predictor repeats the displacement, and the solution changes it."""
    one = server()
    for step, x in enumerate((0.0, 1e-3, 1e-3, 2e-3), 1):
        one.take(
            client_message(MessageCode.TRIAL, one.wanted.displacement[0]) + client_message(MessageCode.FORCE)
        )
        one.take(client_message(MessageCode.TRIAL, x) + client_message(MessageCode.COMMIT))
        assert one.wanted.displacement == (x,)
        complete_motion(one, float(step))
    assert answers(one) == [(0.0,), (1.0,), (2.0,), (3.0,)]
    assert (one.steps, one.commits) == (4, 4)


def test_steps_at_rest_of_a_client_that_does_not_wait_are_made_in_order() -> None:
    one = server()
    one.take(
        (client_message(MessageCode.TRIAL, 1e-3) + client_message(MessageCode.COMMIT)) * 3
        + client_message(MessageCode.END)
    )
    found = 0
    while one.phase is Phase.WANTED:
        found += 1
        complete_motion(one, 0.0)
    assert (found, one.steps, one.commits) == (3, 3, 3)
    assert one.phase is Phase.ENDED


def test_a_step_at_rest_with_a_velocity_that_is_not_finite_is_refused() -> None:
    one = server()
    one.take(wire.message(HEADER, MessageCode.TRIAL, Quantities((0.0,), (math.nan,), (0.0,), (), (0.0,))))
    with pytest.raises(RemoteProtocolError, match="not finite"):
        one.take(client_message(MessageCode.COMMIT))


def test_a_revised_displacement_is_refused_and_suitable_integrators_are_named() -> None:
    one = server()
    one.take(client_message(MessageCode.TRIAL, 1e-3) + client_message(MessageCode.FORCE))
    complete_motion(one, 1.0)
    with pytest.raises(RevisedError, match=r"1 mm to 1\.1 mm.*NewmarkExplicit, CentralDifference or AlphaOS"):
        one.take(client_message(MessageCode.TRIAL, 1.1e-3))


def test_a_revised_displacement_is_refused_even_before_the_first_was_imposed() -> None:
    """The refusal does not depend on whether the laboratories had time to move."""
    one = server()
    with pytest.raises(RevisedError):
        one.take(client_message(MessageCode.TRIAL, 1e-3) + client_message(MessageCode.TRIAL, 2e-3))


def test_a_change_by_rounding_does_not_count_as_a_revised_displacement() -> None:
    one = server()
    one.take(
        client_message(MessageCode.TRIAL, 1e-3)
        + client_message(MessageCode.TRIAL, 1e-3 * (1.0 + 1e-11))
        + client_message(MessageCode.FORCE)
    )
    assert one.wanted.displacement == (1e-3,)


def test_displacements_of_a_client_that_does_not_wait_are_imposed_in_order() -> None:
    one = server()
    one.take(
        b"".join(
            client_message(MessageCode.TRIAL, x) + client_message(MessageCode.COMMIT)
            for x in (1e-3, 2e-3, 3e-3)
        )
        + client_message(MessageCode.END)
    )
    found = []
    while one.phase is Phase.WANTED:
        found.append(one.wanted.displacement[0])
        complete_motion(one, 0.0)
    assert found == [1e-3, 2e-3, 3e-3]
    assert one.phase is Phase.ENDED


def test_openfresco_acquires_every_quantity_of_its_header_and_needs_no_commit() -> None:
    one = server(FRESCO)
    one.take(
        client_message(MessageCode.TRIAL, 0.0, FRESCO) + client_message(MessageCode.ACQUIRE, 0.0, FRESCO)
    )
    for x in (1e-3, 2e-3):
        one.take(
            client_message(MessageCode.TRIAL, x, FRESCO) + client_message(MessageCode.ACQUIRE, x, FRESCO)
        )
        one.impose()
        one.measured(Measurement((x,), (K * x,), 0.25))
    assert one.steps == 2  # nothing tells whether an equal displacement is a predictor or a step at rest
    assert answers(one, FRESCO, 3) == [(0.0, 0.0, 0.0), (1e-3, K * 1e-3, 0.25), (2e-3, K * 2e-3, 0.25)]


def test_after_the_end_message_no_request_is_answered() -> None:
    one = server()
    one.take(client_message(MessageCode.END) + client_message(MessageCode.FORCE))
    assert one.phase is Phase.ENDED
    assert not one.outgoing()


def test_the_last_displacements_are_imposed_before_the_end() -> None:
    one = server()
    one.take(
        client_message(MessageCode.TRIAL, 1e-3)
        + client_message(MessageCode.COMMIT)
        + client_message(MessageCode.END)
    )
    assert one.wanted.displacement == (1e-3,)
    assert one.ending
    complete_motion(one, 1.0)
    assert one.phase is Phase.ENDED


@pytest.mark.parametrize(
    ("header", "says"),
    [
        (wire.element(2), "2 degrees of freedom, but 1 of the laboratories"),
        (ClientHeader(Sizes(displacement=1, force=1), Sizes(force=1), 256), "commands forces"),
        (ClientHeader(Sizes(displacement=1), Sizes(velocity=1, force=1), 256), "acquires velocities"),
        (ClientHeader(Sizes(displacement=1), Sizes(displacement=1), 256), "acquires 0 forces"),
        (ClientHeader(Sizes(displacement=1, time=2), Sizes(force=1), 256), "acquires 1 forces"),
    ],
)
def test_a_client_that_asks_for_unavailable_quantities_is_refused(header: ClientHeader, says: str) -> None:
    with pytest.raises(RemoteProtocolError, match=says):
        server(header)


def test_messages_too_short_for_a_matrix_are_refused() -> None:
    header = ClientHeader(Sizes(displacement=5), Sizes(force=5), 24)
    with pytest.raises(RemoteProtocolError, match="5 times 5"):
        server(header, (K,) * 5)


@given(st.lists(st.integers(1, 7), min_size=1, max_size=8))
def test_the_result_does_not_depend_on_how_the_bytes_are_split(lengths: list[int]) -> None:
    data = (
        wire.header_bytes(HEADER)
        + client_message(MessageCode.TRIAL, 1e-3)
        + client_message(MessageCode.MASS)
        + client_message(MessageCode.FORCE)
    )
    one, place = ElementServer([K]), 0
    for length in lengths:
        one.take(data[place : place + 97 * length])
        place += 97 * length
    one.take(data[place:])
    assert one.waits
    assert one.wanted.displacement == (1e-3,)


@given(st.binary(max_size=300))
def test_arbitrary_bytes_are_refused_or_leave_a_valid_phase(data: bytes) -> None:
    one = ElementServer([K])
    try:
        one.take(data)
    except RemoteProtocolError:
        return
    assert one.phase in (Phase.GREETING, Phase.MEASURED, Phase.WANTED, Phase.ENDED)
