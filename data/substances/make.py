"""Writes stdlib/substances.mtx from list.csv, identifiers.csv, values.csv and water.csv beside it; refuses what does not agree.

    python3 data/substances/make.py            # writes the module, and `cas` into stdlib/species.mtx
    python3 data/substances/make.py --check    # says whether both are as it would write them

Needs nothing but Python 3.11. gather.py made the tables; SOURCES.md tells where they come from.
"""
import csv
import functools
import math
import re
import statistics
import sys
from pathlib import Path

HERE = Path(__file__).parent
LIBRARY = HERE.parent.parent / "stdlib"
MODULE = LIBRARY / "substances.mtx"
SPECIES = LIBRARY / "species.mtx"

UNITS = {
    "density": "g/mL", "heat_capacity": "J/(mol*K)", "melting_point": "degC", "boiling_point": "degC", "flash_point": "degC",
    "heat_of_vaporization": "kJ/mol", "solubility": "g/kg", "molar_volume": "mL/mol",
}
DIGITS = {"density": 4, "heat_capacity": 4, "heat_of_vaporization": 4, "solubility": 2, "molar_volume": 3}
ORDER = list(UNITS)
TEMPERATURES = {"melting_point", "boiling_point", "flash_point"}

# How far a second source may be off before it is said beside the value, and before the value is refused: in K, or as a share.
AGREES = {"density": 0.01, "heat_capacity": 0.04, "heat_of_vaporization": 0.03, "melting_point": 1.5, "boiling_point": 1.5, "flash_point": 8}
REFUSED = {"density": 0.06, "heat_capacity": 0.1, "heat_of_vaporization": 0.06, "melting_point": 5, "boiling_point": 5, "flash_point": 8}
# Of metals and oxides, which melt and boil far up, a share of the kelvins.
HIGH = {"agrees": 0.004, "refused": 0.012}

# Kopp's rule for solids, J/(mol*K) for each atom (Felder and Rousseau, Elementary Principles of Chemical Processes, table B.10).
KOPP = {"C": 7.5, "H": 9.6, "B": 11.3, "Si": 15.9, "O": 17, "F": 20.9, "P": 22.6, "S": 22.6}
KOPP_OTHER = 26

HAZARDS = {
    "X": "explosive", "F": "flammable", "O": "oxidising", "C": "corrosive", "T": "toxic", "I": "irritant", "H": "health_hazard",
    "E": "environment", "G": "gas_under_pressure",
}


def rows(name):
    with open(HERE / name, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def check_digit(cas):
    digits = [int(c) for c in cas.replace("-", "")]
    return re.fullmatch(r"\d{2,7}-\d\d-\d", cas) and sum(i * d for i, d in enumerate(digits[-2::-1], 1)) % 10 == digits[-1]


def atoms(formula):
    out = {}
    for part in formula.split("."):
        times, part = re.fullmatch(r"(\d*)(.*)", part).groups()
        stack = [out]
        for element, count, opens, closes in re.findall(r"([A-Z][a-z]?)(\d*)|(\()|\)(\d*)", part):
            if opens:
                stack.append({})
            elif element:
                stack[-1][element] = stack[-1].get(element, 0) + int(count or 1)
            else:
                inner = stack.pop()
                for e, n in inner.items():
                    stack[-1][e] = stack[-1].get(e, 0) + n * int(closes or 1)
        if times:
            raise ValueError(f"hydrates are not read: {formula}")
    return out


def shares(formula):
    """The atoms of a formula in the least whole numbers: P4O10 and P2O5 are one."""
    counts = atoms(formula)
    return {element: count // math.gcd(*counts.values()) for element, count in counts.items()}


def kopp(formula):
    return sum(KOPP.get(element, KOPP_OTHER) * count for element, count in atoms(formula).items())


@functools.cache
def liquids():
    """Measured heat capacities of liquids over those of Kopp's rule for solids, ascending."""
    known = {row["name"]: row for row in rows("identifiers.csv")}
    measured = [row for row in rows("values.csv") if row["property"] == "heat_capacity" and row["source"] != "fit"]
    found = [(known[row["name"]], float(row["value"])) for row in measured if row["name"] in known]
    return sorted(value / kopp(ids["formula"]) for ids, value in found if ids["phase"] == "liquid")


def liquid_factor():
    return round(statistics.median(liquids()), 2)


def shown(what, value):
    """A number with the digits that it deserves."""
    if what in TEMPERATURES:
        celsius = value - 273.15
        text = f"{celsius:.1f}" if abs(celsius) < 1000 else f"{celsius:.0f}"
        return re.sub(r"^-0\.0$", "0.0", text).removesuffix(".0")
    text = f"{value:.{DIGITS[what]}g}"
    return f"{float(text):.10f}".rstrip("0").rstrip(".") if "e" in text else text


class Row:
    """A value with its source, and what the second source makes of it."""

    def __init__(self, what, value, source, second=None):
        self.what, self.value, self.source, self.second = what, value, source, second

    def remark(self):
        if self.source in ("kopp", "fit", "gir", "aq", "aqs", "aqd", "aqa", "liq", "kol"):
            return ""
        if self.second is None:
            return " alone"
        off = abs(self.value - self.second)
        if self.what in TEMPERATURES:
            return f" within {math.ceil(off)} K" if off > max(AGREES[self.what], HIGH["agrees"] * self.value) else ""
        share = off / self.second
        return f" within {math.ceil(share * 100)} %" if share > AGREES[self.what] else ""

    def fault(self):
        if self.second is not None:
            off = abs(self.value - self.second)
            most = REFUSED[self.what] * (1 if self.what in TEMPERATURES else self.second)
            if off > max(most, HIGH["refused"] * self.value if self.what in TEMPERATURES else 0):
                return f"{self.value} and {self.second} disagree"
        return None

    def line(self):
        return f"    {self.what}: {shown(self.what, self.value)} {UNITS[self.what]}  // [{self.source}]{self.remark()}\n"


def faults_of(known, by, mass):
    """What is wrong with the numbers of one substance, in words."""
    at = {what: row.value for what, row in by.items()}
    for what, row in by.items():
        if row.fault():
            yield f"{what}: {row.fault()}"
    if "melting_point" in at and "boiling_point" in at and at["melting_point"] > at["boiling_point"]:
        yield "melts above where it boils"
    if "flash_point" in at and "boiling_point" in at and at["flash_point"] > at["boiling_point"]:
        yield "flashes above where it boils"
    if "density" in at and not 0.4 < at["density"] < 23:
        yield f"a density of {at['density']} g/mL"
    if "heat_capacity" in at and by["heat_capacity"].source != "aq" and not 0.1 < at["heat_capacity"] / mass < 4:
        yield f"a specific heat of {at['heat_capacity'] / mass} J/(g*K)"
    if "boiling_point" in at and (known["phase"] == "gas") != (at["boiling_point"] < 298.15):
        yield "its boiling point is not that of its phase"
    if "melting_point" in at and known["phase"] == "liquid" and at["melting_point"] > 300:
        yield "its melting point is not that of a liquid"


def masses():
    """Molar masses of elements, g/mol, from the library's own text in Rust."""
    text = (LIBRARY.parent / "lang/src/chem/elements.rs").read_text(encoding="utf-8")
    return {symbol: float(mass) for symbol, mass in re.findall(r'\("([A-Z][a-z]?)", Some\(([0-9.]+)', text)}


def substances():
    """The rows to write, by section; what is wrong stops it."""
    listed, known = rows("list.csv"), {row["name"]: row for row in rows("identifiers.csv")}
    values = {}
    for row in rows("values.csv"):
        second = float(row["second"]) if row["second"] else None
        values.setdefault(row["name"], {})[row["property"]] = Row(row["property"], float(row["value"]), row["source"], second)
    water = {row["name"]: row for row in rows("water.csv")}
    taken = set(re.findall(r"^species (\S+) ", SPECIES.read_text(encoding="utf-8"), re.M))
    explained = (HERE / "head.mtx").read_text(encoding="utf-8")
    weigh, wrong, seen, out, dropped = masses(), [], {}, [], []
    wrong += [f"{name}: is in water.csv and not in list.csv" for name in water.keys() - {row["name"] for row in listed}]
    for row in listed:
        name, ids, by = row["name"], known.get(row["name"]), values.get(row["name"], {})
        if ids is None:
            dropped.append(f"{name}: nothing known")
            continue
        if ids["phase"] != "gas" and "density" not in by:
            dropped.append(f"{name}: no density")
            continue
        mass = sum(weigh[element] * count for element, count in atoms(ids["formula"]).items())
        if ids["phase"] == "solid" and "heat_capacity" not in by:
            by["heat_capacity"] = Row("heat_capacity", float(f"{kopp(ids['formula']):.3g}"), "kopp")
        if ids["phase"] == "liquid" and "heat_capacity" not in by:
            by["heat_capacity"] = Row("heat_capacity", float(f"{liquid_factor() * kopp(ids['formula']):.3g}"), "kol")
        say = lambda text: wrong.append(f"{name}: {text}")
        if re.search(r"[+-]$", ids["formula"]):
            say(f"its formula has a charge: {ids['formula']}")
        for word in [name, *row["aliases"].split()]:
            # A name such as `Fe3O4` is a formula.
            if re.fullmatch(r"(?:[A-Z][a-z]?\d*)*\d(?:[A-Z][a-z]?\d*)*", word) and set(atoms(word)) <= set(weigh) and shares(word) != shares(ids["formula"]):
                say(f"`{word}` is not its formula: {ids['formula']}")
        for text in faults_of(ids, by, mass):
            say(text)
        for stated in by.values():
            if f"`[{stated.source}]`" not in explained:
                say(f"head.mtx does not explain `[{stated.source}]`")
        if not check_digit(row["cas"]):
            say("the check digit of its CAS number is wrong")
        for key in {row["cas"], ids["inchikey"], ids["smiles"]} - {""}:
            if key in seen:
                say(f"is {seen[key]}")
            seen[key] = name
        for word in [name, *row["aliases"].split()]:
            if word in taken:
                say(f"`{word}` is taken")
            if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", word):
                say(f"`{word}` is no name")
            taken.add(word)
        if ids["phase"] == "gas" and "G" not in row["hazards"] and "boiling_point" in by:
            say("a gas under pressure")
        if "flash_point" in by and by["flash_point"].value < 333 and "F" not in row["hazards"]:
            say(f"flashes at {by['flash_point'].value - 273.15:.0f} degC and is not said to be flammable")
        out.append((row, ids, by, water.get(name)))
    return out, dropped, wrong


def usual(row, formula):
    """A formula as its name or alias has it, `OsO4`, where that has the same atoms."""
    for word in [row["name"], *row["aliases"].split()]:
        if re.fullmatch(r"(?:[A-Z][a-z]?\d*)+", word):
            try:
                if atoms(word) == atoms(formula):
                    return word
            except ValueError:
                pass
    return formula


def entry(row, ids, by, water):
    """The text of a substance with its other names."""
    out = f"/// {row['title']}.\nspecies {row['name']} {{\n"
    if ids["smiles"]:
        smiles = ids["smiles"].replace("\\", "\\\\")
        out += f'    smiles: "{smiles}"\n'
    out += f'    formula: "{usual(row, ids["formula"])}"\n    cas: "{row["cas"]}"\n    phase: "{ids["phase"]}"\n'
    out += "".join(by[what].line() for what in ORDER if what in by)
    if water:
        out += "    reacts_with_water: true\n"
    if water and water["makes"]:
        out += f'    makes_with_water: "{water["makes"]}"\n'
    if row["groups"]:
        out += f"    reactive_groups: [{row['groups'].replace(' ', ', ')}]\n"
    if row["hazards"]:
        hazards = ", ".join(f'"{HAZARDS[letter]}"' for letter in row["hazards"])
        out += f"    hazards: [{hazards}]\n"
    out += "}\n"
    return out + "".join(f"\nspecies {alias} {{ same_as: {row['name']} }}\n" for alias in row["aliases"].split())


def percent(share):
    return f"{math.ceil(100 * share)} %"


def head(out):
    """The doc comment, with how good the estimates are."""
    good = {row["tag"]: row for row in rows("estimates.csv")}
    errors = sorted(
        abs(kopp(ids["formula"]) / by["heat_capacity"].value - 1)
        for _, ids, by, _ in out
        if ids["phase"] == "solid" and {"C", "H"} <= set(atoms(ids["formula"])) and by["heat_capacity"].source != "kopp"
    )
    off = sorted(abs(liquid_factor() / factor - 1) for factor in liquids())
    fills = {
        "WARMER_ERROR": percent(off[math.ceil(0.9 * len(off)) - 1]), "WARMER": f"{liquid_factor():.3g}", "POURED": str(len(off)),
        "FITTED_ERROR": percent(float(good["fit"]["nine_tenths"])), "FITTED_HALF": percent(float(good["fit"]["half"])),
        "FITTED": good["fit"]["known"], "DENSER_ERROR": percent(float(good["gir"]["nine_tenths"])),
        "SMALLER_ERROR": percent(float(good["liq"]["nine_tenths"])), "SMALLER": f"{float(good['liq']['factor']):.2g}", "BOILED": good["liq"]["known"],
        "DENSER": f"{float(good['gir']['factor']):.3g}", "KNOWN": good["gir"]["known"], "KOPPED": str(len(errors)),
        "KOPP_ERROR": percent(errors[math.ceil(0.9 * len(errors)) - 1]),
        "TYPED": str(sum(1 for row in rows("list.csv") if row["formula"])),
    }
    text = (HERE / "head.mtx").read_text(encoding="utf-8")
    return re.sub(r"\b(" + "|".join(fills) + r")\b", lambda m: fills[m[1]], text)


def module(out):
    """The text of the module."""
    text, section = head(out), None
    for row, ids, by, water in out:
        if row["section"] != section:
            section = row["section"]
            text += f"\n// ---- {section}\n"
        text += "\n" + entry(row, ids, by, water)
    return text


def with_cas(text):
    """std::species with the CAS numbers of cas.csv below the formulas."""
    text = re.sub(r'^    cas: "[^"]*"\n', "", text, flags=re.M)
    for row in rows("cas.csv"):
        if not check_digit(row["cas"]):
            raise ValueError(f"the check digit of {row['name']} is wrong")
        start = re.search(rf"^species {re.escape(row['name'])} \{{\n", text, re.M)
        line = re.compile(r'^    formula: "[^"]*"\n', re.M).search(text, start.end())
        text = f'{text[: line.end()]}    cas: "{row["cas"]}"\n{text[line.end() :]}'
    return text


def main():
    out, dropped, wrong = substances()
    for line in dropped:
        print(f"left out: {line}", file=sys.stderr)
    for line in wrong:
        print(f"wrong: {line}", file=sys.stderr)
    if wrong:
        return 1
    written = {MODULE: module(out), SPECIES: with_cas(SPECIES.read_text(encoding="utf-8"))}
    if "--check" in sys.argv:
        stale = [path.name for path, text in written.items() if path.read_text(encoding="utf-8") != text]
        print(f"not as written here: {', '.join(stale)}" if stale else "as written here")
        return 1 if stale else 0
    for path, text in written.items():
        path.write_text(text, encoding="utf-8")
    print(f"{len(out)} substances", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
