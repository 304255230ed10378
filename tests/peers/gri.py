"""GRI-Mech 3.0, written as processes of a capability from Cantera's data, run and compared with Cantera's own reactor.

    gri.py MATTERIXC FOLDER [MECHANISM.yaml]

A closed, adiabatic vessel of constant volume with a stoichiometric mixture of methane and air, once per start temperature; 53 species and
325 reactions with third bodies and fall-off (Lindemann, Troe). Mole fractions above 1e-8 and the temperature must agree within 1e-4 at
times before, in and after ignition, and the time of ignition too. Exit status 1 where they do not.
"""

import csv
import os
import subprocess
import sys
import time

import cantera as ct

CLOSE = 1e-4
STARTS = ((1300.0, 101325.0), (1500.0, 10 * 101325.0), (1800.0, 101325.0))


def num(value):
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def arrhenius(rate):
    out = num(rate.pre_exponential_factor)
    if rate.temperature_exponent:
        out += f" * T ^ {num(rate.temperature_exponent)}"
    if rate.activation_energy:
        out += f" * exp({num(-rate.activation_energy / ct.gas_constant)} / T)"
    return f"({out})"


def product(sides, name):
    terms = []
    for species, n in sides.items():
        c = f"c_{name[species]}"
        terms += [c] * int(n) if float(n).is_integer() else [f"{c} ^ {num(n)}"]
    return " * ".join(terms) or "1.0"


def falloff(rate):
    if isinstance(rate, ct.LindemannRate):
        return "1.0"
    if not isinstance(rate, ct.TroeRate):
        raise SystemExit(f"a fall-off of another kind: {rate.type}")
    a, t3, t1, *t2 = rate.falloff_coeffs
    centre = f"{num(1 - a)} * exp(-T / {num(t3)}) + {num(a)} * exp(-T / {num(t1)})"
    if t2:
        centre += f" + exp({num(-t2[0])} / T)"
    return f"troe(pr, {centre})"


def written(gas, until, every):
    name = {s: f"s{i}" for i, s in enumerate(gas.species_names)}
    members, laws = [], []
    members.append(f"state T: Ratio = {num(gas.T)}")
    for s, c in zip(gas.species_names, gas.concentrations):
        members.append(f"state c_{name[s]}: Ratio = {num(c)}")
    for s in gas.species():
        middle, high, low = s.thermo.coeffs[0], s.thermo.coeffs[1:8], s.thermo.coeffs[8:15]
        h = lambda a: " + ".join([num(a[0])] + [f"{num(a[i] / (i + 1))} * T ^ {i}" for i in range(1, 5)] + [f"{num(a[5])} / T"])
        cp = lambda a: " + ".join([num(a[0])] + [f"{num(a[i])} * T ^ {i}" for i in range(1, 5)])
        sr = lambda a: " + ".join([f"{num(a[0])} * ln(T)"] + [f"{num(a[i] / i)} * T ^ {i}" for i in range(1, 5)] + [num(a[6])])
        for what, of in (("h", h), ("cp", cp), ("sr", sr)):
            members.append(f"derived {what}_{name[s.name]}: Ratio = choose(T < {num(middle)}, {of(low)}, {of(high)})")
        members.append(f"derived g_{name[s.name]}: Ratio = h_{name[s.name]} - sr_{name[s.name]}")
    change = {s: [] for s in gas.species_names}
    for i, r in enumerate(gas.reactions()):
        third = r.third_body
        m = None
        if third is not None:
            terms = []
            for s in gas.species_names:
                e = third.efficiencies.get(s, third.default_efficiency)
                if e:
                    terms.append(f"c_{name[s]}" if e == 1 else f"{num(e)} * c_{name[s]}")
            m = " + ".join(terms)
        rate = r.rate
        body = []
        if isinstance(rate, ct.ArrheniusRate):
            body.append(f"derived k_{i}: Ratio = {arrhenius(rate)}" + (f" * ({m})" if m else ""))
        elif isinstance(rate, ct.FalloffRate):
            body.append(f"derived p_{i}: Ratio = {arrhenius(rate.low_rate)} * ({m}) / {arrhenius(rate.high_rate)}")
            f = falloff(rate).replace("pr,", f"p_{i},")
            body.append(f"derived k_{i}: Ratio = {arrhenius(rate.high_rate)} * p_{i} / (1.0 + p_{i}) * {f}")
        else:
            raise SystemExit(f"a rate of another kind: {rate.type}")
        net = {}
        for side, sign in ((r.reactants, -1), (r.products, 1)):
            for s, n in side.items():
                net[s] = net.get(s, 0) + sign * n
        net = {s: n for s, n in net.items() if n}
        flow = product(r.reactants, name)
        if r.reversible:
            g = " + ".join(f"{num(-n)} * g_{name[s]}" for s, n in net.items())
            total = sum(net.values())
            power = f" * ({num(ct.one_atm / ct.gas_constant)} / T) ^ {num(total)}" if total else ""
            body.append(f"derived e_{i}: Ratio = exp({g}){power}")
            flow = f"({flow} - {product(r.products, name)} / e_{i})"
        body.append(f"derived w_{i}: Ratio = k_{i} * {flow}")
        members += body
        for s, n in net.items():
            change[s].append(f"{num(n)} * w_{i}")
    for s, terms in change.items():
        members.append(f"derived d_{name[s]}: Ratio = {' + '.join(terms) or '0.0'}")
        if terms:
            laws.append(f"process of_{name[s]} {{ c_{name[s]}' += d_{name[s]} / 1 s }}")
    heat = " + ".join(f"(h_{name[s]} - 1.0) * d_{name[s]}" for s in gas.species_names)
    capacity = " + ".join(f"c_{name[s]} * (cp_{name[s]} - 1.0)" for s in gas.species_names)
    laws.append(f"process of_T {{ T' += -T * ({heat}) / ({capacity}) / 1 s }}")
    watched = ["T"] + [f"c_{name[s]}" for s in gas.species_names]
    records = "".join(f"    record m.{w} every {every!r} s\n" for w in watched)
    lines = "".join(f"    {line}\n" for line in members + laws)
    text = (
        "mtx 1\n"
        "/// Broadening of fall-off: Gilbert, Luther, Troe, Ber. Bunsenges. Phys. Chem. 87, 169 (1983).\n"
        "fn troe(pr: Ratio, centre: Ratio) -> Ratio =\n"
        "    10.0 ^ (log10(centre) / (1.0 + (shift(pr, log10(centre)) / (0.75 - 1.27 * log10(centre) - 0.14 * shift(pr, log10(centre)))) ^ 2))\n"
        "fn shift(pr: Ratio, f: Ratio) -> Ratio = log10(pr) - 0.4 - 0.67 * f\n"
        f"capability Gas {{\n{lines}}}\nasset Vessel: Gas {{ }}\nlab bench {{ ambient: 25 degC, m = Vessel }}\n"
        f"workflow burn in bench {{\n{records}    wait {until!r} s\n}}\n"
    )
    return text, watched


def main():
    matterixc, folder = sys.argv[1:3]
    mechanism = sys.argv[3] if len(sys.argv) > 3 else "gri30.yaml"
    os.makedirs(folder, exist_ok=True)
    worst = 0.0
    for kelvin, pressure in STARTS:
        gas = ct.Solution(mechanism)
        gas.TPX = kelvin, pressure, "CH4:1, O2:2, N2:7.52"
        def net_of():
            reactor = ct.IdealGasReactor(gas, clone=False)
            net = ct.ReactorNet([reactor])
            net.rtol, net.atol = 1e-11, 1e-22
            net.max_steps = 10**6
            return reactor, net
        start = gas.state
        reactor, net = net_of()
        last, steepest, ignition = (0.0, kelvin), 0.0, 0.0
        while net.time < 1.0:
            net.step()
            slope = (reactor.T - last[1]) / (net.time - last[0])
            if slope > steepest:
                steepest, ignition = slope, net.time
            last = (net.time, reactor.T)
        # 20 times, the tenth a little before ignition.
        until, every = 2.0 * ignition, 0.1 * ignition
        gas.state = start
        text, watched = written(gas, until, every)
        file = os.path.join(folder, f"gri-{kelvin:.0f}.mtx")
        open(file, "w").write(text)
        began = time.perf_counter()
        done = subprocess.run([matterixc, "run", file, "--out", os.path.join(folder, f"gri-{kelvin:.0f}"), "--csv"], capture_output=True, text=True)
        took = time.perf_counter() - began
        if done.returncode != 0:
            print((done.stderr + done.stdout)[-2000:])
            return 1
        found = {}
        for row in csv.DictReader(open(os.path.join(folder, f"gri-{kelvin:.0f}", "records.csv"))):
            found.setdefault(float(row["time [s]"]), {})[row["record"]] = float(row["value"])
        gas.state = start
        began = time.perf_counter()
        reactor, net = net_of()
        apart, at = 0.0, ""
        times = sorted(t for t in found if t > 0)
        for t in times:
            net.advance(t)
            total = sum(found[t][f"m.{w}"] for w in watched[1:])
            apart_T = abs(found[t]["m.T"] / reactor.T - 1.0)
            if apart_T > apart:
                apart, at = apart_T, f"T at {t:.6g} s"
            for w, s, x in zip(watched[1:], gas.species_names, reactor.phase.X):
                if x > 1e-8:
                    off = abs(found[t][f"m.{w}"] / total / x - 1.0)
                    if off > apart:
                        apart, at = off, f"{s} at {t:.6g} s"
        other = time.perf_counter() - began
        worst = max(worst, apart)
        print(f"gri: {kelvin:.0f} K, {pressure / 101325:.0f} atm, ignition at {ignition:.6g} s: within {apart:.1e} ({at}); {took:.2f} s, Cantera {other:.2f} s")
    return 0 if worst <= CLOSE else 1


if __name__ == "__main__":
    sys.exit(main())
