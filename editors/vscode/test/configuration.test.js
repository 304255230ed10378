// What counts as a word, and where the next line goes in or out.
'use strict';

const assert = require('node:assert');
const fs = require('fs');
const path = require('path');
const { test } = require('node:test');

const { HERE } = require('./grammar');

const { wordPattern, indentationRules } = JSON.parse(fs.readFileSync(path.join(HERE, 'language-configuration.json'), 'utf8'));

test('words are names, units and numbers', () => {
  const words = (text) => text.match(new RegExp(wordPattern, 'g'));
  assert.deepStrictEqual(words('add 4.2e8 µL of tip_1 at 20 °C'), ['add', '4.2e8', 'µL', 'of', 'tip_1', 'at', '20', '°C']);
  assert.deepStrictEqual(words('1 %w/w in std::glassware'), ['1', '%w/w', 'in', 'std', 'glassware']);
  assert.deepStrictEqual(words('x.contents[I-]'), ['x', 'contents', 'I']);
});

test('lines go in after an open bracket and out before a closing one', () => {
  const deeper = new RegExp(indentationRules.increaseIndentPattern);
  const back = new RegExp(indentationRules.decreaseIndentPattern);
  for (const line of ['lab bench {', '} finally {', '    let x = f(', 'say "{x}" {', 'workflow w(a: Mass) in bench {']) assert.match(line, deeper);
  for (const line of ['heat plate to 3 K // {', '// lab bench {', 'note "a { b"', 'x { a: 1 }', 'f(1)']) assert.doesNotMatch(line, deeper);
  for (const line of ['}', '    ) mm', '} on slip {']) assert.match(line, back);
  assert.doesNotMatch('x = 1 }', back);
});
