"""Water for a reality that has none: a level surface in every vessel, a stream over the lowest point of the rim.

What it is: quasi-static. The surface is level whatever the vessel does; over the rim runs what stands above it,
by the law of a sharp-crested weir (dQ = 2/3 Cd sqrt(2g) h^1.5 ds along the rim); what has left falls as a stone does, and
lands in the vessel whose opening it meets, or beside. What it is not: no waves, no splashing, no drops that cling.
"""
import math
import numpy as np

G, RHO = 9.81, 1000.0


class Vessel:
    """A cavity as points: `inside` samples it evenly, `rim` goes around its edge; body frame, m."""

    def __init__(self, name, inside, rim, around, capacity, volume, opening):
        self.name, self.inside, self.rim = name, inside, rim
        self.capacity, self.volume = capacity, volume
        self.piece, self.opening = around / len(rim), opening    # of the rim, m a point; whether a point is in the opening

    @staticmethod
    def box(name, side, height, wall, volume, chance, n=3000):
        s, h = side / 2 - wall, height - wall
        inside = chance.uniform([-s, -s, wall], [s, s, height], (n, 3))
        edge = np.linspace(-s, s, 24, endpoint=False)
        rim = np.array([(x, y, height) for t in edge for x, y in ((t, -s), (-t, s), (-s, -t), (s, t))])
        return Vessel(name, inside, rim, 8 * s, 4 * s * s * h, volume, lambda p: abs(p[0]) <= s and abs(p[1]) <= s)

    @staticmethod
    def round(name, radius, height, wall, volume, chance, n=3000):
        r = radius - wall
        around, away = chance.uniform(0, 2 * math.pi, n), r * np.sqrt(chance.uniform(0, 1, n))
        inside = np.column_stack([away * np.cos(around), away * np.sin(around), chance.uniform(wall, height, n)])
        turn = np.linspace(0, 2 * math.pi, 96, endpoint=False)
        rim = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(96, height)])
        return Vessel(name, inside, rim, 2 * math.pi * r, math.pi * r * r * (height - wall), volume, lambda p: math.hypot(p[0], p[1]) <= r)

    def settle(self, turned):
        """How far the surface stands above each point of the rim, m (negative: below), and the water's centre, body frame."""
        heights, edge = self.inside @ turned[2], self.rim @ turned[2]
        if self.volume <= 0:
            return np.full(len(edge), -1.0), np.zeros(3)
        share = min(self.volume / self.capacity, 1.0)
        nth = min(int(share * len(heights)), len(heights) - 1)
        order = np.argpartition(heights, nth)
        over = max(self.volume - self.capacity, 0.0) / (self.capacity / np.ptp(self.inside[:, 2]))
        return heights[order[nth]] + over - edge, self.inside[order[:nth + 1]].mean(axis=0)


class Water:
    """All vessels, and what was spilt. `poses` gives each vessel's rotation and place in the world."""

    def __init__(self, vessels, chance=None):
        self.vessels, self.spilt = vessels, 0.0
        self.discharge = 0.6 if chance is None else chance.uniform(0.5, 0.7)
        self.held_back = 0.001 if chance is None else chance.uniform(0.0005, 0.002)    # by the lip's surface tension, m
        self.falling = []    # (when, which vessel or None, m3)

    def step(self, now, dt, poses):
        """Runs, falls and lands for `dt`; returns the water's mass, kg, and centre, body frame, of every vessel."""
        loads = []
        for vessel, (turned, at) in zip(self.vessels, poses):
            heads, centre = vessel.settle(turned)
            heads = np.maximum(heads - self.held_back, 0)
            if heads.any():
                flow = 2 / 3 * self.discharge * math.sqrt(2 * G) * (heads ** 1.5).sum() * vessel.piece
                gone = min(flow * dt, vessel.volume)
                vessel.volume -= gone
                lip = heads @ vessel.rim / heads.sum()
                # Along the wall it ran down and away from the middle, as fast as a weir's sheet is on average.
                away = turned @ (lip * [1, 1, 0] / max(np.hypot(lip[0], lip[1]), 1e-9) + [0, 0, 1])
                away[2] = 0
                speed = 2 / 3 * self.discharge * math.sqrt(2 * G * heads.max()) * away / max(np.linalg.norm(away), 1)
                self.falling.append(self.fall(now, vessel, turned @ lip + at, speed, poses) + (gone,))
            loads.append((RHO * vessel.volume, centre))
        for landed in [f for f in self.falling if f[0] <= now]:
            self.falling.remove(landed)
            if landed[1] is None:
                self.spilt += landed[2]
            else:
                landed[1].volume += landed[2]
        return loads

    def fall(self, now, source, at, speed, poses):
        for vessel, (turned, place) in zip(self.vessels, poses):
            depth = at[2] - (turned @ vessel.rim.mean(axis=0) + place)[2]
            if vessel is not source and depth > 0:
                seconds = math.sqrt(2 * depth / G)
                if vessel.opening(turned.T @ (at + speed * seconds - place)):
                    return now + seconds, vessel
        return now + math.sqrt(2 * max(at[2], 0) / G), None
