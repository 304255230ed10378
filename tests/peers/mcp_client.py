"""Drives `matterixc mcp` with the client of the protocol's own Python SDK, which checks every answer against the schema of its tool.

python mcp_client.py MATTERIXC FOLDER: in the empty folder, mends broken protocols by the corrections that are offered, with each way of
beginning a session that the client knows.
"""

import asyncio
import json
import sys
from pathlib import Path

from jsonschema import Draft202012Validator
from mcp.client.client import Client
from mcp.client.stdio import StdioServerParameters

SOUND = """mtx 1
use std::glassware::Beaker250mL
use std::furniture::OpticalTable

lab bench {
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
    b = Beaker250mL on table holding 100 g of water
}

workflow w in bench {
    parallel {
        wait 5 s
    }
    expect b.contents.mass == 100 g +- 1 g
}
"""

# What is typed wrong, and whether a correction is offered.
SLIPS = {
    "brace.mtx": ("5 s\n    }", "5 s", True),
    "comma.mtx": ("5 s", "2,5 s", True),
    "equals.mtx": ("==", "=", True),
    "comment.mtx": ("5 s", "5 s # a pause", True),
    "name.mtx": ("of water", "of watr", True),
    "thing.mtx": ("table =", "tabel =", True),
    "member.mtx": ("contents.mass", "contents.mas", True),
    "unit.mtx": ("wait 5 s", "wait 5 mL", False),
    "amount.mtx": ("holding 100 g", "holding 900 g", False),
}


def expect(holds, what):
    if not holds:
        sys.exit(f"mcp: {what}")


async def call(client, tool, arguments):
    """The data of an answer; its own text is there too."""
    result = await client.call_tool(tool, arguments)
    expect(not result.is_error, f"{tool} {arguments}: {result.content}")
    expect(result.content[0].text, f"{tool} says nothing to read")
    return result.structured_content


async def refused(client, tool, arguments, says):
    result = await client.call_tool(tool, arguments)
    expect(result.is_error and says in result.content[0].text, f"{tool} {arguments}: {result.content}")


async def mend(client, path, offered):
    found = await call(client, "check", {"path": path})
    expect(found["errors"] > 0, f"{path} has no finding")
    for _ in range(5):
        ids = [fix["id"] for finding in found["findings"] for fix in finding["fixes"]]
        if not ids:
            break
        found = await call(client, "fix", {"path": path, "ids": ids[:1], "write": True})
    expect((found["errors"] == 0) == offered, f"{path}: {json.dumps(found['findings'])}")
    for finding in found["findings"]:
        page = await call(client, "explain", {"code": finding["code"]})
        expect("## Mended" in page["page"], finding["code"])
    return found["errors"] == 0


async def session(command, folder, mode):
    server = StdioServerParameters(command=command, args=["mcp", "--root", str(folder)])
    async with Client(server, mode=mode) as client:
        tools = (await client.list_tools()).tools
        for tool in tools:
            Draft202012Validator.check_schema(tool.input_schema)
            Draft202012Validator.check_schema(tool.output_schema)
        for name, (right, wrong, _) in SLIPS.items():
            (folder / name).write_text(SOUND.replace(right, wrong))
        mended = [await mend(client, name, offered) for name, (_, _, offered) in SLIPS.items()]
        for name, (right, wrong, offered) in SLIPS.items():
            if offered:
                ran = await call(client, "run", {"path": name})
                expect(ran["passed"] and ran["report"]["status"] == "passed", f"{name}: {ran}")
        await call(client, "plan", {"text": SOUND, "search": 1})
        await call(client, "contents", {"text": SOUND, "line": 13})
        await call(client, "library", {"words": "hotplate stirrer"})
        await call(client, "format", {"text": SOUND})
        await refused(client, "check", {"path": "/etc/passwd"}, "outside the folder")
        await refused(client, "check", {"paths": "w.mtx"}, "unknown field")
        for resource in (await client.list_resources()).resources:
            page = await client.read_resource(resource.uri)
            expect(page.contents[0].text, resource.uri)
        for prompt in (await client.list_prompts()).prompts:
            arguments = {argument.name: "beakers.mtx" for argument in prompt.arguments}
            filled = await client.get_prompt(prompt.name, arguments)
            expect("beakers.mtx" in filled.messages[0].content.text, prompt.name)
        version = client.session.protocol_version
    print(f"mcp: {mode}, version {version}: {len(tools)} tools, {sum(mended)} of {len(mended)} protocols mended")


def main():
    command, folder = sys.argv[1], Path(sys.argv[2])
    for mode in ("legacy", "auto"):
        asyncio.run(session(command, folder, mode))


main()
