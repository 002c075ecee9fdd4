//! MCU, time, system.

use super::{Drill::*, Fly, Row, row};
use crate::judge;

pub(super) const ROWS: [Row; 15] = [
    row(
        "U1",
        "a part of the unit hangs",
        Flights(&[Fly {
            plans: &[
                "hang:sensors@33s",
                "hang:gyros@33s",
                "hang:telemetry@33s",
                "hang:umbilical-out@33s",
                "hang:umbilical-in@33s",
                "hang:lines@33s",
                "hang:nand@33s",
                "dma-hung@33s",
            ],
            motion: "rocket",
            said: &[(33_500, "G_VE"), (37_000, "G_ST")],
            ms: 38_000,
            judge: judge::watchdog_bites_and_flight_goes_on,
        }]),
        &[
            "src/unit/vote.rs: any_one_of_the_eight_alone_keeps_the_watchdog_from_being_fed",
            "boards/emulated/tests/faults.rs: a_part_that_hangs_lets_the_watchdog_bite_and_flight_is_resumed",
        ],
    ),
    row(
        "U2",
        "storm of interrupts, bouncing line",
        Flights(&[Fly {
            plans: &[
                "busy=2@3s..8s x300",
                // Not in step with the polls every 20 ms, which would always meet the same half of a bounce.
                "lift-off:bouncing=0.053@3s..8s",
                "busy=3@3s..8s x100 micro-g:bouncing=3@3s..8s",
            ],
            motion: "still",
            said: &[],
            ms: 11_000,
            judge: judge::nearly_steady,
        }]),
        &["host-tests/tests/guards.rs: u2_a_processor_that_is_kept_busy_through_a_cycle_closes_the_packet_and_says_so"],
    ),
    row(
        "U3",
        "HardFault or panic",
        Flights(&[Fly {
            plans: &["panic@33s", "panic@32.077s"],
            motion: "rocket",
            said: &[(40_000, "G_ST")],
            ms: 41_000,
            judge: judge::flight_goes_on_and_the_log_is_whole,
        }]),
        &[
            "host-tests/tests/resets.rs: the_reason_of_a_reset_is_in_the_log_in_derived_frames_and_in_the_status",
            "host-tests/tests/resets.rs: a_crash_that_the_log_does_not_have_is_told_again",
            "src/crash.rs: a_record_survives_its_own_encoding",
            "src/crash.rs: every_one_bit_error_is_refused",
            "boards/emulated/tests/crash.rs: an_instruction_that_is_none_leaves_a_crash_record_and_the_unit_goes_on",
            "boards/emulated/tests/crash.rs: a_panic_leaves_a_crash_record_that_the_log_keeps",
        ],
    ),
    row(
        "U4",
        "stack overflow",
        None,
        &[
            "boards/emulated/tests/crash.rs: a_stack_that_runs_over_leaves_a_crash_record_and_the_unit_goes_on",
            "boards/emulated/tests/image.rs: the_stack_stays_within_its_place_through_commands_self_test_and_faults",
        ],
    ),
    row(
        "U5",
        "reset after reset",
        Flights(&[Fly {
            plans: &["reset@3s..20s x5", "panic@3s..20s x5"],
            motion: "still",
            said: &[
                (1_000, "G_MVG_MV"),
                (1_500, "G_MGG_MG"),
                (1_700, "G_DL"),
                (26_000, "G_XN"),
                (40_000, "G_ST"),
            ],
            ms: 41_000,
            judge: judge::safe_mode_and_out_of_it,
        }]),
        &[
            "host-tests/tests/safe_mode.rs: the_fourth_start_without_a_minute_of_health_is_in_safe_mode_and_says_so",
            "host-tests/tests/safe_mode.rs: three_starts_are_none_too_many",
            "host-tests/tests/safe_mode.rs: a_word_leaves_safe_mode_and_the_attitude_comes_back",
            "host-tests/tests/safe_mode.rs: a_minute_of_health_begins_the_count_anew",
        ],
    ),
    row(
        "U6",
        "the crystal fails",
        Flights(&[Fly {
            // The reset stands for that of the clock security system's handler: the emulator cannot raise its NMI.
            plans: &["crystal-lost@3s reset@3.001s"],
            motion: "still",
            said: &[(6_000, "G_ST")],
            ms: 8_000,
            judge: judge::says_internal_oscillator,
        }]),
        &[
            "boards/emulated/tests/image.rs: a_board_without_its_crystal_says_so_everywhere_and_flies_on",
            "boards/emulated/tests/image.rs: a_crystal_that_stops_in_flight_costs_a_reset_and_flight_goes_on",
        ],
    ),
    row(
        "U7",
        "roll-over of clocks and counters",
        Flights(&[Fly {
            // 2^32 us are 4294.97 s: passed 5 s after the start. It strikes before the unit's first instruction.
            plans: &["clock-step=4289900@0s"],
            motion: "tumble",
            said: &[(1, "G_DL")],
            ms: 15_000,
            judge: judge::time_goes_on,
        }]),
        &[
            "host-tests/tests/guards.rs: u7_a_clock_beyond_32_bits_of_microseconds_changes_nothing",
            "ground/packets/src/stream/sequence.rs: a_day_is_numbered_without_a_break",
            "ground/packets/src/stream/sequence.rs: a_gap_is_missed_packets_also_over_the_wrap",
        ],
    ),
    row(
        "U8",
        "the clock steps back",
        Flights(&[Fly {
            plans: &[
                "clock-step@3s..8s x10",
                "clock-step=-32@3.153s",
                "clock-step=-200@3.153s",
            ],
            motion: "still",
            said: &[(1, "G_DL")],
            ms: 12_000,
            judge: judge::time_goes_on,
        }]),
        &[],
    ),
    row(
        "U9",
        "bit flips in RAM",
        Flights(&[
            Fly {
                plans: &["kept-flip@31.5s..39s x6", "kept-flip=33@33s", "kept-flip=127@33s"],
                motion: "rocket",
                said: &[(40_000, "G_ST")],
                ms: 41_000,
                judge: judge::flight_goes_on_and_the_log_is_whole,
            },
            Fly {
                plans: &["ram-flip@32s..36s x50", "ram-flip@31s..36s x200"],
                motion: "rocket",
                said: &[(38_000, "G_ST")],
                ms: 39_000,
                judge: judge::no_silent_wrong_mode,
            },
        ]),
        &[
            "src/retained.rs: a_damaged_copy_is_passed_over_and_two_are_refused",
            "src/mode/tests.rs: a_flipped_bit_of_the_mode_is_put_right_by_its_copies",
            "src/estimate/tests.rs: a_flipped_bit_of_the_calibration_is_put_right_by_the_copy_whose_checksum_fits",
            "src/estimate/tests.rs: after_a_flipped_bit_of_the_filter_the_attitude_goes_on_from_its_copy",
            "boards/emulated/tests/crash.rs: a_flipped_bit_of_the_mode_in_ram_is_put_right_and_said",
            "boards/emulated/tests/crash.rs: flipped_bits_of_the_filter_in_ram_are_found_and_the_attitude_goes_on",
        ],
    ),
    row(
        "U10",
        "bit flip in the firmware's flash",
        Flights(&[Fly {
            plans: &["image-flip@20s", "image-flip=0@4s", "image-flip=32767@4s"],
            motion: "still",
            said: &[(3_000, "G_ST"), (29_000, "G_ST")],
            ms: 30_000,
            judge: judge::says_that_the_image_changed,
        }]),
        &[
            "host-tests/tests/guards.rs: u10_a_bit_of_the_image_that_flips_is_said_and_in_the_status",
            "boards/emulated/tests/image.rs: the_status_has_the_checksum_of_the_image_and_another_one_for_another",
        ],
    ),
    row(
        "U11",
        "lift-off line bounces, glitches, is stuck, is lost",
        Flights(&[
            Fly {
                plans: &[
                    "lift-off:high@3.005s..3.02s",
                    "lift-off:high@3.005s..3.044s",
                    "lift-off:high@3.005s..3.02s lift-off:high@3.205s..3.22s",
                ],
                motion: "still",
                said: &[(5_000, "G_ST")],
                ms: 6_000,
                judge: judge::stays_in_wait,
            },
            Fly {
                plans: &["lift-off:high@0s"],
                motion: "still",
                said: &[(5_000, "G_ST")],
                ms: 6_000,
                judge: judge::line_is_shown,
            },
            Fly {
                plans: &["lift-off:low@0s"],
                motion: "rocket",
                said: &[(32_000, "G_MVG_MV"), (33_000, "G_ST")],
                ms: 35_000,
                judge: judge::flight_by_command,
            },
        ]),
        &[
            "src/discrete.rs: a_glitch_of_two_polls_never_passes",
            "src/discrete.rs: a_bouncing_edge_passes_once",
        ],
    ),
    row(
        "U12",
        "the micro-gravity line contradicts the accelerometers",
        Flights(&[Fly {
            plans: &["micro-g:high@5s"],
            motion: "still",
            said: &[(1, "G_DL")],
            ms: 25_000,
            judge: judge::attitude_goes_by_the_norm,
        }]),
        &["host-tests/tests/flight.rs: lift_off_starts_flight_and_recording"],
    ),
    row(
        "U13",
        "power switched off and on again and again",
        Flights(&[Fly {
            plans: &["power-cut@31.5s..70s x40"],
            motion: "rocket",
            said: &[(72_000, "G_ST")],
            ms: 73_000,
            judge: judge::flight_goes_on_and_the_log_is_whole,
        }]),
        &["boards/emulated/tests/recorder.rs: a_record_is_durable_400_ms_after_a_power_cut_and_sooner_after_a_reset"],
    ),
    row(
        "U14",
        "queues full",
        Flights(&[Fly {
            plans: &["umbilical-stuck@3s..8s"],
            motion: "still",
            said: &[
                (2_900, "G_MTG_MT"),
                (3_200, "G_HEG_STG_HEG_STG_HEG_ATG_STG_STG_STG_ST"),
                (5_000, "G_CRG_CRG_HEG_ST"),
                (20_000, "G_MtG_Mt"),
                (24_000, "G_VEG_ST"),
            ],
            ms: 28_000,
            judge: judge::what_was_lost_is_counted,
        }]),
        &[],
    ),
    row(
        "U15",
        "supply chain",
        None,
        &[
            ".ci/supply: cargo deny --locked --workspace check --hide-inclusion-graph licenses bans sources",
            "ground/src/sbom.rs: a_package_that_is_not_from_a_registry_is_refused",
        ],
    ),
];
