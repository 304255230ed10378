"""Compares water that comes to rest with carbon dioxide with PHREEQC.

    gases.py MATTERIXC FOLDER

needs phreeqpython. Water, lye and a slurry of calcite exchange gases with air and with carbon dioxide of 1 atm at 10 to 40 degC until nothing
changes any more. Compared are the pH and the dissolved carbon; the exit code is 1 where one is further off than it may be. There gases are made
ideal, ion pairs are left out, calcite follows van 't Hoff's law, and carbon dioxide has the activity coefficient that the library has from a
later database.
"""

import pathlib
import re
import subprocess
import sys

import phreeqpython

PH, SHARE = 0.01, 0.01
# What is in 100 g of water, mol, and the solid that may be there.
CASES = {
    "water": ({}, None), "lye": ({"NaOH": 1e-3}, None), "strong lye": ({"NaOH": 5e-3}, None), "salt": ({"NaCl": 10e-3}, None),
    "acid": ({"HCl": 1e-4}, None), "calcite": ({}, "Calcite"), "calcite in lye": ({"NaOH": 1e-3}, "Calcite"),
}

TEXT = """mtx 1
use std::gases
use std::glassware::Beaker250mL
asset Cup: Beaker250mL, GasExchange {{
    contents: {{ activities: debye_hueckel }}
    gases: [CO2(g)]
    pressures: [{pressure:.10g} Pa]
    exchange_rate: 1 1/s
}}
lab bench {{
    ambient: {celsius} degC
    cup = Cup at (0, 0, 0) m holding 100 g of water{holding}
}}
workflow look in bench {{
    wait 30 h
    note "pH {{acidity(cup.contents) :.6}} carbon {{(cup.contents.amount[CO2] + cup.contents.amount[HCO3-] + cup.contents.amount[CO3^2-]) as umol :.6}}"
}}
"""


def ours(program, folder, celsius, pressure, amounts, solid):
    holding = "".join(f" + {1e3 * amount:g} mmol of {name}" for name, amount in amounts.items())
    holding += " + 5 mmol of CaCO3" if solid else ""
    (folder / "case.mtx").write_text(TEXT.format(celsius=celsius, pressure=pressure, holding=holding))
    done = subprocess.run([program, "run", "case.mtx", "--no-cache"], cwd=folder, capture_output=True, text=True, timeout=600)
    found = re.search(r"pH (-?[\d.]+) carbon ([\d.]+)", done.stdout)
    if done.returncode or not found:
        raise SystemExit(f"{done.stdout}{done.stderr}\n{(folder / 'case.mtx').read_text()}")
    return float(found.group(1)), float(found.group(2)) * 1e-6


def theirs(engine, celsius, index, amounts, solid):
    solution = engine.add_solution({"units": "mol/kgw", "temp": celsius, "pH": "7 charge"})
    for name, amount in amounts.items():
        solution.add(name, 10 * amount, "mol")
    phases = ["CO2(g)"] + ([solid] if solid else [])
    solution.equalize(phases, to_si=[index] + ([0] if solid else []), in_phase=[10] + ([0.05] if solid else []))
    dissolved = ("CO2", "HCO3-", "CO3-2")
    return solution.pH, 0.1 * sum(solution.species.get(name, 0.0) for name in dissolved)


def main():
    program, folder = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    database = (pathlib.Path(phreeqpython.__file__).parent / "database" / "phreeqc.dat").read_text(encoding="latin1")
    database = re.sub(r"^\s*-T_c.*$", "", database, flags=re.M)
    database = re.sub(r"^(CO3-2 \+ 2 H\+ = CO2 \+ H2O.*)$", r"\1\n\t-gamma 0 0.066", database, flags=re.M)
    database = re.sub(r"^\S.*= (NaCO3-|NaHCO3|NaOH|CaCO3|CaHCO3\+|CaOH\+)\s*\n(?:[ \t].*\n)*", "", database, flags=re.M)
    database = re.sub(r"^Calcite\n(?:[ \t].*\n)*?\s*CaCO3 = .*\n(?:[ \t].*\n)*",
                      "Calcite\n\tCaCO3 = CO3-2 + Ca+2\n\t-log_k -8.45; -delta_h -3.15 kcal\n", database, flags=re.M)
    (folder / "phreeqc.dat").write_text(database, encoding="latin1")
    engine = phreeqpython.PhreeqPython(database="phreeqc.dat", database_directory=folder.resolve())
    worst, off = [0.0, 0.0], 0
    for celsius in (10, 25, 40):
        for index in (-3.38, 0.0):
            for name, (amounts, solid) in CASES.items():
                ph, carbon = ours(program, folder, celsius, 101325 * 10**index, amounts, solid)
                their_ph, their_carbon = theirs(engine, celsius, index, amounts, solid)
                gaps = [abs(ph - their_ph), abs(carbon / their_carbon - 1)]
                worst = [max(pair) for pair in zip(worst, gaps)]
                if gaps[0] > PH or gaps[1] > SHARE:
                    off += 1
                    print(f"{name} at {celsius} degC, index {index}: pH {ph:.4f}, theirs {their_ph:.4f}; "
                          f"carbon {carbon:.5g} mol, theirs {their_carbon:.5g} mol")
    print(f"{len(CASES) * 6 - off} of {len(CASES) * 6} cases agree; furthest off: pH {worst[0]:.4f}, carbon {100 * worst[1]:.2f} %")
    return 1 if off else 0


sys.exit(main())
