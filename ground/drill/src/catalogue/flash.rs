//! Flash and power.

use super::{Drill::*, Fly, Row, row};
use crate::{campaign, judge};

const IN_FLIGHT: &[(u64, &str)] = &[(1_000, "G_MVG_MV"), (2_000, "G_MGG_MG")];

const fn resets(plans: &'static [&'static str]) -> Fly {
    Fly {
        plans,
        motion: "rocket",
        said: &[(40_000, "G_ST")],
        ms: 41_000,
        judge: judge::flight_goes_on_and_the_log_is_whole,
    }
}

const fn recorder(plans: &'static [&'static str]) -> Fly {
    Fly {
        plans,
        motion: "still",
        said: IN_FLIGHT,
        ms: 9_000,
        judge: judge::recorder_says_so_and_comes_back,
    }
}

pub(super) const ROWS: [Row; 21] = [
    row(
        "F1",
        "power cut between any two operations of the NAND",
        Campaign("cut at one of the first 150 operations", campaign::one_cut),
        &["host-tests/tests/recorder_cuts.rs: a_cut_at_any_operation_in_any_way_loses_nothing"],
    ),
    row(
        "F2",
        "power cut inside a page's program, torn in nine ways",
        Campaign("each operation torn in nine ways", campaign::one_cut),
        &["host-tests/tests/recorder_cuts.rs: a_cut_at_any_operation_in_any_way_loses_nothing"],
    ),
    row(
        "F3",
        "unstable bits: a torn page reads differently each time",
        Campaign("weak and half-torn pages, read four times", campaign::unstable_bits),
        &["host-tests/tests/recorder_faults.rs: f03_a_torn_record_comes_back_as_itself_or_not_at_all"],
    ),
    row(
        "F4",
        "power cut inside a block's erase",
        None,
        &["host-tests/tests/recorder_erase.rs: f04_a_block_whose_erase_was_cut_is_erased_again_before_it_is_used"],
    ),
    row(
        "F5",
        "second cut during recovery",
        Campaign("a cut, and another 1 to 12 operations later", campaign::two_cuts),
        &["host-tests/tests/recorder_cuts.rs: a_second_cut_soon_after_the_first_loses_nothing"],
    ),
    row(
        "F6",
        "up to twelve cuts in one flight",
        Campaign("1 to 12 cuts, wrong bits, worn blocks", campaign::many_cuts),
        &["host-tests/tests/recorder_cuts.rs: many_cuts_with_flips_and_blocks_that_wear_out_lose_nothing"],
    ),
    row(
        "F7",
        "cut anywhere in the erase of the log",
        None,
        &[
            "host-tests/tests/recorder_erase.rs: f07_a_cut_at_any_operation_of_an_erase_leaves_the_old_log_or_none",
            "host-tests/tests/recorder_erase.rs: f07_an_erase_ordered_again_after_a_cut_and_cut_again_leaves_the_old_log_or_none",
        ],
    ),
    row(
        "F8",
        "reset in FLIGHT, RAM kept",
        Flights(&[resets(&["reset@31.5s..39s x6", "reset@31.5s"])]),
        &[
            "host-tests/tests/recorder_unit.rs: f08_resets_at_random_instants_lose_no_record_and_end_in_flight",
            "boards/emulated/tests/recorder.rs: cuts_at_random_instants_lose_no_record_and_end_in_flight",
        ],
    ),
    row(
        "F9",
        "power cut in FLIGHT, RAM lost",
        Flights(&[resets(&["power-cut@31.5s..39s x6", "power-cut=2@32.077s"])]),
        &[
            "host-tests/tests/recorder_unit.rs: f09_a_power_cut_in_flight_ends_in_flight_and_recording",
            "host-tests/tests/recorder_unit.rs: f09_a_power_cut_without_lift_off_resumes_from_the_log_alone",
        ],
    ),
    row(
        "F10",
        "factory bad blocks",
        None,
        &["host-tests/tests/recorder_faults.rs: f10_marked_blocks_are_neither_written_nor_erased_and_their_marks_stay"],
    ),
    row(
        "F11",
        "grown bad blocks",
        None,
        &[
            "host-tests/tests/recorder_faults.rs: f11_a_block_that_wears_out_costs_no_record",
            "host-tests/tests/recorder_starts.rs: bad_blocks_beyond_those_that_are_remembered_do_not_stop_the_recorder",
        ],
    ),
    row(
        "F12",
        "one wrong bit in each 256 bytes of every read",
        Flights(&[Fly {
            plans: &["nand-flips=1000@0s"],
            motion: "still",
            said: &[(1_000, "G_MVG_MV"), (2_000, "G_MGG_MG"), (8_000, "G_ST")],
            ms: 9_000,
            judge: judge::log_is_whole,
        }]),
        &[
            "host-tests/tests/recorder_faults.rs: f12_a_wrong_bit_in_every_half_page_costs_nothing_and_is_counted",
            "src/nand/ecc.rs: every_single_wrong_bit_is_put_right",
        ],
    ),
    row(
        "F13",
        "two wrong bits in a half page; a whole page destroyed",
        None,
        &[
            "host-tests/tests/recorder_faults.rs: f13_any_lost_page_costs_at_most_the_newest_record",
            "src/nand/ecc.rs: two_wrong_bits_are_noticed_wherever_they_are",
        ],
    ),
    row(
        "F14",
        "misdirected write, address line stuck",
        None,
        &["host-tests/tests/recorder_faults.rs: f14_pages_that_answer_for_others_are_noticed_and_never_erased"],
    ),
    row(
        "F15",
        "NAND busy for ever, or absent",
        Flights(&[recorder(&["nand-dead@4s..5s", "nand-dead@3.9s..4.1s"])]),
        &[
            "host-tests/tests/recorder_faults.rs: f15_a_dead_or_absent_chip_is_an_error_with_a_name",
            "host-tests/tests/recorder_unit.rs: a_chip_that_comes_back_is_used_again",
            "host-tests/tests/recorder_unit.rs: f15_a_dead_or_absent_chip_costs_neither_packets_nor_the_console",
        ],
    ),
    row(
        "F16",
        "flash full in FLIGHT",
        None,
        &[
            "host-tests/tests/recorder_faults.rs: f16_a_full_log_stops_and_overwrites_nothing",
            "host-tests/tests/recorder_unit.rs: f16_a_full_recorder_says_so_and_packets_go_on",
        ],
    ),
    row(
        "F17",
        "superblock lost, stale, foreign, newer",
        None,
        &[
            "host-tests/tests/recorder_superblock.rs: f17_a_lost_superblock_is_replaced_by_its_copy_or_by_a_scan",
            "host-tests/tests/recorder_superblock.rs: f17_a_newer_format_is_named_and_left_alone",
            "host-tests/tests/recorder_superblock.rs: f17_foreign_content_is_left_alone_until_it_is_erased_by_command",
            "host-tests/tests/recorder_superblock.rs: f17_the_mode_of_an_older_save_gives_way_to_that_of_the_newest_record",
        ],
    ),
    row(
        "F18",
        "arbitrary image on the NAND",
        None,
        &[
            "ground/hostile/tests/replay.rs: flight_log",
            "host-tests/tests/recorder_superblock.rs: f18_arbitrary_images_are_mounted_read_and_appended_to_in_bounded_time",
        ],
    ),
    row(
        "F19",
        "read-out interrupted by G_ME, reset or unplugging",
        Flights(&[Fly {
            plans: &["reset@5.1s", "power-cut=1@5.1s", "umbilical-stuck@5.1s..6s"],
            motion: "still",
            said: &[
                (1_000, "G_MVG_MV"),
                (2_000, "G_MGG_MG"),
                (4_000, "G_MEG_ME"),
                (5_000, "G_Ml"),
                (7_500, "G_Ml"),
                (12_000, "G_ST"),
            ],
            ms: 13_000,
            judge: judge::dump_ends,
        }]),
        &[
            "host-tests/tests/recorder_unit.rs: f19_a_dump_goes_on_where_it_was_interrupted",
            "ground/recorder/src/dump/tests.rs: wherever_it_is_unplugged_it_goes_on_and_ends_whole",
        ],
    ),
    row(
        "F20",
        "the supply fails and comes back",
        Flights(&[recorder(&["supply@4s..5s", "supply@4s..4.5s"])]),
        &[
            "host-tests/tests/resets.rs: a_dip_of_the_supply_costs_no_more_than_the_records_of_its_own_duration",
            "host-tests/tests/recorder_unit.rs: f20_a_failing_supply_begins_no_operation",
            "boards/emulated/tests/recorder.rs: a_failing_supply_begins_no_operation",
            "boards/emulated/tests/recorder.rs: a_dip_of_20_ms_costs_no_record",
        ],
    ),
    row(
        "F21",
        "a million reads of a block",
        None,
        &["host-tests/tests/recorder_faults.rs: f21_a_million_reads_cost_corrected_bits_and_no_record"],
    ),
];
