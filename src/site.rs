//! Where the unit is: gravity, latitude and declination of a site, and what a launch crew knows beside.
//!
//! What the filter is told because of it is [`crate::estimate`]'s.

pub mod told;

pub use told::Told;

/// A place on Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// [m/s2] gravity. Wrong by a part: the velocity that bounds the tilt is wrong by that part.
    pub gravity: f32,
    /// \[deg\] latitude, north positive. Wrong by a radian: 15 deg/h of drift that the gyro bias takes up.
    pub latitude_deg: f32,
    /// \[deg\] declination of the field, east positive. Wrong by an angle: heading is wrong by it. 0: north is magnetic.
    pub declination_deg: f32,
    /// What a launch crew knows beside; `None` in a room.
    pub launch: Option<Launch>,
}

/// What a launch crew knows: norm and dip of a field that a model gives and nothing disturbs, and the unit in its vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Launch {
    /// \[uT\] norm. Wrong by a part: the field shows a disturbance of that part for ever.
    pub norm_ut: f32,
    /// \[deg\] below the horizontal.
    pub dip_deg: f32,
    /// \[deg\] error of its direction about each axis across it, standard deviation: the model's (IGRF-13 leaves
    /// some 0.1 uT of 25, P. Alken et al., Earth Planets Space 73:49, 2021) and the rail's iron.
    pub sd_deg: f32,
    /// \[uT\] the vehicle's hard iron on each axis after it was swung, standard deviation.
    pub iron_sd_ut: f32,
    /// [deg/s] by how much the bias of a gyro changes with each g, standard deviation: what a bench leaves of the data sheet's
    /// 0.2 (ADIS16265, Table 1). 0: it is known.
    pub bias_per_g_deg_s: f32,
}

impl Site {
    /// São José dos Campos, where the thesis' unit was turned: its gravity (WGS 84), the declination of the field in the
    /// laboratory.
    pub const LABORATORY: Site = Site {
        gravity: 9.7864,
        latitude_deg: -23.2111,
        declination_deg: -22.09,
        launch: None,
    };

    /// The launch centre of Alcantara: the normal gravity of WGS 84 at 2.32 S, IGRF-13 for 7 December 2016
    /// (24.23, -9.22, -4.07) uT.
    pub const ALCANTARA: Site = Site {
        gravity: 9.7804,
        latitude_deg: -2.32,
        declination_deg: -20.833,
        launch: Some(Launch {
            norm_ut: 26.242,
            dip_deg: -8.922,
            sd_deg: 0.2,
            iron_sd_ut: 0.15,
            bias_per_g_deg_s: 0.0,
        }),
    };
}
