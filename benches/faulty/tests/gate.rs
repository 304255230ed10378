//! Some hundred trials: nothing is told twice, nothing is left hot or moving that is not named.

use matterix_faulty::labs::all;
use matterix_faulty::room::{Death, Fate, Fault};
use matterix_faulty::trial::{End, Verdict, extent, fated, trial};
use matterix_soundness::random::Random;

const TRIALS: u64 = 200;

/// Seeds that once were wrong. 20302: a pause and a step at the moment at which another process went on. 133794: a line that was
/// lost as a watchdog was fed.
const FOUND: [u64; 2] = [20302, 133_794];

#[test]
fn nothing_is_done_twice_and_nothing_is_left_on_in_silence() {
    let verdicts: Vec<_> = (0..TRIALS).chain(FOUND).map(|seed| (seed, trial(seed))).collect();
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

/// What is wrong with it, with what led to that.
fn wrong(name: &str, verdict: &Verdict) -> Option<String> {
    let what = (!verdict.wrong.is_empty()).then(|| verdict.wrong.join("; "))?;
    Some(format!("{}, {name}: {what}\n{}", verdict.lab, verdict.log.join("\n")))
}

#[test]
fn every_frame_may_be_garbled_or_the_line_cut_at_it() {
    for number in 0..all().len() {
        for frame in 0..extent(number).0 {
            for fault in [Fault::Garbled, Fault::Cut] {
                let fate = Fate { faults: vec![(frame, fault)], ..Fate::calm() };
                let verdict = fated(number, fate, Random::new(frame as u64));
                assert_eq!(wrong(&format!("{fault:?} at frame {frame}"), &verdict), None);
            }
        }
    }
}

#[test]
fn processes_that_die_one_after_the_other_are_gone_through_again_to_the_last_bit() {
    for number in 0..all().len() {
        let lasts = extent(number).1;
        for seed in 0..40 {
            let mut random = Random::new(seed);
            let mut deaths = [(); 3].map(|()| lasts.mul_f64(1.5 * random.below(1000) as f64 / 1000.0));
            deaths.sort();
            let hesitation = std::time::Duration::from_millis(random.below(2000) as u64);
            let deaths = deaths.map(|at| (at, Death::Killed)).into();
            let verdict = fated(number, Fate { deaths, hesitation, ..Fate::calm() }, random);
            assert_eq!(wrong(&format!("deaths {seed}"), &verdict), None);
        }
    }
}
