"""Networks of N species and 2N reactions (`cargo bench --bench growth -- generate species N`), integrated by SUNDIALS in the same run.

    cvode.py MATTERIXC FILE...

Each FILE is one that the bench wrote. CVODE (scikit-SUNDAE) has the rates as a sparse matrix times the amounts. It has a dense linear solver
with its Jacobian given or by differences, and a sparse one (SuperLU_MT). Its absolute tolerance, 1e-6 of the relative one in mol, leaves
amounts that only begin to come about unresolved; `from nothing on` has one of 1e-30 mol instead, as matterixc follows each amount from its first molecules on. The amounts at the end are known exactly, by the exponential of the matrix; CVODE is
given the loosest tolerance of 1e-4 .. 1e-13 at which it is as accurate as matterixc, by the largest relative error of an amount. The time of matterixc is that of the whole command, less that
of the same file with a wait of 1 ms: reading, checking and reporting are left out.
"""

import json
import re
import subprocess
import sys
import tempfile
import time

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from sksundae.cvode import CVODE

END = 600.0


def least(times, work):
    best, result = float("inf"), None
    for _ in range(times):
        began = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - began)
    return best, result


def ours(matterixc, file):
    def run():
        return subprocess.run([matterixc, "run", file, "--format", "json"], check=True, capture_output=True).stdout

    took, out = least(3, run)
    return took, json.loads(out)


def amounts(report, n):
    (beaker,) = [m for m in report["containers"] if m["name"].startswith("beaker")]
    by_name = {s["name"]: s["amount"] for s in beaker["species"]}
    return np.array([by_name.get(f"S{i}", 0.0) for i in range(n)])


def cvode(rates, start, solver, tolerance, absolute):
    whole = rates.toarray()
    sparse = rates.tocsc()

    def f(t, y, dy):
        dy[:] = rates @ y

    if solver == "dense":

        def jacobian(t, y, dy, j):
            j[:] = whole

        how = {"linsolver": "dense", "jacfn": jacobian}
    elif solver == "dense by differences":
        how = {"linsolver": "dense"}
    else:
        how = {"linsolver": "sparse", "sparsity": sparse}
    model = CVODE(f, rtol=tolerance, atol=absolute, method="BDF", max_num_steps=10**6, **how)
    return least(3, lambda: model.solve(np.array([0.0, END]), start).y[-1])


def main():
    matterixc, files = sys.argv[1], sys.argv[2:]
    for file in files:
        text = open(file).read()
        n = len(re.findall(r"^species S\d+", text, re.M))
        entry = re.compile(r"^reaction \w+: S(\d+) -> S(\d+) \{ rate: (\S+) 1/s", re.M)
        rates = sp.lil_matrix((n, n))
        for a, b, k in entry.findall(text):
            rates[int(a), int(a)] -= float(k)
            rates[int(b), int(a)] += float(k)
        rates = rates.tocsr()
        start = np.zeros(n)
        start[0] = 10e-3
        exact = scipy.linalg.expm(rates.toarray() * END) @ start

        def error(found):
            return (np.abs(found - exact) / exact).max()

        with tempfile.NamedTemporaryFile("w", suffix=".mtx") as short:
            short.write(text.replace("wait 10 min", "wait 1 ms"))
            short.flush()
            begin, _ = ours(matterixc, short.name)
        took, report = ours(matterixc, file)
        wanted = error(amounts(report, n))
        row = f"{n} species: matterixc {took - begin:.3f} s of {took:.2f} s, error {wanted:.1e}"
        for name in ("dense", "dense by differences", "sparse", "dense, from nothing on", "sparse, from nothing on"):
            solver, _, whole = name.partition(", ")
            for digits in range(4, 14):
                absolute = 1e-30 if whole else 10.0 ** -(digits + 6)
                other, found = cvode(rates, start, solver, 10.0**-digits, absolute)
                if error(found) <= wanted:
                    row += f"; CVODE {name} at 1e-{digits} {other:.3f} s, error {error(found):.1e}"
                    break
            else:
                row += f"; CVODE {name} is never as accurate"
        print(row, flush=True)


if __name__ == "__main__":
    main()
