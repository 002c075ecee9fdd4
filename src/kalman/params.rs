//! What the filter is told of gyros, motion, field and site, with what small and large values do.

use nalgebra::Vector3;

use super::Reference;

/// Parameters of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// \[s\] between updates. Small: more work, and disturbances that last are counted as many witnesses; large: errors
    /// grow unseen for longer.
    pub window_s: f32,
    /// [rad/sqrt(s)] angle noise that no model explains, beside the increments' own variance. Small: the gyros are
    /// trusted for longer than they deserve; large: attitude follows accelerometers and magnetometers.
    pub angle_noise: f32,
    /// [rad/sqrt(rad)] the same for each radian turned: what is left of scale and timing errors.
    pub turn_noise: f32,
    /// [rad/s] bias at the start, standard deviation.
    pub bias_sd: f32,
    /// [rad/s/sqrt(s)] bias random walk. Small: a drifting bias is followed late; large: the bias takes up disturbances.
    pub bias_walk: f32,
    /// [rad/s for each g] by how much force moves a gyro's bias: for who carries on through a boost.
    pub bias_per_g: f32,
    /// \[1\] scale and misalignment of the gyros at the start, standard deviation. Zero keeps them out of the filter.
    pub gyro_matrix_sd: f32,
    /// [1/sqrt(s)] random walk of scale and misalignment.
    pub gyro_matrix_walk: f32,
    /// [m/s] velocity that is found of a moving unit in one window, its own and what accelerometers add, standard
    /// deviation. Small: quick acceleration is mistaken for tilt; large: tilt is learnt slowly.
    pub velocity_sd: f32,
    /// \[s\] how much of the spread of specific force within a window adds to it.
    pub velocity_per_spread_s: f32,
    /// [m/s] the same at rest.
    pub velocity_rest_sd: f32,
    /// \[s\] for how long it stays the same: so many windows are one witness. Zero: each window is one.
    pub velocity_lasts_s: f32,
    /// [m/s2] error of the mean specific force of a window beside the samples' own: bias and scale of accelerometers.
    pub acc_error: f32,
    /// \[1\] error of specific force in parts of how far it spreads: scale, misalignment, instants of the samples.
    pub acc_scale_error: f32,
    /// \[1\] how far specific force is believed to be off across the vertical, in parts of what it is off one g for seconds.
    /// Small: vibration that slow samples fold down is taken for tilt; large: climbing and sinking cost tilt.
    pub acc_excess: f32,
    /// \[rad\] error of the reference's heading in one window. Small: heading follows every piece of iron; large: it follows
    /// the gyros.
    pub heading_sd: f32,
    /// \[rad\] error of the field's direction at the start; the heading's is this over the cosine of the dip.
    pub start_field_sd: f32,
    /// \[rad\] error of the reference's dip in one window.
    pub dip_sd: f32,
    /// \[s\] for how long both stay the same: so many windows are one witness. Zero: each window is one.
    pub field_lasts_s: f32,
    /// \[1\] how far a disturbance is believed to reach across the field, in parts of what norm and dip show of it.
    pub disturbance: f32,
    /// \[1\] a field whose norm and dip are off by more (in parts of the norm, and radians) is disturbed, and not used while the
    /// attitude is known better. Small: coasts on the gyros often; large: follows iron.
    pub field_gate: f32,
    /// \[s\] after so long what neither force nor field tells is what the gyros say of their bias at rest.
    pub coast_s: f32,
    /// \[1\] how much of the field's spread within a window adds to its uncertainty.
    pub field_spread: f32,
    /// \[1\] gate in standard deviations of the innovation. Small: good data are lost; large: bad data get in.
    pub gate: f32,
    /// \[s\] a kind of measurement rejected for so long starts the attitude afresh; a field that was disturbed is used again after so
    /// long without.
    pub recovery_s: f32,
    /// \[rad\] an attitude known no better starts afresh.
    pub lost_sd: f32,
    /// [rad/s] by how much the rate may have changed in a gap of the increments.
    pub gap_rate_sd: f32,
    /// \[s\] longest gap that is bridged.
    pub longest_gap_s: f32,
    /// [rad/s] error of the rate while a gyro is saturated.
    pub saturated_rate_sd: f32,
    /// When the unit is at rest.
    pub rest: Rest,
    /// How late each sensor's samples are.
    pub delays: Delays,
    /// [m/s2] local gravity.
    pub gravity: f32,
    /// [rad/s] the Earth's rate in n; zero where it is not known.
    pub earth_rate_n: Vector3<f32>,
    /// \[uT\] hard iron on each axis that may have come with the unit, standard deviation. Zero: none is looked for.
    /// Large: gradients of a room are taken for iron sooner.
    pub iron_sd_ut: f32,
    /// \[uT\] what else moves the field within a window.
    pub iron_noise_ut: f32,
    /// \[1\] by how much more a window counts less whose field moves.
    pub iron_per_spread: f32,
    /// \[s\] iron that comes or goes is looked for in the windows of so long. Small: what passes is taken for iron of the unit;
    /// large: a magnet is noticed late.
    pub iron_change_s: f32,
    /// \[uT\] such iron on each axis, standard deviation.
    pub iron_change_sd_ut: f32,
    /// The field at the site, or one to be learnt in the first [`Params::learn_s`].
    pub field: Reference,
    /// \[s\] how long the field is learnt.
    pub learn_s: f32,
}

/// What a window must look like for the unit to be at rest, and what rest is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// [rad/s] greatest mean rate: beyond it a slow turn would be taken for a bias. Zero switches rest off.
    pub rate: f32,
    /// [rad/s] greatest spread of the rate.
    pub rate_spread: f32,
    /// [m/s2] greatest spread of specific force.
    pub acc_spread: f32,
    /// [rad/s] error of a bias measured in one window.
    pub bias_sd: f32,
}

/// \[s\] how long before its stamp each sensor saw what it gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delays {
    /// \[s\] gyros.
    pub gyro_s: f32,
    /// \[s\] accelerometers.
    pub acc_s: f32,
    /// \[s\] magnetometers.
    pub mag_s: f32,
}

/// \[rad\] a degree.
const DEG: f32 = core::f32::consts::PI / 180.0;

impl Params {
    /// For a unit moved by hand or machine in a room, its site unknown. Chosen on seven real recordings, on which
    /// they leave 0.74 deg at 285 Hz and 0.84 deg at 5 Hz; on nine others 1.14 and 1.53 deg.
    pub const ROOM: Params = Params {
        window_s: 1.0,
        angle_noise: 0.12 * DEG,
        turn_noise: 3.5e-4,
        bias_sd: 0.5 * DEG,
        bias_walk: 6e-4 * DEG,
        bias_per_g: 0.0,
        gyro_matrix_sd: 2e-3,
        gyro_matrix_walk: 5e-5,
        velocity_sd: 0.034,
        velocity_per_spread_s: 0.05,
        velocity_rest_sd: 0.011,
        velocity_lasts_s: 20.0,
        acc_error: 0.015,
        acc_scale_error: 0.03,
        acc_excess: 1.0,
        heading_sd: 0.8 * DEG,
        start_field_sd: 2.0 * DEG,
        dip_sd: 0.6 * DEG,
        field_lasts_s: 64.0,
        disturbance: 0.7,
        field_gate: 0.15,
        coast_s: 60.0,
        field_spread: 0.2,
        gate: 5.0,
        recovery_s: 5.0,
        lost_sd: 0.6,
        gap_rate_sd: 0.5,
        longest_gap_s: 1.0,
        saturated_rate_sd: 1.0,
        rest: Rest {
            rate: 2.0 * DEG,
            rate_spread: 0.5 * DEG,
            acc_spread: 0.15,
            bias_sd: 0.01 * DEG,
        },
        delays: Delays {
            gyro_s: 0.0,
            acc_s: 0.0,
            mag_s: 0.0,
        },
        gravity: 9.806_65,
        earth_rate_n: Vector3::new(0.0, 0.0, 0.0),
        iron_sd_ut: 2.0,
        iron_noise_ut: 2.0,
        iron_per_spread: 100.0,
        iron_change_s: 4.0,
        iron_change_sd_ut: 60.0,
        field: Reference::unknown(),
        learn_s: 20.0,
    };
}
