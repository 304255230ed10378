// A page that shows files as the grammar colours them, to be looked at: node test/picture.js OUT.html FILE...
'use strict';

const fs = require('fs');
const path = require('path');

const { load, tokens } = require('./grammar');

const COLOURS = [
  ['comment', '#6a737d;font-style:italic'], ['string', '#0a3069'], ['punctuation.definition.string', '#0a3069'],
  ['constant.character.escape', '#953800'], ['constant.other.format', '#953800'], ['punctuation.section.embedded', '#953800'],
  ['constant.numeric', '#0550ae'], ['keyword.other.unit', '#116329'], ['keyword.operator.word', '#0550ae'], ['keyword.operator', '#57606a'],
  ['keyword.control', '#cf222e'], ['keyword.other', '#8250df'], ['storage', '#8250df'], ['entity.name.function', '#6639ba'],
  ['entity.name.type', '#1a7f64'], ['entity.name.namespace', '#116329'], ['entity.name.label', '#cf222e'], ['constant.other', '#953800'],
  ['constant.language', '#0550ae'], ['variable.language', '#0550ae'], ['variable.parameter', '#9a6700'], ['variable.other.property', '#9a6700'],
  ['variable.other.constant', '#953800'], ['variable', '#24292f'], ['punctuation', '#57606a'], ['invalid', '#ffffff;background:#cf222e'],
];

const escape = (text) => text.replace(/[&<>]/g, (sign) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;' })[sign]);

function coloured(grammar, text) {
  const lines = text.split('\n').map((line) => ({ line, at: 0, html: '' }));
  for (const token of tokens(grammar, text)) {
    const row = lines[token.line];
    const colour = COLOURS.find(([scope]) => token.scope.startsWith(scope))?.[1] ?? '#ff00ff';
    row.html += escape(row.line.slice(row.at, token.start)) + `<span style="color:${colour}">${escape(token.text)}</span>`;
    row.at = token.end;
  }
  return lines.map(({ line, at, html }) => html + escape(line.slice(at))).join('\n');
}

async function main([out, ...files]) {
  const grammar = await load();
  const parts = files.map((file) => `<h3>${escape(path.basename(file))}</h3><pre>${coloured(grammar, fs.readFileSync(file, 'utf8'))}</pre>`);
  fs.writeFileSync(out, `<!DOCTYPE html><meta charset="utf-8"><style>body{font:13px sans-serif}pre{font:13px/1.35 monospace}</style>${parts.join('')}`);
}

main(process.argv.slice(2));
