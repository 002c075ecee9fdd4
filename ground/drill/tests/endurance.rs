//! A flight with faults that arrive at random, short enough for every change; `ground drill --long` flies a day.

use drill::Board;

#[test]
fn a_quarter_of_an_hour_with_faults_at_random_costs_nothing_that_is_not_excused() {
    let told = drill::endurance::fly(&Board::Host, 1, 900);
    println!("struck {}; {:?}", told.struck, told.did);
    assert!(told.struck > 20, "{}", told.struck);
    told.did.expect("accepted");
}
