use super::*;
use proptest::prelude::*;

/// `CCO + 2 [H+]` as names, structures and coefficients.
fn side(text: &str) -> Vec<(String, Structure, f64)> {
    text.split(" + ")
        .filter(|term| !term.is_empty())
        .map(|term| {
            let (coefficient, smiles) = term.split_once(' ').unwrap_or(("1", term));
            (smiles.to_string(), Structure::parse(smiles).expect(smiles), coefficient.parse().expect(term))
        })
        .collect()
}

fn run(template: &str, equation: &str) -> Result<Vec<String>, TemplateError> {
    let (left, right) = equation.split_once(" -> ").expect(equation);
    let (left, right) = (side(left), side(right));
    let participants = |side: &[(String, Structure, f64)]| -> Vec<Participant<'static>> {
        side.iter()
            .map(|(name, structure, coefficient)| {
                let structure: &'static Structure = Box::leak(Box::new(structure.clone()));
                Participant {
                    name: name.clone().leak(),
                    structure: Some(structure),
                    formula: &structure.formula,
                    coefficient: *coefficient,
                }
            })
            .collect()
    };
    check(template, &participants(&left), &participants(&right))
}

fn gives(template: &str, equation: &str) -> (Vec<String>, Vec<String>) {
    match run(template, equation) {
        Err(TemplateError::OtherProducts { gives, missing }) => {
            (gives.into_iter().map(|p| p.smiles).collect(), missing)
        }
        other => panic!("{template}: {other:?}"),
    }
}

const SN1: &str = "[C:1][OX2H:2].[IH:3]>>[C:1][I:3].[OH2:2]";

#[test]
fn templates_give_the_declared_products() {
    for (reaction, template, equation) in [
        ("SN1", SN1, "CCO + I -> CCI + O"),
        ("SN1, other order", SN1, "I + CCO -> O + CCI"),
        ("SN1, hydrogen written", SN1, "[H]OCC + [H]I -> CCI + [H]O[H]"),
        ("SN2", "[CX4:1][Br:2].[OH-:3]>>[C:1][OH+0:3].[Br-:2]", "CCBr + [OH-] -> CCO + [Br-]"),
        (
            "SN2 by cyanide",
            "[CX4:1][Cl,Br,I:2].[C-:3]#[N:4]>>[C:1][C+0:3]#[N:4].[*-:2]",
            "CCBr + [C-]#N -> CCC#N + [Br-]",
        ),
        (
            "esterification",
            "[C:1](=[O:2])[OX2H:3].[OX2H:4][CX4:5]>>[C:1](=[O:2])[O:4][C:5].[OH2:3]",
            "CC(=O)O + CCO -> CCOC(C)=O + O",
        ),
        (
            "ester hydrolysis",
            "[C:1](=[O:2])[OX2H0:3][C:4].[OH2:5]>>[C:1](=[O:2])[OH:5].[OH:3][C:4]",
            "CCOC(C)=O + O -> CC(=O)O + CCO",
        ),
        (
            "acetylation",
            "[c:1][OX2H:2].[C:3](=[O:4])[O:5][C:6]=[O:7]>>[c:1][O:2][C:3]=[O:4].[OH:5][C:6]=[O:7]",
            "OC(=O)c1ccccc1O + CC(=O)OC(C)=O -> CC(=O)Oc1ccccc1C(=O)O + CC(=O)O",
        ),
        (
            "amide coupling",
            "[C:1](=[O:2])[OX2H:3].[NX3;H2,H1;!$(NC=O):4]>>[C:1](=[O:2])[N:4].[OH2:3]",
            "OC(=O)c1ccccc1 + NCC -> CCNC(=O)c1ccccc1 + O",
        ),
        (
            "oxidation by hypochlorite",
            "[CX4;H1,H2:1][OX2H:2].[Cl:3][O-:4]>>[C:1]=[O:2].[Cl-:3].[OH2+0:4]",
            "CC(O)C + [O-]Cl -> CC(C)=O + [Cl-] + O",
        ),
        (
            "Diels-Alder",
            "[C:1]=[C:2][C:3]=[C:4].[C:5]=[C:6]>>[C:1]1[C:2]=[C:3][C:4][C:5][C:6]1",
            "C=CC=C + O=C1C=CC(=O)O1 -> O=C1OC(=O)C2CC=CCC12",
        ),
        (
            "Suzuki",
            "[c:1][Br,I:2].[c:3][B:4]([OH:5])[OH:6].[OH-:7]>>[c:1]-[c:3].[*-:2].[B:4]([OH:5])([OH:6])[OH+0:7]",
            "Brc1ccncc1 + OB(O)c1ccccc1 + [OH-] -> c1ccc(cc1)-c1ccncc1 + [Br-] + OB(O)O",
        ),
        (
            "reductive amination",
            "[C:1]=[O:2].[NX3;H2,H1:3].[H][H]>>[C:1][N:3].[OH2:2]",
            "CC(C)=O + CN + [H][H] -> CC(C)NC + O",
        ),
        ("hydrogenation", "[C:1]=[C:2].[H:3][H:4]>>[C:1]([H:3])[C:2][H:4]", "C=Cc1ccccc1 + [H][H] -> CCc1ccccc1"),
        ("neutralisation", "[H+].[OH-:1]>>[OH2+0:1]", "[H+] + [OH-] -> O"),
        (
            "iodide by peroxide",
            "[OH:1][OH:2].[I-:3].[I-:4].[H+].[H+]>>[I+0:3][I+0:4].[OH2:1].[OH2:2]",
            "OO + 2 [I-] + 2 [H+] -> II + 2 O",
        ),
        (
            "iodine by ascorbic acid",
            "[C:1]([OH:2])=[C:3][OH:4].[I:5][I:6]>>[C:1](=[O:2])[C:3]=[O:4].[I-:5].[I-:6].[H+].[H+]",
            "OC[C@H](O)[C@H]1OC(=O)C(O)=C1O + II -> OC[C@H](O)[C@H]1OC(=O)C(=O)C1=O + 2 [I-] + 2 [H+]",
        ),
    ] {
        assert_eq!(run(template, equation), Ok(vec![]), "{reaction}");
    }
}

#[test]
fn small_by_products_may_be_left_out() {
    let template = "[C:1][OX2H].[IH:3]>>[C:1][I:3]";
    assert_eq!(run(template, "CCO + I -> CCI + O"), Ok(vec!["O".to_string()]));
}

#[test]
fn the_main_product_may_not_be_left_out() {
    let (smiles, missing) = gives("[C:1][OX2H:2].[IH:3]>>[OH2:2]", "CCO + I -> CCI + O");
    assert_eq!((smiles, missing), (vec!["O".to_string()], vec!["CCI".to_string()]));
}

#[test]
fn halves_are_scaled() {
    let template = "[C:1][SH:2].[C:3][SH:4].[O:5]=[O:6]>>[C:1][S:2][S:4][C:3].[OH:5][OH:6]";
    assert_eq!(run(template, "CS + 0.5 O=O -> 0.5 CSSC + 0.5 OO"), Ok(vec![]));
}

#[test]
fn other_products_are_listed() {
    let (smiles, missing) = gives(SN1, "CCO + I -> CCCI + O");
    assert_eq!((smiles, missing), (vec!["CCI".to_string(), "O".to_string()], vec!["CCCI".to_string()]));
}

#[test]
fn proportions_count() {
    let template = "[OH:1][OH:2].[I-:3].[I-:4].[H+].[H+]>>[I+0:3][I+0:4].[OH2:1].[OH2:2]";
    let (_, missing) = gives(template, "OO + 2 [I-] + 2 [H+] -> II + O");
    assert!(missing.is_empty());
}

#[test]
fn what_cannot_match_says_so() {
    assert_eq!(run(SN1, "CCCl + I -> CCI + Cl"), Err(TemplateError::NoMatch));
    assert_eq!(run(SN1, "CCO -> CCO"), Err(TemplateError::NoMatch));
    assert_eq!(
        run("[CX4:1][Br:2].[OH-:3]>>[C:1][OH:3].[Br-:2]", "CCBr + [OH-] -> CCO + [Br-]"),
        Err(TemplateError::Impossible)
    );
    assert_eq!(run(">>C", "C -> C"), Err(TemplateError::ReactantCount(0)));
    assert_eq!(run(&format!("{}>>C", ["C"; 9].join(".")), "C -> C"), Err(TemplateError::ReactantCount(9)));
}

#[test]
fn unreadable_templates_are_located() {
    for (template, offset) in [
        ("CC", None),
        ("", None),
        ("[C:1]>>[C:1", Some(11)),
        ("[Q:1]>>[C:1]", Some(1)),
        ("[C:1] >>[C:1]", Some(5)),
        ("[C:1]>>[C:1]µ", Some(12)),
    ] {
        match run(template, "C -> C") {
            Err(TemplateError::Unreadable { offset: found, detail }) => {
                assert_eq!(found, offset, "{template}: {detail}");
                assert!(!detail.contains("position"), "{detail}");
            }
            other => panic!("{template}: {other:?}"),
        }
    }
}

#[test]
fn a_formula_stands_in_for_a_structure() {
    let (ethanol, iodide) = (Structure::parse("CCO").expect("reads"), Structure::parse("CCI").expect("reads"));
    let hydrogen_iodide = Structure::parse("I").expect("reads");
    let water = Formula::parse("H2O").expect("reads");
    let of = |name, structure| {
        let structure: &Structure = structure;
        Participant { name, structure: Some(structure), formula: &structure.formula, coefficient: 1.0 }
    };
    let product = Participant { name: "water", structure: None, formula: &water, coefficient: 1.0 };
    let left = [of("EtOH", &ethanol), of("HI", &hydrogen_iodide)];
    assert_eq!(check(SN1, &left, &[of("EtI", &iodide), product]), Ok(vec![]));
}

proptest! {
    #[test]
    fn garbage_gives_an_error(text in "\\PC{0,40}") {
        prop_assert!(run(&text, "CCO + I -> CCI + O").is_err());
    }

    #[test]
    fn template_like_garbage_does_not_panic(
        text in "(\\[[COINX*#0-9HDc;,&!$()+-]{1,4}(:[1-4])?\\]|[CO.=()1]){1,6}>>(\\[[COIH+-]{1,3}[0-9]?(:[1-4])?\\]|[CO.=()1]){1,6}"
    ) {
        let _ = run(&text, "CCO + I -> CCI + O");
    }
}
