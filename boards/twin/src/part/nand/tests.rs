use super::*;

mod driver;

const AT: PageAddress = PageAddress { block: 3, page: 0 };
const NEXT: PageAddress = PageAddress { block: 3, page: 1 };

fn page(fill: u8) -> PageBytes {
    let mut page = [fill; PAGE_BYTES];
    page[MAIN_BYTES + BAD_MARK] = 0xFF;
    page
}

fn erased() -> Cells {
    let mut cells = Cells::new(8, &[5], 1);
    assert_eq!(cells.erase(3), Outcome::Done);
    cells
}

#[test]
fn a_programmed_page_reads_back_until_it_is_erased() {
    let mut cells = erased();
    assert_eq!(cells.program(AT, &page(0x5A)), Outcome::Done);
    assert_eq!(cells.read(AT), page(0x5A));
    assert_eq!(cells.erase(3), Outcome::Done);
    assert_eq!(cells.read(AT), [0xFF; PAGE_BYTES]);
    assert_eq!(cells.breaks, []);
}

#[test]
fn every_break_of_a_rule_is_kept() {
    let mut cells = erased();
    cells.program(NEXT, &page(0));
    cells.program(NEXT, &page(0));
    cells.program(AT, &page(0));
    cells.program(PageAddress { block: 5, page: 0 }, &page(0));
    cells.erase(5);
    cells.program(PageAddress { block: 3, page: 2 }, &[0; PAGE_BYTES]);
    assert_eq!(
        cells.breaks,
        [
            Break::ProgrammedTwice(NEXT),
            Break::OutOfOrder(AT),
            Break::MarkedBad(5),
            Break::MarkedBad(5),
            Break::MarkWritten(PageAddress { block: 3, page: 2 }),
        ]
    );
}

#[test]
fn a_torn_page_spoils_its_block_until_it_is_erased() {
    for tear in TEARS {
        let mut cells = erased();
        cells.befalls.cut = Some((2, tear));
        assert_eq!(cells.program(AT, &page(0)), Outcome::Cut);
        assert!(cells.off);
        cells.power_on();
        cells.program(NEXT, &page(0));
        assert_eq!(cells.breaks, [Break::NotErased(NEXT)], "{tear:?}");
    }
}

#[test]
fn tears_leave_what_they_say() {
    let after = |tear| {
        let mut cells = erased();
        cells.befalls.cut = Some((2, tear));
        cells.program(AT, &page(0));
        let zeros = |bytes: &[u8]| bytes.iter().map(|byte| byte.count_zeros()).sum::<u32>();
        let read = cells.read(AT);
        (zeros(&read[..MAIN_BYTES]), zeros(&read[MAIN_BYTES..]))
    };
    assert_eq!(after(Tear::Nothing), (0, 0));
    assert_eq!(after(Tear::MainOnly), (4096, 0));
    assert_eq!(after(Tear::SpareOnly), (0, 120));
    assert_eq!(after(Tear::Unacknowledged), (4096, 120));
    assert!((1_800..2_300).contains(&after(Tear::Half).0));
    assert!((1..300).contains(&after(Tear::Few).0));
    assert!((3_800..4_096).contains(&after(Tear::Most).0));
}

#[test]
fn cells_between_two_states_read_differently_each_time() {
    let mut cells = erased();
    cells.befalls.cut = Some((2, Tear::Half));
    cells.program(AT, &page(0));
    let first = cells.read(AT);
    assert!((0..10).any(|_| cells.read(AT) != first));
}

#[test]
fn worn_blocks_fail_aloud_or_in_silence() {
    let mut cells = erased();
    cells.befalls.worn = vec![(3, 1, Wear::ProgramFails), (4, 0, Wear::EraseDoesNothing)];
    assert_eq!(cells.program(AT, &page(0)), Outcome::Failed);
    assert_eq!(cells.erase(4), Outcome::Done);
    cells.befalls.worn = vec![(3, 0, Wear::ProgramDoesNothing)];
    assert_eq!(cells.erase(3), Outcome::Done);
    assert_eq!(cells.program(AT, &page(0)), Outcome::Done);
    assert_eq!(cells.read(AT), [0xFF; PAGE_BYTES]);
}
