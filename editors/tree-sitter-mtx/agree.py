#!/usr/bin/env python3
"""Whether this grammar accepts what the compiler accepts: on every file of the repository, and on seeded mutants of its items.

usage: agree.py MATTERIXC [--mutants N] [--seed N] [--show N] [--floor RATE]

Needs a C compiler and the package in requirements.txt beside it.
Exit status 1 where a file is judged differently, or a smaller share of the mutants than the floor is judged alike.
"""

import argparse
import ctypes
import pathlib
import random
import re
import subprocess
import sys
import tempfile

import tree_sitter

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

# What the compiler says under `syntax` of texts that fit the grammar: the version, numbers beyond any, values in texts.
NOT_GRAMMAR = re.compile(
    r"does not start with `mtx 1`|is not a known version of the language|number is too large|in a text starts or ends a value|in this text"
)
ITEM = re.compile(
    r"^(?:use|dimension|unit|species|solution|reaction|reactive_group|material|incompatible|allow|hazard|caution|capability|asset|process"
    r"|event|relation|extern|fn|const|driver|lab|skill|workflow|study|fit|test)\b",
    re.M,
)
TOKEN = re.compile(
    r'"(?:\\.|[^"\\\n])*"|//[^\n]*|[A-Za-z_°µΩÅ%][A-Za-z0-9_°µΩÅ]*|[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?'
    r"|\n[ \t]*|[ \t]+|<->|->|<-|\.\.|\+-|::|==|!=|<=|>=|\+=|-=|."
)


def language(folder):
    """The parser, compiled."""
    library = folder / "mtx.so"
    sources = [str(HERE / "src" / name) for name in ("parser.c", "scanner.c")]
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-w", "-I", str(HERE / "src"), *sources, "-o", str(library)], check=True)
    function = ctypes.CDLL(str(library)).tree_sitter_mtx
    function.restype = ctypes.c_void_p
    capsule = ctypes.pythonapi.PyCapsule_New
    capsule.restype = ctypes.py_object
    capsule.argtypes = (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
    return tree_sitter.Language(capsule(function(), b"tree_sitter.Language", None))


def corpus():
    """Every text of the language in the repository, by a name for it."""
    files = sorted(path for top in ("examples", "stdlib", "tests") for path in (ROOT / top).rglob("*.mtx"))
    texts = {str(path.relative_to(ROOT)): path.read_text() for path in files}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for number, block in enumerate(re.findall(r"^```mtx[^\n]*\n(.*?)^```", page.read_text(), re.M | re.S)):
            texts[f"{page.relative_to(ROOT)}#{number}"] = block
    return texts


def refused(matterixc, texts, folder):
    """What the compiler says of each text that it does not accept, by its index."""
    found = {}
    for first in range(0, len(texts), 400):
        paths = []
        for index, text in enumerate(texts[first : first + 400], first):
            path = folder / f"{index}.mtx"
            path.write_bytes(text.encode())
            paths.append(str(path))
        said = subprocess.run([matterixc, "fmt", "--check", "--color", "never", *paths], capture_output=True, text=True).stderr
        for headline, path in re.findall(r"^error\[[^\]]*\]: (.*?)\n +╭─\[([^\n]*?):\d+:\d+\]", said, re.M | re.S):
            if not NOT_GRAMMAR.search(headline):
                found.setdefault(int(pathlib.Path(path).stem), headline)
    return found


def items(text):
    starts = [match.start() for match in ITEM.finditer(text)] + [len(text)]
    return [text[start:end] for start, end in zip(starts, starts[1:])]


def mutate(rng, text, pool):
    """The text with one change: (what was done, the text)."""
    tokens = TOKEN.findall(text)
    solid = [i for i, token in enumerate(tokens) if not token.isspace() and not token.startswith("//")]
    blank = [i for i, token in enumerate(tokens) if token.isspace()]
    kind = rng.choice(["drop", "double", "swap", "replace", "insert", "break", "join", "cut", "add", "tighten"])
    at = rng.choice(solid)
    if kind == "drop":
        tokens[at] = ""
    elif kind == "double":
        tokens[at] += " " + tokens[at]
    elif kind == "swap":
        other = rng.choice(solid[max(0, solid.index(at) - 2) : solid.index(at) + 3])
        tokens[at], tokens[other] = tokens[other], tokens[at]
    elif kind == "replace":
        tokens[at] = rng.choice(pool)
    elif kind == "insert":
        tokens[at] = rng.choice(pool) + " " + tokens[at]
    elif kind == "break":
        tokens[at] = "\n" + tokens[at]
    elif kind == "join":
        lines = [i for i in blank if "\n" in tokens[i]]
        tokens[rng.choice(lines) if lines else at] = " "
    elif kind == "tighten":
        tokens[rng.choice(blank) if blank else at] = ""
    else:
        place = rng.randrange(len(text))
        char = "" if kind == "cut" else rng.choice("{}()[],;:.=+-*/<>'\"^&|?!%_ \n0a")
        return kind, text[:place] + char + text[place + (kind == "cut") :]
    return kind, "".join(tokens)


def compare(parser, matterixc, texts, folder):
    """(index, what the compiler says or None, whether the grammar accepts) of each text that is judged differently."""
    said = refused(matterixc, texts, folder)
    accepts = [not parser.parse(text.encode()).root_node.has_error for text in texts]
    return [(i, said.get(i), accepts[i]) for i in range(len(texts)) if accepts[i] == (i in said)], len(said)


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("matterixc")
    arguments.add_argument("--mutants", type=int, default=2000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--show", type=int, default=20)
    arguments.add_argument("--floor", type=float, default=0.99)
    args = arguments.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        parser = tree_sitter.Parser(language(folder))
        texts = corpus()
        names = list(texts)
        differ, count = compare(parser, args.matterixc, list(texts.values()), folder)
        for index, said, _ in differ:
            print(f"{names[index]}: the compiler says {said or 'nothing'}, the grammar the opposite")
        print(f"{len(texts) - len(differ)} of {len(texts)} texts judged alike, {count} of them refused")

        rng = random.Random(args.seed)
        pieces = [piece for text in texts.values() for piece in items(text)]
        pool = [token for piece in pieces for token in TOKEN.findall(piece) if not token.isspace() and not token.startswith("//")]
        mutants = [mutate(rng, rng.choice(pieces), pool) for _ in range(args.mutants)]
        texts = ["mtx 1\n" + text for _, text in mutants]
        unlike, count = compare(parser, args.matterixc, texts, folder)
        for index, said, _ in unlike[: args.show]:
            print(f"---- {index} {mutants[index][0]}: the compiler says {said or 'nothing'}\n{mutants[index][1].rstrip()}")
        rate = 1 - len(unlike) / max(1, len(texts))
        print(f"{len(texts) - len(unlike)} of {len(texts)} mutants judged alike ({100 * rate:.2f} %), {count} of them refused")
    sys.exit(bool(differ) or rate < args.floor)


if __name__ == "__main__":
    main()
