"""Cases of SBML's semantic test suite, written as processes and events of a capability, run and compared with the suite's results.

    sbml.py MATTERIXC FOLDER SUITE [FROM [TO]]

SUITE is the folder `cases/semantic` of the suite, FOLDER is where the files and recordings go. A case counts as passed where every value
is within the suite's own tolerances, as refused where a model asks for something that laws have no form for; the reasons are
counted. Exit status 1 where a case failed that is not refused.

The mapping: a species is a state that holds its amount, or its concentration where a rule sets that; a reaction is a process, a rate rule
too; an assignment rule is a derived member. Events are `when C after DELAY` where they persist, `for DELAY` where they do not.
"""

import collections
import csv
import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import libsbml as sb


class Refused(Exception):
    """What laws have no form for."""


VERSIONS = ("l3v2", "l3v1", "l2v5", "l2v4", "l2v3", "l2v2", "l2v1", "l1v2")


def number(value):
    if math.isnan(value) or math.isinf(value):
        raise Refused("a value that is not a finite number")
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


class Mapping:
    def __init__(self, path):
        document = sb.readSBMLFromFile(path)
        for i in range(document.getNumPlugins()):
            package = document.getPlugin(i).getPackageName()
            if package in ("fbc", "arrays", "multi", "distrib", "qual", "spatial"):
                raise Refused(f"the package {package}")
        for change in ("flatten comp", "expandFunctionDefinitions", "promoteLocalParameters"):
            options = sb.ConversionProperties()
            if change == "flatten comp":
                if document.getPlugin("comp") is None:
                    continue
                options.addOption("basePath", os.path.dirname(path))
                options.addOption("performValidation", False)
            options.addOption(change, True)
            if document.convert(options) != sb.LIBSBML_OPERATION_SUCCESS:
                raise Refused(f"what {change} of libsbml cannot convert")
        self.document = document
        self.model = m = document.getModel()
        self.level, self.version = document.getLevel(), document.getVersion()
        self.rates, self.assigned = {}, {}
        for rule in m.getListOfRules():
            if rule.isAlgebraic():
                raise Refused("an algebraic rule")
            if rule.getMath() is not None:
                (self.rates if rule.isRate() else self.assigned)[rule.getVariable()] = rule.getMath()
        self.initial = {a.getSymbol(): a.getMath() for a in m.getListOfInitialAssignments() if a.getMath() is not None}
        self.species = {s.getId(): s for s in m.getListOfSpecies()}
        self.compartments = {c.getId(): c for c in m.getListOfCompartments()}
        self.parameters = {p.getId(): p for p in m.getListOfParameters()}
        self.reactions = {r.getId(): r for r in m.getListOfReactions()}
        self.references = {}
        for r in m.getListOfReactions():
            if r.isSetFast() and r.getFast():
                raise Refused("a fast reaction")
            for ref in list(r.getListOfReactants()) + list(r.getListOfProducts()):
                if ref.isSetId() and ref.getId():
                    self.references[ref.getId()] = ref
        self.set_by_events = {a.getVariable() for e in m.getListOfEvents() for a in e.getListOfEventAssignments()}
        given = self.assigned.keys() | self.initial.keys()
        sized = [(sid, c.getSize() if c.isSetSize() else (1.0 if self.level < 3 else math.nan)) for sid, c in self.compartments.items()]
        valued = [(sid, p.getValue() if p.isSetValue() else math.nan) for sid, p in self.parameters.items()]
        self.values = dict(sized + valued)
        self.unset = {sid for sid, value in self.values.items() if math.isnan(value) and sid not in given}
        self.members, self.laws, self.first, self.last = [], [], [], []
        self.write()

    # What a species stands for in a formula: its amount, or its concentration.
    def in_amounts(self, s):
        compartment = self.compartments.get(s.getCompartment())
        flat = compartment is not None and compartment.isSetSpatialDimensions() and compartment.getSpatialDimensionsAsDouble() == 0
        return s.getHasOnlySubstanceUnits() or flat

    # Whether the state holds what formulas mean, not the amount.
    def is_direct(self, sid):
        return self.in_amounts(self.species[sid]) or sid in self.rates or sid in self.assigned

    def symbol(self, sid):
        if sid in self.unset:
            raise Refused("a quantity without a value")
        if sid in self.species and not self.is_direct(sid):
            if self.species[sid].getCompartment() in self.unset:
                raise Refused("a quantity without a value")
            return f"(x_{sid} / x_{self.species[sid].getCompartment()})"
        if sid in self.reactions:
            return f"r_{sid}"
        known = sid in self.species or sid in self.compartments or sid in self.parameters or sid in self.references
        if not known:
            raise Refused("a name of another kind")
        return f"x_{sid}"

    def amount(self, sid):
        s = self.species[sid]
        if self.is_direct(sid) and not self.in_amounts(s):
            return f"(x_{sid} * x_{s.getCompartment()})"
        return f"x_{sid}"

    # A formula as a number.
    def num(self, node):
        if node is None:
            raise Refused("a formula that is left out")
        if node.isBoolean() or node.isRelational() or node.isLogical():
            return f"choose({self.truth(node)}, 1.0, 0.0)"
        kids = [node.getChild(i) for i in range(node.getNumChildren())]
        kind = node.getType()
        n = self.num
        if node.isNumber():
            return number(node.getValue())
        if kind == sb.AST_NAME_TIME:
            return "(elapsed / 1 s)"
        if kind == sb.AST_NAME_AVOGADRO:
            return "6.02214179e23"
        if kind == sb.AST_NAME:
            return self.symbol(node.getName())
        if kind == sb.AST_CONSTANT_E:
            return number(math.e)
        if kind == sb.AST_CONSTANT_PI:
            return number(math.pi)
        if kind == sb.AST_PLUS:
            return "(" + " + ".join(map(n, kids)) + ")" if kids else "0.0"
        if kind == sb.AST_TIMES:
            return "(" + " * ".join(map(n, kids)) + ")" if kids else "1.0"
        if kind == sb.AST_MINUS:
            return f"(-{n(kids[0])})" if len(kids) == 1 else f"({n(kids[0])} - {n(kids[1])})"
        if kind == sb.AST_DIVIDE:
            return f"({n(kids[0])} / {n(kids[1])})"
        if kind in (sb.AST_POWER, sb.AST_FUNCTION_POWER):
            return f"({n(kids[0])} ^ {n(kids[1])})"
        if kind == sb.AST_FUNCTION_ROOT:
            degree, base = (kids[0], kids[1]) if len(kids) == 2 else (None, kids[0])
            if degree is None or degree.isNumber() and degree.getValue() == 2:
                return f"sqrt({n(base)})"
            return f"({n(base)} ^ (1.0 / {n(degree)}))"
        if kind == sb.AST_FUNCTION_LOG:
            return f"(ln({n(kids[1])}) / ln({n(kids[0])}))" if len(kids) == 2 else f"log10({n(kids[0])})"
        simple = {
            sb.AST_FUNCTION_EXP: "exp({0})",
            sb.AST_FUNCTION_LN: "ln({0})",
            sb.AST_FUNCTION_ABS: "abs({0})",
            sb.AST_FUNCTION_FLOOR: "floor({0})",
            sb.AST_FUNCTION_CEILING: "ceil({0})",
            sb.AST_FUNCTION_SIN: "sin({0} * 1 rad)",
            sb.AST_FUNCTION_COS: "cos({0} * 1 rad)",
            sb.AST_FUNCTION_TAN: "(sin({0} * 1 rad) / cos({0} * 1 rad))",
            sb.AST_FUNCTION_SEC: "(1.0 / cos({0} * 1 rad))",
            sb.AST_FUNCTION_CSC: "(1.0 / sin({0} * 1 rad))",
            sb.AST_FUNCTION_COT: "(cos({0} * 1 rad) / sin({0} * 1 rad))",
            sb.AST_FUNCTION_SINH: "((exp({0}) - exp(-{0})) / 2.0)",
            sb.AST_FUNCTION_COSH: "((exp({0}) + exp(-{0})) / 2.0)",
            sb.AST_FUNCTION_TANH: "((exp({0}) - exp(-{0})) / (exp({0}) + exp(-{0})))",
            sb.AST_FUNCTION_SECH: "(2.0 / (exp({0}) + exp(-{0})))",
            sb.AST_FUNCTION_CSCH: "(2.0 / (exp({0}) - exp(-{0})))",
            sb.AST_FUNCTION_COTH: "((exp({0}) + exp(-{0})) / (exp({0}) - exp(-{0})))",
            sb.AST_FUNCTION_ARCSIN: "(arcsin({0}) / 1 rad)",
            sb.AST_FUNCTION_ARCCOS: "(arccos({0}) / 1 rad)",
            sb.AST_FUNCTION_ARCTAN: "(arctan({0}) / 1 rad)",
            sb.AST_FUNCTION_ARCSEC: "(arccos(1.0 / {0}) / 1 rad)",
            sb.AST_FUNCTION_ARCCSC: "(arcsin(1.0 / {0}) / 1 rad)",
            sb.AST_FUNCTION_ARCCOT: "(arctan(1.0 / {0}) / 1 rad)",
            sb.AST_FUNCTION_ARCSINH: "ln({0} + sqrt({0} ^ 2 + 1.0))",
            sb.AST_FUNCTION_ARCCOSH: "ln({0} + sqrt({0} ^ 2 - 1.0))",
            sb.AST_FUNCTION_ARCTANH: "(ln((1.0 + {0}) / (1.0 - {0})) / 2.0)",
            sb.AST_FUNCTION_ARCCOTH: "(ln(({0} + 1.0) / ({0} - 1.0)) / 2.0)",
            sb.AST_FUNCTION_ARCSECH: "ln((1.0 + sqrt(1.0 - {0} ^ 2)) / {0})",
            sb.AST_FUNCTION_ARCCSCH: "ln(1.0 / {0} + sqrt(1.0 / {0} ^ 2 + 1.0))",
        }
        if kind in simple:
            return simple[kind].format(n(kids[0]))
        if kind == sb.AST_FUNCTION_FACTORIAL:
            # Of whole numbers, which are all that it is defined for.
            points = ", ".join(f"({i}, {number(math.factorial(i))})" for i in range(21))
            return f"interpolate({n(kids[0])}, [{points}])"
        if kind in (sb.AST_FUNCTION_MAX, sb.AST_FUNCTION_MIN):
            name = "max" if kind == sb.AST_FUNCTION_MAX else "min"
            out = n(kids[0])
            for kid in kids[1:]:
                out = f"{name}({out}, {n(kid)})"
            return out
        if kind in (sb.AST_FUNCTION_QUOTIENT, sb.AST_FUNCTION_REM):
            a, b = n(kids[0]), n(kids[1])
            quotient = f"choose({a} / {b} < 0.0, ceil({a} / {b}), floor({a} / {b}))"
            return quotient if kind == sb.AST_FUNCTION_QUOTIENT else f"({a} - {b} * {quotient})"
        if kind == sb.AST_FUNCTION_RATE_OF:
            return self.rate_of(kids[0].getName())
        if kind == sb.AST_FUNCTION_PIECEWISE:
            if len(kids) % 2 == 0:
                raise Refused("a piecewise formula without `otherwise`")
            out = n(kids[-1])
            for i in range(len(kids) - 3, -1, -2):
                out = f"choose({self.truth(kids[i + 1])}, {n(kids[i])}, {out})"
            return out
        if kind == sb.AST_FUNCTION_DELAY:
            raise Refused("a value of a past time")
        raise Refused(f"the function {node.getName() or kind}")

    # A formula as a condition.
    def truth(self, node):
        kids = [node.getChild(i) for i in range(node.getNumChildren())]
        kind, t = node.getType(), self.truth
        if kind == sb.AST_CONSTANT_TRUE:
            return "true"
        if kind == sb.AST_CONSTANT_FALSE:
            return "false"
        signs = {
            sb.AST_RELATIONAL_EQ: "==",
            sb.AST_RELATIONAL_NEQ: "!=",
            sb.AST_RELATIONAL_LT: "<",
            sb.AST_RELATIONAL_LEQ: "<=",
            sb.AST_RELATIONAL_GT: ">",
            sb.AST_RELATIONAL_GEQ: ">=",
        }
        if kind in signs:
            if kind in (sb.AST_RELATIONAL_EQ, sb.AST_RELATIONAL_NEQ) and any(k.isBoolean() or k.isLogical() for k in kids):
                a, b = t(kids[0]), t(kids[1])
                same = f"(({a} and {b}) or (not {a} and not {b}))"
                return same if kind == sb.AST_RELATIONAL_EQ else f"(not {same})"
            pairs = [f"{self.num(a)} {signs[kind]} {self.num(b)}" for a, b in zip(kids, kids[1:])]
            return "(" + " and ".join(pairs) + ")"
        if kind == sb.AST_LOGICAL_AND:
            return "(" + " and ".join(map(t, kids)) + ")" if kids else "true"
        if kind == sb.AST_LOGICAL_OR:
            return "(" + " or ".join(map(t, kids)) + ")" if kids else "false"
        if kind == sb.AST_LOGICAL_NOT:
            return f"(not {t(kids[0])})"
        if kind == sb.AST_LOGICAL_XOR:
            out = t(kids[0]) if kids else "false"
            for kid in kids[1:]:
                b = t(kid)
                out = f"(({out} and not {b}) or (not {out} and {b}))"
            return out
        if kind == sb.AST_LOGICAL_IMPLIES:
            return f"(not {t(kids[0])} or {t(kids[1])})"
        if kind == sb.AST_FUNCTION_PIECEWISE:
            if len(kids) % 2 == 0:
                raise Refused("a piecewise formula without `otherwise`")
            out = t(kids[-1])
            for i in range(len(kids) - 3, -1, -2):
                c, a = t(kids[i + 1]), t(kids[i])
                out = f"(({c} and {a}) or (not {c} and {out}))"
            return out
        return f"({self.num(node)} != 0.0)"

    def rate_of(self, sid):
        if sid in self.rates:
            return self.num(self.rates[sid])
        if sid in self.assigned:
            raise Refused("the rate of what a rule assigns")
        if sid in self.species:
            s = self.species[sid]
            terms = [f"({by})" for by in self.changes(sid)]
            total = "(" + " + ".join(terms) + ")" if terms else "0.0"
            if self.in_amounts(s):
                return total
            volume = s.getCompartment()
            if volume in self.assigned:
                raise Refused("the rate of a concentration in a volume that a rule assigns")
            size = f"x_{volume}"
            if volume in self.rates:
                return f"(({total} - x_{sid} / {size} * {self.num(self.rates[volume])}) / {size})"
            return f"({total} / {size})"
        return "0.0"

    # What reactions add to the amount of a species each second.
    def changes(self, sid):
        s, out = self.species[sid], []
        if s.getBoundaryCondition() or s.getConstant() or sid in self.rates or sid in self.assigned:
            return out
        factor = s.getConversionFactor() if s.isSetConversionFactor() else self.model.getConversionFactor() if self.model.isSetConversionFactor() else ""
        for r in self.model.getListOfReactions():
            for sign, refs in (("-", r.getListOfReactants()), ("", r.getListOfProducts())):
                for ref in refs:
                    if ref.getSpecies() != sid:
                        continue
                    by = f"{self.stoichiometry(ref)} * r_{r.getId()}"
                    out.append(f"{sign}{by}" + (f" * {self.symbol(factor)}" if factor else ""))
        return out

    def stoichiometry(self, ref):
        if ref.isSetId() and ref.getId():
            return f"x_{ref.getId()}"
        if ref.isSetStoichiometryMath() and ref.getStoichiometryMath().getMath() is not None:
            return self.num(ref.getStoichiometryMath().getMath())
        value = ref.getStoichiometry()
        if math.isnan(value):
            value = 1.0 if self.level < 3 else value
        return number(value / ref.getDenominator() if self.level == 1 else value)

    def state(self, sid, initial):
        self.members.append(f"state x_{sid}: Ratio = {initial}")

    def write(self):
        m = self.model
        for sid, c in self.compartments.items():
            self.quantity(sid, self.values[sid], c.getConstant())
        for sid, p in self.parameters.items():
            self.quantity(sid, self.values[sid], p.getConstant())
        for sid, ref in self.references.items():
            value = ref.getStoichiometry()
            if ref.isSetStoichiometryMath():
                self.members.append(f"derived x_{sid}: Ratio = {self.num(ref.getStoichiometryMath().getMath())}")
                continue
            constant = ref.getConstant() if self.level >= 3 else sid not in self.rates and sid not in self.set_by_events
            self.quantity(sid, value, constant)
        for sid, s in self.species.items():
            if sid in self.assigned:
                self.members.append(f"derived x_{sid}: Ratio = {self.num(self.assigned[sid])}")
                continue
            size = f"x_{s.getCompartment()}"
            direct = self.is_direct(sid)
            amounts = self.in_amounts(s)
            if sid in self.initial:
                given = self.num(self.initial[sid])
                value = given if direct else f"{given} * {size}"
            elif s.isSetInitialAmount():
                value = number(s.getInitialAmount()) + ("" if amounts or not direct else f" / {size}")
            elif s.isSetInitialConcentration():
                value = number(s.getInitialConcentration()) + (f" * {size}" if amounts or not direct else "")
            else:
                value = "0.0"
            self.state(sid, value)
        for sid in self.rates:
            self.laws.append(f"process rule_{sid} {{ x_{sid}' += ({self.num(self.rates[sid])}) / 1 s }}")
        for sid, r in self.reactions.items():
            law = r.getKineticLaw()
            rate = "0.0" if law is None or law.getMath() is None else self.num(law.getMath())
            self.members.append(f"derived r_{sid}: Ratio = {rate}")
        for sid in self.species:
            lines = [f"x_{sid}' += {by} / 1 s" for by in self.changes(sid)]
            if lines:
                self.laws.append(f"process amount_{sid} {{\n" + "".join(f"            {line}\n" for line in lines) + "        }")
        self.events()

    def quantity(self, sid, value, constant):
        if sid in self.unset:
            if sid in self.rates or sid in self.set_by_events:
                raise Refused("a quantity without a value")
        elif sid in self.assigned:
            self.members.append(f"derived x_{sid}: Ratio = {self.num(self.assigned[sid])}")
        elif sid in self.initial:
            self.state(sid, self.num(self.initial[sid]))
        elif constant and sid not in self.set_by_events and sid not in self.rates:
            self.members.append(f"param x_{sid}: Ratio = {number(value)}")
        else:
            self.state(sid, number(value))

    def events(self):
        events = []
        for i, e in enumerate(self.model.getListOfEvents()):
            priority = 0.0
            if e.isSetPriority() and e.getPriority().getMath() is not None:
                node = e.getPriority().getMath()
                if node.getType() == sb.AST_MINUS and node.getNumChildren() == 1 and node.getChild(0).isNumber():
                    priority = -node.getChild(0).getValue()
                elif node.isNumber():
                    priority = node.getValue()
                else:
                    raise Refused("a priority that is computed")
            events.append((-priority, i, e))
        for place, (_, i, e) in enumerate(sorted(events, key=lambda x: x[:2])):
            trigger = e.getTrigger()
            if trigger is None or trigger.getMath() is None:
                continue
            when = self.truth(trigger.getMath())
            if not trigger.isSetInitialValue() or trigger.getInitialValue():
                # What is true at the start has not become true.
                self.members.append(f"state seen_{i}: Bool = false")
                self.first.append(f"event see_{i} when not {when} and not seen_{i} {{ seen_{i} = true }}")
                when = f"({when} and seen_{i})"
            persists = not trigger.isSetPersistent() or trigger.getPersistent()
            delay = self.num(e.getDelay().getMath()) if e.isSetDelay() and e.getDelay().getMath() is not None else None
            taken = e.getUseValuesFromTriggerTime() if self.level > 2 or self.version >= 4 else True
            sets, takes, values = [], [], []
            for k, a in enumerate(e.getListOfEventAssignments()):
                if a.getMath() is None:
                    continue
                sid = a.getVariable()
                value = self.num(a.getMath())
                if taken and (delay is not None or len(events) > 1):
                    self.members.append(f"state taken_{i}_{k}: Ratio = 0.0")
                    takes.append(f"taken_{i}_{k} = {value}")
                    value = f"taken_{i}_{k}"
                else:
                    values.append(f"let new_{k} = {value}")
                    value = f"new_{k}"
                if sid in self.species and not self.is_direct(sid):
                        value = f"{value} * x_{self.species[sid].getCompartment()}"
                # A concentration is set in the volume as it was, whatever the same event makes of that.
                sets.append((sid in self.compartments, sid, f"x_{sid} = {value}"))
            # The amounts stay where an event sets a volume: concentrations that rules move are others then.
            given = {sid for _, sid, _ in sets}
            for sid, s in self.species.items():
                if sid in self.rates and not self.in_amounts(s) and (c := s.getCompartment()) in given:
                    values.append(f"let size_{c} = x_{c}")
                    sets.append((2, sid, f"x_{sid} = x_{sid} * size_{c} / x_{c}"))
            values = list(dict.fromkeys(values))
            sets = [line for _, _, line in sorted(sets, key=lambda x: x[0])]
            if takes:
                self.first.append(f"event take_{i} when {when} {{\n" + "".join(f"            {t}\n" for t in takes) + "        }")
            if not values + sets:
                continue
            if delay is not None:
                later = f" {'after' if persists else 'for'} {delay} * 1 s"
            else:
                later = " after 0 s" if persists and len(events) > 1 else ""
            body = "".join(f"            {line}\n" for line in values + sets)
            self.last.append(f"event happen_{i} when {when}{later} {{\n{body}        }}")

    def text(self, variables, settings):
        amounts = [v.strip() for v in settings.get("amount", "").split(",")]
        outputs, columns = [], []
        for v in variables:
            if v in self.species:
                s = self.species[v]
                value = self.amount(v) if v in amounts or self.in_amounts(s) and v not in settings.get("concentration", "") else None
                if value is None:
                    value = f"({self.amount(v)} / x_{s.getCompartment()})"
            else:
                value = self.symbol(v)
            self.members.append(f"derived o_{len(outputs)}: Ratio = {value}")
            columns.append(f"m.o_{len(outputs)}")
            outputs.append(v)
        start, duration, steps = (float(settings[k]) for k in ("start", "duration", "steps"))
        if start != 0:
            raise Refused("results from a later time on")
        lines = "".join(f"        {line}\n" for line in self.members + self.laws + self.first + self.last)
        records = "".join(f"    record {c} every {duration / steps!r} s\n" for c in columns)
        return (
            f"mtx 1\ncapability Model {{\n{lines}}}\nasset Case: Model {{ }}\nlab bench {{ ambient: 25 degC, m = Case }}\n"
            f"workflow simulate in bench {{\n{records}    wait {duration!r} s\n}}\n"
        )


def settings_of(path):
    lines = [line.split(":", 1) for line in open(path) if ":" in line]
    return {k.strip(): v.strip() for k, v in lines}


def judge(matterixc, folder, suite, name):
    base = os.path.join(suite, name)
    path = next((p for v in VERSIONS if os.path.exists(p := f"{base}/{name}-sbml-{v}.xml")), None)
    if path is None:
        return name, "refused", "no version of SBML core"
    if "RandomEventExecution" in open(f"{base}/{name}-model.m").read():
        return name, "refused", "events whose order is drawn at random"
    settings = settings_of(f"{base}/{name}-settings.txt")
    rows = [r for r in csv.reader(open(f"{base}/{name}-results.csv")) if r]
    head, expected = [h.strip() for h in rows[0]], rows[1:]
    file = os.path.join(folder, f"{name}.mtx")
    try:
        text = Mapping(path).text(head[1:], settings)
    except Refused as reason:
        return name, "refused", str(reason)
    open(file, "w").write(text)
    if any(not math.isfinite(float(v)) for row in expected for v in row):
        return name, "refused", "a value that is not a finite number"
    out = os.path.join(folder, name)
    try:
        done = subprocess.run([matterixc, "run", file, "--out", out, "--csv"], capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return name, "failed", "takes more than 60 s"
    if done.returncode != 0:
        said = [line for line in (done.stderr + done.stdout).splitlines() if "error" in line or "×" in line or "fail" in line]
        if "event_pending" in done.stdout:
            return name, "refused", "an event that is set off again before it has happened"
        if "chattering" in done.stdout:
            return name, "refused", "events that follow one another ever faster"
        return name, "failed", "; ".join(said[:2])[:200] or f"exit status {done.returncode}"
    found = collections.defaultdict(list)
    for row in csv.DictReader(open(f"{out}/records.csv")):
        found[row["record"]].append(float(row["value"]))
    absolute, relative = float(settings["absolute"]), float(settings["relative"])
    for i, v in enumerate(head[1:]):
        column = found.get(f"m.o_{i}", [])
        if len(column) < len(expected):
            return name, "failed", f"{len(column)} values of {v} instead of {len(expected)}"
        for row, value in zip(expected, column):
            wanted = float(row[i + 1])
            if not abs(value - wanted) <= absolute + relative * abs(wanted):
                return name, "failed", f"{v} at {row[0]} s is {value}, not {wanted}"
    return name, "passed", ""


def main():
    words = sys.argv[1:]
    matterixc, folder, suite = words[:3]
    first, last = (int(words[3]) if len(words) > 3 else 1), (int(words[4]) if len(words) > 4 else 10**6)
    os.makedirs(folder, exist_ok=True)
    names = sorted(n for n in os.listdir(suite) if n.isdigit() and first <= int(n) <= last)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda n: judge(matterixc, folder, suite, n), names))
    for what in ("refused", "failed"):
        reasons = collections.Counter(reason for _, result, reason in results if result == what)
        if what == "refused":
            for reason, count in reasons.most_common():
                print(f"refused {count}: {reason}")
        else:
            for name, result, reason in results:
                if result == what:
                    print(f"FAILED {name}: {reason}")
    count = collections.Counter(result for _, result, _ in results)
    has_events = lambda name: "EventWithDelay" in (tags := open(os.path.join(suite, name, f"{name}-model.m")).read()) or "EventNoDelay" in tags
    events = collections.Counter(result for name, result, _ in results if has_events(name))
    print(f"sbml: {count['passed']} of {len(names)} passed, {count['failed']} failed, {count['refused']} refused;", end=" ")
    print(f"with events {events['passed']} passed, {events['failed']} failed, {events['refused']} refused")
    return 1 if count["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
