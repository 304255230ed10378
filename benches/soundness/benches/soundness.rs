use matterix_lang::Session;
use matterix_soundness::{generate::generate, judge::judge, print::print};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: u64 = args.get(1).and_then(|a| a.parse().ok()).unwrap_or(50);
    let from: u64 = args.get(2).and_then(|a| a.parse().ok()).unwrap_or(0);
    let mut session = Session::default();
    let t = std::time::Instant::now();
    let (mut clean, mut dis) = (0, 0);
    for seed in from..from+n {
        let plan = generate(seed);
        let v = judge(std::slice::from_ref(&plan), seed, 200, &mut session).remove(0);
        clean += v.clean_without("") as usize;
        for d in &v.disagreements { dis += 1; println!("{seed}: {} -- {}", d.signature(), d.what); }
        if n == 1 { println!("{}", print(std::slice::from_ref(&plan)).text); println!("{:#?}", v.findings); println!("{:?} {:?} {} {}", v.summary.violations, v.summary.executions, v.summary.certain, v.summary.clean); }
    }
    println!("{n} plans, {clean} clean, {dis} disagreements, {:?}", t.elapsed());
}
