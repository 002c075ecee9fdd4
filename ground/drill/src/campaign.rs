//! Drills that are many runs on a model of one part, each drawn from the seed.

use std::collections::BTreeSet;

use emems::{
    command::{COMMANDS, Heard, Parser},
    health::Health,
    mode::{Action, Reply, State},
};
use host_tests::{
    Flight, MS, S,
    recorder::{Flown, Tally, campaign, draws},
    world,
};
use twin::{
    part::nand::{Cells, TEARS, Tear, Wear},
    run::Fault,
};

use crate::judge;

/// What a campaign has to tell.
pub struct Told {
    /// How often its fault struck.
    pub struck: u64,
    /// What the unit did, or why it is not accepted.
    pub did: judge::Verdict,
}

/// Runs of a campaign: quick, and long.
fn runs(long: bool, quick: u64, many: u64) -> u64 {
    if long { many } else { quick }
}

/// Cells torn by at least a third of the cuts: of the nine ways to tear two leave nothing between.
fn told(tally: Tally) -> Told {
    let said = format!(
        "{} runs, {} operations torn, {} records acknowledged: {} lost, {} wrong, {} rules broken",
        tally.runs, tally.torn, tally.acknowledged, tally.lost, tally.wrong, tally.breaks
    );
    let accepted = tally.is_clean() && tally.acknowledged > tally.runs && tally.torn >= tally.cuts / 3;
    Told {
        struck: tally.cuts,
        did: if accepted { Ok(said) } else { Err(said) },
    }
}

/// Blocks of a small chip: the superblock's, the kept set's and spare ones beside those of the records.
const BLOCKS: u16 = 18;

fn used(seed: u64) -> Flown {
    let mut flown = Flown::on(Cells::new(BLOCKS, &[1, 6], seed));
    flown.boot(5 + (seed % 40) as u32, None);
    flown
}

/// F1, F2: one cut at any of the first 150 operations, torn in any way.
pub fn one_cut(seed: u64, long: bool) -> Told {
    told(campaign(runs(long, 2_700, 30_000), |run| {
        let mut draw = draws(seed, run);
        let mut flown = used(draw(1 << 32));
        flown.boot(150, Some((1 + run / 9 % 150, TEARS[(run % 9) as usize])));
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    }))
}

/// F3: a torn page whose bits read differently each time, read again and again.
pub fn unstable_bits(seed: u64, long: bool) -> Told {
    told(campaign(runs(long, 500, 20_000), |run| {
        let mut draw = draws(seed, run);
        let mut flown = Flown::on(Cells::new(20, &[], draw(1 << 32)));
        flown.boot(40, Some((20 + draw(20), [Tear::Weak, Tear::Most][draw(2) as usize])));
        for _ in 0..4 {
            flown.boot(0, None);
            flown.boot(2, None);
        }
        flown.judge(&BTreeSet::new())
    }))
}

/// F5: a second cut 1 to 12 operations into the recovery from the first.
pub fn two_cuts(seed: u64, long: bool) -> Told {
    told(campaign(runs(long, 2_700, 46_000), |run| {
        let mut draw = draws(seed, run);
        let mut flown = Flown::on(Cells::new(BLOCKS, &[5], draw(1 << 32)));
        flown.boot(70, Some((1 + draw(70), TEARS[(run % 9) as usize])));
        flown.boot(70, Some((1 + draw(12), TEARS[draw(9) as usize])));
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    }))
}

/// F6: up to twelve cuts, wrong bits and blocks that wear out.
pub fn many_cuts(seed: u64, long: bool) -> Told {
    told(campaign(runs(long, 1_000, 100_000), |run| {
        let mut draw = draws(seed, run);
        let mut chip = Cells::new(40, &[draw(40) as u16 / 8 * 8 + 7], draw(1 << 32));
        chip.befalls.flips_per_thousand = 50;
        for _ in 0..draw(4) {
            let ways = [
                Wear::ProgramFails,
                Wear::EraseFails,
                Wear::ProgramDoesNothing,
                Wear::EraseDoesNothing,
            ];
            let worn = (draw(40) as u16, draw(60) as u32, ways[draw(4) as usize]);
            chip.befalls.worn.push(worn);
        }
        let mut flown = Flown::on(chip);
        for _ in 0..1 + draw(12) {
            flown.boot(60, Some((1 + draw(50), TEARS[draw(9) as usize])));
        }
        flown.boot(8, None);
        flown.judge(&BTreeSet::new())
    }))
}

/// C3: random bytes into parser and state, one in four a letter of the words: none erases.
pub fn random_bytes(seed: u64, long: bool) -> Told {
    const LETTERS: &[u8] = b"G_MVETACILRWSHDtl0123456789ABCDEF";
    let bytes = runs(long, 20_000_000, 1_000_000_000);
    let mut draw = draws(seed, 0);
    let (mut parser, mut state) = (Parser::default(), State::default());
    let (mut words, mut erases) = (0_u64, 0_u64);
    for at_us in (0..bytes).map(|n| n * 87) {
        let drawn = draw(1 << 32);
        let byte = match drawn & 3 {
            0 => LETTERS[(drawn >> 8) as usize % LETTERS.len()],
            _ => (drawn >> 8) as u8,
        };
        if let Some(Heard::Command(command)) = parser.hear(byte, at_us) {
            words += 1;
            erases += u64::from(state.command(command, at_us) == Reply::Done(Action::Erase));
        }
    }
    let said = format!("{bytes} bytes, {words} words by chance, {erases} erases");
    Told {
        struck: words,
        did: if erases == 0 { Ok(said) } else { Err(said) },
    }
}

/// S5: a bus that is stuck when the unit starts, then a part that holds SDA or a controller that sends no START in every cycle, at
/// any instant of it.
pub fn bus_events(seed: u64, long: bool) -> Told {
    let events = runs(long, 2_000, 100_000);
    let mut draw = draws(seed, 0);
    let mut flight = Flight::ideal(world("still"))
        .fault(0, Fault::BusStuck(true))
        .fault(2 * S, Fault::BusStuck(false))
        .say(1, b"G_DL");
    for event in 0..events {
        // Cycles begin 150 ms into the second and every 200 ms, and take 7 ms.
        let at = (3_150 + 200 * event) * MS + draw(7_000_000);
        let fault = match draw(2) {
            0 => Fault::SdaHeld(1 + draw(9) as u8),
            _ => Fault::StopMisplaced,
        };
        flight = flight.fault(at, fault);
    }
    let flown = flight.fly((4_000 + 200 * events) * MS);
    let freed = flown
        .derived
        .iter()
        .filter(|frame| frame.health.contains(Health::BUS_RECOVERED));
    let freed = freed.count() as u64;
    let did = judge::gyros_go_on_and_all_come_back(&flown).and_then(|said| {
        let said = format!("{said}; of {events} events {freed} made the unit free the bus");
        let met = freed * 10 >= events * 9 && flown.report.struck.get("stop-misplaced") >= Some(&(events / 3));
        if met { Ok(said) } else { Err(said) }
    });
    Told { struck: freed, did }
}

/// C5: words at the line's rate without a pause, while packets are recorded.
pub fn flood(seed: u64, long: bool) -> Told {
    let seconds = runs(long, 60, 3_600);
    let mut draw = draws(seed, 0);
    let mut flight = Flight::ideal(world("still"))
        .say(S, b"G_MVG_MV")
        .say(2 * S, b"G_MGG_MG");
    let mut sent = 0;
    // 11.5 bytes a millisecond are asked for every 20 ms: 230 bytes, 57 words. None that ends FLIGHT.
    let harmless = COMMANDS
        .iter()
        .filter(|entry| entry.word != b"G_ME" && entry.word != b"G_MV");
    let harmless: Vec<_> = harmless.collect();
    for step in 150..seconds * 50 {
        let words = (0..57).flat_map(|_| *harmless[draw(harmless.len() as u64) as usize].word);
        flight = flight.say(step * 20 * MS, &words.collect::<Vec<u8>>());
        sent += 57;
    }
    let flown = flight.fly(seconds * S);
    let did = judge::steady(&flown).and_then(|steady| {
        let kept = host_tests::recorder::logged(flown.nand.clone().ok_or("no chip")?).len();
        let recorded = flown.packets.iter().filter(|(at, _)| *at > 2_200 * MS).count();
        let said = format!("{steady}; {kept} of {recorded} packets since then recorded");
        if long || kept >= recorded { Ok(said) } else { Err(said) }
    });
    Told { struck: sent, did }
}
