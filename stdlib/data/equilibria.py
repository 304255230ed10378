"""Writes the modules of equilibria in stdlib/ from the tables beside this file.

    equilibria.py [--check] [--report]

`species.csv` and `equilibria.csv` have a row for each species and equilibrium, a column for each number and one for its source. A heat of
solution that no second source agrees with to 1 kJ/mol has `alone`, or `within` how much, behind the name of its source.
`interactions.csv` has a row for each number of an interaction, with its terms.
`modules.csv` says which modules there are and what they use; `sources.csv` what each tag stands for; `modules/NAME.md` is the page of each
module, `modules/NAME.more` what else stands in it. The sections of docs/library.md on them are written too. With `--check` nothing is
written: the exit code is 1 where a module differs from its tables, where an equation does not balance or an equilibrium says what others say
already. With `--report` it prints which constants have one source only, and where two differ by more
than 0.1 in log10 K or 3 kJ/mol.
"""

import csv
import functools
import math
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
LIBRARY = HERE.parent
WIDTH = 140
# The gas constant times ln 10, J/(mol*K), and the temperature of constants, K.
R_LN10 = 8.314462618 * math.log(10)
T0 = 298.15
# Atomic masses of what solubilities are given of, g/mol (IUPAC, 2021, abridged).
MASSES = {
    "H": 1.008, "B": 10.81, "C": 12.011, "N": 14.007, "O": 15.999, "Na": 22.990, "Mg": 24.305, "P": 30.974, "S": 32.06, "Cl": 35.45, "K": 39.098,
    "Fe": 55.845, "Cu": 63.546, "Zn": 65.38, "Br": 79.904, "I": 126.904, "Ba": 137.327, "Pb": 207.2,
}
# How far two sources may be apart.
LOG_K, ENTHALPY = 0.1, 3.0


def table(name):
    with open(HERE / name, encoding="utf8", newline="") as file:
        return list(csv.DictReader(file))


def elements(formula):
    """The atoms of a formula and its charge under `charge`."""
    match = re.search(r"\^?(\d*)([+-])$", formula) if "^" in formula else re.search(r"()([+-])$", formula)
    charge, body = 0, formula
    if match:
        charge = int(match.group(1) or 1) * (1 if match.group(2) == "+" else -1)
        body = formula[: match.start()]
    # Old names of the library write Ca2+ without a caret.
    if match and "^" not in formula and re.fullmatch(r"[A-Z][a-z]?[234]", body):
        charge, body = charge * int(body[-1]), body[:-1]
    found = {"charge": charge}
    for part in body.split("."):
        times = re.match(r"^\d+(?=[A-Z(])", part)
        factor, part = (int(times.group()), part[times.end():]) if times else (1, part)
        stack = [{}]
        for token in re.finditer(r"([A-Z][a-z]?)(\d*)|(\()|\)(\d*)", part):
            if token.group(1):
                stack[-1][token.group(1)] = stack[-1].get(token.group(1), 0) + int(token.group(2) or 1)
            elif token.group(3):
                stack.append({})
            else:
                inner, count = stack.pop(), int(token.group(4) or 1)
                for element, number in inner.items():
                    stack[-1][element] = stack[-1].get(element, 0) + number * count
        for element, number in stack[0].items():
            found[element] = found.get(element, 0) + factor * number
    return found


def sides(equation):
    """Stoichiometric numbers of an equation, products positive."""
    numbers = {}
    for side, sign in zip(equation.split(" <-> "), (-1, 1)):
        for term in side.split(" + "):
            match = re.match(r"^(\d+) (.*)$", term.strip())
            count, name = (int(match.group(1)), match.group(2)) if match else (1, term.strip())
            numbers[name] = numbers.get(name, 0) + sign * count
    return numbers


def formulas():
    """The formula of each species, of the library and of the tables."""
    text = (LIBRARY / "species.mtx").read_text(encoding="utf8")
    found = dict(re.findall(r'^species (\S+) \{\n(?:(?!^\}).*\n)*?    formula: "(.*?)"', text, re.M))
    for row in table("species.csv"):
        found[row["name"]] = row["formula"]
    return found


def analytic(row):
    """Numbers of log10 K = A1 + A2 T + A3 / T + A4 log10 T + ... with a constant heat capacity change."""
    value, enthalpy, capacity = float(row["value"]), float(row["enthalpy"]) * 1e3, float(row["capacity"])
    a3 = -(enthalpy - capacity * T0) / R_LN10
    a4 = capacity / 8.314462618
    a1 = -value - a3 / T0 - a4 * math.log10(T0)
    return [round(a1, 5), 0, round(a3, 3), round(a4, 5)]


def solved(matrix, right):
    """The solution of three linear equations, by elimination."""
    rows = [row[:] + [value] for row, value in zip(matrix, right)]
    for i, _ in enumerate(rows):
        pivot = max(range(i, len(rows)), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k, row in enumerate(rows):
            if k != i:
                factor = row[i] / rows[i][i]
                rows[k] = [a - factor * b for a, b in zip(row, rows[i])]
    return [row[-1] / row[i] for i, row in enumerate(rows)]


def davies(molality_of, charges, celsius):
    """What charge and ionic strength take off log10 of an activity, per charge squared, and the ionic strength up to which that goes."""
    strength = min(0.5 * sum(count * charges[name] ** 2 for name, count in molality_of.items()), 1)
    rise = celsius - 25
    slope = 0.51 + 8.74e-4 * rise + 4.34e-6 * rise**2
    return slope * (math.sqrt(strength) / (1 + math.sqrt(strength)) - 0.3 * strength), strength


@functools.cache
def acid_steps():
    """For each acid the base that it becomes by giving off H+, and the row of that."""
    found = {}
    for row in table("equilibria.csv"):
        if row["kind"] == "pka":
            numbers = sides(row["equation"])
            acid = next(name for name, count in numbers.items() if count < 0 and name != "water")
            base = next(name for name, count in numbers.items() if count > 0 and name != "H+")
            found.setdefault(acid, (base, row))
    return found


def log_acid_constant(row, celsius):
    """log10 of an acidity constant at a temperature."""
    kelvin = celsius + 273.15
    if row["analytic"] or row["capacity"]:
        a = [float(x) for x in row["analytic"].split()] if row["analytic"] else analytic(row)
        a += [0] * (6 - len(a))
        return a[0] + a[1] * kelvin + a[2] / kelvin + a[3] * math.log10(kelvin) + a[4] / kelvin**2 + a[5] * kelvin**2
    return -float(row["value"]) - float(row["enthalpy"] or 0) * 1e3 / R_LN10 * (1 / kelvin - 1 / T0)


def settled(dissolved, known, celsius):
    """Molalities at equilibrium where acids and bases of one acid are dissolved, with ions that are neither; without OH-."""
    charges = {name: elements(known[name])["charge"] for name in [*dissolved, "H+"]}
    bases = {base: acid for acid, (base, _) in acid_steps().items()}
    forms = [next((name for name in dissolved if name in acid_steps() or name in bases), None)]
    while forms[0] in bases:
        forms.insert(0, bases[forms[0]])
    while forms[-1] in acid_steps():
        forms.append(acid_steps()[forms[-1]][0])
    if forms == [None]:
        return dict(dissolved), charges
    charges |= {name: elements(known[name])["charge"] for name in forms}
    total = sum(dissolved.get(name, 0) for name in forms)
    others = {name: count for name, count in dissolved.items() if name not in forms}
    strength, found = 0, {}
    for _ in range(100):
        # Shares at an activity of H+, with activity coefficients of the last round.
        low, high = -14.0, 1.0
        for _ in range(80):
            middle = (low + high) / 2
            off, _ = davies(found, charges, celsius) if found else (0, 0)
            logs = [0.0]
            for acid in forms[:-1]:
                base, row = acid_steps()[acid]
                logs.append(logs[-1] + log_acid_constant(row, celsius) - middle + off * (charges[base] ** 2 - charges[acid] ** 2))
            most = max(logs)
            shares = [10 ** (x - most) for x in logs]
            found_now = {name: total * share / sum(shares) for name, share in zip(forms, shares)}
            found_now["H+"] = 10 ** (middle + off)
            balance = sum(count * charges[name] for name, count in (found_now | others).items())
            low, high = (low, middle) if balance > 0 else (middle, high)
        found = found_now | others
        before, strength = strength, davies(found, charges, celsius)[1]
        if abs(strength - before) < 1e-12:
            break
    return found, charges


def saturated(numbers, formula, percent, celsius, alone):
    """log10 K of a solid of which a saturated solution holds this much, with the activities of `davies` in stdlib/chemistry.mtx; of one that
    stands `alone` no acid or base splits."""
    known = formulas()
    molality = percent / (100 - percent) / mass(formula) * 1e3
    water = numbers.get("water", 0)
    products = {name: count for name, count in numbers.items() if name != "water" and count > 0}
    dissolved = {name: count * molality for name, count in products.items()}
    found, charges = (dissolved, {name: elements(known[name])["charge"] for name in products}) if alone else settled(dissolved, known, celsius)
    off, strength = davies(found, charges, celsius)
    total = sum(count * (math.log10(found[name]) - (off * charges[name] ** 2 if charges[name] else -0.1 * strength)) for name, count in products.items())
    return total - water * 0.017 * sum(found.values()) / math.log(10)


def solid_of(row):
    """The solid of an equation, and the solubilities known of it."""
    numbers = sides(row["equation"])
    solid = next(name for name, count in numbers.items() if count < 0)
    return solid, numbers, [point for point in table("solubilities.csv") if point["salt"] == solid]


def crystallising(row):
    """Numbers of log10 K = A1 + A3 / T + A4 log10 T that give the solubilities of a solid, by least squares; how far off; their sources. With
    two of them A4 is 0."""
    _, numbers, points = solid_of(row)
    basis, logs = [], []
    for point in points:
        celsius = float(point["temperature"])
        kelvin = celsius + 273.15
        basis.append([1, 1e3 / kelvin, math.log10(kelvin / T0)])
        logs.append(saturated(numbers, point["formula"], float(point["mass_percent"]), celsius, row["module"] == "crystals"))
    matrix = [[sum(b[i] * b[k] for b in basis) for k in range(3)] for i in range(3)]
    right = [sum(row_[i] * value for row_, value in zip(basis, logs)) for i in range(3)]
    if len(points) == 2:
        matrix[2], right[2] = [0, 0, 1], 0
    a, b, c = solved(matrix, right)
    worst = max(abs(sum(x * y for x, y in zip((a, b, c), row_)) - value) for row_, value in zip(basis, logs))
    order = sum(count for name, count in numbers.items() if count > 0 and name != "water")
    names = sorted({point["source"] for point in points})
    return [round(a - c * math.log10(T0), 5), 0, round(1e3 * b, 3), round(c, 5)], 100 * (10 ** (worst / order) - 1), names


def dissolving(row):
    """log10 K of a solid of which one solubility is known, near 25 degC, and its source."""
    _, numbers, (point,) = solid_of(row)
    value = saturated(numbers, point["formula"], float(point["mass_percent"]), float(point["temperature"]), False)
    return round(value, 4), point["source"]


def mass(formula):
    """The molar mass of a formula, g/mol."""
    return sum(MASSES[element] * count for element, count in elements(formula).items() if element != "charge")


def number(value):
    return f"{float(value):.10g}"


def tag(*names):
    """The comment that names sources; what stands in a cell after the name of one, `sit alone`, is a remark."""
    found = [name.split(" ", 1) for name in dict.fromkeys(n for n in names if n)]
    return "  // " + "".join(f"[{name}]" + "".join(f" {remark}" for remark in rest) for name, *rest in found)


def listed_words(cell):
    """Texts of a cell, with semicolons between them, as a list of the language."""
    return ", ".join(f'"{word}"' for word in cell.split(";"))


def check_digit(cas):
    digits = [int(c) for c in cas.replace("-", "")]
    return re.fullmatch(r"\d{2,7}-\d\d-\d", cas) and sum(i * d for i, d in enumerate(digits[-2::-1], 1)) % 10 == digits[-1]


FIELDS = [
    ("smiles", '"{}"', None), ("formula", '"{}"', None), ("cas", '"{}"', None), ("synonyms", "[{}]", None), ("phase", '"{}"', None),
    ("density", "{} g/mL", "density_source"),
    ("molar_volume", "{} mL/mol", "volume_source"), ("heat_capacity", "{} J/(mol*K)", "capacity_source"), ("melting_point", "{} degC", "crc"),
    ("boiling_point", "{} degC", "crc"), ("dissolves", "{}", None), ("pka", "{}", "pka_source"), ("pkah", "{}", "pkah_source"),
    ("solubility", "{} g/kg", "solubility_source"), ("heat_of_solution", "{} kJ/mol", "heat_source"),
    ("absorbs", "({}) L/(mol*cm)", "absorbs_source"), ("crowding", "{} mL/mol", "dh"),
    ("ion_size", "{} nm", "pdh"), ("salting", "{}", "pdh"), ("diffusion", "{}e-9 m^2/s", "diffusion_source"), ("gas_solubility", "{} mmol/kg", "gas_source"), ("fatal_in_air", "{}", "fatal_source"),
]


def species(row):
    lines = [f"/// {row['doc']}", f"species {row['name']} {{"] if not row["same_as"] else []
    if row["same_as"]:
        return [f"species {row['name']} {{ same_as: {row['same_as']} }}", ""]
    for field, form, source in FIELDS:
        if row.get(field):
            name = row[source] if source and source in row else source
            value = listed_words(row[field]) if field == "synonyms" else row[field].replace("\\", "\\\\")
            lines.append(f"    {field}: {form.format(value)}" + (tag(name) if name else ""))
    if row["hazards"]:
        lines.append(f"    hazards: [{listed_words(row['hazards'])}]")
    return lines + ["}", ""]


@functools.cache
def heats():
    """Heats of solution with their sources, as they are written."""
    text = (LIBRARY / "species.mtx").read_text(encoding="utf8")
    known = [row for row in table("species.csv") if row["heat_of_solution"]]
    found = {row["name"]: f"{row['heat_of_solution']} kJ/mol  // [{row['heat_source'].split()[0]}]" for row in known}
    for name, body in re.findall(r"^species (\S+) \{\n(.*?)^\}", text, re.M | re.S):
        heat = re.search(r"^    heat_of_solution: (.*? kJ/mol(?:  // \[\w+\])?)", body, re.M)
        if heat:
            found[name] = heat.group(1)
    return found


def equilibrium(row):
    # A constant that does not follow the temperature holds near the one at which it was measured, as a rule of the language says.
    follows = row["enthalpy"] or row["analytic"] or row["kind"] == "solubility"
    low, high = (row["low"], row["high"]) if follows else (max(int(row["low"]), 15), min(int(row["high"]), 35))
    window = f"valid: {low} degC .. {high} degC"
    sources = tag(row["source"], row["enthalpy_source"])
    head = f"equilibrium {row['name']}: {row['equation']} {{"
    said, more = [], []
    if row["analytic"]:
        constant = "analytic: [" + ", ".join(number(x) for x in row["analytic"].split()) + "]"
        sources = tag(row["source"])
    elif row["kind"] == "solubility" and len(solid_of(row)[2]) == 1:
        value, source = dissolving(row)
        constant = f"log_constant: {number(value)}" + (f", enthalpy: {number(row['enthalpy'])} kJ/mol" if row["enthalpy"] else "")
        sources = tag(source, row["enthalpy_source"])
    elif row["kind"] == "solubility":
        numbers, worst, names = crystallising(row)
        constant = "analytic: [" + ", ".join(number(x) for x in numbers) + "]"
        sources = tag(*names)
        heat = heats().get(row["equation"].split(" <->")[0].removesuffix("(s)"))
        more = [f"    heat: {heat}"] if heat else []
        said = [f"    // met within {max(worst, 0.1):.1f} %"]
    elif row["capacity"] and row["kind"] == "pka":
        constant = "analytic: [" + ", ".join(number(x) for x in analytic(row)) + "]"
        said = [f"    // pK {number(row['value'])}, {number(row['enthalpy'])} kJ/mol, {number(row['capacity'])} J/(mol*K)"]
    else:
        constant = f"{row['kind']}: {number(row['value'])}"
        if row["enthalpy"]:
            constant += f", enthalpy: {number(row['enthalpy'])} kJ/mol"
    line = f"{head} {constant}, {window} }}{sources}"
    doc = [f"/// {row['doc']}"]
    if len(line) <= WIDTH and not said:
        return doc + [line, ""]
    return doc + [head] + said + [f"    {constant}{sources}", *more, f"    {window}", "}", ""]


def named(between):
    """The name of the interaction between some species."""
    species = between.split()
    return "between_" + "_".join(re.sub(r"(\^.*|(?<=[a-z])2?[+-]|(?<=[A-Z])[+-]|[+-])$", "", s) for s in species)


def interactions(rows):
    lines, found = [], {}
    for row in rows:
        found.setdefault(row["between"], []).append(row)
    for between, numbers in found.items():
        species = between.split()
        terms = {row["number"]: [number(x) for x in row["terms"].split()] for row in numbers}
        said = [f"{key}: {of[0] if len(of) == 1 else '[' + ', '.join(of) + ']'}" for key, of in terms.items()]
        sources = tag(*(row["source"] for row in numbers))
        name = named(between)
        head = f"interaction {name}: {' + '.join(species)} {{"
        doc = f"/// {', '.join(species[:-1])} and {species[-1]}."
        line = f"{head} {', '.join(said)} }}{sources}"
        lines += [doc, line, ""] if len(line) <= WIDTH else [doc, head, *(f"    {one}{sources}" for one in said), "}", ""]
    return lines


def sections(rows):
    found = {}
    for row in rows:
        found.setdefault(row["section"], []).append(row)
    return found


def wrapped(text, width=WIDTH - 4):
    """Words of a paragraph in lines."""
    lines, line = [], ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > width:
            lines, line = lines + [line], word
        else:
            line = f"{line} {word}".strip()
    return lines + [line]


def module(entry, all_species, all_equilibria, all_interactions, sources):
    name = entry["module"]
    acting = [row for row in all_interactions if row["module"] == name]
    own = [row for row in all_species if row["module"] == name]
    rules = [row for row in all_equilibria if row["module"] == name]
    body = []
    for title in dict.fromkeys(row["section"] for row in rules + own):
        body += [f"// ---- {title}", ""]
        for row in sections(own).get(title, []):
            body += species(row)
        for row in sections(rules).get(title, []):
            body += equilibrium(row)
    if acting:
        body += ["// ---- interactions", "", *interactions(acting)]
    used = [row for row in sources if f"[{row['tag']}]" in "\n".join(body)]
    head = ["mtx 1"]
    for paragraph in (HERE / "modules" / f"{name}.md").read_text(encoding="utf8").strip().split("\n\n"):
        head += [f"//! {line}" for line in wrapped(paragraph.replace("\n", " "))] + ["//!"]
    remarked = ". `alone` says that a heat of solution was compared with no other, `within` by how much another is off; the rest agree within 1 kJ/mol"
    said = f"`[x]` after a number names its source{remarked if re.search(r'// .*] (alone|within)', chr(10).join(body)) else ''}:"
    head += [f"//! {line}" for line in wrapped(said)] + ["//!"]
    for row in used:
        first, *rest = wrapped(f"- `[{row['tag']}]` {row['says']}")
        head += [f"//! {first}"] + [f"//!   {line}" for line in rest]
    uses = [f"use std::{used}" for used in entry["uses"].split()]
    tail = HERE / "modules" / f"{name}.more"
    written = "\n".join(head + ([""] + uses if uses else []) + [""] + body).rstrip() + "\n"
    return written + ("\n" + tail.read_text(encoding="utf8") if tail.exists() else "")


def listed(names):
    """Names in lines of a page."""
    return "\n".join(wrapped(", ".join(f"`{name}`" for name in names)))


def section(entry, all_species, all_equilibria, all_interactions):
    """What docs/library.md says of a module."""
    name = entry["module"]
    own = [row for row in all_species if row["module"] == name]
    rules = [row for row in all_equilibria if row["module"] == name]
    says = (HERE / "modules" / f"{name}.md").read_text(encoding="utf8").split("\n\n")[0].replace("\n", " ").strip()
    lines = [f"## `std::{name}`", "", re.sub(r"\((\w+)\.mtx\)", r"(library/\1.md)", says), ""]
    for title, rows in sections(own).items():
        lines += [f"{title[0].upper()}{title[1:]}:", "", listed(row["name"] for row in rows), ""]
    tail = HERE / "modules" / f"{name}.more"
    if tail.exists():
        found = re.findall(r"^/// (.*)\n(const|caution|fn) (\w+)(?:\((.*?)\))?", tail.read_text(encoding="utf8"), re.M)
        lines += ["| name | is |", "| --- | --- |"]
        taken = {word: "(" + ", ".join(re.findall(r"(\w+):", given)) + ")" for _, kind, word, given in found if kind == "fn"}
        lines += [f"| {'caution ' if kind == 'caution' else ''}`{word}{taken.get(word, '')}` | {doc} |" for doc, kind, word, _ in found] + [""]
    acting = list(dict.fromkeys(named(row["between"]) for row in all_interactions if row["module"] == name))
    if acting:
        lines += [f"Interactions ({len(acting)}):", "", listed(acting), ""]
    if name != "equilibria":
        return "\n".join(lines + ([f"Equilibria ({len(rules)}):", "", listed(row["name"] for row in rules), ""] if rules else []))
    lines += ["| equilibrium | constant at 25 °C | enthalpy, kJ/mol | source |", "| --- | --- | --- | --- |"]
    words = {"pka": "pKa", "pksp": "pKsp", "log_constant": "log10 K"}
    for row in rules:
        if row["kind"] == "solubility":
            lines.append(f"| `{row['name']}` | of the solubility | {row['enthalpy']} | {', '.join(sorted({p['source'] for p in solid_of(row)[2]}))} |")
            continue
        moves = ", analytic" if row["analytic"] or row["capacity"] else ""
        lines.append(f"| `{row['name']}` | {words[row['kind']]} {number(row['value'])}{moves} | {row['enthalpy']} | {row['source']} |")
    return "\n".join(lines + [""])


def paged(page, entries, all_species, all_equilibria, all_interactions):
    """The page of the library with the sections of these modules."""
    for before, entry in zip([{"module": "framings"}, *entries], entries):
        text = section(entry, all_species, all_equilibria, all_interactions)
        old = re.search(rf"^## `std::{entry['module']}`\n.*?(?=^## )", page, re.M | re.S)
        if old:
            page = page[: old.start()] + text + "\n" + page[old.end():]
        else:
            at = re.search(rf"^## `std::{before['module']}`\n.*?(?=^## )", page, re.M | re.S).end()
            page = page[:at] + text + "\n" + page[at:]
    return page


def rank(rows):
    """The rank of a matrix by elimination."""
    rows, found = [dict(row) for row in rows], 0
    while rows:
        row = rows.pop()
        row = {key: value for key, value in row.items() if abs(value) > 1e-9}
        if not row:
            continue
        found += 1
        key = max(row, key=lambda k: abs(row[k]))
        for other in rows:
            if key in other:
                factor = other[key] / row[key]
                for column, value in row.items():
                    other[column] = other.get(column, 0) - factor * value
    return found


def faults(rows):
    known, found = formulas(), []
    for row in rows:
        sums = {}
        for name, count in sides(row["equation"]).items():
            if name not in known:
                found.append(f"{row['name']}: no species {name}")
                continue
            for element, number_of in elements(known[name]).items():
                sums[element] = sums.get(element, 0) + count * number_of
        off = {element: value for element, value in sums.items() if value}
        if off:
            found.append(f"{row['name']}: {row['equation']} is off by {off}")
    # Salts of std::brines stand in other modules too, with constants for other activities; who uses both is told so.
    for left_out in ({"brines"}, {"crystals", "solids"}):
        some = [row for row in rows if row["module"] not in left_out]
        if rank([sides(row["equation"]) for row in some]) < len(some):
            found.append("an equilibrium follows from others")
    return found


def report(rows):
    for row in rows:
        said = []
        if row["kind"] == "solubility":
            continue
        if not row["second"]:
            said.append("one source")
        elif abs(float(row["second"]) - float(row["value"])) > LOG_K:
            said.append(f"[{row['second_source']}] has {row['second']}")
        if not row["enthalpy"] and not row["analytic"]:
            said.append("no enthalpy")
        elif row["second_enthalpy"] and row["enthalpy"] and abs(float(row["second_enthalpy"]) - float(row["enthalpy"])) > ENTHALPY:
            said.append(f"enthalpy {row['enthalpy']}, [{row['second_enthalpy_source']}] has {row['second_enthalpy']}")
        if said:
            print(f"{row['module']}: {row['name']}, {row['kind']} {row['value']} [{row['source']}]: {'; '.join(said)}")


def main():
    modules, all_species, rows, acting, sources = (
        table(f"{name}.csv") for name in ("modules", "species", "equilibria", "interactions", "sources")
    )
    found = faults(rows)
    found += [f"{row['name']}: the check digit of {row['cas']} is wrong" for row in all_species if row.get("cas") and not check_digit(row["cas"])]
    for entry in modules:
        text = module(entry, all_species, rows, acting, sources)
        path = LIBRARY / f"{entry['module']}.mtx"
        if "--check" in sys.argv:
            if not path.exists() or path.read_text(encoding="utf8") != text:
                found.append(f"{path.name} differs from its tables: run stdlib/data/equilibria.py")
        else:
            path.write_text(text, encoding="utf8")
    path = LIBRARY.parent / "docs" / "library.md"
    page = path.read_text(encoding="utf8")
    text = paged(page, modules, all_species, rows, acting)
    if "--check" not in sys.argv:
        path.write_text(text, encoding="utf8")
    elif page != text:
        found.append("docs/library.md differs from the tables: run stdlib/data/equilibria.py")
    if "--report" in sys.argv:
        report(rows)
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
