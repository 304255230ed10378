//! Some hundred trials: nothing is told twice, nothing is left hot or moving that is not named.

use matterix_faulty::trial::{End, trial};

const TRIALS: u64 = 200;

#[test]
fn nothing_is_done_twice_and_nothing_is_left_on_in_silence() {
    let verdicts: Vec<_> = (0..TRIALS).map(|seed| (seed, trial(seed))).collect();
    let wrong: Vec<String> = verdicts
        .iter()
        .filter(|(_, v)| !v.wrong.is_empty())
        .map(|(seed, v)| format!("seed {seed}, {}: {}", v.lab, v.wrong.join("; ")))
        .collect();
    assert!(wrong.is_empty(), "`cargo bench -p matterix-faulty -- --show SEED` shows them:\n{}", wrong.join("\n"));
    let passed = verdicts.iter().filter(|(_, v)| v.end == End::Passed).count();
    assert!(passed > 50 && passed < 190, "{passed} of {TRIALS} passed");
    assert!(verdicts.iter().any(|(_, v)| v.processes > 2));
}
