"""Compares two builds of the command: where they say anything different of the same texts, to the last byte.

usage: same.py OLD NEW [--generated N] [--edits N] [--seed S] [--only PART] FILE|FOLDER...

    python3 tests/peers/same.py before target/release/matterixc examples tests/cases
    python3 tests/peers/same.py before target/release/matterixc --only edits --edits 20000 examples tests/faults

Three parts, `--only` one of them:

- `commands`: every text is checked (for programs, for people, strictly, at either fidelity, with what is known at each
  statement, with its corrections made), written in the one style, and asked for the names it gives; each workflow is scheduled.
  Where nothing is wrong each workflow is also run, billed, shown, written down, emitted for every target and, with bindings
  beside it, deployed dry; tests, studies and fits are carried out. Compared are standard output, standard error, the exit
  status and every file that was written.
- `generated`: N texts with mistakes, made from those given, are checked, some also at the fidelity of motions, and so on.
- `edits`: two language servers are given the same N edits. Compared are what they find after each; after every fifth what they
  have told of all open texts, and what they answer to everything they say they can be asked, at one place; and what is told in
  the end of a text that is whole again, once nothing moves any more.

Both builds work in copies of the texts with what lies beside them, so that imports and files of data are found, and have caches
of their own. What depends on the machine is not compared: what a search for a schedule had found when the clock cut it off, and
numbers of threads. A crash or a timeout of both is said and counted; of one, it is a difference.

The exit status is 0 if nothing differs, 1 if something does, 2 for bad usage. Texts that made a difference, or were too much for
both, are kept, for edits with what was sent to come to it.
"""

import argparse
import difflib
import json
import os
import queue
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from urllib.parse import quote

# The parts, by what is counted of each.
PARTS = {"commands": "commands", "generated": "generated texts", "edits": "edits"}
# Seconds that a command or an answer of a server may take. What only one build does not do in time it may try again, so many
# times as long.
PATIENCE = 120.0
AGAIN = 3
# The same for a text that was generated, of which many may take for ever.
SHORT = 30.0
# Differences that are printed, and of one kind; all are counted. Things said, lines and columns of each.
SHOWN = 20
ALIKE = 3
THINGS = 2
LINES = 14
COLUMNS = 200
# Bytes of address space for each process, stacks that are never used included: a bomb must not take the machine along.
SPACE = 16 << 30
# What stands for the folder of a build in whatever it says.
HERE = "/same-side"
OUT = "same_out"
TARGETS = ["opentrons-json", "opentrons-python", "commands", "commands-json", "urscript"]
TARGETS += ["joint-trajectory", "joint-trajectory-json"]


class Tally:
    """What was compared, what differs, and where it is kept."""

    def __init__(self, kept):
        self.counts, self.kinds, self.kept = Counter(), Counter(), kept
        self.differences, self.shown, self.noted = 0, 0, 0
        self.said = time.monotonic()

    def differ(self, text, kind, command, what):
        """One difference: of a text, at a command of some kind, with pairs of what both say by the names of what they are."""
        self.differences += 1
        kind = f"{kind}: {', '.join(what)}"
        self.kinds[kind] += 1
        if self.shown >= SHOWN or self.kinds[kind] > ALIKE:
            return
        self.shown += 1
        print(f"\nDIFFERENT {self.differences}: {text}\n  {command}")
        for name, (old, new) in list(what.items())[:THINGS]:
            print(f"  {name}:")
            for line in first_lines(old, new):
                print(f"    {line}")
        if len(what) > THINGS:
            print(f"  also {', '.join(list(what)[THINGS:])}")
        sys.stdout.flush()

    def note(self, why):
        """What befell both builds alike."""
        self.counts["crashes and timeouts of both"] += 1
        self.noted += 1
        if self.noted <= SHOWN:
            print(f"both: {why}", flush=True)

    def keep(self, name, text):
        """Keeps a text that made a difference."""
        self.kept.mkdir(exist_ok=True)
        path = self.kept / name.replace("/", "-")
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    def progress(self, part, done, of):
        """A sign of life on standard error, now and then."""
        if time.monotonic() - self.said > 20:
            self.said = time.monotonic()
            print(f"{part}: {done} of {of}, {self.differences} differences", file=sys.stderr, flush=True)


def first_lines(old, new):
    """The first lines of a unified diff of two things; JSON is laid out before."""
    if isinstance(old, bytes) and isinstance(new, bytes) and (b"\0" in old or b"\0" in new):
        at = next((i for i, (a, b) in enumerate(zip(old, new)) if a != b), min(len(old), len(new)))
        parts = [str(data[max(0, at - 30) : at + 60]) for data in (old, new)]
        return [f"{len(old)} and {len(new)} bytes, from byte {max(0, at - 30)} on:", "-" + parts[0], "+" + parts[1]]
    a, b = laid_out(old), laid_out(new)
    if a == b:
        a, b = plain(old), plain(new)
    start = next((i for i, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
    a, b = a[max(0, start - 1) : start + 200], b[max(0, start - 1) : start + 200]
    diff = list(difflib.unified_diff(a, b, "old", "new", lineterm="", n=1))[3:]
    gone, come = (next((line for line in diff if line.startswith(sign)), "") for sign in "-+")
    column = len(os.path.commonprefix([gone[1:], come[1:]]))
    where = [f"at line {start + 1}"] if start else []
    more = [f"({len(diff) - LINES} lines more)"] if len(diff) > LINES else []
    return where + [narrow(line, column) for line in diff[:LINES]] + more


def plain(value):
    """A thing as lines, as it is."""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return value.splitlines(keepends=False) if isinstance(value, str) else json.dumps(value, sort_keys=True).splitlines()


def laid_out(value):
    """A thing as lines: JSON, and lines of JSON, a line for each value."""
    if not isinstance(value, (bytes, str)):
        return json.dumps(value, indent=1, sort_keys=True, ensure_ascii=False).splitlines()
    lines = plain(value)
    for parts in (["\n".join(lines)], lines):
        try:
            return [row for part in parts for row in json.dumps(json.loads(part), indent=1, ensure_ascii=False).splitlines()]
        except ValueError:
            pass
    return lines


def narrow(line, column):
    """A line of a diff, cut to what stands around a column."""
    start = 1 + (max(0, column - COLUMNS // 2) if len(line) > COLUMNS else 0)
    before, after = "…" if start > 1 else "", "…" if len(line) > start + COLUMNS else ""
    return line[:1] + before + line[start : start + COLUMNS] + after


class Side:
    """A build with a copy of the texts and a cache of its own."""

    def __init__(self, name, binary, folder):
        self.name, self.binary = name, str(Path(binary).resolve())
        self.root = folder / name
        self.tree = self.root / "tree"
        self.tree.mkdir(parents=True)
        kept = {k: v for k, v in os.environ.items() if k in ("PATH", "LANG", "LC_ALL", "TMPDIR", "LD_LIBRARY_PATH")}
        self.env = {**kept, "HOME": str(self.root), "XDG_CACHE_HOME": str(self.root / "cache"), "TERM": "dumb", "TZ": "UTC"}

    def start(self, arguments, **streams):
        """A process of the build, in its tree, under the command's name."""
        command, where = ["matterixc", *arguments], {"cwd": self.tree, "env": self.env}
        return subprocess.Popen(command, executable=self.binary, start_new_session=True, **where, **streams)

    def neutral(self, said):
        """What was said without what differs between any two processes: the folder they work in, the numbers of threads."""
        said = said.replace(str(self.root).encode(), HERE.encode())
        return re.sub(rb"(thread '[^']*') \(\d+\)", rb"\1", said)

    def files(self, path):
        """All files at or below a path of the tree, by their names."""
        path = self.tree / path
        found = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
        return {str(p.relative_to(self.tree)): p.read_bytes() for p in found}


class Ended:
    """How a command of one build ended."""

    def __init__(self, side, status, out, err, files):
        self.status, self.out, self.err = status, side.neutral(out), side.neutral(err)
        self.files = {name: side.neutral(data) for name, data in files.items()}
        self.crashed = status is not None and status not in (0, 1, 2)


class Running:
    """A command of one build while it goes on."""

    def __init__(self, side, arguments):
        self.side = side
        self.out, self.err = (open(side.root / name, "w+b") for name in ("stdout", "stderr"))
        self.process = side.start(arguments, stdin=subprocess.DEVNULL, stdout=self.out, stderr=self.err)

    def end(self, until, written):
        """Waits for its end, and ends it where that does not come."""
        while self.process.poll() is None and time.monotonic() < until:
            time.sleep(0.003)
        status, said = self.process.poll(), []
        end(self.process)
        for stream in (self.out, self.err):
            stream.seek(0)
            said.append(stream.read())
            stream.close()
        return Ended(self.side, status, *said, self.side.files(written) if written else {})


def end(process):
    """Ends a process and what it has started, if it still runs."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


class Bench:
    """Two builds, given the same to do at the same time."""

    def __init__(self, old, new, folder, tally):
        self.sides = [Side("old", old, folder), Side("new", new, folder)]
        # How the last command ended with either.
        self.tally, self.ended = tally, []

    def perform(self, side, arguments, copy, written):
        """Starts a command in a tree without leftovers of an earlier one."""
        discard(side.tree / written if written else None)
        if copy:
            shutil.copyfile(side.tree / copy, side.tree / written)
        return Running(side, arguments)

    def carry_out(self, arguments, written, copy, patience):
        """How a command ended with both, which leaves nothing behind."""
        running = []
        try:
            for side in self.sides:
                running.append(self.perform(side, arguments, copy, written))
            until = time.monotonic() + patience
            ended = [one.end(until, written) for one in running]
            late = [one.status is None for one in ended]
            if any(late) and not all(late):
                # The machine may have been busy.
                slow = late.index(True)
                running.append(self.perform(self.sides[slow], arguments, copy, written))
                ended[slow] = running[-1].end(time.monotonic() + AGAIN * patience, written)
            return ended
        finally:
            for one in running:
                end(one.process)
            for side in self.sides:
                discard(side.tree / written if written else None)

    def compare(self, text, arguments, written=None, copy=None, patience=PATIENCE, only=lambda out: out):
        """Has both do a command; whether both ended with status 0. `written` is what it may write, `copy` what must lie there
        before, `only` takes the part of standard output that counts."""
        self.tally.counts["commands"] += 1
        line = "matterixc " + " ".join(arguments)
        old, new = self.ended = self.carry_out(arguments, written, copy, patience)
        if old.status is None and new.status is None:
            self.tally.note(f"not within {patience:.0f} s: {line}")
            return False
        if old.crashed and new.crashed and old.status == new.status:
            # Where in its text a program has crashed is a matter of its text.
            self.tally.note(f"ended with status {old.status}: {line}")
            old.err = new.err = b""
        what = {"status": (lasted(old), lasted(new))}
        what["standard error"] = (old.err, new.err)
        what["standard output"] = (only(old.out), only(new.out))
        for name in sorted(old.files.keys() | new.files.keys()):
            what[name] = (old.files.get(name, "not written"), new.files.get(name, "not written"))
        what = {name: pair for name, pair in what.items() if pair[0] != pair[1]}
        if what:
            kind = " ".join(a for a in arguments if a.startswith("--") or a in TARGETS)
            self.tally.differ(text, f"{arguments[0]} {kind}", line, what)
        return old.status == 0 and new.status == 0


def lasted(ended):
    """How a command ended, in words."""
    if ended.status is None:
        return "still goes on"
    return str(ended.status) if ended.status >= 0 else f"killed by signal {-ended.status}"


def discard(path):
    """Removes a file or a folder, if it is there."""
    if path is not None and path.is_dir():
        shutil.rmtree(path)
    elif path is not None:
        path.unlink(missing_ok=True)


# The texts.


class Texts:
    """The texts to compare with, copied to both builds with what lies beside them. Paths are as the builds see them."""

    def __init__(self, paths, bench):
        paths = [Path(p).resolve() for p in paths]
        folders = [p if p.is_dir() else p.parent for p in paths]
        here = Path.cwd()
        root = here if all(f.is_relative_to(here) for f in folders) else Path(os.path.commonpath(folders))
        for folder in folders:
            for side in bench.sides:
                shutil.copytree(folder, side.tree / folder.relative_to(root), ignore=aside, dirs_exist_ok=True)
        found = {t for p in paths for t in ([p] if p.is_file() else seen(p))}
        self.all = sorted(str(t.relative_to(root)) for t in found)
        self.tree = bench.sides[0].tree
        self.folders = {}
        for path in self.all:
            self.folders.setdefault(os.path.dirname(path), []).append(path)
        whole = {path: self.whole(path) for path in self.all}
        self.readable = {path: text for path, text in whole.items() if text is not None}
        self.units = sorted({unit for text in self.readable.values() for unit in UNIT.findall(text)})

    def whole(self, path):
        """A text as it is in the copies, if it is text."""
        try:
            return (self.tree / path).read_bytes().decode()
        except ValueError:
            return None

    def any(self, rng, paths=None):
        """One of them, by folders, so that one with many texts does not drown the others."""
        folders = self.folders if paths is None else {f: [p for p in all if p in paths] for f, all in self.folders.items()}
        while True:
            path = rng.choice(rng.choice([all for _, all in sorted(folders.items()) if all]))
            if path in self.readable:
                return path

    def imports(self, path):
        """What a text imports that lies beside it, with what that imports, each once; the text itself is first."""
        found = [path]
        for one in found:
            for module in re.findall(r"^use\s+([\w:]+)", self.whole(one) or "", re.M):
                parts = module.strip(":").split("::")
                for depth in (len(parts), len(parts) - 1):
                    there = os.path.join(os.path.dirname(path), *parts[:depth]) + ".mtx" if depth else ""
                    if there and there not in found and (self.tree / there).is_file():
                        found.append(there)
        return found


def aside(folder, names):
    """What is not copied."""
    skipped = ("target", "node_modules", "__pycache__")
    return [n for n in names if n.startswith(".") or n in skipped or os.path.islink(os.path.join(folder, n))]


def seen(folder):
    """The texts of a folder and those below."""
    for at, below, names in os.walk(folder):
        skipped = set(aside(at, below + names))
        below[:] = [b for b in below if b not in skipped]
        yield from (Path(at) / n for n in names if n.endswith(".mtx") and n not in skipped)


# Commands.


def commands(bench, texts):
    """Everything that the command says of the texts."""
    pages(bench)
    for number, path in enumerate(texts.all):
        bench.tally.counts["texts"] += 1
        bench.tally.progress("commands", number, f"{len(texts.all)} texts")
        text = (texts.tree / path).read_bytes().decode("utf-8", "replace")
        looked = looked_at(bench, path, text)
        workflows = re.findall(r"^workflow\s+(\w+)(.*)", text, re.M)
        lab = re.search(r"^lab\s+(\w+)", text, re.M)
        for name, rest in workflows or [("", "")]:
            subject = [path, *(["--workflow", name] if name else [])]
            if "any lab" in rest and lab:
                subject += ["--lab", lab[1]]
            bench.compare(path, ["plan", *subject, "--format", "json", "--time-limit", "10s"], only=decided)
            if looked and name:
                carried_out(bench, path, subject)
        if looked:
            asked_for(bench, path, text)


def pages(bench):
    """The pages of all codes."""
    bench.compare("no text", ["explain", "--index"])
    bench.compare("no text", ["explain"])
    for code in re.findall(r"^  (\S+) ", bench.ended[0].out.decode(), re.M):
        bench.compare("no text", ["explain", code])


def looked_at(bench, path, text):
    """A text, looked at in all ways; whether nothing is wrong with it."""
    fixed = os.path.join(os.path.dirname(path), "same_fixed.mtx")
    check = ["check", "--no-cache"]
    good = bench.compare(path, [*check, "--format", "json", path])
    bench.compare(path, [*check, path])
    bench.compare(path, [*check, "--fidelity", "process", "--format", "json", path])
    bench.compare(path, [*check, "--fidelity", "process", "--strict", "--format", "json", path])
    bench.compare(path, [*check, "--contents", "--format", "json", path])
    bench.compare(path, [*check, "--fidelity", "process", "--fix=all", fixed], written=fixed, copy=path)
    bench.compare(path, ["fmt", "--check", path])
    bench.compare(path, ["fmt", "--stdout", path])
    given = re.findall(r"\belse\s+([a-z]\w*)|\bhazard\s+(\w+)|\bfails\s+(\w+)", text)
    for name in sorted({n for names in given for n in names if n} - {"if"}):
        bench.compare(path, ["explain", name, path])
    return good


def carried_out(bench, path, subject):
    """A workflow of a text without mistakes, with everything that can be made of it."""
    bench.compare(path, ["run", *subject, "--seed", "5", "--out", OUT, "--format", "json"], written=OUT)
    bench.compare(path, ["run", *subject, "--dry", "--plan", "--format", "json"])
    bench.compare(path, ["bill", *subject, "--format", "json"])
    bench.compare(path, ["doc", *subject])
    bench.compare(path, ["view", *subject, "--export", f"{OUT}.html"], written=f"{OUT}.html")
    for target in TARGETS:
        bench.compare(path, ["emit", *subject, "--target", target])
    bindings = os.path.splitext(path)[0] + ".toml"
    if (bench.sides[0].tree / bindings).is_file():
        bench.compare(path, ["deploy", *subject, "--bind", bindings])


def asked_for(bench, path, text):
    """The tests, studies and fits of a text without mistakes."""
    if re.search(r"^test\s", text, re.M):
        bench.compare(path, ["test", path, "--format", "json"])
    for kind, name in re.findall(r"^(study|fit)\s+(\w+)", text, re.M):
        few = ["--runs", "4"] if kind == "study" else []
        bench.compare(path, [kind, path, "--name", name, *few, "--seed", "5", "--out", OUT, "--format", "json"], written=OUT)


def decided(out):
    """A schedule as far as no clock has a part in it: what a search that was cut off had found depends on the machine."""
    try:
        schedule = json.loads(out)
    except ValueError:
        return out
    if schedule.get("optimal"):
        return out
    chance = ("makespan", "bound", "optimal", "blocks", "actions")
    return json.dumps({key: value for key, value in schedule.items() if key not in chance}).encode()


# Mistakes of typing.

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?")
UNIT = re.compile(r"(?<![\w.])\d[\d.]*(?:e[+-]?\d+)?[ \t]+([A-Za-zµ°%][\w/*^%]*)")
WORD = re.compile(r"[^\W\d]\w*")
NUMBERS = ["0", "1", "2", "0.5", "-1", "7", "10", "99999", "1e-9", "1e12", "3.3333333", "1000000000"]
KEYWORDS = """
and any asset as at by capability claim const derived effect else ends event expect false finally fn for from holding hazard
if in include into keeps lab law let needs not of on or param parallel part process reaction relation repeat retry rules run
skill solution species state step study takes test then timeout to true until use vary wait when while with within without
workflow
""".split()
SIGNS = [*"{}[](),:.=-*/|&@µ", '"', "..", "==", "->", "+-", "//", "\t", "\r", "\0"]


def replaced(match, by, text):
    """A text with something else in the place of a match."""
    return text[: match.start()] + by + text[match.end() :]


def one_of(pattern, text, rng):
    """Some match of a pattern in a text."""
    found = list(pattern.finditer(text))
    return rng.choice(found) if found else None


def stretch(lines, rng):
    """Some lines that belong together, from one up to another: a line, or mostly all from a bracket to the one that closes."""
    said = [i for i, line in enumerate(lines) if line.strip() not in ("", "}") and not line.lstrip().startswith("//")]
    start = rng.choice(said or range(len(lines)))
    depth = 0
    for i in range(start, len(lines) if rng.random() < 0.9 else start):
        depth += lines[i].count("{") - lines[i].count("}")
        if depth <= 0:
            return start, i + 1
    return start, start + 1


def lines_gone(text, rng, texts):
    lines = text.splitlines(keepends=True)
    start, end = stretch(lines, rng)
    return "".join(lines[:start] + lines[end:])


def lines_twice(text, rng, texts):
    lines = text.splitlines(keepends=True)
    start, end = stretch(lines, rng)
    return "".join(lines[:end] + lines[start:end] + lines[end:])


def lines_swapped(text, rng, texts):
    lines = text.splitlines(keepends=True)
    start, end = stretch(lines, rng)
    rest = lines[:start] + lines[end:]
    at = min(start + rng.choice([-1, 1]), len(rest)) if rng.random() < 0.5 else rng.randint(0, len(rest))
    return "".join(rest[: max(0, at)] + lines[start:end] + rest[max(0, at) :])


def other_number(text, rng, texts):
    """A number ten times as great, or a tenth, or one more, or another of the text, or an odd one."""
    match, other = (one_of(NUMBER, text, rng) for _ in range(2))
    near = [match[0] + "0", "0." + match[0].replace(".", ""), str(int(float(match[0]) % 1e9) + 1)] if match else []
    return replaced(match, rng.choice([*near, other[0], other[0], rng.choice(NUMBERS)]), text) if match else text


def other_unit(text, rng, texts):
    """A unit that is another, mostly of the same text."""
    match, other = (one_of(UNIT, text, rng) for _ in range(2))
    by = match and (other[1] if rng.random() < 0.6 else rng.choice(texts.units))
    return text[: match.start(1)] + by + text[match.end(1) :] if match else text


def other_name(text, rng, texts):
    """A name that is another one of the text; remarks and words of the language stay."""
    names = [m for m in WORD.finditer(re.sub(r"//.*", lambda m: " " * len(m[0]), text)) if m[0] not in KEYWORDS]
    return replaced(rng.choice(names), rng.choice(names)[0], text) if names else text


def other_word(text, rng, texts):
    match, other = (one_of(WORD, text, rng) for _ in range(2))
    return replaced(match, other[0], text) if match else text


def word_typed_wrong(text, rng, texts):
    match = one_of(WORD, text, rng)
    at = rng.randrange(len(match[0])) if match else 0
    return replaced(match, match[0][:at] + rng.choice(["", "x", "e"]) + match[0][at + 1 :], text) if match else text


def bracket_gone(text, rng, texts):
    match = one_of(re.compile(r"[{}()\[\]\"]"), text, rng)
    return replaced(match, "", text) if match else text


def word_put_in(text, rng, texts):
    match = one_of(WORD, text, rng)
    return text[: match.start()] + rng.choice(KEYWORDS) + " " + text[match.start() :] if match else text


def sign_put_in(text, rng, texts):
    at = rng.randint(0, len(text))
    return text[:at] + rng.choice(SIGNS) + text[at:]


def cut_off(text, rng, texts):
    return text[: rng.randint(0, len(text))]


def joined(text, rng, texts):
    """Two texts in one, the lines that import either at its top or where they were."""
    head, mark, body = texts.readable[texts.any(rng)].partition("mtx 1\n")
    if rng.random() < 0.3 or not mark:
        return text + (body or head)
    uses = "".join(line for line in body.splitlines(keepends=True) if line.startswith("use "))
    rest = "".join(line for line in body.splitlines(keepends=True) if not line.startswith("use "))
    first, mark, last = text.partition("mtx 1\n")
    return first + mark + uses + last + rest


# Those that mostly leave a text that can be read, and those that mostly do not.
SLIPS = [lines_gone, lines_twice, lines_swapped, other_number, other_number, other_unit, other_name, other_name]
MISTAKES = [other_word, word_typed_wrong, bracket_gone, word_put_in, sign_put_in, cut_off, joined]


def generated(bench, texts, count, seed):
    """Texts with mistakes, checked by both."""
    for number in range(count):
        rng = random.Random(f"{seed} generated {number}")
        path = texts.any(rng)
        text, made = texts.readable[path], []
        for mistake in rng.choices([*SLIPS, *(MISTAKES if number % 4 == 0 else [])], k=rng.choice([1, 1, 1, 2, 2, 3, 5])):
            text = mistake(text, rng, texts) if text else text
            made.append(mistake.__name__)
        bench.tally.counts["generated texts"] += 1
        bench.tally.progress("generated", number, f"{count} texts")
        there = os.path.join(os.path.dirname(path), "same_generated.mtx")
        for side in bench.sides:
            (side.tree / there).write_bytes(text.encode())
        before, shown, noted = bench.tally.differences, bench.tally.shown, bench.tally.noted
        what = f"generated {number} with seed {seed}: {path} with {', '.join(made)}"
        ways = [["check", "--no-cache", "--format", "json", "--fidelity", "process"]]
        ways += [["check", "--no-cache", "--format", "json"]] if number % 10 == 0 else []
        ways += [["check", "--no-cache", "--format", "json", "--contents"]] if number % 10 == 3 else []
        ways += [["check", "--no-cache", "--fidelity", "process"]] if number % 10 == 5 else []
        ways += [["plan", "--format", "json", "--time-limit", "5s"]] if number % 10 == 7 else []
        ways += [["fmt", "--stdout"]] if number % 5 == 4 else []
        for way in ways:
            bench.compare(what, [*way, there], patience=SHORT, only=decided if way[0] == "plan" else lambda out: out)
        if bench.tally.differences > before or bench.tally.noted > noted:
            kept = bench.tally.keep(f"generated-{number}-{path}", text)
            if bench.tally.shown > shown or bench.tally.noted > noted:
                print(f"  kept as {kept}")
        for side in bench.sides:
            discard(side.tree / there)


# Edits.


class Lost(Exception):
    """Servers that have gone, or say nothing, and why."""

    def __init__(self, why):
        super().__init__()
        self.why = why


class Server:
    """The language server of one build."""

    def __init__(self, side):
        self.side = side
        self.errors = open(side.root / "lsp-errors", "w+b")
        self.process = side.start(["lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors)
        self.came = queue.Queue()
        # What was told of a text first under a number of it, what was told last, and answers by the numbers of their requests.
        self.first, self.told, self.answers = {}, {}, {}
        self.going, self.broken = queue.Queue(), ""
        for work in (self.read, self.write):
            threading.Thread(target=work, daemon=True).start()

    def write(self):
        """Gives messages to the server, which may not take them; that it has gone the other stream tells."""
        try:
            while (message := self.going.get()) is not None:
                self.process.stdin.write(message)
                self.process.stdin.flush()
        except OSError:
            pass

    def read(self):
        """Takes messages from the server, without what differs between any two builds."""
        stream = self.process.stdout
        try:
            while True:
                length = 0
                while line := stream.readline().strip():
                    name, _, value = line.partition(b":")
                    length = int(value) if name.lower() == b"content-length" else length
                body = stream.read(length)
                if not body or len(body) < length:
                    break
                self.came.put(json.loads(self.side.neutral(body)))
        except ValueError as why:
            self.broken = f", sends what cannot be read: {why}"
        self.came.put(None)

    def send(self, message):
        """Sends a message; addresses in it are those without the folder of the build."""
        body = json.dumps({"jsonrpc": "2.0", **message}).replace(HERE, str(self.side.root)).encode()
        self.going.put(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))

    def take(self, patience):
        """The next message; whether there was one."""
        try:
            message = self.came.get(timeout=max(0.0, patience))
        except queue.Empty:
            return False
        if message is None:
            raise Lost({self: self.last_words()})
        params = message.get("params") or {}
        if message.get("method") == "textDocument/publishDiagnostics":
            told = params.get("version"), params["diagnostics"]
            self.told[params["uri"]] = told
            self.first.setdefault((params["uri"], told[0]), told[1])
        elif "method" not in message:
            refused = {"refused": message.get("error")}
            self.answers[message["id"]] = refused if "error" in message else message.get("result")
        return True

    def wait(self, is_there, patience):
        """Takes messages until something is there."""
        until = time.monotonic() + patience
        while not is_there():
            if time.monotonic() > until or not self.take(until - time.monotonic()):
                raise Lost({self: SILENT})

    def last_words(self):
        """How it has ended."""
        try:
            status = self.process.wait(10)
        except subprocess.TimeoutExpired:
            status = "none yet" + self.broken
        self.errors.seek(0)
        said = self.side.neutral(self.errors.read()).decode("utf-8", "replace").strip().splitlines()
        return f"has ended with status {status}: {' / '.join(said[-3:])}"

    def work(self):
        """Whether it works at this moment, and how much it has worked, as Linux counts it; of other systems nothing is known."""
        ticks, runs = 0, False
        try:
            for task in os.listdir(f"/proc/{self.process.pid}/task"):
                fields = Path(f"/proc/{self.process.pid}/task/{task}/stat").read_text().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
                runs = runs or fields[0] in "RD"
        except (OSError, ValueError):
            pass
        return runs, ticks

    def close(self):
        self.going.put(None)
        end(self.process)
        self.errors.close()


class Document:
    """A text that is open in both editors, with the way back to what it was."""

    def __init__(self, path, text):
        self.path, self.text, self.original, self.version, self.undo = path, text, text, 1, []
        self.uri = "file://" + HERE + "/tree/" + quote(path)
        # Where it was changed last.
        self.at = 0

    def position(self, offset):
        """A place as the protocol has it, columns in bytes. Lines end with either sign or both."""
        before = self.text[:offset]
        if before.endswith("\r") and self.text[offset : offset + 1] == "\n":
            before = before[:-1]
        starts = [m.end() for m in re.finditer(r"\r\n|\r|\n", before)]
        return {"line": len(starts), "character": len(before[starts[-1] if starts else 0 :].encode())}

    def range(self, start, end):
        return {"start": self.position(start), "end": self.position(end)}

    def change(self, start, end, by, whole=False):
        """Changes it; the message that says so."""
        change = {"range": self.range(start, end), "text": by}
        self.text = self.text[:start] + by + self.text[end:]
        self.version += 1
        self.at = start + len(by)
        document = {"uri": self.uri, "version": self.version}
        changes = [{"text": self.text} if whole else change]
        return {"method": "textDocument/didChange", "params": {"textDocument": document, "contentChanges": changes}}


def place(**more):
    """What is asked of a place."""
    return lambda document, rng, at: {"textDocument": {"uri": document.uri}, "position": at, **more}


def whole(**more):
    """What is asked of a text."""
    return lambda document, rng, at: {"textDocument": {"uri": document.uri}, **more}


def part(**more):
    """What is asked of a part of a text, or of the part that is all of it."""

    def params(document, rng, at):
        start, end = sorted(rng.randint(0, len(document.text)) for _ in range(2))
        start, end = (start, end) if rng.random() < 0.4 else (0, len(document.text))
        return {"textDocument": {"uri": document.uri}, "range": document.range(start, end), **more}

    return params


STYLE = {"tabSize": 4, "insertSpaces": True}
# What can be asked, by what a server says of itself.
ASKED = [
    ("hoverProvider", "textDocument/hover", place()),
    ("definitionProvider", "textDocument/definition", place()),
    ("typeDefinitionProvider", "textDocument/typeDefinition", place()),
    ("referencesProvider", "textDocument/references", place(context={"includeDeclaration": True})),
    ("documentHighlightProvider", "textDocument/documentHighlight", place()),
    ("completionProvider", "textDocument/completion", place()),
    ("signatureHelpProvider", "textDocument/signatureHelp", place()),
    ("renameProvider", "textDocument/prepareRename", place()),
    ("renameProvider", "textDocument/rename", place(newName="same_name")),
    ("callHierarchyProvider", "textDocument/prepareCallHierarchy", place()),
    ("documentSymbolProvider", "textDocument/documentSymbol", whole()),
    ("foldingRangeProvider", "textDocument/foldingRange", whole()),
    ("semanticTokensProvider", "textDocument/semanticTokens/full", whole()),
    ("semanticTokensProvider", "textDocument/semanticTokens/range", part()),
    ("inlayHintProvider", "textDocument/inlayHint", part()),
    ("codeActionProvider", "textDocument/codeAction", part(context={"diagnostics": []})),
    ("documentFormattingProvider", "textDocument/formatting", whole(options=STYLE)),
    ("documentRangeFormattingProvider", "textDocument/rangeFormatting", part(options=STYLE)),
    ("workspaceSymbolProvider", "workspace/symbol", lambda document, rng, at: {"query": rng.choice("aeiorst")}),
]
CLIENT = {
    "general": {"positionEncodings": ["utf-8"]},
    "textDocument": {
        "hover": {"contentFormat": ["markdown"]},
        "completion": {"completionItem": {"snippetSupport": True}},
        "codeAction": {"codeActionLiteralSupport": {"codeActionKind": {"valueSet": []}}},
        "documentSymbol": {"hierarchicalDocumentSymbolSupport": True},
    },
}
# Seconds without any work after which a server is at rest, more than it waits itself before it looks at the ways of robots; and
# the most that is waited for that.
REST = 1.0
RESTLESS = 60.0
# Servers that may be lost before it is enough.
LOSSES = 6
SILENT = "says nothing"


class Editors:
    """Two editors, each with the server of its build, that are used in the same way."""

    def __init__(self, bench):
        self.bench, self.tally = bench, bench.tally
        self.servers, self.sent, self.number = [], [], 0

    def start(self):
        """Starts both servers and agrees with them."""
        self.sent, self.number = [], 0
        self.servers = [Server(side) for side in self.bench.sides]
        old, new = self.ask([("initialize", {"processId": None, "capabilities": CLIENT})])[0]
        self.tally.counts["editor answers"] += 1
        if old != new:
            self.tally.differ("no text", "lsp", "matterixc lsp: initialize", {"answer": (old, new)})
        self.can = old.get("capabilities", {}).keys() & new.get("capabilities", {}).keys()
        self.send({"method": "initialized", "params": {}})

    def close(self):
        for server in self.servers:
            server.close()
        self.servers = []

    def send(self, message):
        self.sent.append(json.dumps(message))
        for server in self.servers:
            server.send(message)

    def both(self, is_there):
        """Waits for both servers. What only one of them does not say in time it may say later."""
        lost = {}
        for server in self.servers:
            try:
                server.wait(lambda: is_there(server), PATIENCE)
            except Lost as one:
                lost.update(one.why)
        if list(lost.values()) == [SILENT]:
            (late,) = lost
            late.wait(lambda: is_there(late), AGAIN * PATIENCE)
        elif lost:
            raise Lost(lost)

    def ask(self, requests):
        """The answers of both to requests, in their order."""
        numbers = []
        for method, params in requests:
            self.number += 1
            numbers.append(self.number)
            self.send({"id": self.number, "method": method, "params": params})
        self.both(lambda server: all(n in server.answers for n in numbers))
        return [tuple(server.answers.pop(n) for server in self.servers) for n in numbers]

    def differ(self, document, what, pair, more=""):
        """Says what is different, and keeps the text with all that was sent to come to it."""
        kept = self.tally.keep(f"edited-{self.tally.differences + 1}-{document.path}", document.text)
        self.tally.keep("edited.jsonl", "\n".join(self.sent) + "\n")
        self.tally.differ(f"{document.path}, edited, kept as {kept}", "lsp", f"matterixc lsp: {what} {more}", {what: pair})

    def found(self, document):
        """Waits for what is found in a text as it is, and compares it. What is told of it first is what every check finds; what
        looking at the ways of robots finds comes later, or never, if the next edit comes before."""
        key = document.uri, document.version
        self.both(lambda server: key in server.first)
        pair = [server.first[key] for server in self.servers]
        for server in self.servers:
            server.first.clear()
        self.tally.counts["findings of edited texts"] += 1
        if pair[0] != pair[1]:
            self.differ(document, "findings", pair, f"of version {document.version}")

    def told(self, document):
        """Compares all that was told of all texts; where one server may only be ahead of the other, once both are at rest."""
        if self.servers[0].told != self.servers[1].told:
            self.rest()
            old, new = (server.told for server in self.servers)
            if old != new:
                uris = [uri for uri in sorted(old.keys() | new.keys()) if old.get(uri) != new.get(uri)]
                pair = tuple({uri: told.get(uri) for uri in uris} for told in (old, new))
                self.differ(document, "all that was told", pair)
        self.tally.counts["editor answers"] += 1

    def rest(self):
        """Waits until neither server works any more."""
        since, until = time.monotonic(), time.monotonic() + RESTLESS
        before = None
        while time.monotonic() - since < REST:
            if time.monotonic() > until:
                return self.tally.note(f"servers that do not come to rest within {RESTLESS:.0f} s")
            came = [server.take(0.05) for server in self.servers]
            work = [server.work() for server in self.servers]
            if any(came) or any(runs for runs, _ in work) or work != before:
                since, before = time.monotonic(), work

    def answers(self, document, rng):
        """Asks everything at one place, and something more of what was answered."""
        at = document.position(somewhere(document, rng))
        wanted = [(method, params(document, rng, at)) for can, method, params in ASKED if can in self.can]
        more = []
        for (method, params), (old, new) in zip(wanted, self.compared(document, wanted)):
            if not old or old != new:
                continue
            if method == "textDocument/completion" and old["items"]:
                more.append(("completionItem/resolve", rng.choice(old["items"])))
            elif method == "textDocument/prepareCallHierarchy":
                more += [(f"callHierarchy/{way}Calls", {"item": old[0]}) for way in ("incoming", "outgoing")]
            elif method == "textDocument/semanticTokens/full" and "resultId" in old:
                more.append((f"{method}/delta", {"previousResultId": old["resultId"], "textDocument": {"uri": document.uri}}))
        self.compared(document, more)
        self.told(document)

    def compared(self, document, requests):
        """Answers to requests, compared."""
        pairs = self.ask(requests)
        for (method, params), pair in zip(requests, pairs):
            self.tally.counts["editor answers"] += 1
            if pair[0] != pair[1]:
                self.differ(document, method, pair, json.dumps(params)[:400])
        return pairs


def somewhere(document, rng):
    """A place in a text: where it was changed, in a word, or anywhere."""
    text, luck = document.text, rng.random()
    if luck < 0.4:
        return max(0, min(len(text), document.at - rng.choice([0, 0, 1, 3])))
    word = one_of(WORD, text, rng)
    return rng.randint(word.start(), word.end()) if word and luck < 0.85 else rng.randint(0, len(text))


WAYS = ["digit", "digit", "digit", "letter", "letter", "line", "gone", "paste", "sign", "space", "name", "number"]


def typed(document, rng, texts):
    """What somebody does to a text: from where to where, and what comes there instead."""
    text = document.text
    starts = [0] + [m.end() for m in re.finditer("\n", text)]
    number, word = one_of(NUMBER, text, rng), one_of(WORD, text, rng)
    way = rng.choice(WAYS)
    if way == "digit" and number:
        at = rng.randrange(number.start(), number.end())
        return at, at + rng.choice([0, 1, 1]), rng.choice(["", *"0123456789"])
    if way == "number" and number:
        return number.start(), number.end(), rng.choice(["1", "2.5", str(rng.randint(0, 200))])
    if way == "letter" and word:
        at = rng.randint(word.start(), word.end())
        return at, min(at + rng.choice([0, 0, 1]), len(text)), rng.choice(["", *"abcdefghilmnoprstuwx"])
    if way == "name" and word:
        return word.start(), word.end(), rng.choice([one_of(WORD, text, rng)[0], rng.choice(KEYWORDS)])
    line = rng.randrange(len(starts))
    start, end = starts[line], starts[line + 1] if line + 1 < len(starts) else len(text)
    if way == "gone":
        return start, end, ""
    if way == "paste":
        lines = (text if rng.random() < 0.4 else texts.readable[texts.any(rng)]).splitlines(keepends=True)
        at = rng.randrange(len(lines) or 1)
        return start, start, "".join(lines[at : at + rng.randint(1, 6)])
    if way == "line":
        at = start if rng.random() < 0.7 else rng.randint(start, end)
        return at, at, rng.choice(["\n", "\n    ", "\n// a remark\n"])
    at = rng.randint(0, len(text))
    return at, at, rng.choice([" ", "  "]) if way == "space" else rng.choice(SIGNS[:-2])


def edited(document, rng, texts):
    """The message of the next edit of a text: something typed, or, the more likely the more there is, the last of it undone."""
    whole = rng.random() < 0.05
    if document.undo and rng.random() < 0.3 + 0.15 * len(document.undo):
        return document.change(*document.undo.pop(), whole)
    start, end, by = typed(document, rng, texts)
    document.undo.append((start, start + len(by), document.text[start:end]))
    return document.change(start, end, by, whole)


class Group:
    """A text with what it imports, open in both editors; the text is first, what is imported behind what imports it."""

    def __init__(self, editors, texts, paths, closure):
        self.editors, self.texts, self.closure = editors, texts, closure
        self.documents = [Document(path, texts.whole(path)) for path in paths]
        for document in reversed(self.documents):
            item = {"uri": document.uri, "languageId": "mtx", "version": 1, "text": document.text}
            editors.send({"method": "textDocument/didOpen", "params": {"textDocument": item}})
            editors.found(document)

    def checked(self, document):
        """Waits for what is found in a text that was changed. What imports it is checked anew by itself, but nothing says when:
        so it is given a new number, under which it must be told of."""
        self.editors.found(document)
        for above in reversed(self.documents[: self.documents.index(document)]):
            self.editors.send(above.change(0, 0, ""))
            self.editors.found(above)

    def edit(self, rng, most):
        """One edit, or a few in a row without a pause; the text that was edited."""
        imported = len(self.documents) > 1 and rng.random() < 0.3
        document = rng.choice(self.documents[1:]) if imported else self.documents[0]
        count = min(most, rng.randint(2, 6) if rng.random() < 0.06 else 1)
        for _ in range(count):
            self.editors.send(edited(document, rng, self.texts))
            self.editors.tally.counts["edits"] += 1
        self.checked(document)
        return document

    def restore(self):
        """Makes its texts what they were, and compares what is told once nothing moves any more."""
        for document in reversed(self.documents):
            if document.text != document.original:
                document.undo.clear()
                self.editors.send(document.change(0, len(document.text), document.original, True))
                self.checked(document)
        self.editors.rest()
        self.editors.told(self.documents[0])

    def close(self):
        for document in self.documents:
            self.editors.send({"method": "textDocument/didClose", "params": {"textDocument": {"uri": document.uri}}})
        # An answer comes after all that was told before.
        self.editors.ask([("same/over", {})])
        self.editors.told(self.documents[0])


def edits(bench, texts, count, seed):
    """The same edits in two editors: some fifty of a text, then of another, while the last few stay open."""
    rng = random.Random(f"{seed} edits")
    editors, tally, groups, losses = Editors(bench), bench.tally, [], 0
    importing = {path for path in texts.readable if len(texts.imports(path)) > 1}
    try:
        while tally.counts["edits"] < count and losses < LOSSES:
            path = texts.any(rng, importing if importing and rng.random() < 0.2 else None)
            try:
                if not editors.servers:
                    editors.start()
                session(editors, texts, groups, path, rng, count)
            except Lost as lost:
                losses += 1
                missed(editors, lost, f"{path}, after {tally.counts['edits']} edits with seed {seed}")
                groups.clear()
                editors.close()
    finally:
        editors.close()
    if losses == LOSSES:
        print(f"edits: after {LOSSES} lost servers the rest is left out")


def session(editors, texts, groups, path, rng, count):
    """Some fifty edits of a text."""
    closure = texts.imports(path)
    for group in [g for g in groups if g.closure & set(closure) or g in groups[:-2]]:
        groups.remove(group)
        group.close()
    group = Group(editors, texts, closure if rng.random() < 0.7 else closure[:1], set(closure))
    groups.append(group)
    counts = editors.tally.counts
    last = min(count, counts["edits"] + rng.randint(30, 70))
    while counts["edits"] < last:
        before = counts["edits"]
        document = group.edit(rng, last - before)
        if counts["edits"] // 5 > before // 5:
            editors.answers(document, rng)
        editors.tally.progress("edits", counts["edits"], count)
    group.restore()


def missed(editors, lost, where):
    """Says that a server has gone, or says nothing, and keeps what was sent to come to it."""
    tally, why = editors.tally, dict(lost.why)
    time.sleep(1)
    gone = [server for server in editors.servers if server not in why and server.process.poll() is not None]
    why.update({server: server.last_words() for server in gone})
    pair = [why.get(server, "goes on") for server in editors.servers]
    if pair[0].partition(":")[0] == pair[1].partition(":")[0]:
        return tally.note(f"language servers: {pair[0]}: {where}")
    kept = tally.keep(f"lost-{tally.counts['edits']}.jsonl", "\n".join(editors.sent) + "\n")
    tally.differ(where, "lsp", f"matterixc lsp, told what is in {kept}, last {editors.sent[-1][:400]}", {"server": pair})


def arguments():
    parser = argparse.ArgumentParser(description="Compares two builds of the command; see the head of this file.")
    parser.add_argument("old", metavar="OLD")
    parser.add_argument("new", metavar="NEW")
    parser.add_argument("--generated", type=int, default=500, metavar="N", help="texts to generate (500)")
    parser.add_argument("--edits", type=int, default=5000, metavar="N", help="edits in an editor (5000)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="where all randomness starts (0)")
    parser.add_argument("--only", choices=PARTS, metavar="PART", help="one part: " + ", ".join(PARTS))
    parser.add_argument("texts", nargs="+", metavar="FILE|FOLDER")
    given = parser.parse_intermixed_args()
    for binary in (given.old, given.new):
        if not os.access(binary, os.X_OK) or os.path.isdir(binary):
            parser.error(f"{binary} is no program")
    for path in given.texts:
        if not os.path.exists(path):
            parser.error(f"there is no {path}")
    return parser, given


def main():
    parser, given = arguments()
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (SPACE if most == resource.RLIM_INFINITY else min(SPACE, most), most))
    folder = Path(tempfile.mkdtemp(prefix="same-")).resolve()
    tally = Tally(folder / "kept")
    took = []
    try:
        bench = Bench(given.old, given.new, folder, tally)
        texts = Texts(given.texts, bench)
        if not texts.readable:
            parser.error("there are no texts in it")
        parts = {
            "commands": lambda: commands(bench, texts),
            "generated": lambda: generated(bench, texts, given.generated, given.seed),
            "edits": lambda: edits(bench, texts, given.edits, given.seed),
        }
        for name in [given.only] if given.only else PARTS:
            begun, kind = time.monotonic(), PARTS[name]
            before = tally.counts[kind]
            parts[name]()
            seconds, count = time.monotonic() - begun, tally.counts[kind] - before
            took.append(f"{name} took {seconds:.0f} s, {1e3 * seconds / max(1, count):.0f} ms for each of {count} {kind}")
    finally:
        for side in ("old", "new"):
            shutil.rmtree(folder / side, ignore_errors=True)
        if not tally.kept.exists():
            shutil.rmtree(folder, ignore_errors=True)
    print("\n" + ", ".join(f"{count} {what}" for what, count in tally.counts.items()))
    print("\n".join(took))
    for kind, count in tally.kinds.most_common():
        print(f"{count} different in {kind}")
    if tally.kept.exists():
        print(f"texts that made a difference are in {tally.kept}")
    print(f"same: {tally.differences} differences" if tally.differences else "same: no differences")
    sys.exit(1 if tally.differences else 0)


if __name__ == "__main__":
    main()
