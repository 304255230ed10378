//! A survey of a few hundred plans: what disagrees and is not known yet fails.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use matterix_soundness::report::Tally;
use matterix_soundness::survey::{Judged, survey};

/// Plans that are judged.
const PLANS: u64 = 500;

/// Disagreements that are not mended yet: the seed, and what it is about.
const KNOWN: &[(u64, &str)] = &[
    // Two steps that meet in a block with `try`, which takes the failure.
    (86, "FalseError claimed-twice"),
    (275, "FalseError claimed-twice"),
    (292, "FalseError claimed-twice"),
    // Left on along some way only.
    (195, "Missed unfinished"),
    (376, "Missed unfinished"),
    (414, "Missed unfinished"),
    // A reaction changes the volume.
    (380, "Missed volume-underflow"),
    (406, "Missed transfer-fraction"),
    (449, "Missed transfer-fraction"),
    (499, "Missed transfer-fraction"),
    // Behind a failure that is certain and handled nothing is followed.
    (42, "Missed transfer-fraction"),
    (345, "Missed capped"),
    (378, "Outside unreached"),
    (379, "Missed transfer-fraction"),
    // `finally` behind a `fail` that comes before a job.
    (267, "Outside mass"),
    (267, "Outside red"),
    (267, "Outside volume"),
];

/// Families of checks that the machine must miss when they are switched off.
const MISSED: &[char] = &['V', 'T', 'P', 'R', 'H'];

#[test]
fn nothing_disagrees_that_is_not_known() {
    let tally = Mutex::new(Tally::default());
    let new = Mutex::new(BTreeSet::new());
    let survey = survey(0, PLANS, &|judged: Judged| {
        tally.lock().unwrap_or_else(PoisonError::into_inner).add(&judged);
        for d in &judged.verdict.disagreements {
            let about = format!("{:?} {}", d.sort, d.code);
            if !KNOWN.iter().any(|(seed, known)| *seed == judged.seed && *known == about) {
                let mut new = new.lock().unwrap_or_else(PoisonError::into_inner);
                new.insert(format!("{}: {}: {}", judged.seed, d.signature(), d.what));
            }
        }
    });
    assert_eq!(survey, Ok(()));
    let tally = tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    println!("{}", tally.tables());
    let new: Vec<String> = new.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().collect();
    assert!(new.is_empty(), "`cargo bench -p matterix-soundness -- --show SEED` shows them:\n{}", new.join("\n"));
    for family in MISSED {
        assert!(tally.noticed().contains_key(family), "nothing shows that the family {family} is switched off");
    }
}
