"""A studio that listens, and whoever asks it."""

import http.client
import json
import threading
from contextlib import contextmanager
from urllib.parse import urlencode

from skillcrew.analysis.studio.server import Server
from skillcrew.analysis.studio.studio import Studio


class Client:
    """Asks one server."""

    def __init__(self, server):
        self.port, self.url = server.server_port, server.url

    def ask(self, path, method="GET", **headers):
        """Status, headers and text."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request(method, path, headers={name.replace("_", "-"): of for name, of in headers.items()})
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer.status, answer.headers, text

    def runs(self):
        """Rows by name."""
        return {row["name"]: row for row in json.loads(self.ask("/runs")[2])["runs"]}

    def curves(self, *names):
        keys = [("run", self.runs()[name]["key"]) for name in names]
        return json.loads(self.ask(f"/curves?{urlencode(keys)}")[2])

    def page(self, name):
        return self.ask(f"/page?run={self.runs()[name]['key']}")


@contextmanager
def listening(root, scratch):
    studio = Studio(root, scratch)
    with Server(studio, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield Client(server)
        finally:
            server.shutdown()
            thread.join()
            studio.close()
