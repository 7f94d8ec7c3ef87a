"""Fake live: a server that speaks the protocol of `glshade dev`, and shows the page states that a real one seldom has.

It draws a sphere under the page's camera, or sends a picture file, and answers every request at once.
`python tests/support/fake_live.py [PICTURE]` prints its address.
"""

from __future__ import annotations

import io
import json
import mimetypes
import struct
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve

import glshade.live

PAGE = Path(glshade.live.__file__).parent / "page"
SECURITY = "default-src 'self'; img-src 'self' blob:; connect-src 'self'"


def number(key: str, label: str, value: float, usual: tuple[float, float]) -> dict[str, Any]:
    return {
        "key": key,
        "label": label,
        "kind": "number",
        "value": value,
        "usual": usual,
        "bounds": [0, 1e8],
        "description": label,
    }


def group(section: str, key: str, title: str, *fields: dict[str, Any]) -> dict[str, Any]:
    return {"section": section, "key": key, "title": title, "fields": list(fields)}


def choice(key: str, label: str, value: str, *choices: str) -> dict[str, Any]:
    return {"key": key, "label": label, "kind": "choice", "value": value, "choices": list(choices)}


# Another model has other parameters, so its choice replaces the whole material.
MODEL = {
    "key": "materials.red",
    "label": "model",
    "kind": "choice",
    "value": {"brdf": "blinn_phong"},
    "choices": [{"label": name, "value": {"brdf": name}} for name in ("blinn_phong", "ggx", "lambert")],
}
GROUPS = [
    group(
        "object",
        "objects.0",
        "ball",
        choice("objects.0.shading", "shading", "phong", "flat", "gouraud", "phong"),
        choice("objects.0.material", "material", "red", "red", "gold", "chalk"),
    ),
    group(
        "material",
        "materials.red",
        "red",
        MODEL,
        {**number("materials.red.kd", "kd", 0, (0, 1)), "kind": "colour", "value": [0.62, 0.05, 0.07], "bounds": [0, 1]},
        number("materials.red.ks", "ks", 0.5, (0, 1)),
        number("materials.red.exponent", "exponent", 60, (1, 1000)),
        {**number("materials.red.eta", "eta", 0, (1.1, 4)), "kind": "colour", "value": [1.5, 1.5, 1.5], "bounds": [0.01, 100]},
    ),
    group(
        "light",
        "lights.key",
        "key, directional",
        number("lights.key.intensity", "intensity", 0.85, (0, 2)),
        {"key": "lights.key.direction", "label": "direction", "kind": "vector", "value": [0.6, -0.7, -0.7]},
    ),
    group("camera", "camera", "perspective", number("camera.fov", "fov", 40, (10, 90))),
    group(
        "quality",
        "quality",
        "quality",
        choice("quality.math", "math", "exact", "exact", "fast"),
        {"key": "quality.fold", "label": "fold", "kind": "boolean", "value": True},
    ),
]
PROGRAMS = [
    {
        "name": "blinn_phong, phong",
        "objects": ["ball"],
        "reasons": ["the material `red` has the model blinn_phong", "one directional light: the loop is unrolled"],
        "milliseconds": {"compile and link": 31.2},
        "rebuilt": True,
        "no_reference": False,
    },
    {
        "name": "lambert, phong",
        "objects": ["floor"],
        "reasons": ["the material `floor` has the model lambert"],
        "milliseconds": {"compile and link": 24},
        "rebuilt": False,
        "no_reference": True,
    },
]
PROBLEM = {
    "file": "shaders/brdf/blinn_phong.glsl",
    "line": 14,
    "column": 27,
    "message": "`expnent' undeclared",
    "first_line": 12,
    "excerpt": [
        "    float NoH = max(dot(f.n, h), 0.0);",
        "    vec3 diffuse = m.kd * INV_PI;",
        "    float lobe = cospow(NoH, expnent);",
        "    return (diffuse + m.ks * lobe) * NoL;",
        "}",
    ],
    "caret": 30,
    "stage": "fragment",
}
# The files of the object, and the lines of them that lose digits.
FILES = [
    {
        "file": "/shaders/brdf/blinn_phong.glsl",
        "name": "brdf/blinn_phong.glsl",
        "lines": ["float lobe() {", "\tfloat far = NoH + 8192.0;", "}"],
    },
    {"file": "<surface>", "name": "<surface>", "lines": [f"float x{number};" for number in range(200)]},
]
LOST = [
    {
        "file": "/shaders/brdf/blinn_phong.glsl",
        "line": 2,
        "text": "float far = NoH + 8192.0;",
        "digits": 3.7,
        "ill_posed": False,
    },
    {"file": "<surface>", "line": 7, "text": "another text", "digits": 5.0, "ill_posed": True},
]
# The variables of a pixel.
STEP = {
    "file": "<surface>",
    "short": "<surface>",
    "line": 150,
    "text": "float x149;",
    "name": "x149",
    "number": 0,
    "type": "float",
}
STEPS = [
    {**STEP, "float64": "0.25", "float32": "0.25", "digits": 0.0, "picture": True},
    {**STEP, "number": 1, "float64": "0.123456789", "float32": "0.123500000", "digits": 3.8, "picture": True},
    {**STEP, "name": "m", "float64": "(1, 2)", "float32": "(1, 2)", "digits": 0.0, "picture": False},
]
COLOURS = ["#000004", "#3b0f70", "#8c2981", "#de4968", "#fe9f6d", "#fcfdbf"]


class FakeLive:
    """A server at a free port of 127.0.0.1 for any number of pages.

    received: the messages of all pages, in order.
    state: the state message; `push` sends it again.
    judgement: the answer to "judge".
    connections: the connections of the pages.
    """

    def __init__(self, picture: Path | None = None) -> None:
        self.picture = Image.open(picture).convert("RGB") if picture else None
        size = self.picture.size if self.picture else (512, 512)
        camera = {"type": "perspective", "eye": [0, 1, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 40, "height": None}
        self.received: list[dict[str, Any]] = []
        self.judgement: dict[str, Any] = {"state": "verified", "text": "Every pixel lies in the interval of its right values."}
        self.state: dict[str, Any] = {
            "type": "state",
            "revision": 12,
            "stale": False,
            "stale_of": None,
            "problems": [],
            "controls": {"groups": GROUPS},
            "scene": picture.stem if picture else "ball.toml",
            "drawer": "ready",
            "info": {
                "size": list(size),
                "cameras": [{"name": None, **camera}, {"name": "above", **camera, "eye": [0, 5, 1]}],
                "layers": ["depth", "normal", "albedo", "specular"],
                "objects": [{"name": "ball", "key": "objects.0", "material_key": "materials.red", "triangles": 960}],
                "programs": PROGRAMS,
                "driver": "Mesa llvmpipe, 256 bits.",
            },
        }
        self.connections: list[ServerConnection] = []
        self._server: Server = serve(self._page, "127.0.0.1", 0, process_request=_file)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self._server.socket.getsockname()[1]}/"

    def close(self) -> None:
        self._server.shutdown()

    def push(self, **changes: Any) -> None:
        """Changes the state and sends it to all pages."""
        self.state |= changes
        for connection in self.connections:
            connection.send(json.dumps(self.state))

    def _page(self, connection: ServerConnection) -> None:
        self.connections.append(connection)
        with suppress(ConnectionClosed):
            connection.send(json.dumps(self.state))
            for text in connection:
                message = json.loads(text)
                self.received.append(message)
                self._reply(connection, message)
        self.connections.remove(connection)

    def _reply(self, connection: ServerConnection, message: dict[str, Any]) -> None:
        if message["type"] == "view":
            for pane, view in enumerate(message["panes"]):
                connection.send(self._frame(message, pane, view))
        elif answer := self._answer(message):
            connection.send(json.dumps(answer))
            if message["type"] == "probe":
                place = {key: answer[key] for key in ("pane", "x", "y")}
                connection.send(
                    json.dumps({"type": "traced", "object": 0, "steps": STEPS, "left_out": 0, "revision": 12, **place})
                )

    def _answer(self, message: dict[str, Any]) -> dict[str, Any] | None:
        place = {key: message.get(key) for key in ("pane", "x", "y")}
        if message["type"] == "judge":
            return {"type": "judged", "unexplained": 0, "pixels": [], "revision": 12, **self.judgement}
        if message["type"] == "pick":
            return {
                "type": "picked",
                "object": "ball",
                "key": "objects.0",
                "material": "red",
                "material_key": "materials.red",
                **place,
            }
        if message["type"] == "probe":
            values = {
                "value": [0.2126394, 0.0192, 0.02511],
                "reference": [0.21263901, 0.0192, 0.0251101],
                "low": [0.2126385, 0.01919, 0.0251098],
                "high": [0.2126396, 0.01921, 0.0251104],
            }
            return {
                "type": "probed",
                "kind": "inside: one surface covers it",
                "object": "ball",
                "triangle": 417,
                **values,
                **place,
            }
        if message["type"] == "source":
            return {"type": "source", "object": message["object"], "name": "ball", "files": FILES, "revision": 12}
        if message["type"] == "digits":
            return {"type": "digits", "object": message["object"], "lines": LOST, "revision": 12}
        if message["type"] == "write":
            return {"type": "written", "ok": True, "text": "Wrote 1 value into ball.toml."}
        return None

    def _frame(self, message: dict[str, Any], pane: int, view: dict[str, Any]) -> bytes:
        moving = message["moving"]
        image = self.picture or _sphere(view["camera"], 256 if moving else 512)
        data = io.BytesIO()
        image.save(data, "jpeg" if moving else "png")
        scale = (
            {"low": 0, "high": 2.5e-6, "text": "difference, linear light", "colours": COLOURS}
            if view["source"] in ("heat", "variable")
            else None
        )
        header = {
            "number": message["number"],
            "revision": self.state["revision"],
            "stale": self.state["stale"],
            "mime": "image/jpeg" if moving else "image/png",
            "width": image.width,
            "height": image.height,
            "still": not moving,
            "milliseconds": {"draw": 12.3, "encode": 4.5},
            "non_finite": 3 if view["paint"] == "nan" else None,
            "scale": scale,
        }
        text = json.dumps(header).encode()
        return struct.pack(">BBI", 1, pane, len(text)) + text + data.getvalue()


def _file(connection: ServerConnection, request: Request) -> Response | None:
    """Serves the files of the page; the WebSocket goes its own way."""
    if request.path == "/socket":
        return None
    name = "index.html" if request.path == "/" else request.path.removeprefix("/page/")
    file = PAGE / name
    if "/" in name or not file.is_file():
        return connection.respond(404, "not found")
    mime = mimetypes.guess_type(name)[0] or "application/octet-stream"
    headers = Headers(
        {"Content-Type": mime, "Content-Security-Policy": SECURITY, "Cache-Control": "no-store", "Connection": "close"}
    )
    return Response(200, "OK", headers, file.read_bytes())


def _sphere(camera: dict[str, Any] | None, size: int) -> Image.Image:
    """Draws a sphere, lit by a lamp that turns with the camera's position."""
    light = np.array((camera or {}).get("eye", [2, 3, 4]), dtype=float)
    light /= np.linalg.norm(light)
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, size), np.linspace(1.2, -1.2, size))
    z = np.sqrt(np.maximum(0, 1 - x * x - y * y))
    cosine = np.maximum(0, x * light[0] + y * light[1] + z * light[2])
    shade = np.where(z > 0, 0.06 + 0.75 * cosine + 0.5 * cosine**40, 0.012)[..., None]
    pixels = np.clip(shade * [1.0, 0.36, 0.3], 0, 1) ** (1 / 2.2)
    return Image.fromarray((255 * pixels).astype(np.uint8))


if __name__ == "__main__":
    fake = FakeLive(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
    print(fake.address, flush=True)
    threading.Event().wait()
