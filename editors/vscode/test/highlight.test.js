// What the TextMate grammar says of chosen words.
'use strict';

const assert = require('node:assert');
const { test } = require('node:test');

const { load, tokens } = require('./grammar');

const CASES = [
  ['mtx 1', { mtx: 'keyword.other', 1: 'constant.numeric' }],
  ['/// Warms it.', { '/// Warms it.': 'comment.line.documentation' }],
  ['wait 10 s // then', { wait: 'keyword.control', 10: 'constant.numeric', s: 'keyword.other.unit', '// then': 'comment.line.double-slash' }],
  ['let x = 4.2e8 kg/(mol*s) + 20 µL - 3 1/s', { x: 'variable.other.readwrite', '4.2e8': 'constant.numeric', 'kg/(mol*s)': 'keyword.other.unit', 'µL': 'keyword.other.unit', '1/s': 'keyword.other.unit' }],
  ['table = OpticalTable at (0, 1, 2) mm', { OpticalTable: 'entity.name.type', at: 'keyword.operator.word', mm: 'keyword.other.unit' }],
  ['heat plate to 60 degC', { heat: 'entity.name.function', plate: 'variable.other', to: 'keyword.operator.word', degC: 'keyword.other.unit' }],
  ['stop heating plate', { heating: 'entity.name.function', plate: 'variable.other' }],
  ['repeat 3 times {', { repeat: 'keyword.control', 3: 'constant.numeric', times: 'keyword.control' }],
  ['repeat while x < max(a, b) max 3 {', { while: 'keyword.control' }],
  ['reaction r: KNO3(s) <-> K+ + NO3- {', { reaction: 'storage.type', r: 'variable.other.constant', 'KNO3(s)': 'constant.other.species', 'K+': 'constant.other.species', '+': 'keyword.operator', 'NO3-': 'constant.other.species' }],
  ['species SO4^2- { charge: -2 }', { 'SO4^2-': 'constant.other.species', charge: 'variable.other.property' }],
  ['expect v[I-] + x[i-1] > 3 mmol of Ca2+', { 'I-': 'constant.other.species', i: 'variable.other', 'Ca2+': 'constant.other.species', of: 'keyword.operator.word' }],
  ['note "at {t as degC :.1}, {{so}}\\n"', { '"': 'punctuation.definition.string.begin', as: 'keyword.operator.word', degC: 'keyword.other.unit', ':.1': 'constant.other.format', '{{': 'constant.character.escape', '\\n': 'constant.character.escape' }],
  ['move(v, from: a, to: b)', { move: 'entity.name.function', from: 'variable.other.property', to: 'variable.other.property' }],
  ['sum(w in plate.wells: w.volume)', { sum: 'entity.name.function', in: 'keyword.operator.word', wells: 'variable.other.property' }],
  ['    param limits: Range<Temperature>? = unlimited', { param: 'storage.modifier', limits: 'variable.other.property', Temperature: 'entity.name.type', unlimited: 'constant.language' }],
  ['extern skill pick up(item: Graspable) by(arm: Arm)', { extern: 'storage.modifier', skill: 'storage.type', 'pick up': 'entity.name.function', by: 'keyword.operator.word' }],
  ['use std::robots::{FrankaPanda, Robotiq2F85}', { use: 'keyword.other', std: 'entity.name.namespace', FrankaPanda: 'entity.name.type' }],
  ['} on slip { fail late "no" } finally {', { on: 'keyword.control', slip: 'entity.name.label', late: 'entity.name.label', finally: 'keyword.control' }],
];

test('chosen words have their scopes', async () => {
  const grammar = await load();
  for (const [line, expected] of CASES) {
    const found = tokens(grammar, line);
    for (const [text, scope] of Object.entries(expected)) {
      const token = found.find((token) => token.text.trim() === text);
      assert.ok(token, `\`${text}\` is no token of \`${line}\`: ${found.map((t) => t.text).join('|')}`);
      assert.strictEqual(token.scope, scope, `\`${text}\` of \`${line}\``);
    }
  }
});
