"""The SN1 example by scipy's LSODA: accuracy and time per tolerance, one line of JSON each.

Usage: lsoda.py MASS, the mass of the mixture in kg. Constants are those of examples/sn1.mtx.
"""

import json
import math
import sys
import time

from scipy.integrate import solve_ivp

AMBIENT = 298.15
PLATE, GLASS, LIQUID = 1058.3, 43.03, 41.75
CONTACT, WALL = 12.77, 21.08
AIR = (0.573, 1.505, 2.396)
GAIN, TARGET = 70.09, 76.33 + 273.15
A, EA, R = 2.0021e9, 72e3, 8.31446261815324
START = 0.012
WINDOW = 303.15
REPEATS = 7


def law(mass, heating, touching, reacting):
    """Right-hand side: rises above ambient (K) of plate, glass and liquid, and amount made (mmol)."""

    def rates(_, y):
        plate, glass, liquid, made = y
        heat = max(GAIN * (TARGET - AMBIENT - plate), 0.0) if heating else 0.0
        passed = CONTACT * (plate - glass) if touching else 0.0
        mixed = WALL * (glass - liquid)
        q = 0.0
        if reacting:
            left = START - 1e-3 * made
            q = 1e3 * A * math.exp(-EA / (R * (liquid + AMBIENT))) * left * left / mass
        return (
            (heat - passed - AIR[0] * plate) / PLATE,
            (passed - mixed - AIR[1] * glass) / GLASS,
            (mixed - AIR[2] * liquid) / LIQUID,
            q,
        )

    return rates


def window(_, y):
    """Zero where the liquid enters or leaves the temperatures at which it reacts."""
    return y[2] + AMBIENT - WINDOW


window.terminal = True


def run(mass, rtol):
    """Amount made after 2000 s, mmol, and evaluations of the law."""
    y, now, calls = [0.0] * 4, 2.0, 0
    for end, heating, touching in ((8.0, True, False), (1010.6, True, True), (2000.0, False, True)):
        while now < end:
            reacting = window(now, y) > 0.0 or (window(now, y) == 0.0 and heating)
            part = law(mass, heating, touching, reacting)
            found = solve_ivp(part, (now, end), y, "LSODA", rtol=rtol, atol=1e-3 * rtol, events=window)
            calls += found.nfev
            now, y = found.t[-1], found.y[:, -1].tolist()
            if found.status == 1:
                # On to the other side, so that the same crossing is not found again.
                y[2] = WINDOW - AMBIENT + (1e-12 if heating else -1e-12)
    return y[3], calls


def main():
    mass = float(sys.argv[1])
    reference, _ = run(mass, 1e-13)
    print(json.dumps({"reference": reference}))
    for power in range(3, 13):
        times = []
        for _ in range(REPEATS):
            began = time.perf_counter()
            made, calls = run(mass, 10.0**-power)
            times.append(time.perf_counter() - began)
        error = abs(made / reference - 1.0)
        print(json.dumps({"rtol": 10.0**-power, "error": error, "seconds": sorted(times)[REPEATS // 2], "calls": calls}))


main()
