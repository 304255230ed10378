/**
 * The grammar of .mtx for editors. It accepts what grammar/mtx.pest accepts; names of rules follow it where they mean the same.
 *
 * A line goes on where the next line begins with something that cannot begin one. src/scanner.c looks at what follows a line end and says
 * what it is, so that one token of lookahead is enough: `_newline` ends a line; `_blank_line` means nothing, as an operator, a preposition
 * or a closing bracket follows; `_nl_clause` and `_nl_more` stand before words with which a line may begin elsewhere, but goes on here.
 */
/// <reference types="tree-sitter-cli/dsl" />

// Words that are no names. As names of fields, options and failures they will do (`any_word`).
const RESERVED = [
  'after', 'and', 'as', 'ask', 'asks', 'at', 'await', 'by', 'claim', 'effect', 'else', 'every', 'expect', 'expects', 'fail', 'fails',
  'finally', 'for', 'from', 'hold', 'holding', 'if', 'in', 'into', 'is', 'keep', 'let', 'max', 'needs', 'not', 'note', 'of', 'on', 'onto', 'or',
  'parallel', 'presumes', 'record', 'repeat', 'retry', 'return', 'sends', 'sequence', 'start', 'step', 'takes', 'through', 'timeout', 'to',
  'try', 'until', 'using', 'wait', 'while', 'with', 'within',
];

const LABELS = ['to', 'from', 'into', 'onto', 'on', 'in', 'with', 'by', 'at', 'using', 'through', 'as'];

const PREC = { or: 1, and: 2, not: 3, plus_minus: 7, add: 8, mul: 9, neg: 10, pow: 11, of: 12 };

// A line end where the line goes on anyhow.
const nl = ($) => optional($._newline);

const commas = ($, rule) => seq(rule, repeat(seq(',', nl($), rule)));

// Separated by commas, with one after the last if you like.
const listed = ($, rule) => seq(commas($, rule), optional(seq(',', nl($))));

// Lines between braces.
const lines = ($, rule, separator) =>
  seq('{', nl($), optional(seq(rule, repeat(seq(separator, rule)), optional(separator))), '}');

const block_of = ($, rule) => lines($, rule, $._separator);

const fields_of = ($, rule) => lines($, rule, $._field_separator);

const signature_of = ($, verb) => seq(
  field('verb', verb), optional($.parameters), repeat($.labelled_parameters),
  optional(seq('->', nl($), field('result', $.type))),
);

const word_of = ($, ...words) => choice($.identifier, ...words.map((word) => alias(word, $.identifier)));

const infix = ($, sign) => seq(
  field('left', $._arithmetic), field('operator', sign), nl($), field('right', $._arithmetic),
);

module.exports = grammar({
  name: 'mtx',

  externals: ($) => [
    $._newline, $._blank_line, $._nl_clause, $._nl_more,
    $._unit, $._unit_after_as, $.state_word, $._first_word, $._next_word, $._species, $._species_index, $._species_ion, $._less,
    $._tight, $._same_line, $._beside, $._error_sentinel,
  ],

  extras: ($) => [/[ \t\r]/, $.doc_comment, $.comment, $._blank_line],

  word: ($) => $.identifier,

  reserved: { global: () => RESERVED },

  supertypes: ($) => [$.expression, $.statement, $.declaration],

  inline: ($) => [$._operand_or_word, $._law_block],

  rules: {
    source_file: ($) => seq(nl($), optional(choice(
      seq($.header, optional($._separator)),
      seq(optional(seq($.header, $._separator)), $.declaration, repeat(seq($._separator, $.declaration)), optional($._separator)),
    ))),

    header: ($) => seq('mtx', field('version', alias($._version, $.number))),
    _version: () => token(/[0-9]+/),

    _separator: ($) => choice(seq(';', nl($)), $._newline),
    _field_separator: ($) => choice(seq(choice(',', ';'), nl($)), seq($._newline, optional(seq(';', nl($))))),

    // ---- words
    comment: () => token(seq('//', /[^\n]*/)),
    doc_comment: () => token(prec(1, seq(choice('///', '//!'), /[^\n]*/))),
    identifier: () => /[A-Za-z_][A-Za-z0-9_]*/,
    // Any word where no name is meant.
    _any_word: ($) => word_of($, ...RESERVED),
    species: ($) => choice($._species, $._any_word),
    _name: ($) => choice($.identifier, $.scoped_name, alias($._dotted_name, $.member_expression)),
    scoped_name: ($) => seq(field('scope', $._name), token.immediate('::'), $._tight, field('name', $.identifier)),
    _dotted_name: ($) => seq(field('object', $._name), $._member),
    _member: ($) => seq(token.immediate('.'), $._tight, field('member', alias($._immediate_word, $.member_name))),
    _immediate_word: () => token.immediate(/[A-Za-z_][A-Za-z0-9_]*/),
    label: () => choice(...LABELS),

    // ---- literals
    number: () => /[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?/,
    quantity: ($) => seq(field('value', $.number), field('unit', alias($._unit, $.unit))),
    string: ($) => seq('"', repeat(choice($.escape_sequence, $.placeholder, $._string_content)), token.immediate('"')),
    _string_content: () => token.immediate(prec(1, /[^"\\\n{}]+|[{}]/)),
    // In texts that are shown: `{vessel.temperature as degC :.1}`.
    placeholder: () => token.immediate(prec(2, /\{[^{}"\\\n]+\}/)),
    escape_sequence: () => token.immediate(prec(1, choice(/\\([nrt"\\]|x[0-9a-fA-F]{2})/, '{{', '}}'))),

    // ---- expressions
    expression: ($) => choice($._comparable, $.comparison, alias($._membership, $.comparison), $.not_expression, $.logical_expression),
    logical_expression: ($) => choice(
      prec.left(PREC.or, seq(field('left', $.expression), field('operator', 'or'), nl($), field('right', $.expression))),
      prec.left(PREC.and, seq(field('left', $.expression), field('operator', 'and'), nl($), field('right', $.expression))),
    ),
    not_expression: ($) => prec(PREC.not, seq('not', $.expression)),
    _not_operand: ($) => seq('not', choice($._comparable, alias($._not_operand, $.not_expression))),
    // `a < b < c` has no meaning.
    comparison: ($) => seq(
      field('left', $._comparable),
      field('operator', choice('==', '!=', '<=', '>=', alias($._less, '<'), '>', 'is')), nl($),
      field('right', choice($._comparable, alias($._not_operand, $.not_expression))),
    ),
    _membership: ($) => seq(
      field('left', $._comparable), field('operator', 'in'), nl($),
      field('right', choice($._comparable, alias($._not_operand, $.not_expression))),
    ),
    _comparable: ($) => choice($._operand, $.state_word, $.conversion),
    conversion: ($) => seq($._comparable, 'as', nl($), field('unit', alias($._unit_after_as, $.unit))),
    // What may stand as an argument after a preposition.
    _operand: ($) => choice($._arithmetic, $.range),
    range: ($) => seq(field('low', $._arithmetic), '..', nl($), field('high', $._arithmetic)),
    _arithmetic: ($) => choice($._atom, $.binary_expression, $.unary_expression, $.of_expression),
    binary_expression: ($) => choice(
      prec.left(PREC.plus_minus, infix($, '+-')),
      prec.left(PREC.add, infix($, choice('+', '-'))),
      prec.left(PREC.mul, infix($, choice('*', '/'))),
      prec.right(PREC.pow, infix($, '^')),
    ),
    unary_expression: ($) => prec(PREC.neg, seq('-', $._arithmetic)),
    of_expression: ($) => prec(PREC.of, seq(field('amount', $._atom), 'of', nl($), field('species', $.species))),
    _atom: ($) => choice($.number, $.quantity, $.string, $._postfix, $.derivative),
    derivative: ($) => seq($._postfix, token.immediate("'")),
    _postfix: ($) => choice($._name, $._compound),
    _compound: ($) => choice(alias($._species_ion, $.species), $.tuple, $.list, $.call_expression, $.index_expression, alias($._compound_member, $.member_expression)),
    _compound_member: ($) => seq(field('object', $._compound), $._member),
    call_expression: ($) => seq(field('function', choice($._postfix, alias('max', $.identifier))), field('arguments', $.arguments)),
    arguments: ($) => seq(token.immediate('('), nl($), optional(listed($, $._argument)), ')'),
    _loose_arguments: ($) => seq('(', nl($), optional(listed($, $._argument)), ')'),
    _argument: ($) => choice($.named_argument, $.fold, $._positional),
    _positional: ($) => $.expression,
    named_argument: ($) => prec(1, seq(field('name', $._any_word), ':', nl($), field('value', choice($._positional, $.fold)))),
    // `sum(s in set: value of s)`.
    fold: ($) => seq(alias($._membership, $.comparison), ':', nl($), field('value', $.expression)),
    index_expression: ($) => seq(
      field('object', $._postfix), token.immediate('['), nl($), field('index', choice(alias($._species_index, $.species), $.expression)), ']',
    ),
    tuple: ($) => seq('(', nl($), listed($, $.expression), ')', optional(field('unit', alias($._unit, $.unit)))),
    list: ($) => seq('[', nl($), optional(listed($, $.expression)), ']'),

    // ---- types and parameters
    type: ($) => choice(
      $._words_type,
      seq(
        field('name', $._name), repeat(seq('&', field('name', $._name))),
        optional(seq($.type_arguments, repeat(seq('&', field('name', $._name))))), optional('?'),
        optional(choice(seq('where', field('condition', $.expression)), seq('in', nl($), field('allowed', $._operand)))),
      ),
    ),
    _words_type: ($) => seq($._type_word, repeat1(seq('|', nl($), $._type_word))),
    _type_word: ($) => alias(word_of($, ...LABELS), $.state_word),
    type_arguments: ($) => seq('<', $._name, repeat(seq('&', $._name)), optional($.type_arguments), '>'),
    parameters: ($) => seq('(', nl($), optional(listed($, $.parameter)), ')'),
    parameter: ($) => seq(
      field('name', $.identifier), optional(seq(':', nl($), field('type', $.type))), optional(seq('of', nl($), field('of', $.identifier))),
      optional(seq('=', nl($), field('default', $.expression))),
    ),
    _signature: ($) => signature_of($, $.verb),
    verb: ($) => seq(optional('return'), repeat1($.identifier)),
    labelled_parameters: ($) => seq($.label, $.parameters),

    // ---- fields
    fields: ($) => fields_of($, $.field),
    field: ($) => choice(
      seq(alias('dissolves', $.field_name), ':', nl($), $._side),
      seq(field('name', $._key), ':', nl($), field('value', choice($.fields, $.literal, $.expression))),
    ),
    _key: ($) => choice(alias($._species, $.species), alias($._any_word, $.field_name)),
    literal: ($) => seq(field('type', $._name), $.fields),
    _literal: ($) => choice($.literal, field('type', $._name)),
    options: ($) => fields_of($, $.option),
    option: ($) => seq(field('name', alias($._any_word, $.field_name)), ':', nl($), field('value', $.expression)),

    // ---- steps
    // Behind a closing brace the next step may stand on the same line, if a word of the language begins it.
    block: ($) => seq(
      '{', nl($), repeat(choice(seq($.statement, $._separator), seq($._closed, $._beside))), optional($.statement), '}',
    ),
    _closed: ($) => choice(
      $.step_statement, $.if_statement, $.repeat_statement, $.for_statement, $.within_statement, $.keep_statement, $.try_statement,
      $.claim_statement, $.sequence_statement, $.parallel_statement, alias($._closed_call, $.call),
    ),
    _closed_call: ($) => seq(
      alias($._first_word, $.verb_word), repeat(alias($._next_word, $.verb_word)), optional($._operand), repeat($.labelled), $.options,
    ),
    statement: ($) => choice(
      $.let_statement, $.var_statement, $.set_statement, $.wait_statement, $.step_statement, $.if_statement, $.repeat_statement,
      $.for_statement, $.within_statement, $.hold_statement, $.keep_statement, $.try_statement, $.retry_statement, $.claim_statement, $.sequence_statement, $.parallel_statement,
      $.start_statement, $.await_statement, $.fail_statement, $.expect_statement, $.record_statement, $.note_statement, $.ask_statement,
      $.return_statement, $.call,
    ),
    let_statement: ($) => seq('let', field('name', $.identifier), choice(
      seq('<-', nl($), field('value', $.call)),
      seq(optional(seq(':', field('type', $.type))), '=', nl($), field('value', $.expression)),
    )),
    // `var` is a name elsewhere; src/scanner.c looks ahead.
    var_statement: ($) => seq(
      'var', field('name', $.identifier), optional(seq(':', field('type', $.type))), '=', nl($), field('value', $.expression),
    ),
    set_statement: ($) => seq(
      field('name', $.identifier), field('operator', choice('+=', '-=', '=')), nl($), field('value', $.expression),
    ),
    wait_statement: ($) => seq('wait', $._same_line, choice(
      seq('until', field('condition', $.expression), optional($.timeout), optional($._handlers)),
      field('duration', $._operand),
    )),
    timeout: ($) => seq('timeout', $._operand),
    step_statement: ($) => seq('step', field('name', $.identifier), field('body', $.block), optional($._handlers)),
    if_statement: ($) => seq(
      'if', field('condition', $.expression), field('body', $.block),
      repeat(seq('else', 'if', field('condition', $.expression), field('body', $.block))),
      optional(seq('else', field('body', $.block))),
    ),
    repeat_statement: ($) => seq('repeat', choice(
      seq('while', field('condition', $.expression), optional(seq('max', field('bound', $._operand)))),
      seq(field('count', $._operand), 'times'),
    ), field('body', $.block)),
    for_statement: ($) => seq('for', field('name', $.identifier), $._same_line, 'in', nl($), field('set', $._operand), field('body', $.block)),
    within_statement: ($) => seq(
      'within', field('window', $._operand), 'after', field('after', $._operand), field('body', $.block),
      optional($._handlers),
    ),
    hold_statement: ($) => seq(
      'hold', field('condition', $.expression), optional($._nl_more), 'for', field('duration', $._operand), optional($.timeout),
      optional($._handlers),
    ),
    keep_statement: ($) => seq('keep', field('condition', $.expression), field('body', $.block), optional($._handlers)),
    try_statement: ($) => seq(
      'try', field('body', $.block), repeat(seq('else', field('body', $.block))), optional($._handlers),
    ),
    retry_statement: ($) => seq('retry', $._operand),
    claim_statement: ($) => seq('claim', commas($, $._operand), field('body', $.block)),
    sequence_statement: ($) => seq('sequence', field('body', $.block), optional($._handlers)),
    parallel_statement: ($) => seq('parallel', field('body', $.block), optional($._handlers)),
    start_statement: ($) => seq('start', field('name', $.identifier), '=', nl($), choice(field('body', $.block), field('value', $.call))),
    await_statement: ($) => seq('await', field('name', $.identifier)),
    fail_statement: ($) => seq('fail', choice(seq(field('failure', alias($._any_word, $.failure)), optional($.string)), $.string)),
    expect_statement: ($) => seq('expect', field('condition', $.expression)),
    record_statement: ($) => seq('record', field('value', $._operand), 'every', field('period', $._operand)),
    note_statement: ($) => seq('note', $.string),
    ask_statement: ($) => seq('ask', $.string),
    return_statement: ($) => seq('return', field('value', $.expression)),
    _handlers: ($) => choice(seq(repeat1($.handler), optional($.finally)), $.finally),
    handler: ($) => seq('on', field('failure', alias($._any_word, $.failure)), field('body', $.block)),
    finally: ($) => seq('finally', field('body', $.block)),
    // Bare words, then at most one operand, then arguments with prepositions, then options.
    call: ($) => choice(
      seq(
        alias($._first_word, $.verb_word), repeat(alias($._next_word, $.verb_word)), optional($._operand), repeat($.labelled),
        optional($.options),
      ),
      seq(alias('return', $.verb_word), alias($.identifier, $.verb_word), alias($._labelled_to, $.labelled), repeat($.labelled),
        optional($.options)),
    ),
    _labelled_to: ($) => seq(alias('to', $.label), nl($), field('value', $._operand_or_word)),
    labelled: ($) => seq($.label, nl($), field('value', $._operand_or_word)),
    _operand_or_word: ($) => choice($._operand, $.state_word),

    // ---- laws
    law_block: ($) => block_of($, $._law),
    _law_block: ($) => seq(nl($), field('body', $.law_block)),
    _law: ($) => choice($.law_let, $.law_for, $.law_if, $.assignment, $._operand),
    law_let: ($) => seq('let', field('name', $.identifier), '=', nl($), field('value', $.expression)),
    law_for: ($) => seq('for', field('name', $.identifier), $._same_line, 'in', nl($), field('set', $._operand), field('body', $.law_block)),
    law_if: ($) => seq(
      'if', field('condition', $.expression), field('body', $.law_block),
      repeat(seq('else', 'if', field('condition', $.expression), field('body', $.law_block))),
      optional(seq('else', field('body', $.law_block))),
    ),
    assignment: ($) => seq(field('left', $._operand), field('operator', choice('+=', '-=', '=')), nl($), field('right', $.expression)),

    // ---- declarations
    declaration: ($) => choice(
      $.use, $.dimension, $.unit_declaration, $.species_declaration, $.solution, $.reaction, $.interaction, $.capability, $.asset, $.process, $.event,
      $.relation, $.function, $.constant, $.reactive_group, $.material, $.incompatible, $.allow, $.hazard, $.framing, $.driver, $.lab, $.skill,
      $.workflow, $.study, $.fit, $.test, $.table,
    ),
    table: ($) => seq('table', field('name', $.identifier), $.source, field('body', $.columns)),
    columns: ($) => fields_of($, $.column),
    column: ($) => seq(
      field('name', alias($._any_word, $.field_name)), optional(field('header', $.string)), ':', nl($),
      field('type', alias($._column_type, $.type)),
      optional(seq('as', nl($), field('unit', alias($._unit_after_as, $.unit)))),
      optional(seq('=', nl($), field('default', $.expression))),
    ),
    _column_type: ($) => choice($._words_type, seq(field('name', $._name), optional($.type_arguments), optional('?'))),
    use: ($) => seq('use', field('path', $._name), optional(seq(
      choice('::', token.immediate('::')), '{', nl($), listed($, $.identifier), '}',
    ))),
    dimension: ($) => seq('dimension', field('name', $.identifier), optional(seq('=', nl($), choice(
      seq('point', $._operand), $._operand, alias('point', $.identifier),
    )))),
    unit_declaration: ($) => seq(
      'unit', field('name', $.unit_name), optional(seq(':', field('dimension', $.identifier))), optional(seq('=', nl($), $._operand)),
      repeat(choice(
        seq('from', nl($), $._operand),
        seq('with', 'prefixes'),
        seq(optional($._nl_more), 'also', commas($, $.unit_name)),
      )),
    ),
    unit_name: () => /%([A-Za-z](\/[A-Za-z])?)?|[A-Za-z_µμ°ΩÅ][A-Za-z0-9_µμ°ΩÅ]*/,
    species_declaration: ($) => seq('species', field('name', $.species), optional($.fields)),
    solution: ($) => seq('solution', field('name', $.identifier), $.fields, optional(seq(
      optional($._nl_more), 'labelled', choice($.quantity, $.number), 'of', $.species,
      optional(seq('+-', nl($), $._operand)),
    ))),
    reaction: ($) => seq(
      choice('reaction', 'equilibrium'), field('name', $.identifier), ':', nl($), $._side, choice('->', '<->'), nl($), $._side,
      optional($.fields),
    ),
    interaction: ($) => seq('interaction', field('name', $.identifier), ':', nl($), $._side, optional($.fields)),
    _side: ($) => seq($._side_term, repeat(seq('+', nl($), $._side_term))),
    _side_term: ($) => seq(optional($.number), $.species),
    reactive_group: ($) => seq('reactive_group', field('name', $.identifier), $.fields),
    material: ($) => seq('material', field('name', $.identifier), $.fields),
    incompatible: ($) => seq('incompatible', $.species, 'with', nl($), $.species, $.fields),
    allow: ($) => seq('allow', choice(seq('incompatible', $.species, 'with', nl($), $.species), field('name', $.identifier)), $.string),
    hazard: ($) => seq(
      choice('hazard', 'caution'), field('name', $.identifier), $.parameters,
      optional(seq(optional($._nl_more), 'of', nl($), field('value', $._operand), optional(seq(optional($._nl_more), 'after', nl($), $._operand)))),
      optional($._nl_more), 'when', field('condition', $.expression),
      optional(seq(optional($._nl_more), $.string)),
      optional(seq(optional($._nl_more), 'because', nl($), $.string)),
    ),
    extends: ($) => seq(':', nl($), commas($, field('type', $._name))),
    capability: ($) => seq(
      'capability', field('name', $.identifier), optional($.extends),
      choice(seq($.source, optional(field('body', $.members))), field('body', $.members)),
    ),
    source: ($) => seq('from', nl($), field('format', $.identifier), field('file', $.string)),
    members: ($) => block_of($, $._member_line),
    _member_line: ($) => choice($.member, $.view, $.command, $.process, $.event, $.frame, $.limit),
    member: ($) => seq(
      field('role', alias(choice('param', 'state', 'derived', 'reading', 'flow', 'extensive', 'part'), $.role)),
      field('name', alias($._any_word, $.field_name)), ':', nl($), field('type', $.type), optional(seq('per', $.identifier)),
      optional(seq(optional($._nl_more), '=', nl($), field('value', $.expression))), optional($.options),
    ),
    view: ($) => seq(
      'view', '[', $.parameter, ']', ':', nl($), field('type', $.type), optional($._nl_more), '=', nl($), field('value', $.expression),
    ),
    command: ($) => seq('command', $._signature, repeat($._clause)),
    limit: ($) => seq(choice('keeps', 'ends'), field('condition', $.expression), optional($.refusal)),
    frame: ($) => seq('frame', field('name', $.identifier), optional($._place)),
    _place: ($) => seq(
      'at', nl($), $._operand,
      optional(seq('from', nl($), field('from', $.identifier))),
      optional(seq('with', nl($), $._operand)),
    ),
    _clause: ($) => seq(optional($._nl_clause), choice(
      $.needs, $.presumes, $.warns, $.while_clause, $.fails, $.effect, $.takes, $.until, $.option_clause, $.says, $.moves, $.grips, $.frees, $.leads,
    )),
    needs: ($) => seq('needs', field('condition', $.expression), optional($.refusal)),
    warns: ($) => seq('warns', field('condition', $.expression), optional($.refusal)),
    presumes: ($) => seq('presumes', optional('ever'), field('condition', $.expression), optional($.refusal)),
    refusal: ($) => seq(
      'else', field('failure', alias($._any_word, $.failure)), optional($.string),
      optional(seq(optional($._nl_more), 'because', nl($), $.string)),
    ),
    while_clause: ($) => seq('while', field('condition', $.expression)),
    fails: ($) => seq('fails', commas($, alias($._any_word, $.failure))),
    effect: ($) => seq('effect', commas($, $._change)),
    _change: ($) => choice($.each, $._operand, alias($._effect_assignment, $.assignment)),
    _effect_assignment: ($) => seq(field('left', $._operand), '=', nl($), field('right', $.expression)),
    each: ($) => seq(
      'each', choice('(', token.immediate('(')), nl($), field('name', $.identifier), 'in', nl($),
      field('set', $._operand), ':', nl($), commas($, $._change), ')',
    ),
    takes: ($) => seq('takes', $._operand, optional(seq('in', nl($), $._operand))),
    until: ($) => seq('until', field('condition', $.expression)),
    option_clause: ($) => seq(
      'option', field('name', alias($._any_word, $.field_name)), ':', nl($), field('type', $.type),
      optional(seq('=', nl($), field('default', $.expression))),
    ),
    says: ($) => seq('says', $.string, optional(seq(optional($._nl_more), 'when', field('condition', $.expression)))),
    moves: ($) => seq(
      'moves', $._operand, optional($._manner),
      choice(
        seq(optional($._nl_more), 'home'),
        seq('to', nl($), choice(seq('joints', nl($), $._operand), seq($._operand, optional($._moves_by)))),
        $._moves_by,
      ),
      optional(seq('in', nl($), $._operand)),
    ),
    _moves_by: ($) => seq('by', nl($), $._operand),
    _manner: ($) => seq(optional($._nl_more), choice(
      'straight', 'driving',
      seq('upright', optional($._nl_more), 'within', nl($), $._operand),
      seq('tilted', nl($), $._operand, optional($._nl_more), 'about', nl($), $._operand),
    )),
    grips: ($) => seq('grips', $._operand, optional(seq('at', nl($), $._operand)), $._moves_by),
    frees: ($) => seq('frees', $._operand, optional(seq(choice('on', 'to'), nl($), $._operand)), $._moves_by),
    leads: ($) => seq('leads', $._operand, $._moves_by),
    asset: ($) => seq('asset', field('name', $.identifier), optional($.extends), optional($.source), optional(field('body', $.asset_body))),
    asset_body: ($) => fields_of($, choice(
      alias($._asset_field, $.field), alias($._placed_frame, $.frame), $.solid, $.joint, $.grid, $.part,
    )),
    _asset_field: ($) => choice(
      seq(alias('dissolves', $.field_name), ':', nl($), $._side),
      seq(
        field('name', choice(alias($._species, $.species), alias(choice($._any_word, 'frame', 'solid', 'joint'), $.field_name))), ':', nl($),
        field('value', choice($.fields, $.literal, $.expression)),
      ),
    ),
    _placed_frame: ($) => seq('frame', field('name', $.identifier), $._place),
    solid: ($) => seq('solid', $._operand, optional($._place)),
    joint: ($) => seq(
      'joint', field('name', $.identifier), optional(seq(choice('slides', 'turns'), nl($), $._operand, optional($._place))),
      'by', nl($), field('by', $.expression),
    ),
    part: ($) => seq(field('name', $._part_name), '=', nl($), $._literal),
    _part_name: ($) => prec(1, word_of($, 'frame', 'solid', 'joint', 'dissolves')),
    grid: ($) => seq(
      field('name', $._part_name), '[', nl($), $.place, optional(seq('..', nl($), $.place)), ']', '=', nl($), $._literal,
      optional(seq('at', nl($), $._operand)),
      optional(seq(optional($._nl_more), 'pitch', nl($), $._operand, optional($._moves_by))),
    ),
    place: () => /[A-Za-z0-9_]+/,
    process: ($) => seq(
      'process', field('name', $.identifier), optional($.parameters),
      optional(seq('while', field('condition', $.expression))), $._law_block,
    ),
    event: ($) => seq(
      'event', field('name', $.identifier), optional($.parameters), optional($._nl_more), 'when', field('condition', $.expression),
      optional(seq(optional($._nl_more), choice('for', 'after'), nl($), field('delay', $._operand))), $._law_block,
    ),
    relation: ($) => seq(
      'relation', field('name', $.identifier), $.parameters, optional('symmetric'), optional(seq('=', nl($), field('value', $.expression))),
    ),
    function: ($) => seq(
      optional('extern'), 'fn', field('name', word_of($, 'max')), $.parameters, optional(seq('->', nl($), field('result', $.type))),
      optional(seq('=', nl($), field('value', $.expression))), optional($.options),
    ),
    constant: ($) => seq(
      'const', field('name', $.identifier), optional(seq(':', nl($), field('type', $.type))), '=', nl($), field('value', $.expression),
    ),
    framing: ($) => seq('framing', field('name', $.identifier), $.fields),
    driver: ($) => seq(
      'driver', field('name', $.identifier), optional($._nl_more), 'for', field('type', $._name), optional($._nl_more), 'over',
      field('line', $.identifier), optional(alias($._loose_arguments, $.arguments)), field('body', $.wires),
    ),
    wires: ($) => block_of($, $._wire),
    _wire: ($) => choice($.wire_fixed, $.wire_alive, $.wire_repeat, $.wire_reply, $.wire_answers, $.wire_reading, $.wire_ignores, $.wire_command),
    wire_fixed: ($) => prec(1, seq(
      choice('identity', 'open', 'close', 'halt', 'safe', 'play'), optional(seq('while', field('condition', $.expression))), $._exchange,
    )),
    wire_alive: ($) => seq(
      'alive', 'while', field('condition', $.expression), 'every', $._operand, 'within', $._operand,
      'by', $.verb, optional(seq('else', $.verb)),
    ),
    wire_repeat: ($) => seq(
      'repeat', 'while', field('condition', $.expression), 'every', $._operand,
      'by', $.verb, optional(seq('else', $.verb)),
    ),
    wire_reply: ($) => seq('reply', $.string, 'fails', alias($._any_word, $.failure)),
    wire_answers: ($) => seq('answers', $.string, 'with', $.string),
    wire_reading: ($) => seq(
      'reading', field('name', $._name), optional(seq('while', field('condition', $.expression))),
      choice(seq('asks', $.string, 'expects', $.string), seq('hears', $.string, 'every', $._operand)),
    ),
    wire_ignores: ($) => seq('ignores', $.string),
    wire_command: ($) => seq(signature_of($, alias($._wire_verb, $.verb)), $._exchange),
    _wire_verb: ($) => seq(
      choice('return', word_of($, 'identity', 'open', 'close', 'halt', 'safe', 'play', 'alive', 'reply', 'answers', 'reading', 'ignores')), repeat($.identifier),
    ),
    _exchange: ($) => seq('sends', commas($, $.string), optional($._replies), optional($._wire_until)),
    _replies: ($) => seq('expects', commas($, $.string)),
    _answer: ($) => seq('expects', $.string),
    _wire_until: ($) => seq(
      'until', 'asks', $.string, optional($._answer), 'timeout', $._operand,
    ),
    lab: ($) => seq('lab', field('name', $.identifier), optional($.parameters), field('body', $.lab_body)),
    lab_body: ($) => fields_of($, choice($.setting, $.instance, $.include, $.between)),
    setting: ($) => seq(
      field('name', alias(choice($._any_word, 'include', 'between'), $.field_name)), ':', nl($), field('value', $.expression),
    ),
    instance: ($) => seq(
      field('name', word_of($, 'include', 'between')), '=', nl($), $._literal, repeat($.labelled), optional(seq($._holding, repeat($.labelled))),
    ),
    _holding: ($) => seq('holding', nl($), choice($.fills, $._operand)),
    fills: ($) => fields_of($, $.fill),
    fill: ($) => seq(
      $.place, optional(seq('..', nl($), $.place)), nl($), ':', nl($), field('value', $._operand),
      optional(seq('at', nl($), field('at', $._operand))),
    ),
    include: ($) => seq('include', field('path', $._name), $._same_line, 'as', field('name', $.identifier), repeat($.labelled), optional($.options)),
    between: ($) => seq('between', $._operand, 'and', nl($), $._operand, $.fields),
    skill: ($) => seq(
      optional('extern'), 'skill', $._signature, repeat($._clause),
      optional(seq(optional($._nl_clause), field('body', $.block), optional($._handlers))),
    ),
    workflow: ($) => seq(
      'workflow', field('name', $.identifier), optional($.parameters), 'in', nl($),
      choice(seq('any', 'lab'), field('lab', word_of($, 'any')), field('lab', choice($.scoped_name, alias($._dotted_name, $.member_expression)))),
      nl($), field('body', $.block), optional($._handlers),
    ),
    study: ($) => seq('study', field('name', $.identifier), 'of', field('workflow', $._name), block_of($, choice($.vary, $.runs, $.report))),
    vary: ($) => seq(
      'vary', $._operand, 'in', nl($), $._operand,
      optional(seq('by', nl($), field('draw', $.identifier), optional(alias($._loose_arguments, $.arguments)))),
    ),
    runs: ($) => seq('runs', $._operand),
    report: ($) => seq('report', field('name', $.identifier), '=', nl($), field('value', $.expression)),
    fit: ($) => seq('fit', field('name', $.identifier), 'of', field('workflow', $._name), block_of($, choice($.data, $.estimate, $.match))),
    data: ($) => seq('data', $.string),
    estimate: ($) => seq('estimate', $._operand, 'in', nl($), $._operand, optional('log')),
    match: ($) => seq(
      'match', $._operand, 'with', nl($), $.string,
      optional(seq('as', nl($), field('unit', alias($._unit_after_as, $.unit)))),
      optional(seq(optional($._nl_more), 'noise', $._operand)),
    ),
    test: ($) => seq(
      'test', field('name', $.identifier), optional(seq('in', nl($), field('lab', $._name))), nl($),
      field('body', $.block), optional($._handlers),
    ),
  },
});
