"""Public protocols of the OT-2, imported, checked, written again, and compared with what they were.

    python3.11 -m venv venv && venv/bin/pip install opentrons==8.8.2
    git clone https://github.com/Opentrons/Protocols
    venv/bin/python tests/peers/corpus.py all --binary target/release/matterixc --protocols Protocols/protocols --work work

Each protocol goes through these stages; what a stage made is kept in the folder `--work`, and made again only where what it is
made from has changed:

analyse   Opentrons' software runs the protocol with the values that its site offers (corpus_analysis.py), on its protocol engine,
          whatever its level; where that fails, as it is. Protocols for which either comes to its end are the ones counted.
import    `matterixc import opentrons`, `check` and `emit --target opentrons-python`.
again     Opentrons' software analyses what was emitted.
compare   The two analyses, command by command (corpus_compare.py).
report    How many come back the same, and why the others do not, by frequency.

The protocols are parted by the first byte of the SHA-256 of their folder's name: even is the open half, which the importer is
made with; odd is the half held back (`--half held`).

A protocol passes where all its commands are imported, `check` reports no error, and the two analyses do the same. Where `check`
reports an overflow, a well that runs dry, a tip that was taken before, put onto another one or does not fit, or the importer a channel that is over no well, and the
original's own analysis shows the same without either (corpus_faults.py), the protocol is counted apart: a fault of the protocol's was
found. Any other error is false, and the protocol fails.
"""

import argparse
import collections
import concurrent.futures
import functools
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

from corpus_analysis import analyse, files_of
from corpus_compare import difference
from corpus_faults import channels, faults

#: Findings of `check`, and what corpus_faults.py calls them.
CODES = {"volume-overflow": "overflow", "volume-underflow": "underflow", "tip-used": "tip-used", "wrong-spot": "wrong-spot", "wrong-tip": "wrong-tip"}
STAGES = ["analyse", "import", "again", "compare", "report"]


def half_of(name):
    return "held" if hashlib.sha256(name.encode()).digest()[0] % 2 else "open"


@functools.cache
def digest_of_program(path):
    """The same of a program, which no stage changes."""
    return digest(path)


def digest(*paths):
    """What files hold, as one number."""
    out = hashlib.sha256()
    for path in paths:
        out.update(path.read_bytes() if path.exists() else b"-")
    return out.hexdigest()[:16]


class Case:
    """A protocol on its way."""

    def __init__(self, name, given):
        self.name, self.given = name, given
        self.source = given.protocols / name
        self.folder = given.work / name
        self.folder.mkdir(parents=True, exist_ok=True)
        self.state = self.folder / "state.json"
        self.known = json.loads(self.state.read_text()) if self.state.exists() else {}

    def file(self, name):
        return self.folder / name

    def stage(self, name, made_from, make):
        """What a stage says, worked out again where what it is made from is other than it was."""
        known = self.known.get(name)
        if known is None or known["from"] != made_from:
            known = {"from": made_from, **make()}
            self.known[name] = known
            part = self.state.with_suffix(".part")
            part.write_text(json.dumps(self.known, indent=1))
            part.rename(self.state)
        return known

    def analyse(self):
        def make():
            if not list(self.source.glob("*.py")):
                return {"engine": "it has no Python file", "plain": "it has no Python file"}
            files = files_of(self.source, self.folder)
            run = lambda form: analyse(files, self.file(f"{form}.json"), form, self.given.limit)
            said = {"engine": run("engine")}
            if said["engine"] != "ok":
                said["plain"] = run("plain")
                self.file("plain.json").unlink(missing_ok=True)
            return said

        return self.stage("analyse", "1", make)

    def command(self, *arguments):
        """Output, errors and status of the command; none where it takes too long."""
        command = [self.given.binary, *map(str, arguments)]
        try:
            ended = subprocess.run(command, capture_output=True, text=True, timeout=self.given.limit)
        except subprocess.TimeoutExpired:
            return "", f"took more than {self.given.limit} s", None
        return ended.stdout, ended.stderr, ended.returncode

    def bring_in(self):
        """Import, check, emit."""
        def make():
            plan, out = self.file("plan.mtx"), self.file("again.py")
            out.unlink(missing_ok=True)
            said = {"lost": [], "errors": [], "warnings": []}
            _, err, status = self.command("import", "opentrons", self.file("engine.json"), "--out", plan)
            said["lost"], said["numbers"] = lost(err), numbers(err)
            if status != 0:
                return {**said, "failed": "import", "why": last(err)}
            found, err, status = self.command("check", "--format", "json", plan)
            try:
                found = findings(found)
            except ValueError:
                return {**said, "failed": "check", "why": last(err)}
            said["errors"] = [short(f) for f in found if f["severity"] == "error"]
            said["warnings"] = sorted({f["code"] for f in found if f["severity"] == "warning"})
            if status is None or said["errors"]:
                return {**said, "failed": "check", "why": last(err)}
            _, err, status = self.command("emit", plan, "--target", "opentrons-python", "-o", out)
            if status != 0:
                return {**said, "failed": "emit", "why": headline(err)}
            return said

        made_from = digest_of_program(self.given.binary) + digest(self.file("engine.json"))
        return self.stage("import", made_from, make)

    def again(self):
        def make():
            self.file("again.json").unlink(missing_ok=True)
            return {"said": analyse([self.file("again.py")], self.file("again.json"), "engine", self.given.limit)}

        return self.stage("again", digest(self.file("again.py")), make)

    def compare(self):
        def make():
            before, after = (json.loads(self.file(name).read_text()) for name in ("engine.json", "again.json"))
            kind, text = difference(before, after)
            return {"kind": kind, "text": text}

        code = digest_of_program(pathlib.Path(__file__).with_name("corpus_compare.py"))
        return self.stage("compare", code + digest(self.file("engine.json"), self.file("again.json")), make)

    def fault(self, errors):
        """The faults of the protocol's that explain all errors that `check` reports, well by well; none where one stays unexplained."""
        known = faults(json.loads(self.file("engine.json").read_text())) if errors else []
        found = []
        for error in errors:
            label = re.search(r"`\w+\[(\w+)\]`", error["text"])
            if error["code"] == "wrong-tip":
                # The whole rack is named.
                same = [f for f in known if f[0] == "wrong-tip"]
                if not same:
                    return None
                found += same
                continue
            same = [f for f in known if label and CODES.get(error["code"]) == f[0] and f[1].startswith(f"{label[1]} of ")]
            if not same:
                return None
            found += same
        return sorted(found)

    def goes_beside(self, said):
        """Whether nothing is lost but commands in which a channel with a tip is over no well."""
        if not said["lost"] or not all(reason.endswith(": some of its channels reach no well") for reason in said["lost"]):
            return False
        return set(said["numbers"]) <= channels(json.loads(self.file("engine.json").read_text()))[1]

    def outcome(self, upto):
        """What became of it: `pass`, `fault`, `uncounted` or `fail`, and why."""
        stages = STAGES.index(upto)
        said = self.analyse()
        if said["engine"] != "ok":
            if said["plain"] != "ok":
                return "uncounted", said["plain"]
            return "fail", f"analyse: on the engine: {general(said['engine'])}"
        if stages < 1:
            return "analysed", ""
        said = self.bring_in()
        if said.get("failed") == "check" and said["errors"]:
            known = self.fault(said["errors"])
            if known:
                return "fault", f"{known[0][0]} of {known[0][1]}"
        if self.goes_beside(said):
            return "fault", "a channel over no well"
        if said["lost"]:
            return "fail", "lost: " + said["lost"][0]
        if said.get("failed") == "check" and said["errors"]:
            return "fail", f"check: {said['errors'][0]['code']}"
        if "failed" in said:
            return "fail", f"{said['failed']}: {general(said['why'])}"
        if stages < 2:
            return "emitted", ""
        said = self.again()["said"]
        if said != "ok":
            return "fail", f"again: {general(said)}"
        if stages < 3:
            return "analysed again", ""
        said = self.compare()
        return ("fail", f"compare: {said['kind']}") if said["kind"] else ("pass", "")


def lost(err):
    """Commands that were not imported, by what they are and why."""
    found = []
    for line in err.splitlines():
        match = re.fullmatch(r"not imported because (.*?): ((?:\S+ \(command \d+\)(?:, )?)+.*)", line.strip())
        if match:
            names = dict.fromkeys(re.findall(r"(\S+) \(command \d+\)", match[2]))
            found += [f"{name}: {general(match[1])}" for name in names]
    return list(dict.fromkeys(found))


def numbers(err):
    """The numbers of the commands that were not imported, as far as they are listed: the first ones for each reason."""
    lines = [line for line in err.splitlines() if line.strip().startswith("not imported because ")]
    return sorted({int(number) for line in lines for number in re.findall(r"\(command (\d+)\)", line)})


def findings(text):
    """What `check` says in JSON, a line each."""
    return [json.loads(line) for line in text.splitlines()]


def short(finding):
    return {"code": finding["code"], "text": finding["headline"]}


def last(text):
    return (text.strip().splitlines() or ["no word"])[-1]


def headline(text):
    """The first error of a rendered report."""
    lines = [line for line in text.splitlines() if line.startswith("error")]
    return lines[0] if lines else last(text)


def general(text):
    """A reason without names and numbers, so that like ones are counted together."""
    text = re.sub(r"`[^`]*[\[.][^`]*`|'[^']*'", "_", text)
    return re.sub(r"-?\d+(\.\d+)?", "N", text)[:160]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", choices=[*STAGES, "all"])
    parser.add_argument("--protocols", type=pathlib.Path, default=os.environ.get("MATTERIX_PROTOCOLS"))
    parser.add_argument("--binary", type=pathlib.Path, default="target/release/matterixc")
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--half", choices=["open", "held"], default="open")
    parser.add_argument("--limit", type=int, default=300, help="seconds for each program that is run (300)")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--least", type=float, help="the share that must pass; the exit status is 1 below")
    parser.add_argument("names", nargs="*", help="these protocols only")
    given = parser.parse_intermixed_args()
    if given.protocols is None:
        parser.error("--protocols or MATTERIX_PROTOCOLS must say where the folder `protocols` of Opentrons/Protocols is")
    given.protocols, given.work = pathlib.Path(given.protocols).resolve(), given.work.resolve()
    given.binary = given.binary.resolve()
    names = given.names or sorted(p.name for p in given.protocols.iterdir() if p.is_dir() and half_of(p.name) == given.half)
    names = [name for name in names if half_of(name) == given.half]
    upto = "compare" if given.stage in ("all", "report") else given.stage
    with concurrent.futures.ProcessPoolExecutor(given.jobs) as pool:
        pending = [(name, pool.submit(work, name, given, upto)) for name in names]
        outcomes = []
        for name, future in pending:
            outcomes.append((name, *future.result()))
            if given.stage != "report":
                print(*outcomes[-1], flush=True)
    return report(outcomes, given)


def work(name, given, upto):
    return Case(name, given).outcome(upto)


def report(outcomes, given):
    """The figure, and why the others fail, by frequency."""
    count = collections.Counter(outcome for _, outcome, _ in outcomes)
    counted = len(outcomes) - count["uncounted"]
    print(f"\n{len(outcomes)} protocols of the {given.half} half; {counted} analyse")
    for outcome, number in count.most_common():
        print(f"  {outcome:15} {number:4} {100 * number / max(1, counted):5.1f} %")
    for wanted in ("fail", "fault", "uncounted"):
        reasons = collections.defaultdict(list)
        for name, outcome, why in outcomes:
            if outcome == wanted:
                reasons[why].append(name)
        if reasons:
            print(f"\n{wanted}:")
        for why, names in sorted(reasons.items(), key=lambda item: -len(item[1])):
            print(f"  {len(names):4}  {why}  ({', '.join(names[:3])})")
    if given.least is not None and count["pass"] < given.least * counted:
        print(f"\nfewer than {100 * given.least:g} % pass")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
