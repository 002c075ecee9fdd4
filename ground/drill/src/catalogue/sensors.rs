//! Sensors and buses.

use super::{Drill::*, Fly, Row, row};
use crate::{campaign, judge};

const fn still(plans: &'static [&'static str], ms: u64, judge: fn(&host_tests::Flown) -> judge::Verdict) -> Fly {
    Fly {
        plans,
        motion: "still",
        said: &[(1, "G_DL")],
        ms,
        judge,
    }
}

pub(super) const ROWS: [Row; 23] = [
    row(
        "S1",
        "one sensor never answers",
        Flights(&[still(
            &[
                "silent:a1@3s..4.99s",
                "silent:a3@3s..4.99s",
                "silent:m2@3s..4.99s",
                "silent:m4@3s..4.99s",
                "silent:g3@3s..4.99s",
                "silent:g4@3s..4.99s",
                "silent:t1@3s..4.99s",
                "silent:t4@3s..4.99s",
            ],
            7_000,
            judge::one_is_marked,
        )]),
        &[
            "host-tests/tests/cycle.rs: k_silent_sensors_cost_their_own_values_only",
            "boards/emulated/tests/faults.rs: a_silent_sensor_has_its_error_bit_until_it_answers_again",
        ],
    ),
    row(
        "S2",
        "up to sixteen sensors run out of time",
        Flights(&[still(
            &[
                "stretch:a1=60000@3s stretch:a2=60000@3s stretch:a3=60000@3s stretch:a4=60000@3s",
                "stretch:a1=60000@3s stretch:m2=60000@3s stretch:t3=60000@3s",
            ],
            8_000,
            judge::closed_by_the_deadline,
        )]),
        &[
            "host-tests/tests/guards.rs: s2_parts_that_run_out_of_time_at_once_leave_the_packet_its_deadline",
            "src/budget.rs: whatever_sensors_are_silent_the_others_have_time_and_the_packet_closes",
        ],
    ),
    row(
        "S3",
        "a part holds SDA low",
        Flights(&[still(
            &[
                "sda-held=1@3.152s",
                "sda-held=2@3.152s",
                "sda-held=3@3.152s",
                "sda-held=4@3.152s",
                "sda-held=5@3.152s",
                "sda-held=6@3.152s",
                "sda-held=7@3.152s",
                "sda-held=8@3.152s",
                "sda-held=9@3.152s",
            ],
            6_000,
            judge::freed_within_two_cycles,
        )]),
        &[
            "host-tests/tests/guards.rs: s3_a_part_that_holds_sda_costs_one_packet",
            "boards/emulated/tests/faults.rs: a_part_that_holds_sda_is_clocked_free",
        ],
    ),
    row(
        "S4",
        "SDA or SCL low for ever",
        Flights(&[
            still(&["bus-stuck@3s..5s"], 8_000, judge::gyros_go_on_and_all_come_back),
            still(&["stretch:m2=60000@3s"], 6_000, judge::gyros_go_on),
        ]),
        &[
            "boards/emulated/tests/faults.rs: a_bus_stuck_in_mid_transfer_is_used_again_when_it_is_free",
            "boards/emulated/tests/faults.rs: a_part_that_holds_the_clock_for_good_costs_its_own_plate_at_most",
        ],
    ),
    row(
        "S5",
        "the bus is held when the unit starts, and again and again",
        Campaign(
            "bus stuck for the first two seconds; then in every cycle SDA held, or a STOP out of place",
            campaign::bus_events,
        ),
        &[
            "boards/emulated/tests/faults.rs: a_bus_stuck_in_mid_transfer_is_used_again_when_it_is_free",
            "boards/emulated/tests/faults.rs: a_controller_that_sends_no_start_is_reset",
        ],
    ),
    row(
        "S6",
        "a byte is not acknowledged",
        Flights(&[still(
            &[
                "nack:a2=1@3s..4.99s",
                "nack:a2=0@3s..4.99s",
                "nack:m3=1@3s..4.99s",
                "nack:t4=1@3s..4.99s",
            ],
            7_000,
            judge::one_is_marked,
        )]),
        &[
            "host-tests/tests/guards.rs: s6_a_byte_that_is_not_acknowledged_once_costs_no_reading",
            "drivers/src/lis331hh/tests.rs: a_part_that_does_not_acknowledge_is_a_bus_error",
            "drivers/src/tmp102.rs: a_part_that_does_not_acknowledge_is_a_bus_error",
        ],
    ),
    row(
        "S7",
        "clock stretched for 20 ms",
        None,
        &["host-tests/tests/cycle.rs: a_part_that_stretches_the_clock_too_long_is_cut_off_and_all_others_are_read"],
    ),
    row(
        "S8",
        "MISO stuck or random",
        Flights(&[still(
            &["garbage:g1@3s..4.99s", "garbage:g4@3s..4.99s", "silent:g2@3s..4.99s"],
            7_000,
            judge::one_is_marked,
        )]),
        &[
            "host-tests/tests/guards.rs: s8_a_gyro_that_answers_at_random_is_marked_from_the_second_packet_on",
            "host-tests/tests/guards.rs: s8_a_gyro_that_dies_between_two_cycles_adds_no_zeros_to_its_increments",
            "host-tests/tests/guards.rs: s8_a_gyro_that_answers_at_random_adds_no_word_to_its_increments",
            "drivers/src/adis16265/tests.rs: a_held_line_is_not_a_gyro_but_a_still_one_is",
        ],
    ),
    row(
        "S9",
        "frozen value",
        None,
        &[
            "host-tests/tests/faults.rs: s9_a_frozen_sensor_is_out_in_two_seconds",
            "src/faults/repeat.rs: it_takes_five_repeats_at_3_mg_and_some_twenty_at_12",
            "host-tests/tests/faults.rs: healthy_units_raise_at_most_one_alarm_in_ten_hours",
        ],
    ),
    row(
        "S10",
        "magnetometer's overflow code, lock left set",
        None,
        &[
            "host-tests/tests/guards.rs: s10_a_magnetometer_beyond_its_range_says_so",
            "drivers/src/hmc5883l/tests.rs: a_lock_left_by_a_partial_reading_is_opened_and_the_held_set_not_used",
        ],
    ),
    row(
        "S11",
        "gyro beyond its range",
        None,
        &[
            "host-tests/tests/guards.rs: s11_a_gyro_at_the_end_of_its_range_is_said_to_be_saturated",
            "src/kalman/tests/recovery.rs: a_saturated_spin_is_recovered_from_within_a_minute",
            "src/estimate/turn.rs: one_saturated_gyro_is_left_out_and_two_make_a_lower_bound",
        ],
    ),
    row(
        "S12",
        "a part restarts with its power-on settings",
        Flights(&[still(
            &["restart:a1@3.05s", "restart:m2@3.05s", "restart:t3@3.05s"],
            9_000,
            judge::configured_again,
        )]),
        &[
            "host-tests/tests/guards.rs: s12_a_part_that_restarts_by_itself_is_found_by_the_verification_in_turn",
            "drivers/src/lis331hh/tests.rs: verify_finds_a_part_that_restarted",
        ],
    ),
    row(
        "S13",
        "two plates exchanged, the same address twice",
        Flights(&[still(
            &["bridged:1@20s..40s", "bridged:2@20s..40s", "bridged:3@20s..40s"],
            75_000,
            judge::disagreement_is_said,
        )]),
        &[
            "src/calibration/tests.rs: exchanged_plates_swapped_axes_and_signs_are_refused",
            "drivers/src/lis331hh/tests.rs: another_part_is_refused_by_its_identity_and_not_written_to",
        ],
    ),
    row(
        "S14",
        "axis reversed, axes swapped",
        None,
        &["host-tests/tests/faults.rs: s14_reversed_axes_and_swapped_ones_are_out_in_five_seconds_of_motion"],
    ),
    row(
        "S15",
        "bias step, ramp or scale step on one axis; 1.7 sigma in five seconds with 0.94: 0.99 is not to be had with the false alarms allowed",
        None,
        &[
            "host-tests/tests/faults.rs: s15_a_chance_of_99_percent_at_1_7_sigma_takes_more_false_alarms_than_are_allowed",
            "host-tests/tests/faults.rs: s15_a_step_of_one_axis_is_isolated_in_a_second_or_in_five",
            "host-tests/tests/faults.rs: s15_ramps_and_scale_steps_of_one_axis_are_isolated",
        ],
    ),
    row(
        "S16",
        "the same on one gyro; 0.3 deg/s is isolated within 10 s of the parity's alarm",
        None,
        &[
            "host-tests/tests/faults.rs: s16_a_gyro_is_isolated_within_ten_seconds_of_its_detection",
            "host-tests/tests/faults.rs: s16_a_step_of_one_gyro_is_detected_in_a_second_or_in_five",
            "host-tests/tests/faults.rs: s16_a_gyro_is_isolated_by_the_vectors_at_rest_and_in_motion",
        ],
    ),
    row(
        "S17",
        "tenfold noise on one axis",
        None,
        &["host-tests/tests/faults.rs: s17_tenfold_noise_is_out_within_ten_seconds"],
    ),
    row(
        "S18",
        "two faults at once on different plates",
        None,
        &["host-tests/tests/faults.rs: s18_of_two_faults_on_different_plates_both_are_named"],
    ),
    row(
        "S19",
        "magnetic disturbance",
        None,
        &[
            "src/kalman/tests/iron.rs: a_magnetic_step_turns_the_heading_by_less_than_two_degrees",
            "src/kalman/tests/iron.rs: iron_that_goes_round_turns_the_heading_by_less_than_two_degrees",
            "src/kalman/tests/iron.rs: a_magnet_on_its_way_past_is_no_iron_of_the_unit",
            "src/kalman/tests/disturbed.rs: a_disturbance_of_any_length_leaves_the_heading_right_or_said_to_be_wrong",
        ],
    ),
    row(
        "S20",
        "boost of 12 g, and micro-gravity",
        None,
        &[
            "src/kalman/tests/force.rs: boost_and_free_fall_after_lift_off_do_not_move_it",
            "src/kalman/tests/force.rs: in_micro_gravity_the_field_bounds_what_it_can",
        ],
    ),
    row(
        "S21",
        "temperature jump, temperature missing",
        None,
        &[
            "src/calibration/tests.rs: the_temperature_of_its_own_plate_corrects_an_axis",
            "src/calibration/tests.rs: beyond_its_validity_a_set_is_applied_as_at_its_end_and_says_so",
        ],
    ),
    row(
        "S22",
        "random words of a sensor",
        None,
        &[
            "host-tests/tests/faults.rs: s22_a_sensor_that_sends_random_words_is_out_in_three_samples",
            "host-tests/tests/faults.rs: a_gyro_that_sends_random_words_is_detected",
        ],
    ),
    row(
        "S23",
        "late, doubled or jittered sample",
        None,
        &[
            "src/kalman/tests/hostile.rs: time_that_stands_still_or_goes_back_is_left_out",
            "src/increments.rs: gaps_and_time_going_back_are_not_integrated",
            "src/kalman/tests.rs: slot_times_and_delays_are_taken_off",
        ],
    ),
];
