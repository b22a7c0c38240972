#!/usr/bin/env python3
"""Writes the meshes of tests/tables: a bracket (binary STL, mm) and a toy house (OBJ, m).

    python scripts/table_meshes.py
"""
import pathlib, struct

TABLES = pathlib.Path(__file__).resolve().parent.parent / "tests/tables"


def drawn_out(outline, deep):
    """The triangles of an outline in x and z, against the clock, drawn out along y; ears are cut from its first corner."""
    at = lambda k, y: (outline[k % len(outline)][0], y, outline[k % len(outline)][1])
    n, triangles = len(outline), []
    for k in range(n):
        triangles += [(at(k, 0), at(k + 1, 0), at(k + 1, deep)), (at(k, 0), at(k + 1, deep), at(k, deep))]
    for k in range(1, n - 1):
        triangles += [(at(0, 0), at(k + 1, 0), at(k, 0)), (at(0, deep), at(k, deep), at(k + 1, deep))]
    return triangles


def stl(path, triangles):
    with open(path, "wb") as file:
        file.write(b"a bracket, mm".ljust(80, b"\0") + struct.pack("<I", len(triangles)))
        for triangle in triangles:
            file.write(struct.pack("<12fH", 0, 0, 0, *[x for corner in triangle for x in corner], 0))


def main():
    # An upright plate of 16 mm on a foot of 80 x 44 mm, with a rib between them.
    bracket = [(0, 0), (80, 0), (80, 14), (28, 14), (16, 26), (16, 74), (0, 74)]
    stl(TABLES / "bracket.stl", drawn_out(bracket, 44))
    # Walls of 52 x 70 mm, 40 mm high, and a roof of 72 mm.
    corners = [(x, y, 0) for y in (0, 70) for x in (0, 52)] + [(x, y, 40) for y in (0, 70) for x in (0, 52)]
    corners += [(26, y, 72) for y in (0, 70)]
    faces = ["1 3 4 2", "1 2 6 9 5", "3 7 10 8 4", "1 5 7 3", "2 4 8 6", "5 9 10 7", "6 8 10 9"]
    lines = ["# a toy house, m"] + ["v " + " ".join(f"{x / 1000:g}" for x in corner) for corner in corners]
    (TABLES / "house.obj").write_text("\n".join(lines + [f"f {face}" for face in faces]) + "\n")


if __name__ == "__main__":
    main()
