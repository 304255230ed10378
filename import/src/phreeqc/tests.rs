use super::*;

const SMALL: &str = "# a database
SOLUTION_MASTER_SPECIES
H H+ -1 H 1.008
SOLUTION_SPECIES
H+ = H+
	-gamma 9 0
e- = e-
H2O = H2O
Ca+2 = Ca+2; -gamma 5 0.165
CO3-2 = CO3-2
Fe+2 = Fe+2
H2O = OH- + H+
	-log_k -14; -delta_h 13.362 kcal
	-analytic 293.29227 0.1360833 -10576.913 -123.73158 0 -6.996455e-5
CO3-2 + H+ = HCO3-
	log_k 10.329
	delta_h -3.561 kcal
Ca+2 + CO3-2 = CaCO3 # a pair
	-log_k 3.224; -delta_h 3.545 kcal
Fe+2 + 2H2O = Fe(OH)2 + 2H+
	-log_k -20.494
Fe+2 = Fe+3 + e-
	-log_k -13.02; -delta_h 9.68 kcal
Fe+3 + H2O = FeOH+2 + H+
	-log_k -2.19
PHASES
Calcite
	CaCO3 = CO3-2 + Ca+2
	-log_k -8.48; -delta_h -2.297 kcal
	-Vm 36.9 cm3/mol # rounded
Gypsum
	CaSO4:2H2O = Ca+2 + SO4-2 + 2 H2O
	-log_k -4.58
CO2(g)
	CO2 = CO2
	-log_k -1.468
EXCHANGE_SPECIES
X- = X-
END
";

fn wanted(phases: &[&str]) -> Wanted {
    Wanted { phases: phases.iter().map(|p| (*p).to_owned()).collect(), ..Wanted::default() }
}

#[test]
fn a_module_has_what_the_database_says() {
    let found = import(SMALL, "small.dat", &wanted(&["Calcite"])).unwrap();
    let has = |part: &str| assert!(found.text.contains(part), "{part}\n{}", found.text);
    has("equilibrium forms_OH_minus: water <-> OH- + H+");
    has("analytic: [293.29227, 0.1360833, -10576.913, -123.73158, 0, -6.996455e-5]");
    has("equilibrium forms_HCO3_minus: CO3^2- + H+ <-> HCO3- { log_constant: 10.329, enthalpy: -14.899224 kJ/mol }");
    has("Ca2+ + CO3^2- <-> CaCO3(aq)");
    has("formula: \"Fe(OH)2\"");
    has("Fe2+ + 2 water <-> FeO2H2(aq) + 2 H+");
    has("Fe3+ + water <-> FeOH^2+ + H+");
    has(
        "equilibrium Calcite_dissolves: Calcite(s) <-> CO3^2- + Ca2+ { log_constant: -8.48, enthalpy: -9.610648 kJ/mol }",
    );
    has("molar_volume: 36.9 mL/mol");
    let left: Vec<(&str, &str)> = found.left_out.iter().map(|l| (l.name.as_str(), l.why.as_str())).collect();
    assert_eq!(
        left,
        [
            ("Fe+3", "its reaction contains electrons"),
            ("Gypsum", "it is not among the requested phases"),
            ("CO2(g)", "it is a gas"),
            ("EXCHANGE_SPECIES", "blocks of this kind are not imported")
        ]
    );
}

#[test]
fn only_some_elements_are_taken() {
    let few = Wanted { elements: ["C".to_owned()].into(), ..Wanted::default() };
    let found = import(SMALL, "small.dat", &few).unwrap();
    assert!(found.text.contains("HCO3-") && !found.text.contains("Ca"), "{}", found.text);
}

#[test]
fn what_cannot_be_read_is_said_with_its_line() {
    let wrong = |text: &str| import(text, "x", &Wanted::default()).unwrap_err();
    assert_eq!(wrong("SOLUTION_SPECIES\nH+ = H+\n log_k\n").line, 3);
    assert_eq!(wrong("SOLUTION_SPECIES\nH+ = H+\n -delta_h 3 furlongs\n").line, 3);
    assert_eq!(wrong("SOLUTION_SPECIES\n -log_k 3\n").line, 2);
    assert_eq!(wrong("SOLUTION_SPECIES\nH+ is H+\n").line, 2);
    assert_eq!(wrong("PHASES\nCaCO3 = CO3-2 + Ca+2\n").line, 2);
    assert_eq!(wrong("LLNL_AQUEOUS_MODEL_PARAMETERS\n-temperatures\nSOLUTION_SPECIES\nH+ = H+\n").line, 1);
    assert!(wrong("hello\n").why.contains("not a database"));
    assert!(import(SMALL, "x", &wanted(&["Quartz"])).unwrap_err().why.contains("no phase `Quartz`"));
}

#[test]
fn formulas_have_their_charges_where_the_language_has_them() {
    let all = [
        ("Ca+2", "Ca^2+", "Ca2+"),
        ("CO3-2", "CO3^2-", "CO3^2-"),
        ("H2PO4-", "H2PO4^-", "H2PO4-"),
        ("Na+", "Na+", "Na+"),
        ("Fe+++", "Fe^3+", "Fe3+"),
        ("Fe2(OH)2+4", "Fe2(OH)2^4+", "Fe2O2H2^4+"),
        ("CaSO4:2H2O", "CaSO4.2H2O", "CaSO42H2O(aq)"),
    ];
    for (text, written, dissolved) in all {
        assert_eq!(names::written(text), written);
        assert_eq!(names::dissolved(text), dissolved);
    }
}

#[test]
fn volumes_at_infinite_dilution_are_those_of_the_literature() {
    // Millero 1971: Na+ -1.21, Cl- 17.83, Ca2+ -17.85 mL/mol, conventional.
    let volume = |terms: &[f64]| write::apparent_volume(terms);
    assert!((volume(&[2.28, -4.38, -4.1, -0.586, 0.09]) + 1.2).abs() < 0.6);
    assert!((volume(&[4.465, 4.801, 4.325, -2.847, 1.748]) - 17.8).abs() < 0.6);
    assert!((volume(&[-0.3456, -7.252, 6.149, -2.479, 1.239]) + 17.9).abs() < 0.8);
}

#[test]
fn numbers_of_pitzer_become_interactions() {
    let text = "SOLUTION_SPECIES\nNa+ = Na+\nCl- = Cl-\nK+ = K+\nH2O = H2O\nPITZER\n-B0\n  Cl-  Na+  7.5e-2 9598.4 0 0 # a remark\n\
                -C0\n  Na+ Cl- 1.48e-3\n-THETA\n  K+ Na+ -0.012\n-PSI\n  Cl- K+ Na+ -0.0015 0 0 1.8e-5\n-ALPHAS\n  Na+ Cl- 2 1\n\
                -LAMBDA\n  Xx(aq) Na+ 0.1\n-ETA\n  Na+ Cl- 1\n";
    let made = import(text, "x", &Wanted::default()).unwrap();
    for line in [
        "interaction between_Cl_minus_Na_plus: Cl- + Na+ { b0: [0.075, 9598.4], c0: 0.00148, reach: [2, 1] }",
        "interaction between_K_plus_Na_plus: K+ + Na+ { theta: -0.012 }",
        "interaction between_Cl_minus_K_plus_Na_plus: Cl- + K+ + Na+ { psi: [-0.0015, 0, 0, 1.8e-5] }",
    ] {
        assert!(made.text.contains(line), "{}", made.text);
    }
    let left: Vec<&str> = made.left_out.iter().map(|left| left.name.as_str()).collect();
    assert_eq!(left, ["Na+ Xx(aq)", "-eta"]);
    let wrong = |text: &str| import(text, "x", &Wanted::default()).unwrap_err();
    assert_eq!(wrong("PITZER\n Na+ Cl- 1\n").line, 2);
    assert_eq!(wrong("PITZER\n-B0\n Na+ Cl-\n").line, 3);
    assert_eq!(wrong("PITZER\n-PSI\n Na+ Cl- x\n").line, 3);
}
