# SPDX-License-Identifier: GPL-2.0-or-later
"""The web server of `chipwise panel`: the page, what it shows as a stream, and the few things it may change.

Called by cli/panel.py.  What a stranger may send is refused before anything is done with it:

 1. visitors.py has how many connections and pages each address may have; each more is closed at once.  A request has
    REQUEST_S to arrive with its body, an answer SEND_S for each part to be accepted: a reader slower than that is cut
    off, and loses nothing but its own page.
 2. The Host header has to be the address that the connection has come to, so that no foreign name can be resolved to it
    (DNS rebinding).  A request that names another origin is refused.
 3. Files are those of FILES and nothing else: no path of a request ever becomes a path of this machine.
 4. A plan of a typed line, a measured program and the place of the tool change nothing: on this computer they need no
    token, but the page's own origin.  They cost computing time, so from elsewhere they need the token.  entry.py makes
    one at a time.
 5. Nothing can be changed without [CHIPWISE]PANEL_TOKEN, the token in the request and the page's own origin; a wrong
    token costs WRONG_TOKEN_S.

A stream is a row of messages: one letter (kind), four bytes (length, least first), content.  R: the last minute, P:
points of the path done, S: the state, M and T: the stock, B: the stock before the program (tiles.py), A and C: path
ahead and contours (look_ahead.py).  A page that is slow gets fewer of them, each up to date.
"""

import contextlib
import hmac
import json
import os
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from http.server import ThreadingHTTPServer

from chipwise import version
from chipwise.host import language
from chipwise.host.clock import patience
from chipwise.panel import Json, colours
from chipwise.panel.entry_routes import CHANGES, HARMLESS, LineRequests, Refused
from chipwise.panel.entry import Lines
from chipwise.panel.page_colours import stylesheet
from chipwise.panel.visitors import Visitor, Visitors
from chipwise.panel.watch import Watch

Address = tuple[str, int] | tuple[str, int, int, int]
WAITING_CONNECTIONS = 128  # that the kernel keeps until they are taken
REQUEST_S = 10.0
SEND_S = 5.0
UNREAD_BYTES = 1 << 18  # that the kernel keeps for a page that does not read
WRONG_TOKEN_S = 0.5
MOST_BODY = 4096  # bytes of a request
WAIT_S = 5.0  # without a look at the machine, until a stream sends something all the same
FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "page")
SHARED = os.path.join(os.path.dirname(FOLDER), os.pardir, "drawing")
SCRIPTS = {
    FOLDER: (
        "panel.js",
        "chart.js",
        "loads.js",
        "ahead.js",
        "sections.js",
        "entry.js",
        "log.js",
        "buttons.js",
        "resume.js",
        "clamps.js",
        "setup.js",
        "geometry.js",
    ),
    SHARED: ("height_shaders.js", "height_view.js"),
}
FILES = {  # path: folder, file, type
    "/": (FOLDER, "panel.html", "text/html"),
    "/panel.css": (FOLDER, "panel.css", "text/css"),
    **{f"/{name}": (folder, name, "text/javascript") for folder, names in SCRIPTS.items() for name in names},
}
HEADERS = (
    ("Cache-Control", "no-store"),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("X-Frame-Options", "DENY"),
    (
        "Content-Security-Policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
)


def message(kind: bytes, content: bytes) -> bytes:
    """One message of a stream; kind: a byte."""
    return kind + struct.pack("<I", len(content)) + content


def as_url(address: str, port: int) -> str:
    """http://ADDRESS:PORT, IPv6 in brackets."""
    return f"http://[{address}]:{port}" if ":" in address else f"http://{address}:{port}"


class Handler(LineRequests):
    """One request; a connection has one."""

    server_version, sys_version = "chipwise", ""
    timeout = REQUEST_S

    def log_message(self, *_words: object) -> None:
        """Nothing: a stranger must not fill the log."""

    def do_GET(self) -> None:
        self.answer(self.get)

    def do_POST(self) -> None:
        self.answer(self.post)

    def answer(self, work: Callable[[], None]) -> None:
        """Do the work; whatever goes wrong, only this connection ends."""
        try:
            self.check_origin()
            work()
        except Refused as refused:
            self.send(refused.status, str(refused).encode(), "text/plain")
        except OSError:  # the other side has gone, or is too slow
            pass
        self.close_connection = True

    def check_origin(self) -> None:
        """Raise Refused unless the request is addressed to this server and comes from its own page, or from no page."""
        hosts = self.server.names_of(self.connection.getsockname()[0])
        if (self.headers.get("Host") or "").lower() not in hosts:
            raise Refused(421, f"this is {self.server.url}, and the request names another host; open that address")
        origin = self.headers.get("Origin")
        if (
            origin is not None
            and origin.lower().removeprefix("http://") != self.headers["Host"].lower()
            or self.headers.get("Sec-Fetch-Site") not in (None, "same-origin", "none")
        ):
            raise Refused(403, "the request comes from another page; use the panel's own")

    def send(self, status: int, content: bytes, kind: str) -> None:
        self.connection.settimeout(SEND_S)
        self.send_response(status)
        self.send_header("Content-Type", kind + "; charset=utf-8" if kind.startswith("text/") else kind)
        self.send_header("Content-Length", str(len(content)))
        self.headers_for_all()
        self.end_headers()
        self.wfile.write(content)

    def headers_for_all(self) -> None:
        for name, value in HEADERS:
            self.send_header(name, value)
        self.send_header("Connection", "close")

    def send_json(self, status: int, found: object) -> None:
        self.send(status, json.dumps(found).encode(), "application/json")

    # --- reading ------------------------------------------------------------------------------------------------

    def get(self) -> None:
        self.server.in_time(self.connection)
        path, _, self.query = self.path.partition("?")
        if path in FILES:
            self.file(*FILES[path])
        elif path in READING:
            READING[path](self)
        else:
            raise Refused(404, "there is nothing here")

    def file(self, folder: str, name: str, kind: str) -> None:
        with open(os.path.join(folder, name), "rb") as file:
            self.send(200, file.read(), kind)

    def strings(self) -> None:
        name, texts = language.catalogue([self.query, *self.languages()])
        self.send_json(200, {"language": name, "strings": texts})

    def style(self) -> None:
        self.send(200, stylesheet(self.server.items).encode(), "text/css")

    def state(self) -> None:
        self.send(200, self.server.watch.text, "application/json")

    def log(self) -> None:
        with self.server.watch.published:
            found = self.server.watch.log.shown()
        self.send_json(200, found)

    def about(self) -> None:
        self.send_json(
            200,
            {
                "version": version(),
                "can_change": bool(self.server.token),
                "local": self.server.visitor(self.connection).local,
            },
        )

    def stream(self) -> None:
        """Messages until the page, LinuxCNC or this program ends."""
        watch = self.server.watch
        with self.server.one_more_page(self.connection):
            self.connection.settimeout(SEND_S)
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNREAD_BYTES)
            self.send_response(200)
            self.send_header("Content-Type", "application/octet-stream")
            self.headers_for_all()
            self.end_headers()
            self.wfile.write(message(b"R", json.dumps(watch.recent()).encode()))
            stock, number, path, mark, ahead = (0, 0), -1, (0, 0), 0, (-1, 0)
            while not watch.ended and not self.server.closing:
                number, state = watch.wait(number, WAIT_S)
                parts, stock = watch.tiles.messages(stock)
                before, mark = watch.tiles.before(mark)
                coming, ahead = watch.ahead.messages(ahead)
                parts += before + coming
                points = watch.path_since(*path)
                if points["points"] or points["epoch"] != path[0]:
                    parts.append((b"P", json.dumps(points).encode()))
                    path = points["epoch"], points["count"]
                self.wfile.write(b"".join(message(kind, content) for kind, content in [*parts, (b"S", state)]))

    # --- changing -----------------------------------------------------------------------------------------------

    def post(self) -> None:
        path, _, self.query = self.path.partition("?")
        if path in HARMLESS:
            self.check_own_page()
            given = self.headers.get("X-Chipwise-Token")
            if given or not self.server.visitor(self.connection).local:
                self.check_token()
            self.by_token = bool(given)
            self.ask(HARMLESS, path, self.body())
            return
        self.check_token()
        wanted = self.body()
        if path == "/token":
            self.send_json(200, {"done": True})
        elif path in CHANGES:
            self.ask(CHANGES, path, wanted)
        else:
            raise Refused(404, "there is nothing here")

    def check_own_page(self) -> None:
        """Raise Refused unless the request names its origin, which check_origin() has compared."""
        if self.headers.get("Origin") is None:
            raise Refused(403, "the request does not name its origin; use the panel's own page")

    def check_token(self) -> None:
        """Raise Refused unless the request may change something."""
        if not self.server.token:
            raise Refused(403, "this panel is read-only; set [CHIPWISE]PANEL_TOKEN to change something with it")
        self.check_own_page()
        given = self.headers.get("X-Chipwise-Token") or ""
        if not hmac.compare_digest(given.encode("utf-8", "replace"), self.server.token.encode()):
            time.sleep(WRONG_TOKEN_S)
            raise Refused(403, "the token is not the one of [CHIPWISE]PANEL_TOKEN; enter that one")
        self.server.befriend(self.connection)

    def body(self) -> Json:
        """The JSON object of the request."""
        try:
            length = int(self.headers.get("Content-Length") or 0)
            if not 0 <= length <= MOST_BODY:
                raise Refused(413, f"the request has {length} bytes, more than {MOST_BODY}")
            content = self.rfile.read(length)
            self.server.in_time(self.connection)
            found = json.loads(content or b"{}")
        except (ValueError, RecursionError) as error:
            raise Refused(400, "the request is not JSON") from error
        if not isinstance(found, dict):
            raise Refused(400, "the request is not a JSON object")
        return found


READING = {  # path: what answers it
    "/strings.json": Handler.strings,
    "/colours.css": Handler.style,
    "/state.json": Handler.state,
    "/log.json": Handler.log,
    "/about.json": Handler.about,
    "/tools.json": Handler.tools,
    "/clamps.json": Handler.clamps,
    "/codes.json": Handler.codes,
    "/line.json": Handler.line,
    "/stream": Handler.stream,
}


class Server(ThreadingHTTPServer):
    """The server on one address; serve_forever() in a thread of its own."""

    daemon_threads = True
    block_on_close = False
    request_queue_size = WAITING_CONNECTIONS
    allow_reuse_address = True

    def __init__(
        self,
        address: str,
        port: int,
        watch: Watch,
        token: str = "",
        items: dict[str, colours.Item] | None = None,
        lines: Lines | None = None,
    ) -> None:
        """address: IPv4 or IPv6; port: 0 for a free one; token: "" for read-only; items: colours.load(), None:
        chipwise's own; lines: lines.Lines, None: without a machine.  Raises OSError."""
        self.address_family = socket.AF_INET6 if ":" in address else socket.AF_INET
        self.watch, self.token, self.closing = watch, token, False
        self.items = colours.load("") if items is None else items
        self.lines = lines or Lines("")
        self._lock = threading.Lock()
        # connection: until when its request has to be there, None afterwards
        self._open: dict[socket.socket, float | None] = {}
        self._visitors = Visitors()
        super().__init__((address, port), Handler)
        self.url = as_url(str(self.server_address[0]), self.server_address[1])

    def server_bind(self) -> None:
        """As HTTPServer does, but without looking its own name up, which may need a network."""
        socket.socket.setsockopt(self.socket, socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = str(self.server_address[0]), self.server_address[1]

    def names_of(self, address: str) -> set[str]:
        """Values that a Host header may have on a connection to an address of this machine."""
        address = address.removeprefix("::ffff:")
        names = {f"[{address}]" if ":" in address else address}
        if address in ("127.0.0.1", "::1"):
            names.add("localhost")
        return {f"{name}:{self.server_port}" for name in names} | (names if self.server_port == 80 else set())

    # the module's server may also be one of datagrams: of TCP a request is always a socket
    def process_request(self, request: socket.socket, client_address: Address) -> None:  # type: ignore[override]  # TCP
        try:
            served = request.getsockname()[0]
        except OSError:  # gone already
            served = ""
        with self._lock:
            stays = self._visitors.come(request, client_address[0], served)
            if stays:
                self._open[request] = time.monotonic() + patience(REQUEST_S)
        if stays:
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    # as for process_request()
    def shutdown_request(self, request: socket.socket) -> None:  # type: ignore[override]  # TCP
        with self._lock:
            self._open.pop(request, None)
            self._visitors.go(request)
        super().shutdown_request(request)

    def visitor(self, connection: socket.socket) -> Visitor:
        """visitors.Visitor of a connection."""
        with self._lock:
            return self._visitors.connections[connection]

    def befriend(self, connection: socket.socket) -> None:
        """A connection has brought the right token."""
        with self._lock:
            self._visitors.befriend(self._visitors.connections[connection])

    def in_time(self, connection: socket.socket) -> None:
        """The request is there, with its body."""
        with self._lock:
            if connection in self._open:
                self._open[connection] = None

    def service_actions(self) -> None:
        """Twice a second: a request that comes byte by byte ends here."""
        now = time.monotonic()
        with self._lock:
            late = [connection for connection, until in self._open.items() if until is not None and until < now]
        for connection in late:
            try:
                connection.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def handle_error(self, request: object, client_address: Address) -> None:
        """Of one connection, in the log as one line."""
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            print(f"chipwise-panel: {type(error).__name__}: {error}", flush=True)

    @contextlib.contextmanager
    def one_more_page(self, connection: socket.socket) -> Iterator[None]:
        """Context of an open page; Refused for one too many."""
        with self._lock:
            if not self._visitors.open_page(connection):
                raise Refused(
                    503,
                    f"{len(self._visitors.streams)} pages are open already, and this one is one too many; close one",
                )
            self.watch.pages = len(self._visitors.streams)
        try:
            yield
        finally:
            with self._lock:
                self._visitors.close_page(connection)
                self.watch.pages = len(self._visitors.streams)

    def close(self) -> None:
        self.closing = True
        self.shutdown()
        self.server_close()
