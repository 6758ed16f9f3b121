"""A radio link by itself: its order statistics, and what it must not lose."""

import collections

import pytest

from drone_sim.vehicles.radio_link import LinkParameters, RadioLink

WIFI = {"latency": 0.2, "jitter": 0.1, "loss": 0.2}


def test_ages_and_shares_over_a_link_are_those_of_its_order_statistics():
    """Sent each 0.1 s, looked for each 0.05 s, 200 ± 100 ms late and one in five lost.

    What is not lost comes after 0.15, 0.2, 0.25 or 0.3 s, each as often. A message of 0.25 s is overtaken by the next
    one where that takes 0.15 s, of 0.3 s where it takes 0.15 or 0.2 s, unless it is lost: 1, 1, 1 - 0.8/4, 1 - 0.8/2.
    """
    link = RadioLink(LinkParameters(**WIFI), (1,), 100)
    ages = collections.Counter()
    for step in range(40_000):
        if step % 2 == 0:
            link.send(step * 0.05, step)
        came = link.receive(step * 0.05)
        if came:
            ages[round(came[0], 3)] += 1
            assert step * 0.05 - came[1] * 0.05 == pytest.approx(came[0])
    shares = {age: count / 20_000 for age, count in ages.items()}
    assert shares == pytest.approx({0.15: 0.2, 0.2: 0.2, 0.25: 0.16, 0.3: 0.12}, abs=0.01)


def test_a_link_that_only_delays_loses_nothing():
    link = RadioLink(LinkParameters(latency=0.15, jitter=0, loss=0), (1,), 100)
    came = []
    for step in range(1000):
        link.send(step * 0.05, step)
        came.append(link.receive(step * 0.05))
    assert [one[1] for one in came[3:]] == list(range(997))
    assert came[:3] == [None] * 3


def test_more_than_the_buffer_holds_is_lost():
    link = RadioLink(LinkParameters(latency=2, jitter=0, loss=0), (1,), 5)
    for number in range(1000):
        link.send(0.0, number)
    assert len(link._under_way) == 5 and link.receive(2.0)[1] == 999
