"""Encryption, discovery, locks, logins, long bytes and moments of SiLA 2 against the reference implementation: part of sila.py."""

import datetime
import hashlib
import os
import pathlib
import re
import shutil
import signal
import ssl
import subprocess
import uuid
import warnings

import bcrypt
from sila2.client import SilaClient
from sila2.features.lockcontroller import (
    InvalidLockIdentifier,
    LockControllerBase,
    LockControllerFeature,
    LockServer_Responses,
    ServerAlreadyLocked,
    ServerNotLocked,
    UnlockServer_Responses,
)
from sila2.framework import DefinedExecutionError, Feature, InvalidMetadata, SilaConnectionError
from sila2.server import FeatureImplementationBase, MetadataInterceptor, SilaServer

STORE = """<?xml version="1.0" encoding="utf-8"?>
<Feature SiLA2Version="1.0" FeatureVersion="1.0" Originator="org.example" Category="data" xmlns="http://www.sila-standard.org">
  <Identifier>Store</Identifier><DisplayName>Store</DisplayName><Description>Keeps bytes and a moment.</Description>
  <Command>
    <Identifier>Put</Identifier><DisplayName>Put</DisplayName><Description>Keeps them.</Description><Observable>No</Observable>
    <Parameter><Identifier>Data</Identifier><DisplayName>Data</DisplayName><Description>Bytes.</Description>
      <DataType><Basic>Binary</Basic></DataType></Parameter>
    <Parameter><Identifier>At</Identifier><DisplayName>At</DisplayName><Description>When.</Description>
      <DataType><Basic>Timestamp</Basic></DataType></Parameter>
    <Parameter><Identifier>Day</Identifier><DisplayName>Day</DisplayName><Description>The day.</Description>
      <DataType><Basic>Date</Basic></DataType></Parameter>
    <Parameter><Identifier>Hour</Identifier><DisplayName>Hour</DisplayName><Description>The time of day.</Description>
      <DataType><Basic>Time</Basic></DataType></Parameter>
    <Response><Identifier>Count</Identifier><DisplayName>Count</DisplayName><Description>Of bytes.</Description>
      <DataType><Basic>Integer</Basic></DataType></Response>
    <Response><Identifier>Back</Identifier><DisplayName>Back</DisplayName><Description>The bytes, backwards.</Description>
      <DataType><Basic>Binary</Basic></DataType></Response>
    <Response><Identifier>Later</Identifier><DisplayName>Later</DisplayName><Description>A day later.</Description>
      <DataType><Basic>Timestamp</Basic></DataType></Response>
  </Command>
</Feature>
"""

STORING = """mtx 1
capability Store from sila "store.sila.xml"
asset Shelf: Store { supposed_count: SIZE }
lab bench { ambient: 22 degC, shelf = Shelf at (0, 0, 0) m }
workflow store in bench {
    put shelf { data: "data.bin", at: "2028-02-28T23:30:00.250-03:30", day: "2026-11-23+01:00", hour: "14:30:00+00:00" }
    expect shelf.count == SIZE
}
"""


# A driver that asks for what is not there, and would make its device safe with a command that is not there either.
DRIVER = r"""
driver OwnStore for Shelf over sila(feature: "org.example/data/Store/v1", timeout: 5 s) {
    put sends "Put(Data: file \"{data}\", At: \"{at}\", Day: \"{day}\", Hour: \"{hour}\")"
    reading count asks "Put.Counting" expects "{}"
    safe sends "Shut"
}
"""


class Store(FeatureImplementationBase):
    heard = None

    def Put(self, Data, At, Day, Hour, *, metadata):
        self.heard = (hashlib.sha256(Data).hexdigest(), At, Day, Hour)
        return len(Data), Data[::-1], At + datetime.timedelta(days=1)


class Locks(LockControllerBase):
    """As the standard says: one identifier at a time."""

    held = None

    def get_IsLocked(self, *, metadata):
        return self.held is not None

    def LockServer(self, LockIdentifier, Timeout, *, metadata):
        if self.held is not None:
            raise ServerAlreadyLocked
        self.held = LockIdentifier
        return LockServer_Responses()

    def UnlockServer(self, LockIdentifier, *, metadata):
        if self.held is None:
            raise ServerNotLocked
        if self.held != LockIdentifier:
            raise InvalidLockIdentifier
        self.held = None
        return UnlockServer_Responses()

    def get_calls_affected_by_LockIdentifier(self):
        return [self.protected]


class Checks(MetadataInterceptor):
    def __init__(self, locks):
        super().__init__([LockControllerFeature["LockIdentifier"]])
        self.locks = locks

    def intercept(self, parameters, metadata, target):
        if self.locks.held is not None and metadata.get(LockControllerFeature["LockIdentifier"]) != self.locks.held:
            raise InvalidLockIdentifier


def said(folder):
    return (pathlib.Path(folder) / "said").read_text()


def encrypted(peer):
    """A lab that is served as the standard asks for it."""
    os.environ["XDG_DATA_HOME"] = os.path.abspath(os.path.join(peer.FOLDER, "data"))
    folder = os.path.join(peer.FOLDER, "encrypted")
    process, host, port = peer.start(folder, peer.LAB, "--host", "0.0.0.0")
    try:
        file = re.search("certificate: (.*)", said(folder)).group(1)
        shown = re.search("fingerprint: (.*)", said(folder)).group(1)
        mode = pathlib.Path(file).with_suffix(".key").stat().st_mode & 0o777
        peer.verdict("the key is the user's own", mode == 0o600, oct(mode))
        chain = pathlib.Path(file).read_bytes()
        # Its constructor holds the UUID in the certificate against the server's.
        client = SilaClient("127.0.0.1", port, root_certs=chain)
        peer.verdict("the official client connects over TLS", client.SiLAService.ServerName.get() == "bench")
        ours = client.SiLAService.ServerUUID.get()
        client.PlateHeater.Heat(T=60.0)
        peer.verdict("and calls", client.PlateHeater.Target.get() == 60.0)
        client.close()
        pem = ssl.get_server_certificate(("127.0.0.1", port))
        digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(pem)).hexdigest().upper()
        peer.verdict("the fingerprint is that of the certificate", shown.replace(":", "") == digest, shown)
        openssl = ["openssl", "x509", "-noout", "-subject", "-ext", "subjectAltName"]
        text = subprocess.run(openssl, input=pem, capture_output=True, text=True).stdout
        peer.verdict("its name is the standard's", re.search("CN ?= ?SiLA2", text) and "127.0.0.1" in text, " ".join(text.split()))
        plain = peer.raised(lambda: SilaClient("127.0.0.1", port, insecure=True), SilaConnectionError)
        peer.verdict("nobody is answered without encryption", plain is not None)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                found = SilaClient.discover(server_uuid=uuid.UUID(ours), timeout=20)
                peer.verdict("the official client finds it on the network", found.SiLAService.ServerUUID.get() == ours, found.address)
                found.close()
            except TimeoutError as why:
                peer.verdict("the official client finds it on the network", False, why)
        listed = subprocess.run([peer.COMMAND, "discover", "--for", "2"], capture_output=True, text=True, timeout=60).stdout
        peer.verdict("`discover` lists it", ours in listed and shown in listed and str(port) in listed, " ".join(listed.split())[:200])
        process.send_signal(signal.SIGTERM)
        process.wait(10)
        process, host, port = peer.start(folder, peer.LAB, "--host", "0.0.0.0")
        peer.verdict("the certificate stays", shown in said(folder))
    finally:
        process.kill()


def guarded(peer):
    """A lab that is locked, and one where people log in."""
    folder = os.path.join(peer.FOLDER, "locked")
    process, host, port = peer.start(folder, peer.LAB, "--insecure", "--no-discovery")
    try:
        one, two = (SilaClient(host, port, insecure=True) for _ in range(2))
        one.LockController.LockServer("ana", 60)
        again = peer.raised(lambda: two.LockController.LockServer("bob", 60), DefinedExecutionError)
        peer.verdict("a locked server is not locked again", again is not None and again.identifier == "ServerAlreadyLocked")
        calls = [lambda: two.PlateHeater.Heat(T=50.0), lambda: two.PlateHeater.Target.get(), two.CancelController.CancelAll]
        peer.verdict("others are refused", all(peer.raised(c, InvalidMetadata) for c in calls) and two.LockController.IsLocked.get())
        wrong = two.LockController.LockIdentifier("bob")
        error = peer.raised(lambda: two.PlateHeater.Heat(T=50.0, metadata=[wrong]), DefinedExecutionError)
        peer.verdict("also with another name", error is not None and error.identifier == "InvalidLockIdentifier")
        right = one.LockController.LockIdentifier("ana")
        one.PlateHeater.Heat(T=50.0, metadata=[right])
        peer.verdict("its holder is answered", one.PlateHeater.Target.get(metadata=[right]) == 50.0)
        one.LockController.UnlockServer("ana")
        two.PlateHeater.Heat(T=55.0)
        peer.verdict("and others when it is unlocked", two.PlateHeater.Target.get() == 55.0 and not two.LockController.IsLocked.get())
        one.close(), two.close()
    finally:
        process.kill()
    folder = os.path.join(peer.FOLDER, "users")
    os.makedirs(folder)
    users = pathlib.Path(folder) / "users"
    users.write_text("ana:" + bcrypt.hashpw(b"secret", bcrypt.gensalt(6)).decode() + "\n")
    process, host, port = peer.start(folder, peer.LAB, "--users", "users", "--no-discovery")
    try:
        file = re.search("certificate: (.*)", said(folder)).group(1)
        client = SilaClient(host, port, root_certs=pathlib.Path(file).read_bytes())
        own = client.SiLAService.ServerUUID.get()
        names = client.SiLAService.ImplementedFeatures.get()
        valid = sum(
            peer.schema().validate(peer.lxml.etree.fromstring(client.SiLAService.GetFeatureDefinition(n).FeatureDefinition.encode()))
            for n in names
        )
        peer.verdict("features of locks and logins keep to the schema", valid == len(names), f"{valid} of {len(names)}")
        login = client.AuthenticationService.Login
        bad = [("ana", "other", own), ("bob", "secret", own), ("ana", "secret", str(uuid.uuid4()))]
        failed = [peer.raised(lambda: login(u, p, s, []), DefinedExecutionError) for u, p, s in bad]
        peer.verdict("wrong logins fail", all(f is not None and f.identifier == "AuthenticationFailed" for f in failed))
        peer.verdict("nobody calls without a login", peer.raised(lambda: client.PlateHeater.Heat(T=50.0), InvalidMetadata) is not None)
        token = login("ana", "secret", own, []).AccessToken
        beside = [client.AuthorizationService.AccessToken(token)]
        client.PlateHeater.Heat(T=50.0, metadata=beside)
        peer.verdict("who has logged in calls", client.PlateHeater.Target.get(metadata=beside) == 50.0)
        peer.verdict("and is named", "called by ana" in said(folder))
        other = login("ana", "secret", own, [next(n for n in names if n.endswith("PlateHeater/v1"))]).AccessToken
        other = [client.AuthorizationService.AccessToken(other)]
        client.PlateHeater.Heat(T=51.0, metadata=other)
        error = peer.raised(lambda: client.PlateStirrer.StopStirring(metadata=other), DefinedExecutionError)
        peer.verdict("a token is for the features it was asked for", error is not None and error.identifier == "InvalidAccessToken")
        client.AuthenticationService.Logout(token)
        error = peer.raised(lambda: client.PlateHeater.Heat(T=50.0, metadata=beside), DefinedExecutionError)
        peer.verdict("and ends at the logout", error is not None and error.identifier == "InvalidAccessToken")
        client.close()
    finally:
        process.kill()


def bound(peer, name, binding, text=None, files=(), env=None):
    """A workflow, deployed with these bindings."""
    folder = pathlib.Path(peer.FOLDER) / name
    folder.mkdir()
    shutil.copy(peer.INPUTS / "hotplate.sila.xml", folder)
    for file, content in files:
        (folder / file).write_bytes(content)
    (folder / "lab.mtx").write_text(text or peer.OWN)
    (folder / "lab.toml").write_text(binding)
    arguments = [peer.COMMAND, "deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal"]
    ended = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=180, env={**os.environ, **(env or {})})
    return ended, folder


def driven(peer):
    """The official server, encrypted, found, locked."""
    server = SilaServer("plate", "Plate", "a plate", "1.0", "https://example.org")
    plate = peer.Plate(server)
    server.set_feature_implementation(Feature(peer.FEATURE), plate)
    port = peer.free()
    server.start("127.0.0.1", port)
    try:
        pem = ssl.get_server_certificate(("127.0.0.1", port))
        digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(pem)).hexdigest()
        at = f'[plate]\nsila = "127.0.0.1:{port}"\n'
        ended, _ = bound(peer, "by fingerprint", f'{at}fingerprint = "{digest}"\n')
        peer.verdict("an encrypted server, by its fingerprint", ended.returncode == 0 and plate.heard[-1] == ("Stop",), peer.last(ended))
        ended, _ = bound(peer, "by certificate", f'{at}certificate = "plate.pem"\n', files=[("plate.pem", pem.encode())])
        peer.verdict("by its certificate", ended.returncode == 0, peer.last(ended))
        heard = len(plate.heard)
        ended, _ = bound(peer, "by another", f'{at}fingerprint = "{"0" * 64}"\n')
        text = " ".join(ended.stderr.split()).replace(" ", "")
        good = ended.returncode == 1 and "nottrusted" in text and len(plate.heard) == heard
        peer.verdict("and by no other", good, peer.last(ended))
        ended, _ = bound(peer, "found", f'[plate]\nsila = "{server.server_uuid}"\nfingerprint = "{digest}"\n')
        peer.verdict("found on the network by its UUID", ended.returncode == 0, peer.last(ended))
        if ended.returncode:
            print(ended.stderr)
        ended, _ = bound(peer, "not found", f'[plate]\nsila = "{uuid.uuid4()}"\nfingerprint = "{digest}"\n')
        peer.verdict("one that is not there is not", ended.returncode == 1 and "has no server with the UUID" in " ".join(ended.stderr.split()), peer.last(ended))
    finally:
        server.stop()

    server = SilaServer("plate", "Plate", "a plate", "1.0", "https://example.org")
    plate, locks = peer.Plate(server), Locks(server)
    feature = Feature(peer.FEATURE)
    locks.protected = feature
    server.set_feature_implementation(feature, plate)
    server.set_feature_implementation(LockControllerFeature, locks)
    server.add_metadata_interceptor(Checks(locks))
    port = peer.free()
    server.start_insecure("127.0.0.1", port, enable_discovery=False)
    try:
        at = f'[plate]\nsila = "127.0.0.1:{port}"\n'
        ended, _ = bound(peer, "taken", f'{at}lock = "1 min"\n')
        peer.verdict("a server is taken and let go", ended.returncode == 0 and locks.held is None and plate.heard[-1] == ("Stop",), peer.last(ended))
        if ended.returncode:
            print(ended.stderr)
        locks.held, heard = "somebody else", len(plate.heard)
        for name, more in (("taken by another", 'lock = "1 min"\n'), ("not ours", "")):
            ended, _ = bound(peer, name, at + more)
            good = ended.returncode == 1 and len(plate.heard) == heard and locks.held == "somebody else"
            peer.verdict(f"{name}: nothing is told", good, peer.last(ended))
    finally:
        server.stop()


def stored(peer):
    """Bytes and moments, there and back."""
    server = SilaServer("shelf", "Shelf", "a shelf", "1.0", "https://example.org")
    store = Store(server)
    server.set_feature_implementation(Feature(STORE), store)
    port = peer.free()
    server.start_insecure("127.0.0.1", port, enable_discovery=False)
    try:
        for size in (3, 5_000_001):
            data = os.urandom(size)
            files = [("data.bin", data), ("store.sila.xml", STORE.encode())]
            text = STORING.replace("SIZE", str(size))
            ended, folder = bound(peer, f"bytes {size}", f'[shelf]\nsila = "127.0.0.1:{port}"\n', text, files)
            zone = lambda hours, minutes=0: datetime.timezone(datetime.timedelta(hours=hours, minutes=minutes))
            wanted = (
                hashlib.sha256(data).hexdigest(),
                datetime.datetime(2028, 2, 28, 23, 30, 0, 250_000, zone(-4, 30)),
                (2026, 11, 23, zone(1)),
                datetime.time(14, 30, tzinfo=zone(0)),
            )
            heard = store.heard and (*store.heard[:2], (store.heard[2].date.year, store.heard[2].date.month, store.heard[2].date.day, store.heard[2].timezone), store.heard[3])
            peer.verdict(f"{size} bytes and moments arrive", ended.returncode == 0 and heard == wanted, peer.last(ended) if ended.returncode else "")
            if heard != wanted:
                print(heard, wanted, ended.stderr)
            journal = (folder / "journal").read_text()
            sent, back = (f"({size} bytes, SHA-256 {hashlib.sha256(d).hexdigest()})" for d in (data, data[::-1]))
            peer.verdict("and what comes back", sent in journal and back in journal and "2028-02-29T23:30:00.250-03:30" in journal)
        for name, wrong, said in (
            ("a day that there is not", ("2026-11-23+01:00", "2026-02-30+01:00"), "2026-02-30"),
            ("a file that there is not", ("data.bin", "other.bin"), "other.bin"),
        ):
            store.heard = None
            ended, _ = bound(peer, name, f'[shelf]\nsila = "127.0.0.1:{port}"\n', text.replace(*wrong), files)
            good = ended.returncode == 1 and "error[unsendable]" in ended.stderr and said in ended.stderr
            peer.verdict(f"{name}: nothing is told", good and store.heard is None, peer.last(ended))
            if not good:
                print(ended.stderr)
        binding = f'[shelf]\nsila = "127.0.0.1:{port}"\ndriver = "OwnStore"\n'
        ended, _ = bound(peer, "driver", binding, text + DRIVER, files)
        said = " ".join(ended.stderr.split())
        good = "`Put` answers no `Counting`" in said and "has no command `Shut`" in said
        peer.verdict("a driver's lines are judged before one is needed", good and store.heard is None, peer.last(ended))
        if not good:
            print(ended.stderr)
    finally:
        server.stop()


def main(peer):
    encrypted(peer)
    guarded(peer)
    driven(peer)
    stored(peer)
