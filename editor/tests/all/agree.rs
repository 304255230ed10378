//! What is found by what is declared never contradicts what was checked.

use matterix_editor::Index;
use matterix_editor::index::Meaning;

use crate::support::{analysed, beside, examples};

#[test]
fn declarations_say_what_the_check_found() {
    let mut wrong = Vec::new();
    let (mut all, mut agreed) = (0, 0);
    for (path, text) in examples() {
        let (analysis, index) = analysed(&path.display().to_string(), &text, &beside(&path));
        let plain = Index::declared(&analysis);
        for (checked, declared) in index.uses(analysis.root).iter().zip(plain.uses(analysis.root)) {
            assert_eq!(checked.span, declared.span);
            let (Meaning::Def(a), b) = (checked.meaning, declared.meaning) else { continue };
            all += 1;
            match b {
                Meaning::Def(b) if index.key(a) == plain.key(b) => agreed += 1,
                // Without a check less is known, but nothing else.
                Meaning::Open | Meaning::Unknown | Meaning::Language(_) => {}
                Meaning::Def(b) => {
                    let (a, b) = (index.def(a).span, plain.def(b).span);
                    let of = |s| index.module_name(s).to_string();
                    let text = index.text(checked.span);
                    wrong.push(format!("{}: `{text}` is {} and {}", path.display(), of(a.file), of(b.file)));
                }
                Meaning::Module(_) => wrong.push(format!("{}: a module", path.display())),
            }
        }
    }
    println!("{agreed} of {all} names are found without a check");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(agreed * 100 >= all * 95, "{agreed} of {all} names are found without a check");
}
