"""Protocol 1 (docs/bridge.md): one connection, one JSON object a line, one answer for each. Serves any class `Reality`.

A `Reality(seed, cell, exact)` has `name`, `joints` and `camera` (width, height; px); `step(dt, q, dq, grip)`, `feedback()` and `stop()`, which return a
feedback; `photo()`, which returns an array of (height, width, 3) bytes; and `water`, the vessels with what they hold.
What it is not: a simulator. Nothing here knows an engine.
"""
import argparse, base64, io, json, socket
from PIL import Image


def answer(reality, request):
    (word, asked), = request.items()
    if word == "hello":
        if asked["version"] != 1:
            return {"error": f"version {asked['version']} is not spoken here", "help": "this is version 1"}
        return {"hello": 1, "name": reality.name, "joints": reality.joints, "camera": dict(zip(("width", "height"), reality.camera)), "scales": True, "realtime": False}
    if word == "step":
        return reality.step(**asked)
    if word == "photo":
        png = io.BytesIO()
        Image.fromarray(reality.photo()).save(png, "PNG")
        return {"png": base64.b64encode(png.getvalue()).decode()}
    if word == "scales":
        return {"water": [[v.name, v.volume] for v in reality.water.vessels], "spilt": reality.water.spilt}
    if word in ("feedback", "stop"):
        return getattr(reality, word)()
    return {"error": f"`{word}` is not known", "help": "hello, step, feedback, photo, scales, stop"}


def main(reality_of, about):
    args = argparse.ArgumentParser(description=about.splitlines()[0])
    args.add_argument("--port", type=int, default=5555)
    args.add_argument("--seed", type=int, default=1)
    args.add_argument("--cell", type=int, help="the robot's and the camera's errors; the seed's own unless given")
    args.add_argument("--exact", action="store_true", help="draw only where things stand")
    args.add_argument("--tell", action="store_true", help="print what was drawn")
    args.add_argument("--once", action="store_true", help="end with the first connection")
    args = args.parse_args()
    build = lambda: reality_of(args.seed, args.seed if args.cell is None else args.cell, args.exact)
    reality = build()  # before anybody is let in: `hello` is waited for 10 s, and a world may take longer on a busy machine
    listener = socket.create_server(("127.0.0.1", args.port))
    print(f"bridge://127.0.0.1:{listener.getsockname()[1]}", flush=True)
    while True:
        connection, _ = listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if args.tell:
            print(json.dumps(reality.drawn()), flush=True)
        with connection, connection.makefile("rwb") as lines:
            for line in lines:
                try:
                    said = answer(reality, json.loads(line))
                except Exception as error:  # a server answers, whatever happens
                    said = {"error": f"{type(error).__name__}: {error}", "help": "see the server's own output"}
                lines.write(json.dumps(said).encode() + b"\n")
                lines.flush()
        if args.once:
            return
        reality = build()  # every connection begins anew
