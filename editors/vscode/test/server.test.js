// The extension as it is packaged, with the real `matterixc lsp`, in an editor without a window (vscode.js).
'use strict';

const assert = require('node:assert');
const fs = require('fs');
const os = require('os');
const path = require('path');
const { test, before, after } = require('node:test');

const { HERE } = require('./grammar');
const { editor, load } = require('./vscode');

const BUNDLE = path.join(HERE, 'dist/extension.js');
const PROGRAM = process.env.MATTERIXC ?? path.join(HERE, '../../target/debug/matterixc');

const TEXT = `mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
}
workflow warm in bench {
    heat plate to 60 degC
    wait 10 min    // 20 µL, °C and 🧪
    stop heating plate
}
`;

let folder;
before(() => { folder = fs.mkdtempSync(path.join(os.tmpdir(), 'mtx-test-')); });
after(() => fs.rmSync(folder, { recursive: true, force: true }));

async function start(settings) {
  const mock = editor(settings);
  const extension = load(BUNDLE, mock.vscode);
  const context = { subscriptions: [], extensionPath: HERE, asAbsolutePath: (name) => path.join(HERE, name) };
  const running = await extension.activate(context);
  return { ...mock, extension, running };
}

function put(mock, name, text) {
  const file = path.join(folder, name);
  fs.writeFileSync(file, text);
  const uri = mock.vscode.Uri.file(file);
  return mock.open(uri, text);
}

test('the server starts, finds what is wrong while it is typed, answers, and stops', async () => {
  const mock = await start({ 'mtx.server.path': PROGRAM });
  try {
    assert.match(mock.seen.status.text, /^matterixc \d/, mock.seen.errors.join('; '));
    const document = put(mock, 'warm.mtx', TEXT);
    mock.type(document, TEXT.replace('60 degC', '60 mL'));
    const [wrong] = await mock.published(document.uri, (found) => found.length > 0);
    assert.strictEqual(wrong.range.start.line, 9, wrong.message);
    mock.type(document, TEXT.replace('wait 10 min', 'wait 10 mni'));
    const [unit] = await mock.published(document.uri, (found) => found.some(({ range }) => range.start.line === 10));
    assert.strictEqual(TEXT.split('\n')[10].slice(0, unit.range.start.character).trim().split(' ')[0], 'wait');
    mock.type(document, TEXT);
    await mock.published(document.uri, (found) => found.length === 0);

    const at = { textDocument: { uri: document.uri.toString() }, position: { line: 10, character: 8 } };
    const hover = await mock.running.client.sendRequest('textDocument/hover', at);
    assert.match(JSON.stringify(hover?.contents ?? ''), /beaker/);
    mock.seen.hovers = [{ contents: [{ value: hover.contents.value }] }];
    await mock.seen.commands.get('mtx.contents')();
    assert.match(mock.seen.shown[0].getText(), /^line 1\n[^]*beaker/);

    const library = await mock.seen.providers['mtx-std'].provideTextDocumentContent(mock.vscode.Uri.parse('mtx-std:/heating.mtx'));
    assert.match(library, /^mtx 1\n/);
    const edits = await mock.running.client.sendRequest('textDocument/formatting', {
      textDocument: at.textDocument, options: { tabSize: 4, insertSpaces: true },
    });
    assert.ok(edits === null || Array.isArray(edits));
  } finally {
    await mock.extension.deactivate();
  }
  assert.strictEqual(mock.running.client, undefined);
});

test('commands run the program on the file in front', async () => {
  const mock = await start({ 'mtx.server.path': PROGRAM, 'mtx.run.arguments': ['--dry'] });
  try {
    const document = put(mock, 'run.mtx', TEXT);
    for (const name of ['check', 'run', 'plan', 'view', 'contents', 'restart']) assert.ok(mock.seen.commands.has(`mtx.${name}`), name);
    await mock.seen.commands.get('mtx.check')();
    await mock.seen.commands.get('mtx.run')();
    const [check, run] = mock.seen.tasks.map(({ execution }) => execution);
    assert.deepStrictEqual(check.args, ['check', '--format', 'concise', document.uri.fsPath]);
    assert.deepStrictEqual(run.args, ['run', '--dry', document.uri.fsPath]);
    assert.strictEqual(run.process, PROGRAM);

    await mock.seen.commands.get('mtx.plan')();
    assert.strictEqual(mock.seen.panels.length, 1, mock.seen.output.join('\n'));
    assert.match(mock.seen.panels[0].webview.html, /data:image\/svg\+xml/);

    await mock.seen.commands.get('mtx.view')();
    const until = Date.now() + 60_000;
    while (mock.seen.opened.length === 0 && Date.now() < until) await new Promise((resolve) => setTimeout(resolve, 50));
    assert.match(mock.seen.opened[0], /^http:\/\/127\.0\.0\.1:\d+/);
    const page = await fetch(mock.seen.opened[0]);
    assert.strictEqual(page.status, 200);
    mock.running.view.dispose();

    await mock.seen.commands.get('mtx.restart')();
    assert.match(mock.seen.status.text, /^matterixc \d/);
  } finally {
    await mock.extension.deactivate();
  }
});

test('a program that is not there is named, and nothing else breaks', async () => {
  const mock = await start({ 'mtx.server.path': path.join(folder, 'nowhere') });
  assert.match(mock.seen.status.text, /not found/);
  assert.match(mock.seen.errors[0], /nowhere` was not found/);
  await mock.extension.deactivate();
});

test('a program that is no server is told from one', async () => {
  const mock = await start({ 'mtx.server.path': process.execPath, 'mtx.server.arguments': [path.join(folder, 'nothing.js')] });
  assert.match(mock.seen.status.text, /does not answer/);
  assert.ok(mock.seen.errors.some((text) => text.includes('does not work as a language server')), mock.seen.errors.join('; '));
  await mock.extension.deactivate();
});

test('what check prints is understood by the problem matcher', () => {
  const { problemMatchers: [{ pattern }] } = JSON.parse(fs.readFileSync(path.join(HERE, 'package.json'), 'utf8')).contributes;
  const file = path.join(folder, 'wrong.mtx');
  fs.writeFileSync(file, TEXT.replace('60 degC', '60 mL'));
  const { stdout, stderr } = require('child_process').spawnSync(PROGRAM, ['check', '--format', 'concise', '--fidelity', 'process', file], { encoding: 'utf8' });
  const found = `${stdout}${stderr}`.split('\n').map((line) => line.match(new RegExp(pattern.regexp))).find(Boolean);
  assert.ok(found, stdout + stderr);
  assert.deepStrictEqual([found[pattern.file], found[pattern.line], found[pattern.severity]], [file, '10', 'error']);
});
