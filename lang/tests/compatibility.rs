//! To which reactive groups the species of the library belong.

use std::collections::BTreeSet;

use matterix_ir::Sources;
use matterix_lang::declare::Tables;
use matterix_lang::declare::compatibility::Party;
use matterix_lang::elaborate::declared;
use matterix_lang::load;
use matterix_lang::names::Names;
use matterix_lang::{LibraryOnly, Session};

/// Groups of a species in words.
fn groups(tables: &Tables<'_>, name: &str) -> BTreeSet<String> {
    let (id, _) = tables.species.iter().find(|(_, s)| s.name == name).expect(name);
    let seats = tables.screen.seats(&tables.species, id);
    let groups = seats.iter().filter(|s| matches!(s.party, Party::Group(_)));
    groups.filter_map(|s| tables.screen.title(s.party)).map(str::to_string).collect()
}

#[test]
fn common_species_belong_to_their_groups() {
    let mut sources = Sources::default();
    let file = sources.add("bench.mtx", "mtx 1\n");
    let (modules, found) = load::load(&mut sources, file, &LibraryOnly, &mut Session::default());
    assert_eq!(found, []);
    let (names, found) = Names::new(&modules);
    assert_eq!(found, []);
    let (tables, found) = declared(&names);
    assert_eq!(found, []);
    for (species, expected) in [
        ("water", &[][..]),
        ("EtOH", &["alcohols"]),
        ("acetone", &["ketones"]),
        ("MeCN", &["nitriles"]),
        ("DMSO", &[]),
        ("DMF", &["amides"]),
        ("THF", &["ethers"]),
        ("toluene", &["aromatic hydrocarbons"]),
        ("hexane", &["saturated hydrocarbons"]),
        ("EtOAc", &["esters"]),
        ("CHCl3", &["halogenated organics"]),
        ("pyridine", &["amines"]),
        ("Et3N", &["amines"]),
        ("aniline", &["amines"]),
        ("acetaldehyde", &["aldehydes"]),
        ("acetyl_chloride", &["acid halides"]),
        ("formic_acid", &["organic acids"]),
        ("acetic_acid", &["organic acids"]),
        ("HCl", &["mineral acids", "hydrochloric acid"]),
        ("HNO3", &["mineral acids", "oxidising mineral acids", "nitric acid"]),
        ("H2SO4", &["mineral acids", "concentrated sulfuric acid"]),
        ("H2O2", &["strong oxidising agents", "strong solutions of hydrogen peroxide"]),
        ("KMnO4", &["strong oxidising agents", "permanganates", "substances that decompose hydrogen peroxide"]),
        ("NaOCl", &["hypochlorites", "strong oxidising agents"]),
        ("KNO3", &["strong oxidising agents"]),
        ("NaOH", &["caustics"]),
        ("NH3", &["caustics"]),
        ("NaCl", &[]),
        ("NaHCO3", &["weak acids"]),
        ("NH4Cl", &["ammonium salts", "weak acids"]),
        ("HSO4-", &["mineral acids"]),
        ("Fe3+", &["substances that decompose hydrogen peroxide", "weak acids"]),
        ("Zn2+", &[]),
        ("Mg2+", &[]),
        ("NaCN", &["cyanides"]),
        ("Na2S", &["inorganic sulfides"]),
        ("NaBH4", &["strong reducing agents"]),
        ("Na", &["alkali metals"]),
        ("urea", &[]),
        ("aspirin", &["esters", "organic acids"]),
        ("paracetamol", &["amides", "phenols"]),
        ("air", &[]),
    ] {
        let expected: BTreeSet<String> = expected.iter().map(|s| (*s).to_string()).collect();
        assert_eq!(groups(&tables, species), expected, "{species}");
    }
}
