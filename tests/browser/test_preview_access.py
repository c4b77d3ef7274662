"""A page of another origin in the browser of an author can neither frame nor read a preview."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import BrowserContext, expect

from support.preview_process import serving
from support.scratch_course import GOOD, Folder
from support.static_host import Host

ATTACK = """
<!DOCTYPE html><meta charset="utf-8"><title>Another site</title>
<iframe src="PREVIEW/"></iframe>
<p id="read"></p>
<script>
const script = document.createElement('script')
script.src = 'PREVIEW/search/index.js'
const loaded = new Promise((resolve) => {
  script.onload = () => resolve('script')
  script.onerror = () => resolve('')
})
document.head.append(script)
const fetched = ['cors', 'no-cors'].map((mode) =>
  fetch('PREVIEW/lessons/1.1-one.html', { mode }).then(() => mode, () => ''))
const framed = new Promise((resolve) => {
  document.querySelector('iframe').onload = () => resolve('')
})
Promise.all([loaded, framed, ...fetched]).then((read) => {
  document.getElementById('read').textContent = `read: ${read.join('')}.`
})
</script>
"""


def test_another_origin_neither_frames_nor_reads_a_preview(
    tmp_path: Path, stores: Path, calm: BrowserContext
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([GOOD], stores)
    other = tmp_path / "other"
    other.mkdir()
    with serving(folder) as preview, Host(other) as host, calm.new_page() as page:
        preview.heard("checked: ")
        attacked = f"http://127.0.0.1:{preview.port}"
        (other / "index.html").write_text(ATTACK.replace("PREVIEW", attacked), encoding="utf-8")
        # Of another site, and of another port of the same one.
        for address in (host.url.replace("127.0.0.1", "localhost"), host.url):
            page.goto(address)
            expect(page.locator("#read")).to_have_text("read: .")
            expect(page.frame_locator("iframe").get_by_text("hello")).to_have_count(0)
            assert page.frames[1].url == "chrome-error://chromewebdata/"
        page.goto(attacked + "/lessons/1.1-one.html")
        expect(page.get_by_text("hello 3.14159")).to_be_visible()
