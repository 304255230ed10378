//! Random files that follow the grammar.

use proptest::prelude::*;

type Text = BoxedStrategy<String>;

fn one_of(words: &'static [&'static str]) -> Text {
    prop::sample::select(words).prop_map(str::to_owned).boxed()
}

fn name() -> Text {
    one_of(&["a", "beaker", "x1", "m_2", "hotplate", "E", "ph", "runs", "frame", "state"])
}

fn species() -> Text {
    one_of(&["EtOH", "K+", "I-", "SO4^2-", "KNO3(s)", "Ca2+", "water", "H2O", "OH-(aq)"])
}

fn unit() -> Text {
    one_of(&["g", "mol/kg", "kg/(mol*s)", "1/s", "°C", "µL", "%w/w", "W/(m^2*K)", "m^-1", "s^1/2", "kg_solvent"])
}

fn number() -> Text {
    one_of(&["0", "1", "2.5", "1e-3", "4.2E8", "100000", "0.50"])
}

fn quantity() -> Text {
    (number(), unit()).prop_map(|(n, u)| format!("{n} {u}")).boxed()
}

fn quoted() -> Text {
    one_of(&["\"\"", "\"text\"", "\"a \\\" b\\n\"", "\"{t as degC :.0} // no {{ comment\"", "\"µ°\""])
}

/// A blank or a line end where one may stand.
fn gap() -> Text {
    prop_oneof![6 => Just(" ".to_owned()), 1 => Just("\n    ".to_owned()), 1 => Just(" // note\n".to_owned())].boxed()
}

fn operand_over(part: Text) -> Text {
    let sign = one_of(&["+", "-", "*", "/", "^", "+-"]);
    let chain = (part.clone(), prop::collection::vec((gap(), sign, gap(), part.clone()), 0..3))
        .prop_map(|(first, rest)| rest.into_iter().fold(first, |all, (a, op, b, part)| all + &a + &op + &b + &part));
    prop_oneof![4 => chain.clone(), 1 => (part.clone(), part).prop_map(|(a, b)| format!("{a} .. {b}"))].boxed()
}

fn cond_over(operand: Text) -> Text {
    let rel = one_of(&["==", "!=", "<", "<=", ">", ">=", "in", "is"]);
    let test = (operand.clone(), gap(), rel, gap(), operand.clone())
        .prop_map(|(a, g, rel, h, b)| format!("{a}{g}{rel}{h}{b}"));
    let test = prop_oneof![
        test.clone(),
        test.prop_map(|t| format!("not {t}")),
        operand.clone(),
        (operand, unit()).prop_map(|(a, u)| format!("{a} as {u}"))
    ]
    .boxed();
    (test.clone(), prop::collection::vec((one_of(&["and", "or"]), test), 0..2))
        .prop_map(|(first, rest)| rest.into_iter().fold(first, |all, (op, t)| format!("{all} {op} {t}")))
        .boxed()
}

fn atom() -> Text {
    let leaf = prop_oneof![name(), number(), quantity(), quoted(), Just("std::mod::value".to_owned())].boxed();
    leaf.prop_recursive(3, 12, 3, |inner| {
        let cond = cond_over(operand_over(inner.clone()));
        prop_oneof![
            name().prop_map(|n| format!("{n}.max.in")),
            (name(), species()).prop_map(|(n, s)| format!("{n}[{s}]'")),
            name().prop_map(|n| format!("{n}[A1 .. H12]")),
            (name(), cond.clone()).prop_map(|(n, c)| format!("{n}[({c}) + 1]")),
            (name(), cond.clone(), cond.clone()).prop_map(|(n, a, b)| format!("{n}({a}, from: {b})")),
            (name(), inner.clone(), cond.clone()).prop_map(|(n, a, b)| format!("sum({n} in {a}: {b})")),
            cond.clone().prop_map(|c| format!("(\n{c})")),
            (cond.clone(), cond.clone()).prop_map(|(a, b)| format!("({a}, {b},) mm")),
            (cond.clone(), cond).prop_map(|(a, b)| format!("[{a},\n{b}\n]")),
            // More than two signs in a row are not read.
            inner.clone().prop_map(|i| if i.starts_with("--") { i } else { format!("-{i}") }),
            (quantity(), species()).prop_map(|(q, s)| format!("{q} of {s}")),
        ]
        .boxed()
    })
    .boxed()
}

fn operand() -> Text {
    operand_over(atom())
}

fn cond() -> Text {
    cond_over(operand())
}

fn call() -> Text {
    let label = one_of(&["to", "from", "into", "by", "at", "using"]);
    let object = prop_oneof![
        Just(String::new()),
        quantity().prop_map(|q| format!(" {q}")),
        name().prop_map(|n| format!(" {n}.part[A1]"))
    ];
    let options = prop_oneof![
        Just(String::new()),
        cond().prop_map(|c| format!(" {{ tips: once, max: {c} }}")),
        cond().prop_map(|c| format!(" {{\n within: {c}\n}}"))
    ];
    (prop::collection::vec(name(), 1..4), object, prop::collection::vec((gap(), label, operand()), 0..3), options)
        .prop_map(|(words, object, labelled, options)| {
            let labelled: String =
                labelled.into_iter().map(|(gap, label, value)| format!("{gap}{label} {value}")).collect();
            format!("{}{object}{labelled}{options}", words.join(" "))
        })
        .boxed()
}

fn block_over(stmt: Text) -> Text {
    let lines =
        prop::collection::vec((stmt.clone(), one_of(&["\n", "\n\n\n", "  // end\n", "\n// own\n", ";\n"])), 0..3)
            .prop_map(|lines| format!("{{\n{}}}", lines.into_iter().map(|(s, end)| s + &end).collect::<String>()));
    prop_oneof![3 => lines, 1 => stmt.clone().prop_map(|s| format!("{{ {s} }}")), 1 => (stmt.clone(), stmt).prop_map(|(a, b)| format!("{{{a}; {b}}}"))].boxed()
}

fn stmt() -> Text {
    let leaf = prop_oneof![
        call(),
        (name(), cond()).prop_map(|(n, c)| format!("let {n} = {c}")),
        (name(), cond()).prop_map(|(n, c)| format!("let {n}: Range<Mass>? = {c}")),
        (name(), call()).prop_map(|(n, c)| format!("let {n} <- {c}")),
        operand().prop_map(|o| format!("wait {o}")),
        (cond(), operand()).prop_map(|(c, o)| format!("wait until {c} timeout {o}")),
        (name(), call()).prop_map(|(n, c)| format!("start {n} = {c}")),
        Just("await a\nretry 2".to_owned()),
        Just("fail slip \"text\"\nfail \"text\"\nfail slip".to_owned()),
        cond().prop_map(|c| format!("expect {c}")),
        (operand(), quantity()).prop_map(|(o, q)| format!("record {o} every {q}")),
        quoted().prop_map(|t| format!("note {t}\nask {t}")),
        cond().prop_map(|c| format!("return {c}")),
    ]
    .boxed();
    leaf.prop_recursive(2, 12, 3, |inner| {
        let block = block_over(inner);
        let handlers = prop_oneof![
            Just(String::new()),
            block.clone().prop_map(|b| format!("\non timeout {b} finally {b}")),
            block.clone().prop_map(|b| format!(" on slip {b}")),
        ];
        prop_oneof![
            (block.clone(), handlers.clone()).prop_map(|(b, h)| format!("step grow {b}{h}")),
            (cond(), block.clone(), block.clone())
                .prop_map(|(c, a, b)| format!("if {c} {a}\nelse if {c} {b} else {a}")),
            (cond(), block.clone()).prop_map(|(c, b)| format!("repeat while {c} max 3 {b}")),
            (operand(), block.clone()).prop_map(|(o, b)| format!("repeat {o} times {b}")),
            (operand(), block.clone()).prop_map(|(o, b)| format!("for w in {o} {b}")),
            (quantity(), block.clone(), handlers.clone())
                .prop_map(|(q, b, h)| format!("within {q} after grow.end {b}{h}")),
            (cond(), quantity(), handlers.clone()).prop_map(|(c, q, h)| format!("hold {c} for {q}\n timeout 1 h{h}")),
            (cond(), block.clone(), handlers.clone()).prop_map(|(c, b, h)| format!("keep {c} {b}{h}")),
            (block.clone(), block.clone(), handlers).prop_map(|(a, b, h)| format!("try {a} else {b}{h}")),
            (operand(), block.clone()).prop_map(|(o, b)| format!("claim a, {o} {b}")),
            block.prop_map(|b| format!("parallel {b}\nsequence {b}\nstart job = {b}")),
        ]
        .boxed()
    })
    .boxed()
}

fn law() -> Text {
    let leaf = prop_oneof![
        (name(), cond()).prop_map(|(n, c)| format!("let {n} = {c}")),
        (name(), species(), cond()).prop_map(|(n, s, c)| format!("{n}.amount[{s}]' += {c}")),
        (name(), cond()).prop_map(|(n, c)| format!("{n} -= {c}")),
        (name(), cond()).prop_map(|(n, c)| format!("{n} = {c}")),
        cond().prop_map(|c| format!("move(q, from: {c})")),
    ]
    .boxed();
    leaf.prop_recursive(2, 8, 2, |inner| {
        let block = block_over(inner);
        prop_oneof![
            (operand(), block.clone()).prop_map(|(o, b)| format!("for s in {o} {b}")),
            (cond(), block.clone(), block).prop_map(|(c, a, b)| format!("if {c} {a} else {b}")),
        ]
        .boxed()
    })
    .boxed()
}

fn item() -> Text {
    let block = block_over(stmt());
    let laws = block_over(law());
    let members = (cond(), laws.clone(), operand()).prop_map(|(c, laws, o)| {
        format!("capability C: A, B {{\n/// Doc.\nparam p: T where {c}\nstate holding: Bool = {c} {{ a: 1 }}\nextensive e: A per Species\nview[s: Species]: T = {c}\nframe f at {o}\ncommand heat to(t: T) needs {c} takes {o} in {o}\nprocess q while {c} {laws}\nevent e\nwhen {c}\n{laws}\n}}")
    });
    prop_oneof![
        Just("use std::robots::{A,\nB,}".to_owned()),
        Just("unit degC: Temperature = 1 K from 273.15 K also °C, Cel with prefixes".to_owned()),
        cond().prop_map(|c| format!("const C: T = {c}")),
        cond().prop_map(|c| format!("fn f(x: T = 1,\ny: T) -> T = {c}")),
        cond().prop_map(|c| format!("relation r(a: A, b: B) symmetric = {c}")),
        (species(), cond()).prop_map(|(s, c)| format!("species {s} {{ smiles: \"C\", {s}: {{ a: {c}, }},\n dissolves: K+ + 2 I- }}")),
        (species(), quoted()).prop_map(|(s, t)| format!("allow incompatible {s} with\n {s} {t}")),
        (species(), quantity()).prop_map(|(s, q)| format!("incompatible {s}\n with {s} {{ consequence: [heat, fire], above: {q} }}")),
        (name(), quantity(), quoted()).prop_map(|(n, q, t)| format!("reactive_group {n} {{ members: {{ K+: {q}, OH-: any }}; smarts: [{t}]\n}}")),
        (name(), quoted()).prop_map(|(n, t)| format!("material {n} {{ title: {t} }}")),
        (name(), cond(), quoted()).prop_map(|(n, c, t)| format!("hazard {n}(a: T)\n when {c}\n {t}")),
        (name(), cond()).prop_map(|(n, c)| format!("caution {n}(a: T) when {c}")),
        (name(), operand(), cond(), quoted()).prop_map(|(n, o, c, t)| {
            format!("caution {n}(a: T)\n of {o}\n after {o}\n when {c}\n {t}\n because {t}")
        }),
        (name(), quoted()).prop_map(|(n, t)| format!("allow {n} {t}")),
        (species(), quantity()).prop_map(|(s, q)| format!("solution S {{ {s}: {q}; water: rest }} labelled {q} of {s} +- 1 %")),
        (species(), cond()).prop_map(|(s, c)| format!("interaction i: {s} + {s} {{ lambda: {c} }}")),
        (species(), cond()).prop_map(|(s, c)| format!("equilibrium e: {s} <-> 2 {s} {{ constant: {c}, at: 25 degC }}")),
        (species(), cond()).prop_map(|(s, c)| format!("reaction r: {s} + 2 {s} <-> {s} {{\n rate: {c},\n order: {{}}\n}}")),
        members,
        (cond(), operand()).prop_map(|(c, o)| format!("asset P: A from urdf \"f\" {{ a: {c}, frame f at {o}\n lid = Lid {{ b: {c} }}\nwells[A1 .. H12] = Well {{ v: {c} }} at {o} pitch {o}\nslot[1 .. 11] = Slot\npitch {o} by {o}, one[A1] = Tip\n}}")),
        laws.prop_map(|l| format!("process p(a: A)\n{l}")),
        (quoted(), operand()).prop_map(|(t, o)| format!("driver D for P over serial(baud: {o}) {{\nheat to(t) sends {t},\n{t} expects {t}\nreading a.b asks {t}\nexpects {t}; reply {t} fails slip\nanswers {t} with {t}\nopen sends {t} until asks {t} timeout {o}\nalive while {o} > 1 every {o} within {o} by run it else rest\nrepeat while {o} > 1 every {o} by run it\nreading c while {o} > 1 asks {t} expects {t}\n}}")),
        (operand(), cond(), species()).prop_map(|(o, c, s)| format!("lab l(a: T) {{\nambient: {c}\nb = B {{ c: {c} }} on {o}\n holding {{\nA1: 2 g of {s} at {o}, B1 .. C12: {o}\n3: {o}\n}} at {o}\n at (1, 2) m on {o}\ninclude x as y at {o}, include x as y; include z as y\nbetween {o} and {o} {{ k: {c} }}\n}}")),
        (cond(), block.clone()).prop_map(|(c, b)| format!("skill do it(x: T) on(y: A & B) -> T\n needs {c} // why\n fails a, b\n{b} on slip {b}\nfinally {b}")),
        (cond(), operand()).prop_map(|(c, o)| format!("extern skill f(x: T) effect a.b = {c}, move({o}) option in: T = {c}")),
        (cond(), block.clone()).prop_map(|(c, b)| format!("workflow w(x: T = {c}) in any lab {b}")),
        operand().prop_map(|o| format!("study s of w {{ vary a.b in {o} by sobol(n: 3); runs 3\nreport y = {o} }}")),
        (operand(), quoted()).prop_map(|(o, t)| format!("fit f of w {{\ndata {t}\nestimate {o} in 1 .. 2 log\nmatch {o} with {t} as mol/kg noise {o}\n}}")),
        block.prop_map(|b| format!("test t {b}")),
    ]
    .boxed()
}

/// A file.
pub fn file() -> impl Strategy<Value = String> {
    let between = one_of(&["\n", "\n\n\n", "\n// own\n", " // end\n", "\n\n/// Doc.\n", ";\n", "\r\n"]);
    prop::collection::vec((item(), between), 0..5).prop_map(|items| {
        let items: String = items.into_iter().map(|(item, between)| item + &between).collect();
        format!("mtx 1\n//! Docs.\n{items}")
    })
}
