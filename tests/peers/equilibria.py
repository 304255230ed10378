"""Compares equilibria with PHREEQC on mixtures drawn by a seed: the same database, imported, and the same law of
activity.

    equilibria.py MATTERIXC FOLDER [CASES [SEED]] [--pitzer]

needs phreeqpython. Each case puts some salts, acids and bases into water at some temperature, sometimes with a solid that may form. Compared
are the pH, every dissolved species above a trace, and which solids form. The exit code is 1 where one is further off than it may be.
With `--pitzer` it is the database pitzer.dat, its law, and strong solutions.
"""

import csv
import io
import os
import pathlib
import random
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import phreeqpython

# What is put into 1 kg of water (here 100 g, all else in proportion), as the ions that it has.
REAGENTS = {
    "HCl": {"H+": 1, "Cl-": 1}, "NaOH": {"Na+": 1, "OH-": 1}, "NaCl": {"Na+": 1, "Cl-": 1}, "KCl": {"K+": 1, "Cl-": 1},
    "CaCl2": {"Ca2+": 1, "Cl-": 2}, "MgCl2": {"Mg2+": 1, "Cl-": 2}, "Na2CO3": {"Na+": 2, "CO3^2-": 1},
    "NaHCO3": {"Na+": 1, "HCO3-": 1}, "KH2PO4": {"K+": 1, "H2PO4-": 1}, "Na2HPO4": {"Na+": 2, "HPO4^2-": 1},
    "Na2SO4": {"Na+": 2, "SO4^2-": 1}, "MgSO4": {"Mg2+": 1, "SO4^2-": 1}, "NaF": {"Na+": 1, "F-": 1},
    "H3BO3": {"H3BO3(aq)": 1}, "ZnCl2": {"Zn2+": 1, "Cl-": 2}, "AlCl3": {"Al3+": 1, "Cl-": 3}, "BaCl2": {"Ba2+": 1, "Cl-": 2},
    "NaBr": {"Na+": 1, "Br-": 1}, "K2SO4": {"K+": 2, "SO4^2-": 1}, "FeCl2": {"Fe2+": 1, "Cl-": 2},
    "SrCl2": {"Sr2+": 1, "Cl-": 2}, "LiBr": {"Li+": 1, "Br-": 1}, "CdCl2": {"Cd2+": 1, "Cl-": 2}, "PbCl2": {"Pb2+": 1, "Cl-": 2},
}
SOLIDS = {
    "Calcite": ("Ca", "CO3"), "Gypsum": ("Ca", "SO4"), "Barite": ("Ba", "SO4"), "Fluorite": ("Ca", "F"), "Strontianite": ("Sr", "CO3"),
    "Witherite": ("Ba", "CO3"), "Celestite": ("Sr", "SO4"), "Gibbsite": ("Al", "OH"), "Anglesite": ("Pb", "SO4"), "Cerussite": ("Pb", "CO3"),
}

# The database, its law, what is put in, which solids may form, the largest amount as a power of ten, and the ionic strength up to which a
# case counts, mol/kg: both laws are used within their range.
DILUTE = ("phreeqc.dat", "debye_hueckel", sorted(REAGENTS.keys() - {"NaBr", "K2SO4", "FeCl2"}), SOLIDS, -1.2, 0.5)
STRONG = (
    "pitzer.dat", "pitzer",
    ["HCl", "NaOH", "NaCl", "KCl", "CaCl2", "MgCl2", "Na2CO3", "NaHCO3", "Na2SO4", "MgSO4", "BaCl2", "LiBr", "NaBr", "K2SO4", "FeCl2"],
    {
        "Halite": ("Na", "Cl"), "Sylvite": ("K", "Cl"), "Mirabilite": ("Na", "SO4"), "Gypsum": ("Ca", "SO4"), "Calcite": ("Ca", "CO3"),
        "Epsomite": ("Mg", "SO4"), "Arcanite": ("K", "SO4"), "Carnallite": ("K", "Mg"), "Barite": ("Ba", "SO4"), "Glaserite": ("K", "SO4"),
    },
    0.6, 12.0,
)
BASE, LAW, NAMES, FORMING, LARGEST, STRONGEST = STRONG if "--pitzer" in sys.argv else DILUTE
# Species below this are not compared, mol/kg.
TRACE = 1e-10
PH, SHARE, INDEX = 0.01, 0.01, 0.01


def draw(rng, reagents):
    solids = rng.sample(sorted(FORMING), rng.randint(1, 2)) if rng.random() < 0.5 else []
    # What solids are made of comes first.
    parts = [part for solid in solids for part in FORMING[solid]]
    names = {rng.choice([name for name in reagents if part in name] or reagents) for part in parts}
    names |= set(rng.sample(reagents, rng.randint(1, 4)))
    amounts = {name: float(f"{10 ** rng.uniform(-5, LARGEST):.4g}") for name in sorted(names)}
    return amounts, solids, round(rng.uniform(5, 60), 1)


def gammas(database):
    """What a database says of activity coefficients, by formula; the last one counts."""
    found, species = {}, None
    for line in database.split("\n"):
        for part in line.split("#")[0].split(";"):
            words = part.split()
            if words[:1] == ["PHASES"]:
                return found
            if "=" in words:
                species = re.sub(r"^[\d.]+", "", words[words.index("=") + 1])
            elif words[:1] == ["-gamma"]:
                found[written(species)] = (float(words[1]), float(words[2]))
    return found


def with_library(database, library):
    """The database with what the library says of activity coefficients, which may come from a later one; and the ions that this changes."""
    theirs, said, changed = gammas(database), {}, []
    for name, body in re.findall(r"^species (\S+) \{\n(.*?)^\}", library, re.S | re.M):
        formula = re.search(r'formula: "(.*?)"', body)
        size, slope = re.search(r"ion_size: (\S+) nm", body), re.search(r"salting: (\S+)", body)
        if formula and slope:
            key = charged(formula.group(1))
            said[key] = (10 * float(size.group(1)) if size else 0.0, float(slope.group(1)))
            if theirs.get(key) != said[key]:
                changed.append(name)
    out, species, block = [], None, None
    for line in database.split("\n"):
        words = line.split("#")[0].split()
        if words and re.fullmatch("[A-Z_]{3,}", words[0]):
            block, species = words[0], None
        is_reaction = block == "SOLUTION_SPECIES" and "=" in words
        if is_reaction:
            species = written(re.sub(r"^[\d.]+", "", words[words.index("=") + 1].rstrip(";")))
        if species in said and words[:1] == ["-gamma"]:
            continue
        out.append(line)
        if is_reaction and species in said:
            out.append("\t-gamma {} {}".format(*said[species]))
    return "\n".join(out), sorted(changed)


def theirs(engine, case):
    amounts, solids, temperature = case
    # Water is neutral at its temperature.
    solution = engine.add_solution({"units": "mol/kgw", "temp": temperature, "pH": "7 charge"})
    for name, amount in amounts.items():
        solution.add(name, amount, "mol")
    if solids:
        solution.equalize(solids, to_si=[0] * len(solids), in_phase=[0] * len(solids))
    return solution


def written(text):
    match = re.match(r"^(.*?)([+-])(\d*)$", text)
    if not match:
        return text.replace(":", ".")
    body, sign, number = match.groups()
    if number in ("", "1"):
        return body + ("^" if body[-1].isdigit() else "") + sign
    return f"{body}^{number}{sign}"


def charged(formula):
    """`Ca2+` and `H2PO4-` with their charges told from their numbers."""
    formula = re.sub(r"^([A-Z][a-z]?)(\d)([+-])$", r"\1^\2\3", formula)
    return formula if "^" in formula else re.sub(r"(\d)([+-])$", r"\1^\2", formula)


def formulas(*texts):
    """Names of dissolved species by formula."""
    found = {}
    for text in texts:
        for name, body in re.findall(r"^species (\S+) \{\n(.*?)^\}", text, re.S | re.M):
            formula = re.search(r'formula: "(.*?)"', body)
            if formula and "dissolves:" not in body and not name.endswith("(s)"):
                found.setdefault(charged(formula.group(1)), name)
    return found


def text_of(case):
    amounts, solids, temperature = case
    ions = {}
    for name, amount in amounts.items():
        for ion, count in REAGENTS[name].items():
            ions[ion] = ions.get(ion, 0) + count * amount
    holding = " + ".join(["100 g of water"] + [f"{0.1 * amount:.10g} mol of {ion}" for ion, amount in ions.items()])
    return f"""mtx 1
use {"_".join(["db"] + sorted(solids))}
use std::glassware::Beaker250mL
asset Cup: Beaker250mL {{ contents: {{ activities: {LAW} }} }}
lab bench {{
    ambient: {temperature} degC
    cup = Cup at (0, 0, 0) m holding {holding} at {temperature} degC
}}
workflow look in bench {{
    wait 1 ms
    note "pH {{acidity(cup.contents) :.6}}"
}}
"""


def ours(program, folder, number, case):
    folder = folder / f"case{number}"
    folder.mkdir(exist_ok=True)
    (folder / "case.mtx").write_text(text_of(case))
    env = dict(os.environ, NO_COLOR="1")
    command = [program, "run", "case.mtx", "--no-cache", "--csv", "--out", "out"]
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, timeout=120)
    found = re.search(r"pH (-?[\d.]+)", done.stdout)
    if done.returncode or not found:
        raise SystemExit(f"case {number}: {done.stdout}{done.stderr}\n{text_of(case)}")
    return float(found.group(1)), (folder / "out" / "states.csv").read_text()


def main():
    args = [arg for arg in sys.argv[1:] if not arg.startswith("--")]
    program, folder = str(pathlib.Path(args[0]).resolve()), pathlib.Path(args[1])
    count = int(args[2]) if len(args) > 2 else 200
    rng = random.Random(int(args[3]) if len(args) > 3 else 1)
    folder.mkdir(parents=True, exist_ok=True)
    data = pathlib.Path(phreeqpython.__file__).parent / "database" / BASE
    library = pathlib.Path("stdlib/species.mtx").read_text()
    database = data.read_text(encoding="latin1")
    if BASE == "phreeqc.dat":
        database, changed = with_library(database, library)
        print(f"with the activity of a later database: {', '.join(changed)}")
    # Without this PHREEQC scales the activities of single ions so that Cl- has that of KCl (MacInnes), which no other number depends on.
    database = database.replace("\nPITZER\n", "\nPITZER\n-MacInnes false\n")
    (folder / BASE).write_text(database, encoding="latin1")
    data = (folder / BASE).resolve()
    engine = phreeqpython.PhreeqPython(database=BASE, database_directory=folder.resolve())
    cases = [draw(rng, NAMES) for _ in range(count)]
    for number, case in enumerate(cases):
        home = folder / f"case{number}"
        home.mkdir(exist_ok=True)
        module = home / ("_".join(["db"] + sorted(case[1])) + ".mtx")
        command = [program, "import", "phreeqc", str(data), "-o", str(module)]
        subprocess.run(command + (["--phases", ",".join(case[1])] if case[1] else []), check=True, capture_output=True)
    names = formulas(module.read_text(), library)
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda pair: ours(program, folder, *pair), enumerate(cases)))
    worst, off, compared, left, solid_cases = {"pH": 0.0, "species": 0.0}, 0, 0, 0, 0
    for number, (case, (ph, table)) in enumerate(zip(cases, results)):
        solution = theirs(engine, case)
        if solution.I > STRONGEST:
            left += 1
            continue
        last = list(csv.DictReader(io.StringIO(table)))[-1]
        here = {m.group(1): float(v) for k, v in last.items() if v and (m := re.match(r"cup\.contents\.amount\[(.*?)\]( .*)?$", k))}
        unit = next(k for k in last if k.startswith("cup.contents.amount["))
        scale = 1e-2 if "mmol" in unit else 10.0
        complaints = []
        gap = abs(ph - solution.pH)
        worst["pH"] = max(worst["pH"], gap)
        if gap > PH:
            complaints.append(f"pH {ph:.4f}, theirs {solution.pH:.4f}")
        for species, amount in solution.species.items():
            name = names.get(written(species))
            if amount < TRACE or species == "H2O" or name is None or name not in here:
                continue
            compared += 1
            share = abs(here[name] * scale - amount) / amount
            worst["species"] = max(worst["species"], share)
            if share > SHARE:
                complaints.append(f"{name}: {here[name] * scale:.5g}, theirs {amount:.5g} mol")
        # Where a solid has formed here the solution is saturated there, and where none has it is not above that.
        for phase in case[1]:
            formed = here.get(f"{phase}(s)", 0.0) > 0
            solid_cases += formed
            index = solution.si(phase)
            # In strong solutions PHREEQC states another index than 0 for hydrates that it has just let form; then the amounts dissolved,
            # compared above, tell.
            if formed and abs(index) > INDEX and BASE == "phreeqc.dat" or not formed and index > INDEX:
                complaints.append(f"{phase} {'forms' if formed else 'does not form'} at a saturation index of {index:.4f}")
        if complaints:
            off += 1
            print(f"case {number}: {case}, I {solution.I:.3f}: " + "; ".join(complaints[:6]))
        solution.forget()
    print(f"{count - left - off} of {count - left} cases agree; {left} are above an ionic strength of {STRONGEST} mol/kg")
    print(f"{compared} amounts and {solid_cases} solids compared; furthest off: pH {worst['pH']:.4f}, "
          f"species {100 * worst['species']:.2f} %")
    return 1 if off else 0


sys.exit(main())
