"""A page whose labs come and go keeps nothing of them: neither the page nor the engine."""

from __future__ import annotations

import re
from dataclasses import dataclass

import pytest
from playwright.sync_api import BrowserContext, CDPSession, Page, Route

from support.lab_page import PAGE, SWING, fetch_text, watch_page

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# Put before the worker's script: whoever asks the worker is shown the engine's memory. A large
# block is put behind all that is in use, so that its address rises with what was not given back.
REVEAL = """{
  const { Instance } = WebAssembly
  WebAssembly.Instance = new Proxy(Instance, {
    construct(target, rest) {
      const made = new target(...rest)
      self.engineMemory = () => {
        const { malloc, free, memory } = made.exports
        const block = malloc(1 << 20)
        free(block)
        return [memory.buffer.byteLength, block]
      }
      return made
    },
  })
}
"""

# The page's own script does not know the copy, and mounts nothing in it.
COPY = """(number) => {
  const place = document.querySelectorAll('.lab')[number]
  const copy = place.cloneNode(true)
  copy.id = 'tried'
  place.replaceWith(copy)
  copy.scrollIntoView()
}"""

# Every lab lives as long as it takes to be there, drawn and running.
COME_AND_GO = """async (times) => {
  const place = document.getElementById('tried')
  const script = new URL(place.dataset.script, document.baseURI).href
  const { mountLab } = await import(script)
  const picture = () => new Promise(requestAnimationFrame)
  for (let i = 0; i < times; i++) {
    const made = await mountLab(place, (key) => key)
    while (made.view.frame === null) await picture()
    made.simulation.play()
    while (made.state !== 'playing') await picture()
    await picture()
    made.dispose()
  }
}"""


DRAW = """(n) => new Promise((done) => {
  const next = () => (n-- > 0 ? requestAnimationFrame(next) : done())
  next()
})"""


@dataclass(frozen=True, slots=True)
class MemoryUse:
    """What there is; least values, for a browser frees some things late."""

    listeners: int
    nodes: int
    memory: int
    """Bytes of the engine's WebAssembly memory."""
    end: int
    """Address of the end of what is in use there."""


def memory_in_use(page: Page, session: CDPSession) -> MemoryUse:
    (worker,) = page.workers
    samples = []
    for _ in range(8):
        session.send("HeapProfiler.collectGarbage")
        page.evaluate(DRAW, 10)
        metrics = session.send("Performance.getMetrics")["metrics"]
        values = {metric["name"]: int(metric["value"]) for metric in metrics}
        memory, end = worker.evaluate("() => self.engineMemory()")
        samples.append((values["JSEventListeners"], values["Nodes"], memory, end))
    return MemoryUse(*map(min, zip(*samples, strict=True)))


def reveal(route: Route) -> None:
    route.fulfill(body=REVEAL + fetch_text(route), headers={"content-type": "text/javascript"})


def test_two_hundred_labs_that_come_and_go_leave_nothing(
    context: BrowserContext, base: str
) -> None:
    context.route(re.compile(r"/worker\.[0-9a-f]+\.js$"), reveal)
    page, console = watch_page(context)
    page.set_viewport_size({"width": 400, "height": 500})
    page.goto(base + PAGE)
    session = context.new_cdp_session(page)
    session.send("Performance.enable")
    page.evaluate(COPY, SWING)
    page.evaluate(COME_AND_GO, 10)
    before = memory_in_use(page, session)
    page.evaluate(COME_AND_GO, 190)
    after = memory_in_use(page, session)
    # A lab has dozens of listeners, hundreds of nodes and megabytes of the engine's memory: one of
    # any left behind by each would be 190 more.
    assert after.listeners <= before.listeners + 40, (before, after)
    assert after.nodes <= before.nodes + 180, (before, after)
    assert after.memory == before.memory, (before, after)
    assert after.end <= before.end + 16 * 200, (before, after)  # the engine's own, for each model
    assert len(page.workers) == 1
    assert console == []
