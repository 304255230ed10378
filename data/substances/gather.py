"""Looks up what is known of the substances of list.csv, and keeps of each property one value with a second one to check it by.

Writes identifiers.csv, values.csv and estimates.csv, from which make.py writes the module. Run it only to add substances or sources:

    python3 -m venv venv && venv/bin/pip install chemicals==1.5.2 rdkit==2026.9.1
    venv/bin/python gather.py --aqsol curated-solubility-dataset.csv --sets data/ --obigt OBIGT/

AqSolDB is at doi 10.7910/DVN/OVHAW8, the sets that it was curated from beside its code (mcsorkun/AqSolDB, `data/`); OBIGT is `inst/extdata/OBIGT` of CHNOSZ 2.2.0. SOURCES.md tells the terms of each source.
"""
import argparse
import csv
import json
import math
import re
import statistics
import sys
import xml.etree.ElementTree
from pathlib import Path

import chemicals
import numpy
from chemicals.dippr import EQ100, EQ105, EQ106, EQ114
from chemicals.heat_capacity import Zabransky_cubic, Zabransky_quasi_polynomial
from rdkit import Chem, RDLogger
from rdkit.Chem import rdMolDescriptors

RDLogger.DisableLog("rdApp.*")
HERE = Path(__file__).parent
TABLES = Path(chemicals.__file__).parent
ROOM = 298.15
R = 8.31446261815324
TABLE = Chem.GetPeriodicTable()
# Solids without molecules: a structure of bonds says nothing of them.
WITHOUT_STRUCTURE = {"oxides", "carbides, nitrides, sulfides and such"}

# Sources that draw on one another count as one: agreement among them proves nothing.
FAMILY = {"chs": "dippr", "per": "dippr", "nfp": "iec"}

# property: how far a second source may be off (absolute, relative), and which source is preferred where it is.
RULES = {
    "melting_point": ((1.5, 0.004), ["onm", "wik", "crc", "nist", "cas", "chs"]),
    "boiling_point": ((1.5, 0.004), ["wik", "crc", "nist", "cas", "chs"]),
    "flash_point": ((8.0, 0.0), ["wik", "iec", "nfp", "ser"]),
    "heat_capacity": ((0.0, 0.04), ["crc", "zab", "chs", "per", "pol", "jan", "obg", "p51"]),
    "heat_of_vaporization": ((0.0, 0.03), ["crc", "chs", "per", "vdi"]),
    "solid_density": ((0.0, 0.03), ["crc", "cas", "obg"]),
}
# Where no second source is so near, one up to this far off is said beside the value; beyond, the value is left out.
WIDER = {
    "melting_point": (5.0, 0.012), "boiling_point": (5.0, 0.012), "heat_capacity": (0.0, 0.1),
    "heat_of_vaporization": (0.0, 0.06), "solid_density": (0.0, 0.06),
}
# How far values of AqSolDB's sets may be from their median, in log10, and how far above it one of them may stray.
SETS_AGREE, SETS_STRAY = 0.1, 1.0
# An open source is preferred to the handbook only where both say the same to this.
SAME = {"melting_point": 0.35, "boiling_point": 0.35, "flash_point": 1.2}


def rows(path, **how):
    """Rows of a table as dictionaries."""
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, **how))


def table(path, key="CAS", dashed=True):
    """Rows of a table of chemicals by CAS number; the last of several rows is dropped for the first."""
    out = {}
    for row in rows(TABLES / path, delimiter="\t", quoting=csv.QUOTE_NONE):
        cas = row[key]
        if not dashed and cas:
            cas = f"{cas[:-3]}-{cas[-3:-1]}-{cas[-1]}"
        out.setdefault(cas, row)
    return out


def number(row, column):
    """A number of a row, or None."""
    try:
        value = float(row[column])
    except (KeyError, TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None


def check_digit(cas):
    digits = [int(c) for c in cas.replace("-", "")]
    return sum(i * d for i, d in enumerate(digits[-2::-1], 1)) % 10 == digits[-1]


def identifiers(wanted):
    """Lines of the PubChem identifiers of chemicals for CAS numbers: cas -> fields. Later files are more specific."""
    found = {}
    for name in ["pubchem large", "pubchem small", "example user db"]:
        with open(TABLES / f"Identifiers/chemical identifiers {name}.tsv", encoding="utf-8") as file:
            for line in file:
                fields = line.rstrip("\n").split("\t")
                if len(fields) > 6 and fields[1] in wanted:
                    found[fields[1]] = fields
    with open(TABLES / "Identifiers/Inorganic db.tsv", encoding="utf-8") as file:
        for line in file:
            fields = line.rstrip("\n").split("\t")
            if len(fields) > 6 and fields[1] in wanted:
                found.setdefault(fields[1], fields)
    return found


def plain(name):
    """A name without its capitals, blanks and signs."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def read_formula(text):
    out = {}

    def walk(part, times):
        at = 0
        while at < len(part):
            if part[at] == "(":
                depth, end = 1, at + 1
                while depth:
                    depth += {"(": 1, ")": -1}.get(part[end], 0)
                    end += 1
                count = re.match(r"\d*", part[end:]).group()
                walk(part[at + 1 : end - 1], times * int(count or 1))
                at = end + len(count)
            else:
                m = re.match(r"([A-Z][a-z]?)(\d*)", part[at:])
                out[m[1]] = out.get(m[1], 0) + times * int(m[2] or 1)
                at += m.end()

    for part in re.split(r"[.*]", re.sub(r"[+-]\d*$", "", text)):
        walk(part, 1)
    return out


class Sources:
    """The tables, by CAS number."""

    def __init__(self, args):
        self.organic = table("Misc/Physical Constants of Organic Compounds.csv")
        self.inorganic = table("Misc/Physical Constants of Inorganic Compounds.csv")
        self.thermo = table("Heat Capacity/CRC Standard Thermodynamic Properties of Chemical Substances.tsv")
        self.notebook = table("Phase Change/OpenNotebook Melting Points.tsv")
        self.webbook = table("Misc/webbook_constants.tsv", dashed=False)
        self.wikidata = table("Misc/wikidata_properties.tsv", dashed=False)
        self.common = table("Misc/common_chemistry_data.tsv", dashed=False)
        self.perry = table("Density/Perry Parameters 105.tsv")
        self.vdi = table("Density/VDI PPDS Density of Saturated Liquids.tsv")
        self.vdi_heat = table("Phase Change/VDI PPDS Enthalpies of vaporization.tsv")
        self.perry_heat = table("Phase Change/Table 2-150 Heats of Vaporization of Inorganic and Organic Liquids.tsv")
        self.crc_heat = table("Phase Change/CRC Handbook Heat of Vaporization.tsv")
        self.perry_cp = table("Heat Capacity/Perry_Table_2-153_DIPPR_100.tsv")
        self.poling = table("Heat Capacity/PolingDatabank.tsv")
        self.janaf = table("Reactions/JANAF_1998.tsv")
        self.solids = json.loads((TABLES / "Heat Capacity/JANAF_1998_solid_Cp.json").read_text())
        self.shomate = json.loads((TABLES / "Heat Capacity/webbook_shomate_coefficients.json").read_text())
        self.iec = table("Safety/IS IEC 60079-20-1 2010.tsv")
        self.nfpa = table("Safety/NFPA 497 2008.tsv")
        self.serat = table("Safety/DIPPR T_flash Serat.csv")
        self.carcinogens = table("Safety/IARC Carcinogen Database.tsv")
        solids = rows(TABLES / "Heat Capacity/Perrys Table 2-151.tsv", delimiter="\t", quoting=csv.QUOTE_NONE)
        self.perry_solids = {}
        for row in solids:
            if (row["main phase"] or "").strip() == "c" and in_range(row, ROOM):
                self.perry_solids.setdefault(row["Ful CAS"], row)
        self.zabransky = {}
        for row in rows(TABLES / "Heat Capacity/Zabransky.tsv", delimiter="\t", quoting=csv.QUOTE_NONE):
            self.zabransky.setdefault(row["CASRN"], []).append(row)
        self.chemsep = {}
        text = (TABLES / "Misc/ChemSep8.32.xml").read_bytes()
        for compound in xml.etree.ElementTree.fromstring(text).iter("compound"):
            cas = compound.find("CAS")
            if cas is not None:
                self.chemsep[cas.get("value")] = compound
        self.aqsol = {row["InChIKey"]: row for row in aqsol(args.aqsol)}
        self.sets = {}
        for path in sorted(args.sets.glob("dataset-*.csv")):
            for row in rows(path):
                self.sets.setdefault(row["InChIKey"], []).append(float(row["Solubility"]))
        self.obigt = {}
        for name in ["organic_liq", "organic_cr", "inorganic_cr", "organic_aq", "inorganic_aq"]:
            for row in rows(args.obigt / f"{name}.csv"):
                kind = name.split("_")[1]
                if kind == "cr" and row["state"] != "cr":
                    continue
                self.obigt.setdefault((kind, plain(row["name"])), row)
                self.obigt.setdefault((kind, plain(re.sub("^n-", "", row["name"]))), row)


def aqsol(path):
    """AqSolDB, of which copies without a head line go about."""
    head = "ID Name InChI InChIKey SMILES Solubility SD Occurrences Group".split()
    with open(path, encoding="utf-8", newline="") as file:
        for row in csv.reader(file):
            if row[0] != "ID":
                yield dict(zip(head, row))


def chemsep(compound, tag, temperature, critical=None):
    """A property of ChemSep at a temperature, in its units; None outside its range."""
    node = compound.find(tag)
    if node is None:
        return None
    of = {child.tag: float(child.get("value")) for child in node if child.get("value")}
    if not of.get("Tmin", 0) - 1 <= temperature <= of.get("Tmax", 1e9) + 1:
        return None
    a, b, c, d, e = (of.get(letter, 0.0) for letter in "ABCDE")
    try:
        match int(of["eqno"]):
            case 16:
                return a + math.exp(b / temperature + c + d * temperature + e * temperature**2)
            case 100:
                return EQ100(temperature, a, b, c, d, e)
            case 105:
                return EQ105(temperature, a, b, c, d)
            case 106:
                return EQ106(temperature, critical, a, b, c, d, e)
            case 114:
                return EQ114(temperature, critical, a, b, c, d)
    except (OverflowError, ZeroDivisionError, ValueError):
        pass
    return None


def value_of(compound, tag):
    node = compound.find(tag)
    return None if node is None else float(node.get("value"))


def in_range(row, temperature):
    least, most = number(row, "Tmin"), number(row, "Tmax")
    return (least is None or least - 1 <= temperature) and (most is None or temperature <= most + 1)


def liquid_densities(of, cas, mass, temperature):
    """Densities of the saturated liquid in g/mL by the equations of several sources."""
    out = {}
    row = of.perry.get(cas)
    if row and in_range(row, temperature):
        c1, c2, c3, c4 = (number(row, f"C{i}") for i in range(1, 5))
        # The table of chemicals has it in mol/m3.
        out["per"] = EQ105(temperature, c1, c2, c3, c4) * mass / 1e6
    row = of.vdi.get(cas)
    if row and temperature < number(row, "Tc"):
        tau = 1 - temperature / number(row, "Tc")
        terms = zip("ABCD", (0.35, 2 / 3, 1, 4 / 3))
        out["vdi"] = (number(row, "rhoc") + sum(number(row, x) * tau**p for x, p in terms)) / 1000
    compound = of.chemsep.get(cas)
    if compound is not None:
        critical = value_of(compound, "CriticalTemperature")
        value = chemsep(compound, "LiquidDensity", temperature, critical)
        if value:
            out["chs"] = value * mass / 1000
    return {source: value for source, value in out.items() if value and value > 0.3}


def volume_boiling(of, known, given):
    """Molar volume in mL/mol of a gas as a liquid at its boiling point."""
    name, cas, formula = known[:3]
    if (name, "boiling_point") not in given:
        return None
    density = liquid_densities(of, cas, mass_of(formula), float(given[name, "boiling_point"][2])).get("per")
    return mass_of(formula) / density if density else None


def liquid_capacities(of, cas, names, mass):
    """Heat capacities of the liquid at 25 degC in J/(mol*K)."""
    out = {"crc": number(of.thermo.get(cas, {}), "Cpl"), "pol": number(of.poling.get(cas, {}), "Cpl")}
    out["jan"] = number(of.janaf.get(cas, {}), "Cpl")
    row = of.perry_cp.get(cas)
    if row and in_range(row, ROOM):
        out["per"] = EQ100(ROOM, *(number(row, x) for x in "ABCDE")) / 1000
    fitting = [r for r in of.zabransky.get(cas, []) if in_range(r, ROOM)]
    fitting.sort(key=lambda r: (r["Data Type"] != "p", len(r["Uncertainty"])))
    if fitting:
        row = fitting[0]
        if number(row, "A1-spline") or number(row, "A2-spline"):
            out["zab"] = Zabransky_cubic(ROOM, *(number(row, f"A{i}-spline") for i in range(1, 5)))
        else:
            a = [number(row, f"A{i}-quasi") for i in range(1, 7)]
            out["zab"] = Zabransky_quasi_polynomial(ROOM, number(row, "Tc"), *a)
    compound = of.chemsep.get(cas)
    if compound is not None:
        value = chemsep(compound, "LiquidHeatCapacityCp", ROOM, value_of(compound, "CriticalTemperature"))
        out["chs"] = value and value / 1000
    row = obigt(of, "liq", names)
    if row and number(row, "Cp"):
        out["obg"] = number(row, "Cp") * (4.184 if row["E_units"] == "cal" else 1)
    return out


def obigt(of, kind, names):
    """The row of OBIGT under one of the names whose formula is that of the first."""
    formula, names = names[0], names[1:]
    for name in names:
        row = of.obigt.get((kind, plain(name)))
        if row and not re.search(r"[+-]", row["formula"]) and read_formula(row["formula"]) == formula:
            return row
    return None


def candidates(of, substance, known):
    """Values of each property by source, in the units of values.csv."""
    cas, names, phase, mass, key = substance["cas"], known["names"], known["phase"], known["mass"], known["inchikey"]
    crc = of.organic.get(cas) or of.inorganic.get(cas) or {}
    web, wiki, common = of.webbook.get(cas, {}), of.wikidata.get(cas, {}), of.common.get(cas, {})
    compound = of.chemsep.get(cas)
    out = {
        "melting_point": {
            "crc": number(crc, "Tm"), "onm": number(of.notebook.get(cas, {}), "Tm"), "wik": number(wiki, "Tm"),
            "nist": number(web, "Tm"), "cas": number(common, "Tm"),
            "chs": compound is not None and value_of(compound, "NormalMeltingPointTemperature") or None,
        },
        "boiling_point": {
            "crc": number(crc, "Tb"), "wik": number(wiki, "Tb"), "nist": number(web, "Tb"), "cas": number(common, "Tb"),
            "chs": compound is not None and value_of(compound, "NormalBoilingPointTemperature") or None,
        },
        "flash_point": {
            "wik": number(wiki, "T_flash"), "iec": number(of.iec.get(cas, {}), "T_flash"),
            "nfp": number(of.nfpa.get(cas, {}), "T_flash"), "ser": number(of.serat.get(cas, {}), "T_flash"),
        },
    }
    boiling = number(crc, "Tb") or number(web, "Tb") or number(common, "Tb")
    if boiling and phase == "liquid":
        heats = {"crc": number(of.crc_heat.get(cas, {}), "HvapTb")}
        heats["crc"] = heats["crc"] and heats["crc"] / 1000
        row = of.perry_heat.get(cas)
        if row and in_range(row, boiling):
            heats["per"] = EQ106(boiling, number(row, "Tc"), *(number(row, f"C{i}") for i in range(1, 5))) / 1000
        row = of.vdi_heat.get(cas)
        if row and boiling < number(row, "Tc"):
            tau = 1 - boiling / number(row, "Tc")
            terms = zip("ABCDE", (1 / 3, 2 / 3, 1, 2, 6))
            heats["vdi"] = R * number(row, "Tc") * sum(number(row, x) * tau**p for x, p in terms) / 1000
        if compound is not None:
            value = chemsep(compound, "HeatOfVaporization", boiling, value_of(compound, "CriticalTemperature"))
            heats["chs"] = value and value / 1e6
        out["heat_of_vaporization"] = heats
    if phase == "liquid":
        out["heat_capacity"] = liquid_capacities(of, cas, names, mass)
        rho = number(crc, "rho")
        out["density"] = {
            "crc": rho and rho / 1000,
            "cas": number(common, "Vml") and mass / number(common, "Vml") / 1e6,
            "atoms": by_atoms(known["mol"], mass),
            "25": liquid_densities(of, cas, mass, ROOM),
            "20": liquid_densities(of, cas, mass, 293.15),
        }
        row = obigt(of, "liq", names)
        if row and number(row, "V"):
            out["density"]["25"]["obg"] = mass / number(row, "V")
    if phase == "solid":
        capacity = {"crc": number(of.thermo.get(cas, {}), "Cps")}
        row = of.perry_solids.get(cas)
        if row and in_range(row, ROOM) and not known["organic"]:
            a, b, c, d = (number(row, x) or 0 for x in ("Constant Term", "+*T term", "/T^2 term", "*T^2 term"))
            capacity["p51"] = (a + b * ROOM + c / ROOM**2 + d * ROOM**2) * 4.184
        known_at, shomate = of.solids.get(cas), (of.shomate.get(cas) or [None])[0]
        if known_at:
            capacity["jan"] = dict(zip(*known_at)).get(ROOM)
        elif shomate:
            least, _, a, b, c, d, e = shomate[0]
            if least <= ROOM + 1:
                capacity["jan"] = a + b * ROOM + c * ROOM**2 + d * ROOM**3 + e / ROOM**2
        row = obigt(of, "cr", names)
        if row and number(row, "Cp"):
            capacity["obg"] = number(row, "Cp") * (4.184 if row["E_units"] == "cal" else 1)
        rho = number(crc, "rho")
        solid = {"crc": rho and rho / 1000, "cas": number(common, "Vms") and mass / number(common, "Vms") / 1e6}
        if row and number(row, "V"):
            solid["obg"] = mass / number(row, "V")
        out["heat_capacity"], out["solid_density"] = capacity, solid
    if phase == "gas":
        row = obigt(of, "aq", names)
        # A volume of 0 there is one that is not known.
        if row and number(row, "Cp"):
            out["dissolved"] = number(row, "V"), number(row, "Cp") * (4.184 if row["E_units"] == "cal" else 1), row["ref1"]
    row = of.aqsol.get(key)
    if row and int(row["Occurrences"]) >= 2 and float(row["SD"]) <= 0.15:
        grams = 10 ** float(row["Solubility"]) * mass
        if grams < 100:
            out["solubility"] = grams, "aqs", f"sd {float(row['SD']):.2g}"
    if "solubility" not in out and key in of.sets and phase != "gas":
        found = of_sets(of.sets[key], phase)
        if found and 10 ** found[0] * mass < 100:
            out["solubility"] = 10 ** found[0] * mass, *found[1:]
    return out


def of_sets(values, phase):
    """log10 of a solubility in mol/L on which most of AqSolDB's sets agree, or of a solid the only one; its source, and how many there are."""
    middle = statistics.median(values)
    near = [value for value in values if abs(value - middle) <= SETS_AGREE]
    if max(values) - middle > SETS_STRAY:
        return None
    if len(near) >= 2 and 2 * len(near) > len(values):
        return statistics.median(near), "aqd", f"{len(near)} of {len(values)}"
    return (values[0], "aqa", "1 of 1") if len(values) == 1 and phase == "solid" else None


def choose(what, by):
    """The value to keep, its source, and a second value and source to check it by; None where sources only contradict one another."""
    (absolute, relative), order = RULES[what]
    by = {source: value for source, value in by.items() if value}
    near = lambda a, b: abs(a - b) <= max(absolute, relative * abs(b))
    family = lambda source: FAMILY.get(source, source)
    best = None
    for source in order:
        if source not in by:
            continue
        seconds = [s for s in by if family(s) != family(source) and near(by[source], by[s])]
        against = [s for s in by if family(s) != family(source) and not near(by[source], by[s])]
        if seconds and len(seconds) >= len(against) and (best is None or len(seconds) > best[1]):
            best = source, len(seconds)
    if best is None and what == "flash_point" and "iec" in by:
        # The standard stands above what was taken in open cups or read in Fahrenheit.
        return by["iec"], "iec", None, None
    if not by:
        return None
    if best is None and len({family(s) for s in by}) == 1:
        return (*next(iter(by.items()))[::-1], None, None)
    if best is None:
        # Of several that differ, the one in their midst, if all are near it.
        if what not in WIDER or not by:
            return None
        absolute, relative = WIDER[what]
        middle = statistics.median_low(by.values())
        source = next((s for s in order if by.get(s) == middle), None)
        farthest = max(by, key=lambda s: abs(by[s] - middle))
        wide = abs(by[farthest] - middle) > max(absolute, relative * middle)
        return None if source is None or wide else (middle, source, by[farthest], farthest)
    centre = statistics.median([by[s] for s in by if near(by[s], by[best[0]])])
    pool = [s for s in order if s in by and near(by[s], centre) and any(family(t) != family(s) and near(by[s], by[t]) for t in by)]
    standard = "iec" if what == "flash_point" else "crc"
    handbook = by.get(standard) if standard in pool else None
    for source in pool:
        if what not in SAME or source == standard or handbook is None or abs(by[source] - handbook) <= SAME[what]:
            if what in SAME and handbook is None and abs(by[source] - centre) > SAME[what] and source != pool[-1]:
                continue
            seconds = [s for s in by if family(s) != family(source) and near(by[source], by[s])]
            second = min(seconds, key=lambda s: abs(by[s] - by[source]))
            return by[source], source, by[second], second
    return None


def mass_of(formula):
    return sum(TABLE.GetAtomicWeight(element) * count for element, count in read_formula(formula).items())


def is_organic(mol):
    """Whether all its atoms are those of organic molecules, in one piece."""
    elements = {a.GetSymbol() for a in mol.GetAtoms()}
    return "C" in elements and elements <= set("C H O N F Cl Br I S P Si B".split()) and len(Chem.GetMolFrags(mol)) == 1


def by_atoms(mol, mass):
    """Density of an organic liquid from its atoms, rings and hydroxyl groups, within some 10 % (Girolami, J. Chem. Educ. 71 (1994) 962)."""
    if mol is None:
        return None
    atoms = [a.GetAtomicNum() for a in Chem.AddHs(mol).GetAtoms()]
    rows_of = ((1, 1), (9, 2), (17, 4), (35, 5), (53, 7.5), (83, 9))
    volume = sum(next(size for last, size in rows_of if z <= last) for z in atoms)
    raises = len(mol.GetSubstructMatches(Chem.MolFromSmarts("[OX2H]"))) + mol.GetRingInfo().NumRings()
    raises += len(mol.GetSubstructMatches(Chem.MolFromSmarts("[NX3;H1,H2,$(NC=O)]")))
    raises += len(mol.GetSubstructMatches(Chem.MolFromSmarts("[#16X3,#16X4](=O)")))
    return mass / (5 * volume) * (1 + 0.1 * min(raises, 3))


def choose_density(by):
    """A density of a liquid at 25 degC: where the handbook has it at 20 degC, carried over by the slope of an equation."""
    crc, warm, cool = by["crc"], by["25"], by["20"]
    if crc:
        for source, value in warm.items():
            if abs(crc / value - 1) <= 0.0025:
                return crc, "crc", value, source
        for source, value in cool.items():
            if abs(crc / value - 1) <= 0.004 and source in warm:
                carried = crc * warm[source] / value
                return carried, "c25", warm[source], source
    families = [(s, t) for s in warm for t in warm if FAMILY.get(s, s) < FAMILY.get(t, t)]
    for s, t in families:
        if abs(warm[s] / warm[t] - 1) <= 0.005:
            return (warm[s], s, warm[t], t)
    if crc and not warm and by["cas"] and abs(crc / by["cas"] - 1) <= 0.01:
        return crc, "crc", by["cas"], "cas"
    if not warm:
        # One value alone, or two that contradict one another: that which atoms and rings bear out.
        by_atoms = by["atoms"] or math.inf
        if crc and by["cas"] and abs(crc / by["cas"] - 1) <= 0.03:
            return crc, "crc", by["cas"], "cas"
        off = {s: abs(by[s] / by_atoms - 1) for s in ("crc", "cas") if by[s]}
        near = 0.12 if len(off) == 1 else 0.08
        if len(off) == 2 and abs(crc / by["cas"] - 1) < 0.1:
            return None
        likely = [(s, by[s]) for s in off if off[s] <= near]
        return (likely[0][1], likely[0][0], None, None) if len(likely) == 1 else None
    if by["cas"] and warm:
        for source, value in warm.items():
            if abs(by["cas"] / value - 1) <= 0.01:
                return value, source, by["cas"], "cas"
    return None


def phase_of(of, substance):
    """The phase at 25 degC, by melting and boiling points."""
    cas = substance["cas"]
    crc = of.organic.get(cas) or of.inorganic.get(cas) or {}
    web, wiki, common = of.webbook.get(cas, {}), of.wikidata.get(cas, {}), of.common.get(cas, {})
    every = lambda column: [v for v in (number(t, column) for t in (crc, web, common, wiki)) if v]
    melting, boiling = every("Tm"), every("Tb")
    notebook = number(of.notebook.get(cas, {}), "Tm")
    if notebook:
        melting.append(notebook)
    if boiling and statistics.median(boiling) < ROOM - 1:
        return "gas"
    if melting and statistics.median(melting) > ROOM:
        return "solid"
    if melting or boiling:
        return "liquid"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aqsol", type=Path, required=True)
    parser.add_argument("--sets", type=Path, required=True)
    parser.add_argument("--obigt", type=Path, required=True)
    args = parser.parse_args()
    of = Sources(args)
    listed = rows(HERE / "list.csv")
    known = identifiers({s["cas"] for s in listed})
    seen, kept, values = {}, [], []
    for s in listed:
        say = lambda text: print(f"{s['name']} ({s['cas']}): {text}", file=sys.stderr)
        if not check_digit(s["cas"]):
            say("the check digit of the CAS number is wrong")
            continue
        fields = known.get(s["cas"])
        if fields is None and not s["formula"]:
            say("no identifiers")
            continue
        formula, smiles, key, names = (fields[2], fields[4], fields[6], fields[7:]) if fields else ("", "", "", [])
        formula, smiles = s["formula"] or formula, s["smiles"] if s["formula"] else smiles
        if s["section"] in WITHOUT_STRUCTURE:
            smiles = ""
        mol = Chem.MolFromSmiles(smiles) if smiles else None
        if mol is not None:
            key = Chem.MolToInchiKey(mol)
        phase = s["phase"] or phase_of(of, s)
        asked = [plain(n) for n in [s["name"], s["title"], *s["aliases"].split()]]
        if fields and not {plain(n) for n in names} & set(asked):
            say(f"known as {names[:4]}")
        if phase is None:
            say("no phase")
            continue
        if mol is not None:
            if read_formula(rdMolDescriptors.CalcMolFormula(mol)) != read_formula(formula):
                say(f"formula {formula} is not that of {smiles}")
                continue
        mass = mass_of(formula)
        same = key or s["name"]
        if same in seen:
            say(f"is {seen[same]}")
            continue
        seen[same] = s["name"]
        every = [read_formula(formula), s["name"], *s["aliases"].split(), s["title"], *names]
        found = candidates(of, s, {"names": every, "phase": phase, "mass": mass, "inchikey": key, "mol": mol,
                                   "organic": mol is not None and is_organic(mol)})
        kept.append([s["name"], s["cas"], formula, smiles, key, phase])
        for what, by in found.items():
            if what == "density":
                got = choose_density(by)
                by = {**by["25"], "crc": by["crc"], "cas": by["cas"]}
            elif what == "dissolved":
                if by[0]:
                    values.append([s["name"], "molar_volume", f"{by[0]:.4g}", "aq", "", "", by[2]])
                values.append([s["name"], "heat_capacity", f"{by[1]:.4g}", "aq", "", "", by[2]])
                continue
            elif what == "solubility":
                values.append([s["name"], what, f"{by[0]:.2g}", by[1], "", "", by[2]])
                continue
            else:
                got = choose(what, by)
                # The handbooks have the melt of some organic solids, without saying so, and copy such values from one another. Where it melts
                # below 40 degC that is as it is used.
                if what == "solid_density" and got and mol is not None and is_organic(mol):
                    ratio = got[0] / by_atoms(mol, mass)
                    melts = choose("melting_point", found["melting_point"])
                    warm = melts is not None and melts[0] < 313.15
                    if ratio < (0.93 if warm else 1.0) or got[3] is None and not warm and not (1.03 if got[1] == "obg" else 1.1) <= ratio <= 1.3:
                        say(f"density {got[0]:.4g} of {got[1]} and {got[3]} is that of a melt, or wrong")
                        got = None
            if got and what == "flash_point" and (phase == "gas" or got[3] is None and got[1] not in ("iec", "nfp")):
                got = None
            fits = {"gas": lambda t: False, "liquid": lambda t: t < ROOM + 2, "solid": lambda t: t > ROOM - 2}
            if got and what == "melting_point" and phase == "gas":
                # Some have no melting point below 1 atm: they sublime.
                boils = choose("boiling_point", found["boiling_point"])
                fits["gas"] = lambda t: boils is not None and t < boils[0]
            if got and what == "melting_point" and got[3] is None and not (mol is not None and is_organic(mol)):
                # Whether it melts at all, decomposes or sublimes is not sure then.
                got = None
            if got and what == "boiling_point" and got[3] is None and got[1] not in ("crc", "nist"):
                # It may be that at a lower pressure.
                got = None
            if got and what == "melting_point" and not fits[phase](got[0]):
                say(f"melting point {got[0]:.5g} of {got[1]} is not that of a {phase}")
                got = None
            if got is None:
                if any(by.values()):
                    say(f"{what}: " + ", ".join(f"{k} {v:.5g}" for k, v in by.items() if v))
                continue
            value, source, second, other = got
            what = "density" if what == "solid_density" else what
            values.append([s["name"], what, f"{value:.6g}", source, f"{second:.6g}" if second else "", other or "", ""])
    given = {(v[0], v[1]): v for v in values}
    mols = {k[0]: Chem.MolFromSmiles(k[3]) for k in kept if k[5] == "liquid" and k[3]}
    sure = [(mols[n], float(v[2])) for (n, what), v in given.items() if n in mols and what == "heat_capacity" and v[5]]
    found, errors = estimate(sure, [(n, mol) for n, mol in mols.items() if (n, "heat_capacity") not in given])
    half, most = numpy.quantile(numpy.abs(errors), (0.5, 0.9))
    goodness = [["fit", len(sure), "", f"{half:.4f}", f"{most:.4f}"]]
    alone = {n: v for (n, what), v in given.items() if n in mols and what == "heat_capacity" and not v[5] and is_organic(mols[n])}
    told, _ = estimate(sure, [(n, mols[n]) for n in alone])
    for n, v in alone.items():
        # A value alone that is far from those of its like is no better than an estimate.
        if n in told and abs(told[n] / float(v[2]) - 1) > 0.2:
            print(f"{n}: heat_capacity {v[2]} of {v[3]} alone, by its parts {told[n]:.4g}", file=sys.stderr)
            values.remove(v)
            found[n] = told[n]
    crystals = {k[0]: (Chem.MolFromSmiles(k[3]), k[2]) for k in kept if k[5] == "solid" and k[3]}
    crystals = {n: (mol, mass_of(formula)) for n, (mol, formula) in crystals.items() if is_organic(mol)}
    sure = [float(given[n, "density"][2]) / by_atoms(*crystals[n]) for n in crystals if given.get((n, "density"), [""] * 6)[5]]
    denser = statistics.median(sure)
    half, most = numpy.quantile([abs(denser / r - 1) for r in sure], (0.5, 0.9))
    goodness.append(["gir", len(sure), f"{denser:.3f}", f"{half:.4f}", f"{most:.4f}"])
    lacking = [n for n in crystals if (n, "density") not in given]
    values += [[n, "density", f"{denser * by_atoms(*crystals[n]):.3g}", "gir", "", "", ""] for n in lacking]
    boiled = {k[0]: volume_boiling(of, k, given) for k in kept if k[5] == "gas"}
    sure = [float(given[n, "molar_volume"][2]) / v for n, v in boiled.items() if v and (n, "molar_volume") in given]
    smaller = statistics.median(sure)
    half, most = numpy.quantile([abs(smaller / r - 1) for r in sure], (0.5, 0.9))
    goodness.append(["liq", len(sure), f"{smaller:.3f}", f"{half:.4f}", f"{most:.4f}"])
    lacking = [n for n, v in boiled.items() if v and (n, "heat_capacity") in given and (n, "molar_volume") not in given]
    values += [[n, "molar_volume", f"{smaller * boiled[n]:.3g}", "liq", "", "", ""] for n in lacking]
    values += [[n, "heat_capacity", f"{value:.3g}", "fit", "", "", ""] for n, value in found.items()]
    write(HERE / "identifiers.csv", "name cas formula smiles inchikey phase".split(), kept)
    write(HERE / "estimates.csv", "tag known factor half nine_tenths".split(), goodness)
    write(HERE / "values.csv", "name property value source second second_source note".split(), values)
    for s in listed:
        group = of.carcinogens.get(s["cas"], {}).get("group", "")
        if group in ("1", "2A") and "H" not in s["hazards"] and s["name"] in {k[0] for k in kept}:
            print(f"{s['name']}: IARC group {group}", file=sys.stderr)


PARTS = {
    "CH3": "[CX4H3]", "CH2": "[CX4H2;!R]", "ring CH2": "[CX4H2;R]", "CH": "[CX4H1]", "C": "[CX4H0]", "=CH": "[CX3;!$(C=O);H1,H2;!c]",
    "=C": "[CX3;!$(C=O);H0;!c]", "arene CH": "[cH]", "arene C": "[cH0]", "#C": "[CX2]", "C=O": "[CX3]=O", "OH": "[OX2H]", "O": "[OX2H0,o]",
    "NH": "[#7;H1,H2]", "N": "[#7;H0]", "F": "F", "Cl": "Cl", "Br": "Br", "I": "I", "S": "[#16]", "P": "[#15]", "Si": "[#14]", "B": "[#5]",
    "O of P, S, N": "[OX1;$(O=P),$(O=S),$([O-]N),$(O=N)]",
}


def parts(mol):
    """How often each part stands in a molecule; None where it has others."""
    counts = [len(mol.GetSubstructMatches(Chem.MolFromSmarts(smarts))) for smarts in PARTS.values()]
    return [1, *counts] if is_organic(mol) else None


def estimate(measured, lacking):
    """Heat capacities of liquids by a sum over their parts, fitted to those with a second source; and the errors of each of these by the
    rest of them."""
    rows = [(parts(mol), value) for mol, value in measured if parts(mol)]
    a, y = (numpy.array(column, dtype=float) for column in zip(*rows))
    # Relative errors count; parts that are rare are held down.
    weight = 1 / y
    hold = 1e-6 * numpy.eye(a.shape[1])
    solve = lambda keep: numpy.linalg.solve((a[keep] * weight[keep, None] ** 2).T @ a[keep] + hold, (a[keep] * weight[keep, None] ** 2).T @ y[keep])
    every = numpy.arange(len(y))
    errors = [float(a[i] @ solve(every != i) / y[i] - 1) for i in every]
    fitted, often = solve(every >= 0), (a > 0).sum(axis=0)
    out = {}
    for name, mol in lacking:
        counts = parts(mol) if mol is not None else None
        # A part that fewer than three others have is not known well enough.
        if counts and all(often[i] >= 3 for i, count in enumerate(counts) if count):
            out[name] = float(numpy.dot(counts, fitted))
    return out, errors


def write(path, head, lines):
    with open(path, "w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(head)
        out.writerows(lines)


if __name__ == "__main__":
    main()
