"""Floods the servers of the command with connections, and asks between them.

python flood.py MATTERIXC EXAMPLE: 10,000 connections each to the page of an example, to an emulated robot's server and to an emulated
hotplate, a third of them with half a request. Every 500 somebody asks properly and must be answered; at the end the server must hold
no more connections than it may, no more memory than before, and end at once on Ctrl-C.
"""

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

CONNECTIONS = 10_000
BETWEEN = 500
# Seconds, far above what an answer takes: the machine may be busy.
PATIENCE = 5.0
# More than either server lets in, and what any process has open besides.
MOST_FILES = 100
MOST_GROWTH = 16 << 10

PAGE = b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
LINE = b"IN_PV_1\r\n"


def memory(process):
    """Resident memory, KiB."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS")))


def ask(port, question):
    """How long an answer takes, s."""
    begun = time.monotonic()
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as connection:
        connection.sendall(question)
        assert connection.recv(64), "no answer"
    return time.monotonic() - begun


def flood(command, question):
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        port = int(process.stdout.readline().decode().strip().rstrip("/").rsplit(":", 1)[1])
        slowest = ask(port, question)
        before = memory(process)
        held = []
        for count in range(CONNECTIONS):
            connection = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
            if count % 3 == 0:
                connection.send(question[:-3])
            held.append(connection)
            if count % BETWEEN == 0:
                slowest = max(slowest, ask(port, question))
        growth = memory(process) - before
        files = len(os.listdir(f"/proc/{process.pid}/fd"))
        assert files <= MOST_FILES, f"{files} files are open"
        assert growth <= MOST_GROWTH, f"it grew by {growth} KiB"
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0, "it did not end well"
        took = time.monotonic() - begun
        print(f"{' '.join(command[1:3])}: slowest answer {slowest * 1e3:.0f} ms, {growth} KiB more, ended after {took * 1e3:.0f} ms")
        for connection in held:
            connection.close()
    finally:
        process.kill()


def main():
    matterixc, example = sys.argv[1:]
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    flood([matterixc, "view", example], PAGE)
    flood([matterixc, "emulate", "OT2", "--tcp", "0"], PAGE)
    flood([matterixc, "emulate", "IkaRetControl", "--tcp", "0"], LINE)


if __name__ == "__main__":
    main()
