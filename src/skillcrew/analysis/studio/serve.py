"""The studio from its beginning to Ctrl-C."""

import signal
import tempfile
import warnings
import webbrowser
from pathlib import Path
from types import FrameType

from skillcrew.analysis.studio.guard import is_local
from skillcrew.analysis.studio.server import Server
from skillcrew.analysis.studio.studio import Studio
from skillcrew.errors import Notice


def serve(root: Path, host: str, port: int, opens: bool) -> None:
    """Shows a folder of runs until somebody ends it.

    Args:
        opens: whether to open it in a browser.

    Raises:
        UserError: there is no such folder, or it cannot listen there.
    """
    with tempfile.TemporaryDirectory(prefix="skillcrew-studio-") as scratch:
        studio = Studio(root, Path(scratch))
        with Server(studio, host, port) as server:
            before = signal.signal(signal.SIGTERM, _end)
            try:
                print(f"{root} at {server.url} (Ctrl-C ends it)", flush=True)
                if not is_local(host):
                    warnings.warn(f"whoever reaches {host} can look at {root}", Notice, stacklevel=2)
                # What is there already is read before anybody asks.
                studio.prepare()
                if opens:
                    webbrowser.open(server.url)
                server.serve_forever()
            except KeyboardInterrupt:
                print("ended", flush=True)
            finally:
                studio.close()
                signal.signal(signal.SIGTERM, before)


def _end(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
