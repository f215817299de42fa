from app.link.messages import Command
from app.robot.command_gate import CommandGate
from app.robot.lease import LEASE_S, Lease


def test_one_holder_at_a_time() -> None:
    lease = Lease(first_epoch=10)
    assert lease.take("anna", 0.0).epoch == 11
    reply = lease.take("ben", 0.1)
    assert (reply.granted, reply.code, reply.reason) == (False, "no_control", "anna drives")
    assert lease.take("anna", 0.2).epoch == 11
    assert lease.take("ben", 0.3, takeover=True).epoch == 12
    assert lease.renew("anna", 11, 0.4).reason == "you do not have control: ben drives"


def test_a_silent_holder_loses_the_lease() -> None:
    lease = Lease()
    lease.take("anna", 0.0)
    lease.renew("anna", 1, 1.5)
    assert lease.expire(1.5 + LEASE_S) is None
    assert lease.expire(1.501 + LEASE_S) == "anna"
    assert lease.expire(9.0) is None
    assert lease.check("anna", 1).reason == "nobody has control: take control first"


def test_commands_keep_the_lease() -> None:
    lease = Lease()
    lease.take("anna", 0.0)
    lease.seen(1.9)
    assert lease.expire(3.8) is None


def test_only_the_holder_gives_it_back() -> None:
    lease = Lease()
    lease.take("anna", 0.0)
    assert not lease.release("ben", 1).granted
    assert not lease.release("anna", 0).granted
    assert lease.release("anna", 1).granted
    assert lease.holder is None


def command(epoch: int = 1, sequence: int = 1, tick: int = 1000, ttl_ms: int = 250) -> Command:
    return Command(epoch=epoch, sequence=sequence, tick=tick, ttl_ms=ttl_ms)


def test_the_gate_names_why_a_command_does_not_count() -> None:
    gate = CommandGate()
    assert not gate.admit(command(), None, 1000)
    assert not gate.admit(command(epoch=2), 1, 1000)
    assert gate.admit(command(sequence=5), 1, 1250)
    assert not gate.admit(command(sequence=5), 1, 1000)
    assert not gate.admit(command(sequence=4), 1, 1000)
    assert not gate.admit(command(sequence=6), 1, 1251)
    assert not gate.admit(command(sequence=6, ttl_ms=100), 1, 1101)
    assert not gate.admit(command(sequence=6, tick=1001), 1, 1000)
    assert not gate.admit(command(sequence=6, tick=0), 1, 1000)
    assert dict(gate.dropped) == {
        "no_lease": 1,
        "epoch": 1,
        "sequence": 2,
        "expired": 3,
        "future": 1,
    }


def test_sequences_start_again_with_a_new_epoch() -> None:
    gate = CommandGate()
    assert gate.admit(command(epoch=1, sequence=100), 1, 1000)
    assert gate.admit(command(epoch=2, sequence=1), 2, 1000)
