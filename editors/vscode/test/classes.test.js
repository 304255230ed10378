// Every word of the examples, the specification and the library has a scope that fits what the compiler says it is.
'use strict';

const assert = require('node:assert');
const { spawn } = require('child_process');
const fs = require('fs');
const path = require('path');
const { test } = require('node:test');
const { pathToFileURL } = require('url');
const rpc = require('vscode-jsonrpc/node');

const { HERE, load, tokens } = require('./grammar');

const ROOT = path.join(HERE, '../..');
const PROGRAM = process.env.MATTERIXC ?? path.join(ROOT, 'target/debug/matterixc');

// Scopes that fit a type of the server's tokens. Where only the compiler can know (whether the last word of a call is its verb's or a
// thing's, whether a name alone is a species), several do.
const FITTING = {
  keyword: /^(keyword|storage)/,
  modifier: /^keyword/,
  number: /^constant\.numeric/,
  enumMember: /^keyword\.other\.unit/,
  string: /^(string|punctuation\.definition\.string|constant\.character|punctuation\.section\.embedded|embedded)/,
  comment: /^comment/,
  method: /^(entity\.name\.function|variable\.other$)/,
  function: /^entity\.name\.function/,
  type: /^(entity\.name|variable\.other)/,
  struct: /^(constant\.other\.species|variable\.other$|entity\.name\.type)/,
  parameter: /^(variable|constant\.other\.species)/,
  property: /^(variable\.(other|parameter)|constant\.other\.species)/,
  variable: /^(variable|entity\.name|constant)/,
};

async function connect() {
  const child = spawn(PROGRAM, ['lsp'], { stdio: ['pipe', 'pipe', 'ignore'] });
  const connection = rpc.createMessageConnection(new rpc.StreamMessageReader(child.stdout), new rpc.StreamMessageWriter(child.stdin));
  connection.onUnhandledNotification(() => {});
  connection.listen();
  const { capabilities } = await connection.sendRequest('initialize', { processId: process.pid, rootUri: null, capabilities: {} });
  await connection.sendNotification('initialized', {});
  return { child, connection, legend: capabilities.semanticTokensProvider.legend.tokenTypes };
}

// { line, start, end, type } of every token, as the protocol packs them.
function unpacked(data, legend) {
  const found = [];
  let line = 0;
  let start = 0;
  for (let i = 0; i < data.length; i += 5) {
    start = data[i] > 0 ? data[i + 1] : start + data[i + 1];
    line += data[i];
    found.push({ line, start, end: start + data[i + 2], type: legend[data[i + 3]] });
  }
  return found;
}

function files(folder) {
  return fs.readdirSync(folder, { withFileTypes: true, recursive: true })
    .filter((entry) => entry.isFile() && entry.name.endsWith('.mtx'))
    .map((entry) => path.join(entry.parentPath ?? entry.path, entry.name));
}

test('the grammar colours words as the compiler classes them', async () => {
  const grammar = await load();
  const { child, connection, legend } = await connect();
  const wrong = [];
  let count = 0;
  for (const file of ['examples', 'tests/spec', 'stdlib'].flatMap((folder) => files(path.join(ROOT, folder))).sort()) {
    const text = fs.readFileSync(file, 'utf8');
    const uri = pathToFileURL(file).href;
    await connection.sendNotification('textDocument/didOpen', { textDocument: { uri, languageId: 'mtx', version: 1, text } });
    const { data } = await connection.sendRequest('textDocument/semanticTokens/full', { textDocument: { uri } });
    await connection.sendNotification('textDocument/didClose', { textDocument: { uri } });
    const lines = text.split('\n');
    const scopes = lines.map(() => []);
    for (const token of tokens(grammar, text)) for (let i = token.start; i < token.end; i++) scopes[token.line][i] = token;
    for (const { line, start, end, type } of unpacked(data, legend)) {
      count += 1;
      const token = scopes[line][start];
      // The values in texts are coloured one by one.
      const scope = type === 'string' && token?.scopes.some((name) => name.startsWith('string')) ? 'string' : token?.scope ?? 'nothing';
      const split = type !== 'string' && scopes[line].slice(start, end).some((other) => other?.scope !== token?.scope);
      if (!FITTING[type].test(scope) || split) wrong.push(`${path.relative(ROOT, file)}:${line + 1}: \`${lines[line].slice(start, end)}\` is a ${type}, coloured as ${scope}`);
    }
  }
  await connection.sendRequest('shutdown');
  await connection.sendNotification('exit');
  connection.dispose();
  child.kill();
  console.log(`# ${count} words, ${wrong.length} of them coloured as something else`);
  assert.ok(count > 10_000);
  assert.deepStrictEqual(wrong, []);
});
