"""How long protocols take: by `matterixc run`, and by the estimate of Opentrons' own software.

    venv/bin/python tests/peers/corpus.py import --protocols Protocols/protocols --work work
    venv/bin/python tests/peers/durations.py --protocols Protocols/protocols --work work

The `DurationEstimator` of `opentrons` (of `opentrons_simulate --estimate-duration`; its times for tips, lids and modules are from hardware)
follows a protocol on the older core, below API level 2.14. Where it comes to its end the same protocol, as corpus.py has imported it, is run here.
What persons take is 0 in both. Printed are the ratios of the two, and how they are spread.
"""

import argparse
import concurrent.futures
import contextlib
import io
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

from corpus_analysis import files_of, patch_modules


def theirs(folder):
    """Seconds by Opentrons' estimate; none where it does not come to its end."""
    import opentrons.simulate as simulate
    from opentrons.protocols.duration import DurationEstimator

    patch_modules()
    with tempfile.TemporaryDirectory() as place:
        work = pathlib.Path(place)
        protocol, *labware = files_of(folder, work)
        own = work / "labware"
        own.mkdir()
        for path in labware:
            shutil.copy(path, own / path.name)
        estimator = DurationEstimator()
        quiet = io.StringIO()
        try:
            with open(protocol, encoding="utf8") as text, contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
                simulate.simulate(text, protocol.name, custom_labware_paths=[str(own)], duration_estimator=estimator, log_level="error")
        except Exception:
            return None
        return estimator.get_total_duration()


def ours(plan, binary, limit):
    """Seconds of the run; none where it does not come to its end."""
    try:
        ended = subprocess.run([binary, "run", plan, "--format", "json"], capture_output=True, text=True, timeout=limit)
        said = json.loads(ended.stdout)
    except (subprocess.TimeoutExpired, ValueError):
        return None
    return said["end"] if said["failure"] is None else None


def both(name, given):
    plan = given.work / name / "plan.mtx"
    found = theirs(given.protocols / name) if plan.exists() else None
    return (found, ours(plan, given.binary, given.limit)) if found else (None, None)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--protocols", type=pathlib.Path, default=os.environ.get("MATTERIX_PROTOCOLS"), required="MATTERIX_PROTOCOLS" not in os.environ)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="the folder of corpus.py")
    parser.add_argument("--binary", type=pathlib.Path, default="target/release/matterixc")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--limit", type=int, default=300, help="seconds for a run (300)")
    given = parser.parse_args()
    given.protocols, given.binary = pathlib.Path(given.protocols), given.binary.resolve()
    names = sorted(path.name for path in given.work.iterdir() if path.is_dir())
    ratios = []
    with concurrent.futures.ProcessPoolExecutor(given.jobs) as pool:
        for name, pending in [(name, pool.submit(both, name, given)) for name in names]:
            their, our = pending.result()
            if not their or our is None:
                continue
            ratios.append(our / their)
            print(f"{name:40} {their:9.0f} s {our:9.0f} s {our / their:6.2f}", flush=True)
    if len(ratios) < 2:
        print("nothing to compare")
        return 1
    tenths = statistics.quantiles(ratios, n=10)
    within = sum(abs(ratio - 1) <= 0.25 for ratio in ratios) / len(ratios)
    print(f"\n{len(ratios)} protocols: ours to theirs {statistics.median(ratios):.2f} in the middle, {tenths[0]:.2f} to {tenths[-1]:.2f} for eight of ten")
    print(f"within a quarter: {100 * within:.0f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
