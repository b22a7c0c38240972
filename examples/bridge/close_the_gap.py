#!/usr/bin/env python3
"""What a twin lacks of a reality that another program simulates: found from two runs, judged on a third.

    pip install mujoco numpy pillow
    cargo build --release
    python examples/bridge/close_the_gap.py --cells 1-5 --out gap-of-mujoco
    python examples/bridge/close_the_gap.py --cells 1-5 --out gap-of-pybullet --server pybullet

For every cell (a robot with friction, rotors and zeros of its own, `SERVER_server.py`): two runs of `pick(jar) then
place(jar)` without knowing anything; `trueup gap` on their recordings, which writes what it names into the cell's file;
a third run, the things elsewhere, with that file. What is told: each number that was drawn beside the one found, what
was named beside, and the gap of the third run with the file and without. `close_the_gap.svg` draws it.
"""
import argparse, json, math, pathlib, subprocess, sys, time

HERE = pathlib.Path(__file__).resolve().parent
LINE = "pick(jar) then place(jar)"
# What a server may draw, by its name there: effect, parameter, unit, colour.
DRAWN = {"rotor_kg_m2": ("armature", "inertia", "kg·m²", "#2050c0"), "viscous_nm_s": ("viscous_friction", "coefficient", "N·m·s/rad", "#c05020"),
         "dry_nm": ("coulomb_friction", "torque", "N·m", "#208050")}


def run(trueup, server, cell, seed, port, out, script):
    """One run of the script in the cell; returns its folder and what the server had drawn."""
    log = out / f"server-{cell}-{seed}.log"
    with log.open("w") as told:
        reality = subprocess.Popen([sys.executable, HERE / f"{server}_server.py", "--cell", str(cell), "--seed", str(seed), "--port", str(port),
                                   "--once", "--tell"], stdout=told)
        while "bridge://" not in log.read_text():
            time.sleep(0.2)
        runs = out / f"runs-{cell}-{seed}"
        done = subprocess.run([trueup, "run", script, "--robot", f"bridge://127.0.0.1:{port}", "--record", runs, "--quiet"])
        reality.wait(timeout=60)
    folder = sorted(runs.iterdir())[-1]
    return folder, json.loads(log.read_text().splitlines()[1]), done.returncode


def gap(trueup, *args):
    done = subprocess.run([trueup, "gap", *args, "--json"], capture_output=True, text=True)
    if done.returncode > 1:
        sys.exit(f"gap {' '.join(map(str, args))}:\n{done.stderr}")
    return json.loads(done.stdout)


def numbers(finding):
    """Every number found, by name, joint and parameter."""
    found = {(item["name"], item["at"], item["parameter"]): item["value"] for item in finding.get("identified") or []}
    for effect in finding["effects"]:
        for name, parameter in effect["parameters"].items():
            found[effect["name"], effect["at"], name] = parameter["value"]
    return found


def close(trueup, server, cell, port, out):
    script = out / f"cell_{cell}.task"
    script.write_text(f"/// What is known of cell {cell}.\ntwin cell_{cell} of kitchen {{\n}}\n\n{LINE}\n")
    (first, drawn, _), (second, _, _) = (run(trueup, server, cell, seed, port, out, script) for seed in (1, 2))
    finding = gap(trueup, first, second, "--model", script, "--apply")
    third, _, code = run(trueup, server, cell, 3, port, out, script)
    without, with_file = gap(trueup, third), gap(trueup, third, "--model", script)
    found, pairs = numbers(finding), []
    for key, (name, parameter, unit, _) in DRAWN.items():
        for joint, value in enumerate(drawn.get(key, []), 1):
            pairs.append({"name": name, "at": f"joint_{joint}", "drawn": value, "found": found.get((name, f"joint_{joint}", parameter)), "unit": unit})
    known = {name for key, (name, *_) in DRAWN.items() if key in drawn}
    beside = [f"{effect['name']}({effect['at']})" for effect in finding["effects"] if effect["name"] not in known]
    return {"cell": cell, "third_run_done": code == 0, "pairs": pairs, "beside": beside,
            "before": without["gap"]["before"]["heldout"], "after": with_file["gap"]["before"]["heldout"]}


def tell(result):
    print(f"cell {result['cell']}: gap of the third run {result['before']:.2f} without, {result['after']:.2f} with what was found (1 is noise)")
    for name, *_ in DRAWN.values():
        pairs = [pair for pair in result["pairs"] if pair["name"] == name]
        if not pairs:
            continue
        line = "  ".join(f"{pair['drawn']:.3f}/{pair['found']:.3f}" if pair["found"] is not None else f"{pair['drawn']:.3f}/-" for pair in pairs)
        print(f"  {name:17} drawn/found by joint, {pairs[0]['unit']}: {line}")
    print(f"  beside: {', '.join(result['beside']) or 'nothing'}", flush=True)


def draw(server, results):
    """Left: drawn against found, both axes logarithmic. Right: the gap of the third run, without and with."""
    least, most, side, left, top = -2.2, 0.3, 300, 70, 40
    at = lambda value: (math.log10(max(value, 1e-9)) - least) / (most - least) * side
    text = lambda x, y, words, more="": f'<text x="{x:.1f}" y="{y:.1f}" {more}>{words}</text>'
    parts = [text(left, 22, f"What {server} had, and what gap found", 'font-weight="bold"')]
    parts.append(f'<rect x="{left}" y="{top}" width="{side}" height="{side}" fill="none" stroke="#888"/>')
    parts.append(f'<line x1="{left}" y1="{top + side}" x2="{left + side}" y2="{top}" stroke="#888" stroke-dasharray="4 3"/>')
    for tick in (0.01, 0.03, 0.1, 0.3, 1):
        parts.append(text(left + at(tick), top + side + 18, f"{tick:g}", 'text-anchor="middle"'))
        parts.append(text(left - 8, top + side - at(tick) + 4, f"{tick:g}", 'text-anchor="end"'))
    parts.append(text(left + side / 2, top + side + 38, "drawn by the server, hidden", 'text-anchor="middle"'))
    parts.append(text(20, top + side / 2, "found", f'text-anchor="middle" transform="rotate(-90 20 {top + side / 2})"'))
    colours = {name: colour for name, _, _, colour in DRAWN.values()}
    for result in results:
        for pair in result["pairs"]:
            if pair["found"]:
                parts.append(f'<circle cx="{left + at(pair["drawn"]):.1f}" cy="{top + side - at(abs(pair["found"])):.1f}" r="4" fill="{colours[pair["name"]]}" fill-opacity="0.7"/>')
    for row, (name, _, unit, colour) in enumerate(DRAWN.values()):
        parts.append(f'<circle cx="{left + 14}" cy="{top + 16 + 18 * row}" r="4" fill="{colour}"/>' + text(left + 24, top + 20 + 18 * row, f"{name}, {unit}"))
    x, wide, peak = left + side + 90, 300, max(result["before"] for result in results)
    parts.append(text(x, 22, "Gap of the next run, in units of noise", 'font-weight="bold"'))
    slot = wide / len(results)
    high = lambda value: side * value / (1.1 * peak)
    for k, result in enumerate(results):
        for shift, key, colour in ((0.12, "before", "#b0b0b0"), (0.5, "after", "#208050")):
            value = result[key]
            parts.append(f'<rect x="{x + slot * (k + shift):.1f}" y="{top + side - high(value):.1f}" width="{0.34 * slot:.1f}" height="{high(value):.1f}" fill="{colour}"/>')
            parts.append(text(x + slot * (k + shift + 0.17), top + side - high(value) - 5, f"{value:.1f}", 'text-anchor="middle" font-size="11"'))
        parts.append(text(x + slot * (k + 0.5), top + side + 18, f"cell {result['cell']}", 'text-anchor="middle"'))
    parts.append(f'<line x1="{x}" y1="{top + side - high(1):.1f}" x2="{x + wide}" y2="{top + side - high(1):.1f}" stroke="#444" stroke-dasharray="4 3"/>')
    parts.append(text(x + wide + 4, top + side - high(1) + 4, "noise"))
    parts.append(text(x, top + side + 38, "grey: twin as it was · green: with what gap added"))
    width, height = x + wide + 60, top + side + 55
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="sans-serif" font-size="13">'
            f'<rect width="{width}" height="{height}" fill="white"/>{"".join(parts)}</svg>\n')


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("--trueup", default=str(HERE / "../../target/release/trueup"))
    args.add_argument("--cells", default="1-5")
    args.add_argument("--server", default="mujoco", help="the reality: SERVER_server.py beside this file")
    args.add_argument("--port", type=int, default=5556)
    args.add_argument("--out", type=pathlib.Path, default=pathlib.Path("gap-of-bridge"))
    args = args.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    first, _, last = args.cells.partition("-")
    results = []
    for cell in range(int(first), int(last or first) + 1):
        results.append(close(args.trueup, args.server, cell, args.port, args.out))
        tell(results[-1])
        (args.out / "close_the_gap.json").write_text(json.dumps(results, indent=1))
        (args.out / "close_the_gap.svg").write_text(draw(args.server, results))


if __name__ == "__main__":
    main()
