"""The state of the page: who is told of its changes, and how often."""

from playwright.sync_api import Page

from tests.e2e.running import run

MOST_A_SECOND = 15


def test_listeners_are_told_fifteen_times_a_second_at_most_and_of_the_last_value(
    modules: Page,
) -> None:
    script = """
    const store = new m.Store({ value: 0 });
    const told = [];
    store.watch(["value"], ({ value }) => told.push([performance.now(), value]));
    const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
    const began = performance.now();
    for (let value = 1; performance.now() - began < 1500; value += 1) {
        store.set({ value });
        await sleep(2);
    }
    store.set({ value: -1 });
    while (told.at(-1)[1] !== -1) await sleep(10);
    return told.slice(1);
    """
    told = run(modules, "core/store.js", script)
    seconds = (told[-1][0] - told[0][0]) / 1000
    assert len(told) <= 1.02 * MOST_A_SECOND * seconds + 2
    assert told[-1][1] == -1


def test_who_does_not_listen_to_what_changed_is_not_told(modules: Page) -> None:
    script = """
    const store = new m.Store({ one: 1, other: 1 });
    const told = [];
    store.watch(["one"], () => told.push("one"));
    const ended = store.watch(["other"], () => told.push("ended"));
    ended();
    const settled = new Promise((done) => {
        store.watch(["other"], ({ other }) => other === 2 && done());
    });
    store.set({ one: 1, other: 2 });
    await settled;
    return told;
    """
    assert run(modules, "core/store.js", script) == ["one", "ended"]
