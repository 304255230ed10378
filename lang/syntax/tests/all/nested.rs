//! Texts of a given nesting.

/// Forms that hold themselves, nested `n` deep; those that fail at every level too.
pub fn nested(n: usize) -> Vec<(&'static str, String)> {
    let wrap = |head: &str, open: &str, core: &str, close: &str, tail: &str| {
        format!("mtx 1\n{head}{}{core}{}{tail}", open.repeat(n), close.repeat(n))
    };
    let step = |open: &str, close: &str| wrap("workflow w in l {\n", open, "wait 1 s", close, "\n}\n");
    let value = |open: &str, close: &str| wrap("const c = ", open, "1", close, "\n");
    vec![
        ("tuple", value("(", ")")),
        ("call", value("f(", ")")),
        ("named argument", value("f(a: ", ")")),
        ("fold", value("sum(a in ", ": a)")),
        ("membership", value("f(a in ", ")")),
        ("list", value("[1, ", "]")),
        ("index", value("x[1 + ", "]")),
        ("if", step("if a { ", " }")),
        ("step", step("step a { ", " }")),
        ("try", step("try { ", " } else { wait 1 s }")),
        ("try alone", step("try { ", " }")),
        ("handler", step("sequence { ", " } on slip { retry 1 }")),
        ("start", step("start a = { ", " }")),
        ("junk after", step("step a { ", " } junk ) junk")),
        ("bad head", step("step a b c { ", " }")),
        ("bad tail", step("repeat 3 times { ", " } else")),
        ("fields", wrap("species S { ", "a: { ", "b: 1", " }", " }\n")),
        ("literals", wrap("lab l { x = A { ", "a: B { ", "b: 1", " }", " } }\n")),
        ("laws", wrap("process p { ", "if a { ", "x += 1", " }", " }\n")),
        ("bad laws", wrap("process p { ", "if { ", "x += 1", " }", " }\n")),
    ]
}
