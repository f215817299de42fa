"""Who may connect, and who makes room: on a virtual clock."""

import pytest

from app.gateway.connection_table import CLOSE_S, KNOWN_S, PROXY, Connection, ConnectionTable


class World:
    """A table, its clock, and what was closed."""

    def __init__(self, connections: int = 10, strangers: int = 6, per_address: int = 3) -> None:
        self.now = 0.0
        self.closed: list[Connection] = []
        self.table = ConnectionTable(connections, strangers, per_address, lambda: self.now)

    def connect(self, address: str, *, speaks: bool = False) -> Connection:
        connection = self.table.admit(address, self.now + 10)
        assert connection is not None
        connection.end = lambda: self.closed.append(connection)
        if speaks:
            self.table.heard(connection)
        return connection

    def sign_in(self, address: str) -> Connection:
        connection = self.connect(address, speaks=True)
        self.table.judged(connection, True)
        return connection


@pytest.fixture
def world() -> World:
    return World()


def test_of_one_address_the_oldest_silent_one_goes_first(world: World) -> None:
    speaks = world.connect("a", speaks=True)
    first, second = world.connect("a"), world.connect("a")
    world.connect("a")
    assert world.closed == [first]
    world.connect("a")
    assert world.closed == [first, second]
    assert speaks in world.table
    assert world.table.strangers == 3


def test_without_a_silent_one_the_one_heard_longest_ago_goes(world: World) -> None:
    first, second, third = (world.connect("a", speaks=True) for _ in range(3))
    world.table.heard(first)
    world.connect("a")
    assert world.closed == [second]
    assert third in world.table


def test_the_address_that_holds_most_gives_up_first(world: World) -> None:
    few = [world.connect("b"), world.connect("c")]
    many = [world.connect("a", speaks=True) for _ in range(3)]
    few.append(world.connect("d"))
    world.connect("e")
    assert world.closed == [many[0]]
    assert all(each in world.table for each in few)


def test_an_address_of_somebody_signed_in_is_preferred(world: World) -> None:
    world.sign_in("a")
    theirs = [world.connect("a") for _ in range(3)]
    others = [world.connect("b"), world.connect("b"), world.connect("c")]
    world.connect("d")
    assert world.closed == [others[0]]
    assert all(each in world.table for each in theirs)
    # That is not for ever, and not without end.
    world.now = KNOWN_S + 1
    world.connect("d")
    assert world.closed[1:] == [theirs[0]]


def test_an_address_of_somebody_signed_in_gives_up_what_is_too_much() -> None:
    world = World(connections=40, strangers=10, per_address=3)
    world.sign_in("a")
    theirs = [world.connect("a") for _ in range(9)]
    other = world.connect("b")
    world.connect("c")
    assert world.closed == [theirs[0]]
    assert other in world.table


def test_strangers_never_take_what_is_kept_for_who_is_signed_in(world: World) -> None:
    for number in range(1000):
        world.connect(f"address {number}", speaks=number % 2 == 0)
    assert world.table.strangers == len(world.table) == 6
    signed_in = [world.sign_in("a") for _ in range(9)]
    assert world.table.strangers == 1
    # The last place, too: nobody who is signed in was closed, and then there is none.
    signed_in.append(world.sign_in("a"))
    assert world.table.strangers == 0
    assert not set(signed_in) & set(world.closed)
    assert world.table.admit("a", 0.0) is None


def test_a_connection_is_counted_by_its_newest_request(world: World) -> None:
    connection = world.sign_in("a")
    assert world.table.strangers == 0
    world.table.judged(connection, False)
    assert world.table.strangers == 1
    world.table.heard(connection)
    world.table.judged(connection, True)
    world.table.remove(connection)
    world.table.remove(connection)
    assert (world.table.strangers, len(world.table)) == (0, 0)


def test_behind_a_proxy_are_many(world: World) -> None:
    several = [world.connect(PROXY) for _ in range(6)]
    assert world.closed == []
    world.connect(PROXY)
    assert world.closed == [several[0]]


def test_what_is_late_ends_and_what_closes_is_cut(world: World) -> None:
    late, closing, unread, good = (world.connect("a"), *map(world.connect, "bcd"))
    ended: list[Connection] = []
    late.expire = lambda: ended.append(late)
    good.deadline = closing.deadline = unread.deadline = None
    closing.is_closing = lambda: True
    unread.write_deadline = 5.0
    world.table.expire()
    assert (ended, world.closed) == ([], [])
    world.now = CLOSE_S
    world.table.expire()
    assert world.closed == [closing]
    world.now = 10.0
    world.table.expire()
    world.table.expire()
    assert (ended, world.closed) == ([late], [closing, unread])
    assert good in world.table
