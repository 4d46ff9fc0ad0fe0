"""A headless Chromium that opens a page of this folder and sends back what the page posts."""

import os
import shutil
import signal
import subprocess
import tempfile
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

WEB = Path(__file__).resolve().parent
THREE = WEB / "node_modules" / "three" / "build" / "three.module.js"
MODULE = WEB.parents[1] / "docs" / "engines" / "photon_bake.js"
_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_FLAGS = (
    "--headless=new",
    "--no-sandbox",  # root has none
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",  # no GPU is needed
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)


def browser():
    """Path of a Chromium: the variable CHROMIUM, or one on the PATH; None where there is none."""
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, _NAMES)), None)


def lacking():
    """What the tests of pages lack, and how to get it; empty if nothing."""
    if not THREE.is_file():
        return "three.js is not installed: `make test-web` installs it by npm"
    if browser() is None:
        return "there is no Chromium: install the package chromium, or let CHROMIUM be the path of one"
    return ""


class _Handler(SimpleHTTPRequestHandler):
    """Serves this folder, a scene's folder as /scene/, and takes what the page posts."""

    def __init__(self, *arguments, scene, posts):
        self._scene, self._posts = scene, posts
        super().__init__(*arguments, directory=str(WEB))

    def translate_path(self, path):
        path = path.partition("?")[0]
        if path == "/photon_bake.js":
            return str(MODULE)
        return (
            str(self._scene / path.removeprefix("/scene/"))
            if path.startswith("/scene/")
            else super().translate_path(path)
        )

    def do_POST(self):
        self._posts.put((self.path, self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


@contextmanager
def _served(scene):
    posts = Queue()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, scene=scene, posts=posts))
    Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}", posts
    finally:
        server.shutdown()
        server.server_close()


def posted(scene, page, timeout=120):
    """What a page posts, bytes, with the files of a folder as /scene/."""
    with _served(scene) as (address, posts), tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [browser(), *_FLAGS, f"--user-data-dir={profile}", f"{address}/{page}"]
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=os.name != "nt"
        )
        try:
            path, body = posts.get(timeout=timeout)
        except Empty:
            raise AssertionError(f"{page} said nothing for {timeout} s") from None
        finally:
            if os.name == "nt":
                process.kill()
            else:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    assert path == "/done", body.decode()
    return body
