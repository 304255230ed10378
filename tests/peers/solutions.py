"""Fits how ions crowd to densities, heat capacities and heats of dilution of whole solutions, and tells how far off each salt is.

    solutions.py [--species]

needs numpy, chemicals (the coefficients of Laliberte) and phreeqpython (pitzer.dat). With x as the share of ions among them and the
water, an ion adds `first x / (x + 0.05) + second x` to what it has at infinite dilution, and to its heat `third x^2` besides; those of H+
are 0. Numbers at infinite dilution are read from stdlib/species.mtx. Printed are the three properties of each ion, to be written there, and
the worst error of each salt; with --species the first only. The exit code is 1 where a stock is further off than docs/solutions.md says.
"""

import csv
import importlib.util
import math
import pathlib
import re
import sys

import numpy as np
import phreeqpython

LIBRARY = pathlib.Path(__file__).parents[2] / "stdlib" / "species.mtx"
EARLY = 0.05
WATER = 18.015
WATER_VOLUME, WATER_CAPACITY = WATER / 0.99705, 75.3
CAL = 4.184

# Formula in the tables of Laliberte: the ions into which the model splits it.
SALTS = {
    "Ba(NO3)2": {"Ba2+": 1, "NO3-": 2}, "BaCl2": {"Ba2+": 1, "Cl-": 2}, "Ca(NO3)2": {"Ca2+": 1, "NO3-": 2}, "CaCl2": {"Ca2+": 1, "Cl-": 2},
    "Cu(NO3)2": {"Cu2+": 1, "NO3-": 2}, "CuCl2": {"Cu2+": 1, "Cl-": 2}, "CuSO4": {"Cu2+": 1, "SO4^2-": 1}, "FeCl2": {"Fe2+": 1, "Cl-": 2},
    "FeCl3": {"Fe3+": 1, "Cl-": 3}, "FeSO4": {"Fe2+": 1, "SO4^2-": 1}, "H2SO4": {"H+": 1, "HSO4-": 1}, "HBr": {"H+": 1, "Br-": 1},
    "HCl": {"H+": 1, "Cl-": 1}, "HNO3": {"H+": 1, "NO3-": 1}, "K2CO3": {"K+": 2, "CO3^2-": 1}, "K2HPO4": {"K+": 2, "HPO4^2-": 1},
    "K2SO4": {"K+": 2, "SO4^2-": 1}, "K3PO4": {"K+": 3, "PO4^3-": 1}, "KBr": {"K+": 1, "Br-": 1}, "KCH3CO2": {"K+": 1, "acetate": 1},
    "KCl": {"K+": 1, "Cl-": 1}, "KH2PO4": {"K+": 1, "H2PO4-": 1}, "KHCO3": {"K+": 1, "HCO3-": 1}, "KI": {"K+": 1, "I-": 1},
    "KNO3": {"K+": 1, "NO3-": 1}, "KOH": {"K+": 1, "OH-": 1}, "Li2SO4": {"Li+": 2, "SO4^2-": 1}, "LiCl": {"Li+": 1, "Cl-": 1},
    "LiNO3": {"Li+": 1, "NO3-": 1}, "LiOH": {"Li+": 1, "OH-": 1}, "Mg(NO3)2": {"Mg2+": 1, "NO3-": 2}, "MgCl2": {"Mg2+": 1, "Cl-": 2},
    "MgSO4": {"Mg2+": 1, "SO4^2-": 1}, "Na2CO3": {"Na+": 2, "CO3^2-": 1}, "Na2HPO4": {"Na+": 2, "HPO4^2-": 1}, "Na2SO4": {"Na+": 2, "SO4^2-": 1},
    "Na3PO4": {"Na+": 3, "PO4^3-": 1}, "NaBr": {"Na+": 1, "Br-": 1}, "NaCH3CO2": {"Na+": 1, "acetate": 1}, "NaCl": {"Na+": 1, "Cl-": 1},
    "NaH2PO4": {"Na+": 1, "H2PO4-": 1}, "NaHCO3": {"Na+": 1, "HCO3-": 1}, "NaHSO4": {"Na+": 1, "HSO4-": 1}, "NaI": {"Na+": 1, "I-": 1},
    "NaNO3": {"Na+": 1, "NO3-": 1}, "NaOH": {"Na+": 1, "OH-": 1}, "NH4Cl": {"NH4+": 1, "Cl-": 1}, "NH4NO3": {"NH4+": 1, "NO3-": 1},
    "(NH4)2SO4": {"NH4+": 2, "SO4^2-": 1}, "NH4HCO3": {"NH4+": 1, "HCO3-": 1}, "Pb(NO3)2": {"Pb2+": 1, "NO3-": 2},
    "Zn(NO3)2": {"Zn2+": 1, "NO3-": 2}, "ZnCl2": {"Zn2+": 1, "Cl-": 2}, "ZnSO4": {"Zn2+": 1, "SO4^2-": 1}, "Mg(CH3CO2)2": {"Mg2+": 1, "acetate": 2},
}
# Mass fractions at which these are about saturated at 25 degC: the tables go on into what is supersaturated.
SATURATED = {
    "Ca(NO3)2": 0.58, "Zn(NO3)2": 0.54, "NH4HCO3": 0.2, "NH4NO3": 0.68, "Na3PO4": 0.13, "ZnCl2": 0.52, "LiNO3": 0.5, "CuCl2": 0.43,
    "FeCl3": 0.48, "NaI": 0.648, "KCH3CO2": 0.6, "CaCl2": 0.45, "KI": 0.6,
}
# Beyond the tables: mass fraction and g/mL at 25 degC, of Perry's Chemical Engineers' Handbook, which was not looked up. The aerosol model
# CARMA, which was, has them within 0.0004 at 25 degC, and at 20 degC what the CRC Handbook has, within 0.0003.
DENSITIES = {"H2SO4": [(0.80, 1.7221), (0.85, 1.7735), (0.90, 1.8093), (0.95, 1.8286), (0.98, 1.8310)]}
# Mass fraction and J/(g*K) at 20 degC, from cal/(g*K) of the same: of HCl (9.09, 16.7 and 20 mol %) and HNO3 as in a copy of its page
# 2-184. That page goes on to NaOH (16.7 and 28.6 mol %) on another, which was not found.
CAPACITIES = {
    "HCl": [(w, c * CAL) for w, c in ((0.1683, 0.74), (0.2886, 0.631), (0.336, 0.591))],
    "HNO3": [(w / 10, c * CAL) for w, c in enumerate((0.9, 0.81, 0.73, 0.675, 0.65, 0.64, 0.615), 1)],
    "NaOH": [(0.3080, 0.80 * CAL), (0.4707, 0.784 * CAL)],
}
# Where the tables have heat capacities at another temperature, degC; and those that they have too little of.
MEASURED_AT = {"KCH3CO2": 35.5, "Na2HPO4": 39.5, "NaH2PO4": 39.5, "NaHSO4": 21, "CuSO4": 18, "CuCl2": 35, "LiNO3": 20}
NO_CAPACITY = {"FeCl2", "FeSO4", "Mg(CH3CO2)2"}
# What counts more, as a stock of the laboratory, or less, as it forms complexes.
DENSITY_WEIGHTS = {
    **dict.fromkeys(("HCl", "NaCl"), 6), **dict.fromkeys(("H2SO4", "NaOH", "KOH", "HNO3", "KCl", "CaCl2", "NH4Cl", "Na2CO3"), 4),
    **dict.fromkeys(("Zn(NO3)2", "ZnCl2", "NH4HCO3"), 0.3), **dict.fromkeys(("Pb(NO3)2", "Ca(NO3)2"), 0.5),
}
CAPACITY_WEIGHTS = {
    **dict.fromkeys(("HCl", "NaOH", "KOH", "NaCl"), 3), **dict.fromkeys(("HNO3", "H2SO4", "CaCl2", "KCl"), 2), **dict.fromkeys(MEASURED_AT, 0.3),
}
# Heat capacity of an ion among ions alone, where nothing else says it, J/(mol*K).
ALONE = 50
# Heat of solution at infinite dilution, and with so many mol of water, kJ/mol given off: Felder and Rousseau, table B.11, which was not
# looked up. What was read agrees. For NaOH: Koretsky, Engineering and Chemical Thermodynamics, table 6.1, as in the repository
# dollodart/chepy, within 0.04. For H2SO4: the same from 1 mol of water to 100 (its own zero is 3.0 off), within 0.02, and up to 3 mol
# Urbanski, Chemistry and Technology of Explosives, table 16, within 0.15. That of H2SO4 is to H+ and HSO4-.
HEATS = {
    "NaOH": (42.89, ((3, 28.87), (4, 34.43), (5, 37.74), (10, 42.51), (20, 42.84), (30, 42.72), (50, 42.51), (100, 42.34))),
    "H2SO4": (74.7, ((0, 0), (0.5, 15.73), (1, 28.07), (1.5, 36.9), (2, 41.92), (3, 48.99), (4, 54.06), (5, 58.03), (10, 67.03), (25, 72.3), (50, 73.34), (100, 73.97))),
}
# mol of water per mole with the heat of dilution to infinity, kJ/mol: CRC Handbook, enthalpy of dilution of acids (Parker, NSRDS-NBS 2,
# 1965), in a copy on the web; of HNO3 without water its heat of solution there. Koretsky, as above, has HNO3 within 0.5.
DILUTIONS = {
    "HCl": (
        (1, 45.61), (2.775, 19.87), (3.7, 15.4), (5.551, 10.24), (7.929, 7.217), (10, 5.841), (13.88, 4.402), (18.5, 3.506), (27.75, 2.623),
        (55.51, 1.695), (111, 1.172), (277.5, 0.761),
    ),
    "HNO3": (
        (0, 33.28), (1, 19.73), (2.775, 9.498), (3.7, 6.883), (5.551, 3.933), (7.929, 2.251), (10, 1.54), (13.88, 0.958), (18.5, 0.665),
        (27.75, 0.527), (55.51, 0.506),
    ),
}
# Heats of dilution by the equations of Pitzer: what is written into PHREEQC, how much of it a mole has, and the highest mol/kg. Koretsky,
# as above, has NaCl within 0.06; for the others nothing to compare them with was found.
PITZER = {
    "NaCl": (("Na", "Na+", 1), ("Cl", "Cl-", 1), 6), "KCl": (("K", "K+", 1), ("Cl", "Cl-", 1), 4.8), "CaCl2": (("Ca", "Ca+2", 1), ("Cl", "Cl-", 2), 6),
    "MgCl2": (("Mg", "Mg+2", 1), ("Cl", "Cl-", 2), 5), "Na2SO4": (("Na", "Na+", 2), ("S(6)", "SO4-2", 1), 3),
}
# The stocks of the laboratory, with what they may be off: density and heat capacity, %.
STOCKS = ("NaOH", "KOH", "H2SO4", "HCl", "HNO3", "NaCl", "KCl", "CaCl2", "NH4Cl", "Na2CO3")
DENSITY, CAPACITY = 1.0, 3.5


def library():
    """Properties of species with their first number."""
    text = LIBRARY.read_text(encoding="utf-8")
    bodies = re.finditer(r"^species (\S+) \{\n(.*?)\n\}", text, re.S | re.M)
    return {m[1]: {k: float(v) for k, v in re.findall(r"^    (\w+): (-?[\d.]+) ", m[2], re.M)} for m in bodies}


def laliberte():
    """Rows of the tables by formula, numbers where there are some."""
    # Found, not imported: only its table is needed.
    path = pathlib.Path(importlib.util.find_spec("chemicals").origin).parent / "Electrolytes" / "Laliberte2009.tsv"
    with path.open(encoding="utf-8") as file:
        rows = list(csv.reader(file, delimiter="\t"))[1:]
    number = lambda cell: float(cell) if re.fullmatch(r"-?[\d.]+(e-?\d+)?", cell, re.I) else None
    return {row[2]: [number(cell) for cell in row + [""] * 40] for row in rows}


def water_density(t):
    """g/mL of water at t degC, the formula of Laliberte."""
    top = ((((-2.8054253e-10 * t + 1.0556302e-7) * t - 4.6170461e-5) * t - 0.0079870401) * t + 16.945176) * t + 999.83952
    return top / (1 + 0.01687985 * t) / 1000


def densities(salt, row):
    """Mass fractions with g/mL at 25 degC."""
    c, t = row[4:9], 25
    points = []
    for w in np.linspace(0.02, 1, 25) * min(row[11], SATURATED.get(salt, 1)):
        apparent = (c[0] * w + c[1]) * math.exp(1e-6 * (t + c[4]) ** 2) / (w + c[2] + c[3] * t) / 1000
        points.append((w, 1 / ((1 - w) / water_density(t) + w / apparent)))
    return points + DENSITIES.get(salt, [])


def capacities(salt, row):
    """Mass fractions with J/(g*K)."""
    a, points = row[23:29], []
    if a[0] is not None and salt not in NO_CAPACITY:
        t = MEASURED_AT.get(salt, 25)
        for w in np.linspace(0.04, 1, 25) * row[31]:
            points.append((w, (1 - w) * 4.1813 + w * (a[0] * math.exp(a[1] * t + a[2] * math.exp(0.01 * t) + a[3] * w) + a[4] * w ** a[5])))
    return points + CAPACITIES.get(salt, [])


def pitzer(salt):
    """mol of water per mole with the heat of dilution to infinity, kJ/mol: from how osmotic and activity coefficients follow the temperature."""
    (cation, cation_is, n), (anion, anion_is, k), most = PITZER[salt]
    phreeqc = phreeqpython.PhreeqPython(database="pitzer.dat").ip

    def excess(m, t):
        phreeqc.run_string(
            f"SOLUTION 1\n temp {t}\n units mol/kgw\n {cation} {m * n:.12g}\n {anion} {m * k:.12g}\nSELECTED_OUTPUT\n -reset false\n"
            f'USER_PUNCH\n -headings o c a\n -start\n 10 PUNCH OSMOTIC, LG("{cation_is}"), LG("{anion_is}")\n -end\nEND\n'
        )
        osmotic, gc, ga = phreeqc.get_selected_output_array()[-1]
        return (n + k) * m * (1 - osmotic) + m * math.log(10) * (n * gc + k * ga)

    points = []
    for m in (0.1, 0.5, 1, 2, 3, 4, 4.8, 5, 6):
        if m <= most:
            points.append((1000 / WATER / m, -(298.15**2) * 8.314462618e-3 * (excess(m, 26) - excess(m, 24)) / 2 / m))
    return points


def fit(points, powers, ridge, prior=lambda ion: (0, 0, 0)):
    """Numbers of each ion, and the worst error of each salt with where it is; of points (salt, where, share, moles, off, scale, weight)."""
    shapes = (lambda x: x / (x + EARLY), lambda x: x, lambda x: x * x)[:powers]
    ions = sorted({ion for p in points for ion in SALTS[p[0]]})
    at = {ion: powers * i for i, ion in enumerate(ions)}
    rows = np.zeros((len(points), powers * len(ions)))
    for row, (salt, _, x, n, _, scale, _) in zip(rows, points):
        for ion, count in SALTS[salt].items():
            for i, shape in enumerate(shapes):
                row[at[ion] + i] = count * n * shape(x) / scale
    off = np.array([p[4] / p[5] for p in points])
    weight = np.array([p[6] for p in points])
    held = ridge * np.eye(rows.shape[1])
    wanted = np.concatenate([prior(ion)[:powers] for ion in ions])
    for i in range(powers):
        held[at["H+"] + i, at["H+"] + i], wanted[at["H+"] + i] = 1e3, 0
    numbers = np.linalg.lstsq(np.vstack([rows * weight[:, None], held]), np.concatenate([off * weight, held @ wanted]), rcond=None)[0]
    worst = {}
    for p, error in zip(points, rows @ numbers - off):
        if abs(error) > abs(worst.get(p[0], (0, 0))[0]):
            worst[p[0]] = (error, p[1])
    return {ion: numbers[at[ion] : at[ion] + powers] for ion in ions}, worst


def main():
    """Fits, prints, and judges the stocks."""
    known, tables = library(), laliberte()
    volumes, heats, enthalpies = [], [], []
    for salt, ions in SALTS.items():
        row, nu = tables[salt], sum(ions.values())
        plain = {p: sum(c * known[i][p] for i, c in ions.items()) for p in ("molar_volume", "heat_capacity")}
        for w, density in densities(salt, row):
            n, water = w / row[3], (1 - w) / WATER
            off = 1 / density - water * WATER_VOLUME - n * plain["molar_volume"]
            volumes.append((salt, w, nu * n / (nu * n + water), n, off, 1 / density, DENSITY_WEIGHTS.get(salt, 1)))
        for w, capacity in capacities(salt, row):
            n, water = w / row[3], (1 - w) / WATER
            off = capacity - water * WATER_CAPACITY - n * plain["heat_capacity"]
            heats.append((salt, w, nu * n / (nu * n + water), n, off, capacity, CAPACITY_WEIGHTS.get(salt, 1)))
        diluted = pitzer(salt) if salt in PITZER else DILUTIONS.get(salt) or [(n, HEATS[salt][0] - h) for n, h in HEATS.get(salt, (0, ()))[1]]
        enthalpies += [(salt, n, nu / (nu + n), 1, h, 1, 1) for n, h in diluted]
    part = lambda ion: ALONE - known[ion]["heat_capacity"]
    fits = [fit(volumes, 2, 3e-4), fit(heats, 2, 1e-4, lambda i: (0.7 * part(i), 0.3 * part(i), 0)), fit(enthalpies, 3, 1e-2)]
    for (numbers, _), name, unit, digits in zip(fits, ("volume", "capacity", "enthalpy"), ("mL/mol", "J/(mol*K)", "kJ/mol"), (1, 0, 1)):
        for ion, values in numbers.items():
            print(f"{ion:8} crowded_{name}: ({', '.join(f'{round(float(v), digits) + 0.0:g}' for v in values)}) {unit}")
    if "--species" in sys.argv:
        return 0
    print("\nworst errors: density, %; heat capacity, %; heat of dilution, kJ/mol")
    shown = lambda worst, salt, by: f"{by * worst[salt][0]:7.2f} at {worst[salt][1]:6.2f}" if salt in worst else " " * 17
    for salt in SALTS:
        print(f"{salt:12}", *(shown(worst, salt, by) for (_, worst), by in zip(fits, (100, 100, 1))))
    bad = [s for s in STOCKS if 100 * abs(fits[0][1][s][0]) > DENSITY or 100 * abs(fits[1][1].get(s, (0, 0))[0]) > CAPACITY]
    print("further off than told:", ", ".join(bad) or "none")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
