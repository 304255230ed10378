// The TextMate grammar, outside of an editor.
'use strict';

const fs = require('fs');
const path = require('path');
const oniguruma = require('vscode-oniguruma');
const { INITIAL, Registry } = require('vscode-textmate');

const HERE = path.join(__dirname, '..');

async function load() {
  const wasm = fs.readFileSync(require.resolve('vscode-oniguruma/release/onig.wasm'));
  await oniguruma.loadWASM(wasm.buffer.slice(wasm.byteOffset, wasm.byteOffset + wasm.byteLength));
  const registry = new Registry({
    onigLib: Promise.resolve({
      createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
      createOnigString: (text) => new oniguruma.OnigString(text),
    }),
    loadGrammar: async () => JSON.parse(fs.readFileSync(path.join(HERE, 'syntaxes/mtx.tmLanguage.json'), 'utf8')),
  });
  return registry.loadGrammar('source.mtx');
}

// Every token that is no blank: { line, start, end, text, scope }, the innermost scope without `.mtx`.
function tokens(grammar, text) {
  const found = [];
  let stack = INITIAL;
  text.split(/\r?\n/).forEach((line, number) => {
    const result = grammar.tokenizeLine(line, stack);
    stack = result.ruleStack;
    for (const { startIndex: start, endIndex: end, scopes } of result.tokens) {
      const piece = line.slice(start, end);
      if (piece.trim()) found.push({ line: number, start, end, text: piece, scope: scopes[scopes.length - 1].replace(/\.mtx$/, ''), scopes });
    }
  });
  return found;
}

module.exports = { HERE, load, tokens };
