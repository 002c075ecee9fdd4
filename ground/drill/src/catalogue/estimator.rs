//! Estimator and numerics: by tests, since no board is needed to inject a number.

use super::{Drill::*, Row, row};

pub(super) const ROWS: [Row; 12] = [
    row(
        "N1",
        "NaN or infinity in any input",
        None,
        &[
            "src/kalman/tests/hostile.rs: rubbish_in_any_input_leaves_the_state_finite_and_is_recovered_from",
            "host-tests/tests/faults.rs: whatever_comes_in_what_goes_out_is_finite",
        ],
    ),
    row(
        "N2",
        "a million steps in f32 beside f64",
        None,
        &["host-tests/tests/kalman.rs: a_million_steps_in_f32_stay_with_f64"],
    ),
    row(
        "N3",
        "huge initial covariance, tiny noise",
        None,
        &[
            "src/kalman/tests/hostile.rs: a_huge_covariance_and_tiny_noise_leave_it_finite_definite_and_right",
            "src/kalman/tests/hostile.rs: the_covariance_stays_positive_for_a_day_at_rest",
        ],
    ),
    row(
        "N4",
        "collinear vectors",
        None,
        &[
            "src/triad.rs: collinear_directions_are_refused_up_to_five_degrees",
            "src/kalman/tests/hostile.rs: zero_vectors_and_collinear_ones_do_not_align_it",
        ],
    ),
    row(
        "N5",
        "zero vectors, quaternion of no or wrong length",
        None,
        &[
            "src/attitude/tests.rs: stored_quaternions_are_normalised_or_refused",
            "src/triad.rs: what_is_no_direction_is_refused",
        ],
    ),
    row(
        "N6",
        "initial error of half a turn",
        None,
        &["src/kalman/tests/recovery.rs: half_a_turn_of_initial_error_is_recovered_from_within_half_a_minute"],
    ),
    row(
        "N7",
        "bursts of outliers",
        None,
        &[
            "src/kalman/tests/recovery.rs: what_triad_found_is_not_turned_by_the_correction_of_its_window_too",
            "src/kalman/tests/hostile.rs: one_bad_sample_costs_itself_and_not_its_window",
        ],
    ),
    row(
        "N8",
        "ill-conditioned calibration loaded",
        None,
        &["src/calibration/tests.rs: an_ill_conditioned_sensor_is_refused_by_name"],
    ),
    row(
        "N9",
        "calibration data that do not fit",
        None,
        &[
            "ground/bench/tests/commands.rs: what_cannot_be_read_is_named",
            "ground/bench/tests/commands.rs: a_wrong_sign_in_the_table_never_becomes_a_quiet_matrix",
        ],
    ),
    row(
        "N10",
        "consistency of the covariance",
        None,
        &[
            "host-tests/tests/kalman.rs: the_covariance_is_honest_at_rest",
            "host-tests/tests/kalman.rs: the_covariance_is_honest_in_a_tumble",
            "host-tests/tests/kalman.rs: the_covariance_is_honest_in_an_orbit",
            "host-tests/tests/kalman.rs: the_covariance_is_honest_on_a_rate_table",
        ],
    ),
    row(
        "N11",
        "reset in flight, attitude restored",
        None,
        &[
            "host-tests/tests/resets.rs: n11_a_reset_without_weight_costs_two_packets_and_an_error_that_is_said",
            "host-tests/tests/resets.rs: a_power_cut_without_weight_goes_on_from_the_newest_record",
            "boards/emulated/tests/estimate.rs: after_a_reset_in_flight_the_first_frame_has_the_attitude_and_says_why_the_unit_started",
        ],
    ),
    row(
        "N12",
        "very long run",
        None,
        &[
            "host-tests/tests/kalman.rs: ten_hours_leave_the_same_work_in_each_window_and_no_denormal_number",
            "src/attitude/tests.rs: a_million_turns_keep_the_norm",
            "src/kalman/tests/hostile.rs: the_covariance_stays_positive_for_a_day_at_rest",
        ],
    ),
];
