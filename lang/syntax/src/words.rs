//! The grammar's rules in the user's words.

use matterix_ir::listing::joined;

use super::grammar::Rule;

/// What a rule stands for where it is expected; `None` for what is never worth saying.
fn describe(rule: Rule) -> Option<&'static str> {
    use Rule::*;
    Some(match rule {
        cond | operand | atom | quantity | tuple | list | tuple_body | neg | kw_not => "a value",
        number | version => "a number",
        string => "a text in quotes",
        unit => "a unit",
        uname => "the name of a unit",
        ident | word | arg_name | bare_word | verb => "a name",
        well | place => "a place such as `A1`",
        key => "a field",
        path => "a name",
        species | charged | side | side_term => "a species",
        ty => "a type",
        infix | rel | as_unit | kw_of => "an operator",
        label | labelled | sig_group => "a preposition",
        named => "an option",
        field => "a field",
        column => "a column",
        source => "`from csv`",
        params | lparen => "`(`",
        rparen => "`)`",
        lbracket | index => "`[`",
        rbracket => "`]`",
        lbrace | block | laws | fields | columns | fills | members | lab_body | wires | study_body | fit_body
        | asset_body => "`{`",
        rbrace => "`}`",
        langle => "`<`",
        comma => "`,`",
        colon | extends => "`:`",
        eq => "`=`",
        larrow => "`<-`",
        arrow => "`->`",
        biarrow => "`<->`",
        assign => "`=`",
        pm => "`+-`",
        end | field_end => "the end of the line",
        call => "a step",
        kw_max => "`max`",
        kw_times => "`times`",
        kw_while => "`while`",
        kw_until => "`until`",
        kw_for => "`for`",
        kw_in => "`in`",
        kw_and => "`and`",
        kw_as => "`as`",
        kw_at => "`at`",
        kw_with => "`with`",
        kw_over => "`over`",
        kw_when => "`when`",
        kw_because => "`because`",
        kw_after => "`after`",
        kw_every => "`every`",
        kw_sends | sends => "`sends`",
        kw_asks => "`asks`",
        kw_hears => "`hears`",
        kw_expects => "`expects`",
        kw_fails => "`fails`",
        kw_prefixes => "`prefixes`",
        kw_fn => "`fn`",
        kw_skill => "`skill`",
        _ => return None,
    })
}

/// What is expected, in words: the few things that say most.
pub(super) fn expected(rules: &[Rule]) -> Vec<&'static str> {
    let mut words: Vec<&'static str> = rules.iter().filter_map(|rule| describe(*rule)).collect();
    words.sort_by_key(|word| (!word.starts_with('`'), *word));
    words.dedup();
    if words.contains(&"the end of the line") {
        return vec!["the end of the line"];
    }
    // What may always follow a value says nothing.
    words.retain(|word| !["an operator", "a preposition", "`[`", "a unit"].contains(word));
    if words.iter().any(|word| !["`(`", "`as`"].contains(word)) {
        words.retain(|word| !["`(`", "`as`"].contains(word));
    }
    if words.len() > 1 && words.contains(&"a value") {
        words.retain(|word| !["a name", "`{`", "`(`", "a text in quotes", "a number", "a species"].contains(word));
    }
    words
}

/// `a`, `a or b`, `a, b or c`.
pub(super) fn either(words: &[&str]) -> String {
    if words.is_empty() { "something else".to_owned() } else { joined(words, "or") }
}
