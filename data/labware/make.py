"""Packs the labware definitions of opentrons-shared-data into assets/labware/opentrons.bin.

    pip download --no-deps opentrons-shared-data==10.1.0
    python3 data/labware/make.py opentrons_shared_data-10.1.0-py3-none-any.whl           # writes the file
    python3 data/labware/make.py opentrons_shared_data-10.1.0-py3-none-any.whl --check   # compares it with the package

Needs nothing but Python 3.11. All versions of schema 2 and 3 are packed. Blanks between the signs of a definition are left out; nothing
else is changed, so that every number keeps its digits.

The file begins with lines of text: the package and its version, then `NAME VERSION PACKED WHOLE` for each definition, with the bytes it
takes compressed and as JSON, in order of name and version; then an empty line. The definitions follow in that order, each compressed on
its own (deflate, RFC 1951, without a header). `--check` compares what they hold and not how they are compressed, which differs from one
zlib to the next.
"""
import json
import re
import sys
import zipfile
import zlib
from pathlib import Path

PACKED = Path(__file__).parent.parent.parent / "assets" / "labware" / "opentrons.bin"
DEFINITION = re.compile(r"opentrons_shared_data/data/labware/definitions/[23]/(?:.*/)?([^/]+)/(\d+)\.json")
PACKAGE = re.compile(r"opentrons_shared_data-([\d.]+)-py3-none-any\.whl")
# A text with its escapes, or blanks outside of one.
SIGNS = re.compile(r'"(?:[^"\\]|\\.)*"|\s+')


def unbroken(text):
    return SIGNS.sub(lambda found: found[0] if found[0].startswith('"') else "", text)


def definitions(wheel):
    """By name and version; the definition says both itself."""
    out = {}
    with zipfile.ZipFile(wheel) as package:
        for path in package.namelist():
            if not (named := DEFINITION.fullmatch(path)):
                continue
            text = package.read(path).decode("utf-8")
            value = json.loads(text)
            key = value["parameters"]["loadName"], value["version"]
            if key != (named[1], int(named[2])) or key in out:
                raise SystemExit(f"{path} holds {key[0]}/{key[1]}")
            packed = unbroken(text)
            if json.loads(packed) != value or value["namespace"] != "opentrons" or re.search(r"\s", key[0]):
                raise SystemExit(f"{path} cannot be packed")
            out[key] = packed.encode("utf-8")
    return dict(sorted(out.items()))


def squeezed(data):
    packer = zlib.compressobj(9, zlib.DEFLATED, -15, 9)
    return packer.compress(data) + packer.flush()


def write(package, found):
    parts = [squeezed(data) for data in found.values()]
    lines = [package] + [
        f"{name} {version} {len(part)} {len(data)}" for ((name, version), data), part in zip(found.items(), parts)
    ]
    PACKED.write_bytes("\n".join(lines).encode() + b"\n\n" + b"".join(parts))
    names = len({name for name, _ in found})
    print(f"{names} names, {len(found)} definitions, {sum(map(len, found.values()))} bytes in {PACKED.stat().st_size}")


def unpack(data):
    index, rest = data.split(b"\n\n", 1)
    package, *lines = index.decode().split("\n")
    out = {}
    for line in lines:
        name, version, size, whole = line.split(" ")
        out[name, int(version)], rest = zlib.decompress(rest[: int(size)], -15), rest[int(size) :]
        if len(out[name, int(version)]) != int(whole):
            raise SystemExit(f"{line}: another length")
    if rest:
        raise SystemExit("there is more in it than it lists")
    return package, out


def main():
    wheel, *options = sys.argv[1:] or [""]
    named = PACKAGE.search(Path(wheel).name)
    if not named or options not in ([], ["--check"]):
        raise SystemExit(__doc__)
    package, found = f"opentrons-shared-data {named[1]}", definitions(wheel)
    if not options:
        return write(package, found)
    if unpack(PACKED.read_bytes()) != (package, found):
        raise SystemExit(f"{PACKED.name} does not hold the definitions of {package}")
    print(f"{PACKED.name} holds the {len(found)} definitions of {package}")


main()
