"""Compares the library's modules of equilibria with PHREEQC on mixtures drawn by a seed: the same constants, written as a database of PHREEQC, and
Davies' law of activity.

    equilibria_data.py MATTERIXC FOLDER [CASES [SEED [PREFIX]]]

needs phreeqpython. PREFIX is `std::` where it is left out; modules of one's own beside the cases are used with an empty one. Each case puts
acids, bases, salts and ligands into water at some temperature. Compared are the pH and every dissolved species above a trace. The exit code is 1
where one is further off than it may be.
"""

import csv
import math
import pathlib
import random
import re
import subprocess
import sys

import phreeqpython

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "stdlib" / "data"))
import equilibria as data  # noqa: E402

MODULES = ["equilibria", "buffers", "acids", "metals", "complexes", "solids"]
STRONGEST, TRACE, PH, SHARE = 0.5, 1e-10, 0.01, 0.01
# What is put in: species of the library, all that splits into ions.
REAGENTS = [
    "HCl", "NaOH", "NaCl", "KCl", "acetic_acid", "sodium_acetate", "citric_acid", "sodium_citrate_dihydrate", "oxalic_acid_dihydrate",
    "potassium_hydrogen_phthalate", "borax", "boric_acid", "tris", "tris_HCl", "HEPES", "MES", "PIPES", "bicine", "glycine", "imidazole",
    "succinic_acid", "histidine", "lactic_acid", "malic_acid", "benzoic_acid", "methylamine", "ethanolamine", "alanine", "glutamic_acid",
    "NH3", "NH4Cl", "NaHCO3", "Na2CO3", "H3PO4", "tripotassium_phosphate", "sodium_fluoride", "potassium_chromate", "sodium_sulfite",
    "EDTA_disodium_dihydrate", "sodium_thiosulfate_pentahydrate", "ethylenediamine", "CuSO4", "calcium_chloride_dihydrate",
    "magnesium_sulfate_heptahydrate", "zinc_nitrate_hexahydrate", "iron_III_nitrate_nonahydrate", "aluminium_nitrate_nonahydrate",
    "nickel_chloride_hexahydrate", "cobalt_II_nitrate_hexahydrate", "manganese_II_chloride_tetrahydrate", "AgNO3",
    "potassium_sodium_tartrate_tetrahydrate",
]


def log_k(row, kelvin):
    """log10 of the constant of an equation at a temperature, as the library reckons it."""
    if row["kind"] == "solubility" and len(data.solid_of(row)[2]) == 1:
        return data.dissolving(row)[0] - float(row["enthalpy"] or 0) * 1e3 / data.R_LN10 * (1 / kelvin - 1 / data.T0)
    if row["analytic"] or row["capacity"] or row["kind"] == "solubility":
        if row["analytic"]:
            a = [float(x) for x in row["analytic"].split()]
        else:
            a = data.crystallising(row)[0] if row["kind"] == "solubility" else data.analytic(row)
        a = a + [0.0] * (6 - len(a))
        return a[0] + a[1] * kelvin + a[2] / kelvin + a[3] * math.log10(kelvin) + a[4] / kelvin**2 + a[5] * kelvin**2
    sign = -1 if row["kind"] in ("pka", "pksp") else 1
    enthalpy = float(row["enthalpy"] or 0) * 1e3
    return sign * float(row["value"]) - enthalpy / data.R_LN10 * (1 / kelvin - 1 / data.T0)


def is_solid(row):
    """Whether an equilibrium is that of a pure solid."""
    return row["kind"] in ("pksp", "solubility") or "(s)" in row["equation"]


class Database:
    """The equilibria as species of PHREEQC: each one that none defines is an element of its own."""

    def __init__(self, rows, ions):
        self.formulas, self.rows, self.defined = data.formulas(), rows, {}
        self.solids = []
        for row in rows:
            numbers = data.sides(row["equation"])
            if is_solid(row):
                self.solids.append((row, numbers))
                continue
            if row["name"] == "water_splits":
                continue
            side = -1 if row["kind"] == "pka" else 1
            first = next(name for name, count in numbers.items() if count * side > 0 and name not in ("water", "H+", "OH-"))
            self.defined[first] = (row, numbers)
        names = {name for row in rows for name, count in data.sides(row["equation"]).items() if count > 0 or not is_solid(row) or name == "H+"}
        names |= ions
        masters = sorted(names - set(self.defined) - {"water", "H+", "OH-"})
        letters = "abcdefghijklmnopqrstuvwxyz"
        self.element = {name: f"X{letters[i // 26]}{letters[i % 26]}" for i, name in enumerate(masters)}
        self.parts = {"H+": {"H": 1}, "water": {"H": 2, "O": 1}, "OH-": {"H": 1, "O": 1}}
        for name in masters:
            atoms = data.elements(self.formulas[name])
            self.parts[name] = {self.element[name]: 1, "O": atoms.get("O", 0), "H": atoms.get("H", 0)}

    def composition(self, name):
        """Of what elements a species is: those of its equation."""
        if name not in self.parts:
            _, numbers = self.defined[name]
            found = {}
            for other, count in numbers.items():
                if other != name:
                    for element, number in self.composition(other).items():
                        found[element] = found.get(element, 0) - number * count / numbers[name]
            self.parts[name] = {element: round(number) for element, number in found.items()}
        return self.parts[name]

    def formula(self, name):
        if name in ("H+", "OH-"):
            return name
        if name == "water":
            return "H2O"
        charge = data.elements(self.formulas[name])["charge"]
        text = "".join(f"{element}{number}" for element, number in sorted(self.composition(name).items()) if number)
        return text + (f"{charge:+d}" if charge else "")

    def text(self, kelvin):
        lines = ["SOLUTION_MASTER_SPECIES", "H H+ -1 H 1.008", "H(0) H2 0 H", "H(1) H+ -1 0", "E e- 0 0 0", "O H2O 0 O 16", "O(0) O2 0 O",
                 "O(-2) H2O 0 0"]
        lines += [f"{element} {self.formula(name)} 0 1 100" for name, element in self.element.items()]
        lines += ["SOLUTION_SPECIES", "H+ = H+", "e- = e-", "H2O = H2O", "2 H2O = O2 + 4 H+ + 4 e-\n log_k -86.08", "2 H+ + 2 e- = H2\n log_k -3.15"]
        lines += [f"{self.formula(name)} = {self.formula(name)}" for name in self.element]
        water = next(row for row in self.rows if row["name"] == "water_splits")
        lines.append(f"H2O = OH- + H+\n log_k {log_k(water, kelvin)}")
        for name, (row, numbers) in self.defined.items():
            factor = 1 / numbers[name]
            terms = {other: -count * factor for other, count in numbers.items() if other != name}
            left = " + ".join(f"{count:g} {self.formula(other)}" for other, count in terms.items() if count > 0)
            right = " + ".join([self.formula(name)] + [f"{-count:g} {self.formula(other)}" for other, count in terms.items() if count < 0])
            lines.append(f"{left} = {right}\n log_k {log_k(row, kelvin) * factor}")
        lines.append("PHASES")
        for row, numbers in self.solids:
            total = {}
            for name, count in numbers.items():
                for element, number in (self.composition(name) if not is_left(name, numbers) else {}).items():
                    total[element] = total.get(element, 0) + number * count
            formula = "".join(f"{element}{number}" for element, number in sorted(total.items()) if number > 0)
            sides = [" + ".join([start] * bool(start) + [f"{abs(count):g} {self.formula(name)}" for name, count in numbers.items()
                                 if count * sign > 0 and not is_left(name, numbers)]) for sign, start in ((-1, formula), (1, ""))]
            lines.append(f"{row['name']}\n {sides[0]} = {sides[1]}\n log_k {log_k(row, kelvin)}")
        return "\n".join(lines + ["END", ""])


def is_left(name, numbers):
    """Whether a species is the solid of an equation."""
    return numbers[name] < 0 and name not in ("H+", "water")


def reagents():
    """What each reagent splits into."""
    text = (ROOT / "stdlib" / "species.mtx").read_text(encoding="utf8")
    found = dict(re.findall(r"^species (\S+) \{\n(?:(?!^\}).*\n)*?    dissolves: (.*)$", text, re.M))
    found.update({row["name"]: row["dissolves"] for row in data.table("species.csv") if row["dissolves"]})
    return {name: {key: count for key, count in data.sides("x <-> " + found[name]).items() if key != "x"} if name in found else {name: 1}
            for name in REAGENTS}


def case_text(amounts, celsius, prefix):
    holding = " + ".join(["100 g of water"] + [f"{amount * 100:.8g} mmol of {name}" for name, amount in amounts.items()])
    uses = "\n".join(f"use {prefix}{name}" for name in [*MODULES, "salts"])
    return f"""mtx 1
{uses}
use std::glassware::Beaker250mL
lab bench {{
    ambient: {celsius} degC
    cup = Beaker250mL at (0, 0, 0) m holding {holding} at {celsius} degC
}}
workflow look in bench {{
    wait 1 ms
    note "pH {{acidity(cup.contents) :.6}} I {{settled_strength(cup.contents, 0) :.6}}"
}}
"""


def ours(program, folder, number, text, prefix):
    file = folder / f"case{number}.mtx"
    file.write_text(text)
    out = folder / f"out{number}"
    done = subprocess.run([program, "run", file.name, "--no-cache", "--csv", "--out", out.name], cwd=folder, capture_output=True, text=True)
    found = re.search(r"pH (-?[\d.]+) I ([\d.]+)", done.stdout)
    if done.returncode or not found:
        raise SystemExit(f"case {number}: {done.stdout}{done.stderr}\n{text}")
    with open(out / "states.csv") as file:
        last = list(csv.DictReader(file))[-1]
    there = {key: re.match(r"cup\.contents\.amount\[(.*?)\]", key) for key in last if ".put" not in key}
    amounts = {m.group(1): 1e-3 * float(last[key]) for key, m in there.items() if m and last[key]}
    return float(found.group(1)), float(found.group(2)), amounts


def theirs(engine, database, put, celsius, names):
    """pH and molalities of the same mixture."""
    lines = [f"SOLUTION 1\n temp {celsius}\n pH 7 charge\n -water 1", "REACTION 1"]
    for parts, amount in put:
        total = {}
        for name, count in parts.items():
            for element, number in database.composition(name).items():
                total[element] = total.get(element, 0) + number * count
        lines.append(" " + "".join(f"{element}{number}" for element, number in sorted(total.items()) if number) + f" {amount:.10g}")
    lines += [" 1", "EQUILIBRIUM_PHASES 1"] + [f" {row['name']} 0 0" for row, _ in database.solids]
    lines += ["SELECTED_OUTPUT 1", " -reset false", "USER_PUNCH 1", " -headings ph w " + " ".join(f"s{i}" for i in range(len(names)))]
    lines += [' 10 PUNCH -LA("H+")', ' 20 PUNCH TOT("water")']
    lines += [f' {30 + i} PUNCH MOL("{database.formula(name)}")' for i, name in enumerate(names)]
    engine.ip.run_string("\n".join(lines + ["END", ""]))
    last = engine.ip.get_selected_output_array()[-1]
    return float(last[0]), {name: float(value) * float(last[1]) for name, value in zip(names, last[2:])}


def main():
    program, folder = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 100
    rng = random.Random(int(sys.argv[4]) if len(sys.argv) > 4 else 1)
    prefix = sys.argv[5] if len(sys.argv) > 5 else "std::"
    folder.mkdir(parents=True, exist_ok=True)
    rows = [row for row in data.table("equilibria.csv") if row["module"] in MODULES]
    split = reagents()
    ions = {ion for parts in split.values() for ion in parts} - {"water", "H+", "OH-"}
    known = {name for row in rows for name, count in data.sides(row["equation"]).items() if not (is_solid(row) and count < 0)}
    database = Database(rows, {ion for ion in ions if ion not in known})
    names = [name for name in sorted(known | ions) if name not in ("water", "H+")]
    worst, off, compared, left = {"pH": 0.0, "species": 0.0}, 0, 0, 0
    for number in range(count):
        chosen = rng.sample(REAGENTS, rng.randint(2, 6))
        amounts = {name: float(f"{10 ** rng.uniform(-4, -1.3):.4g}") for name in chosen}
        celsius = round(rng.uniform(5, 55), 1)
        ph, strength, here = ours(program, folder, number, case_text(amounts, celsius, prefix), prefix)
        if strength > STRONGEST:
            left += 1
            continue
        (folder / "library.dat").write_text(database.text(celsius + 273.15))
        engine = phreeqpython.PhreeqPython(database="library.dat", database_directory=folder)
        their_ph, there = theirs(engine, database, [(split[name], amount) for name, amount in amounts.items()], celsius, names)
        complaints = [f"pH {ph:.4f}, theirs {their_ph:.4f}"] if abs(ph - their_ph) > PH else []
        worst["pH"] = max(worst["pH"], abs(ph - their_ph))
        for name, amount in there.items():
            if amount > TRACE and name in here:
                compared += 1
                share = abs(10 * here[name] - amount) / amount
                worst["species"] = max(worst["species"], share)
                if share > SHARE:
                    complaints.append(f"{name}: {10 * here[name]:.5g}, theirs {amount:.5g} mol")
        if complaints:
            off += 1
            print(f"case {number}: {amounts}, {celsius} degC: " + "; ".join(complaints[:6]))
    print(f"{count - left - off} of {count - left} cases agree; {left} are above an ionic strength of {STRONGEST} mol/kg")
    print(f"{compared} amounts compared; furthest off: pH {worst['pH']:.4f}, species {100 * worst['species']:.2f} %")
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main())
