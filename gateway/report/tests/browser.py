"""A page in a browser without a window: it tells what has become of it as soon as it is ready, however slow it is."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

BROWSER = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
NO_BROWSER = "needs a browser: apt-get install chromium"
PATIENCE_S = 90.0
POLICY = "default-src 'none'"
# of the page, once a condition holds
TELLING = """<script>
const telling = setInterval(() => {
  if (!(%s)) return;
  clearInterval(telling);
  fetch("%s", {method: "POST", mode: "no-cors", body: document.documentElement.outerHTML});
}, 50);
</script></body>"""


def told_by_browser(text: str, folder: Path, size: tuple[int, int], ready: str, fragment: str = "") -> str:
    """The page as the browser has it when the JavaScript expression `ready` holds; it had nothing to complain of.

    Args:
        text: of the page, which may load nothing.
        folder: an empty one.
        size: of the window.
        ready: for example `document.querySelectorAll(".ready").length >= 3`.
        fragment: of the address, behind the #.
    """
    with _listener() as (address, told):
        page = folder / "page.html"
        telling = text.replace(POLICY, f"{POLICY}; connect-src {address}").replace(
            "</body>", TELLING % (ready, address)
        )
        page.write_text(telling, encoding="utf-8")
        options = ["--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}"]
        options += ["--enable-logging=stderr", "--window-size={},{}".format(*size), "--no-first-run"]
        with (folder / "browser.log").open("w") as log:
            process = subprocess.Popen(
                [str(BROWSER), *options, f"{page.as_uri()}#{fragment}"], stderr=log, stdout=log
            )
            try:
                seen = told.get(timeout=PATIENCE_S)
            except Empty:
                seen = ""
            finally:
                process.terminate()
                process.wait()
    said = (folder / "browser.log").read_text(errors="replace")
    complaints = [line for line in said.splitlines() if "CONSOLE" in line]
    assert not complaints, complaints  # no error, and nothing that the page's own policy refused
    assert seen, f"not ready after {PATIENCE_S} s: {ready}"
    return seen


@contextmanager
def _listener() -> Iterator[tuple[str, Queue[str]]]:
    told: Queue[str] = Queue()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            told.put(self.rfile.read(int(self.headers["Content-Length"])).decode())
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}", told
        server.shutdown()
