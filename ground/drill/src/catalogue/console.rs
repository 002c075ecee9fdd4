//! Links, console, security.

use super::{Drill::*, Fly, Row, row};
use crate::{campaign, judge};

pub(super) const ROWS: [Row; 15] = [
    row(
        "C1",
        "one wrong bit in any word",
        None,
        &[
            "src/mode/tests.rs: no_one_bit_error_erases_or_changes_to_a_mode_that_was_not_sent",
            "src/mode/tests.rs: no_word_that_changes_the_state_at_once_is_one_bit_from_another",
            "src/mode/tests.rs: recording_and_packets_take_their_word_twice_within_ten_seconds",
            "host-tests/tests/umbilical.rs: one_wrong_bit_in_a_word_costs_a_report_at_most",
        ],
    ),
    row(
        "C2",
        "two wrong bits; a byte lost, doubled, swapped",
        None,
        &[
            "src/mode/tests.rs: no_lost_doubled_or_swapped_byte_erases_or_changes_to_a_mode_that_was_not_sent",
            "src/mode/tests.rs: no_two_bit_error_in_one_deed_erases",
        ],
    ),
    row(
        "C3",
        "random bytes into the parser",
        Campaign(
            "random bytes, one in four a letter of the words",
            campaign::random_bytes,
        ),
        &[
            "ground/hostile/tests/replay.rs: commands",
            "host-tests/tests/umbilical.rs: a_parser_keeps_thirty_letters_whatever_comes",
        ],
    ),
    row(
        "C4",
        "framing and other errors of the line",
        Flights(&[Fly {
            plans: &["umbilical-noise@3s..13s", "umbilical-break@3s..13s"],
            motion: "still",
            said: &[(5_000, "G_VEG_VE"), (13_001, "G_VE"), (14_000, "G_ST")],
            ms: 16_000,
            judge: judge::heard_again,
        }]),
        &[
            "boards/emulated/tests/image.rs: a_framing_error_on_every_byte_loses_the_command_and_nothing_else",
            "host-tests/tests/guards.rs: c4_a_damaged_byte_ends_the_word_that_it_is_in",
        ],
    ),
    row(
        "C5",
        "flood of words at the line's rate",
        Campaign("57 words every 20 ms", campaign::flood),
        &[],
    ),
    row(
        "C6",
        "erase in FLIGHT, with lift-off, while erasing, twice",
        None,
        &[
            "src/mode/tests.rs: an_erase_takes_a_second_different_word_and_no_lift_off",
            "src/mode/tests.rs: a_task_of_the_other_mode_is_refused",
            "host-tests/tests/recorder_unit.rs: lift_off_during_an_erase_is_recorded_all_the_same",
        ],
    ),
    row(
        "C7",
        "erase of data that were not read out",
        None,
        &[
            "src/mode/tests.rs: an_erase_takes_a_second_different_word_and_no_lift_off",
            "host-tests/tests/console.rs: a_flight_is_recorded_dumped_and_erased",
            "host-tests/tests/resets.rs: c7_arming_an_erase_and_erasing_are_in_the_log",
        ],
    ),
    row(
        "C8",
        "half a word, then a pause",
        None,
        &["src/command.rs: a_half_word_is_forgotten_after_two_seconds"],
    ),
    row(
        "C9",
        "umbilical or telemetry that takes no byte",
        Flights(&[
            Fly {
                plans: &["umbilical-stuck@3s..6s"],
                motion: "still",
                said: &[
                    (2_500, "G_MTG_MT"),
                    (4_000, "G_HE"),
                    (8_000, "G_MtG_Mt"),
                    (9_000, "G_VE"),
                ],
                ms: 12_000,
                judge: judge::console_answers_again,
            },
            Fly {
                plans: &["telemetry-stuck@4s..7s"],
                motion: "still",
                said: &[(1_000, "G_MVG_MV"), (2_000, "G_MGG_MG")],
                ms: 10_000,
                judge: judge::recorder_has_what_the_line_lost,
            },
        ]),
        &["ground/src/console/session.rs: the_console_goes_on_in_the_same_recording_after_a_replug"],
    ),
    row(
        "C10",
        "lines slower than the packets",
        Flights(&[Fly {
            plans: &["lines-slow=12@3s"],
            motion: "still",
            said: &[],
            ms: 12_000,
            judge: judge::frames_are_whole,
        }]),
        &[
            "host-tests/tests/guards.rs: c10_on_a_slow_line_frames_are_whole_or_not_there",
            "host-tests/tests/guards.rs: c10_a_line_that_is_stuck_with_derived_frames_on_does_not_let_the_watchdog_bite",
        ],
    ),
    row(
        "C11",
        "packet stream cut or garbled",
        None,
        &[
            "ground/packets/src/stream/tests.rs: a_truncated_packet_costs_itself_only",
            "ground/packets/src/stream/tests.rs: two_packets_spliced_into_one_are_one_stretch",
        ],
    ),
    row(
        "C12",
        "start letters inside a packet, lower case, wrong length",
        None,
        &[
            "ground/packets/src/stream/tests.rs: lower_case_is_rejected_with_its_position",
            "ground/packets/src/stream/tests.rs: an_over_long_packet_is_rejected_and_the_next_one_found",
            "ground/packets/src/stream/tests.rs: starts_and_ends_within_a_packet_do_not_hide_the_next",
        ],
    ),
    row(
        "C13",
        "read-out beyond the log, overflow in its numbers",
        None,
        &[
            "host-tests/tests/umbilical.rs: what_is_asked_for_beyond_the_log_or_a_set_is_not_there",
            "src/command.rs: a_range_takes_twelve_digits_and_names_a_wrong_one",
            "host-tests/tests/recorder_unit.rs: f19_a_dump_goes_on_where_it_was_interrupted",
        ],
    ),
    row(
        "C14",
        "hostile images into the host's programs",
        None,
        &[
            "ground/recorder/src/recover.rs: a_file_larger_than_a_chip_is_refused_unread",
            "ground/recorder/src/recover.rs: a_chip_full_of_random_bytes_is_read_in_bounded_time",
            "packed/src/lib.rs: a_bomb_is_not_unpacked_to_its_end",
            "ground/hostile/tests/replay.rs: recover",
            "ground/hostile/tests/replay.rs: recording",
            "ground/hostile/tests/replay.rs: csv",
        ],
    ),
    row(
        "C15",
        "memory outside the log read by the console",
        None,
        &[
            "host-tests/tests/umbilical.rs: every_word_is_on_the_page_of_threats_with_what_it_reads_and_writes",
            "host-tests/tests/umbilical.rs: what_is_asked_for_beyond_the_log_or_a_set_is_not_there",
        ],
    ),
];
