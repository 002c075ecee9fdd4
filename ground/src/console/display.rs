//! How values are grouped, scaled and written on the screen.
//!
//! In: channels of [`packets::channel`] and their counts. Out: groups for tabs and plots, values in the unit an engineer
//! reads (rates in °/s, everything else as [`Quantity`] has it), and text for a cell.

use emems::{
    sample::{Errors, Kind, SENSORS},
    sensor::hmc5883l::OVERFLOW,
};

use packets::channel::{CHANNELS, Quantity};

/// Sensors of a kind, as plotted together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Three axes of one plate.
    Accelerometers,
    /// Three axes of one plate.
    Magnetometers,
    /// One axis of all plates.
    Gyros,
    /// All plates.
    Temperatures,
}

/// All groups, in reading order.
pub const GROUPS: [Group; 4] = [
    Group::Accelerometers,
    Group::Magnetometers,
    Group::Gyros,
    Group::Temperatures,
];

impl Group {
    /// What it measures.
    pub fn quantity(self) -> Quantity {
        match self {
            Group::Accelerometers => Quantity::SpecificForce,
            Group::Magnetometers => Quantity::Field,
            Group::Gyros => Quantity::Rate,
            Group::Temperatures => Quantity::Temperature,
        }
    }

    /// Its name over a plot; a group of one plate says which.
    pub fn title(self, plate: usize) -> String {
        match self {
            Group::Accelerometers => format!("accelerometer {}", plate + 1),
            Group::Magnetometers => format!("magnetometer {}", plate + 1),
            Group::Gyros => "gyros".into(),
            Group::Temperatures => "temperatures".into(),
        }
    }

    /// What is drawn: places in [`CHANNELS`] and the label of each.
    pub fn curves(self, plate: usize) -> Vec<(usize, &'static str)> {
        let (one_plate, labels) = match self {
            Group::Accelerometers | Group::Magnetometers => (true, ["x", "y", "z", ""]),
            Group::Gyros | Group::Temperatures => (false, ["1", "2", "3", "4"]),
        };
        let drawn = CHANNELS
            .iter()
            .enumerate()
            .filter(|(_, channel)| channel.quantity == self.quantity() && (!one_plate || channel.plate == plate));
        drawn.map(|(index, _)| index).zip(labels).collect()
    }

    /// The group after this one.
    pub fn next(self) -> Self {
        match self {
            Group::Accelerometers => Group::Magnetometers,
            Group::Magnetometers => Group::Gyros,
            Group::Gyros => Group::Temperatures,
            Group::Temperatures => Group::Accelerometers,
        }
    }
}

/// What a sensor is called where room is short.
pub fn short_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Accelerometer => "acc",
        Kind::Magnetometer => "mag",
        Kind::Gyro => "gyro",
        Kind::Thermometer => "temp",
    }
}

/// The failed sensors, thesis' plate numbers: "acc 1-4, gyro 2".
pub fn failed_names(errors: Errors) -> String {
    let groups = [Kind::Accelerometer, Kind::Magnetometer, Kind::Gyro, Kind::Thermometer];
    let named = groups.iter().filter_map(|kind| {
        let failed = SENSORS
            .iter()
            .enumerate()
            .filter(|(slot, sensor)| sensor.kind == *kind && errors.contains(*slot));
        let plates: Vec<_> = failed.map(|(_, sensor)| (sensor.plate + 1).to_string()).collect();
        match plates.len() {
            0 => None,
            4 => Some(format!("{} 1-4", short_name(*kind))),
            _ => Some(format!("{} {}", short_name(*kind), plates.join(" "))),
        }
    });
    named.collect::<Vec<_>>().join(", ")
}

/// Value of some counts in [`unit()`].
pub fn value(quantity: Quantity, counts: i16) -> f64 {
    match quantity {
        Quantity::Rate => quantity.si(counts).to_degrees(),
        _ => quantity.si(counts),
    }
}

/// Unit on the screen.
pub fn unit(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Rate => "°/s",
        _ => quantity.unit(),
    }
}

/// Cells for a value: counts, and in [`unit()`] with two decimals, which is a count or less for every sensor.
pub fn cells(quantity: Quantity, counts: Option<i16>) -> [String; 2] {
    match counts {
        None => ["--".into(), "--".into()],
        Some(OVERFLOW) if quantity == Quantity::Field => ["ovf".into(), "ovf".into()],
        Some(counts) => [counts.to_string(), format!("{:.2}", value(quantity, counts))],
    }
}

/// Bytes in the unit a reader grasps.
pub fn size(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} B"),
        10_000..10_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_draws_its_own_channels() {
        let names = |group: Group, plate| -> Vec<_> {
            let curves = group.curves(plate).into_iter();
            curves.map(|(index, label)| (CHANNELS[index].name, label)).collect()
        };
        assert_eq!(
            names(Group::Accelerometers, 1),
            [("a2x", "x"), ("a2y", "y"), ("a2z", "z")]
        );
        assert_eq!(
            names(Group::Magnetometers, 3),
            [("m4x", "x"), ("m4y", "y"), ("m4z", "z")]
        );
        assert_eq!(
            names(Group::Gyros, 3),
            [("g1", "1"), ("g2", "2"), ("g3", "3"), ("g4", "4")]
        );
        assert_eq!(
            names(Group::Temperatures, 0),
            [("t1", "1"), ("t2", "2"), ("t3", "3"), ("t4", "4")]
        );
    }

    #[test]
    fn values_are_written_in_the_engineers_units() {
        assert_eq!(cells(Quantity::SpecificForce, Some(-333)), ["-333", "-9.80"]);
        assert_eq!(cells(Quantity::Rate, Some(2203)), ["2203", "161.39"]);
        assert_eq!(cells(Quantity::Temperature, Some(402)), ["402", "25.12"]);
        assert_eq!(cells(Quantity::Field, Some(-4096)), ["ovf", "ovf"]);
        assert_eq!(cells(Quantity::Rate, Some(-4096)), ["-4096", "-300.07"]);
        assert_eq!(cells(Quantity::Rate, None), ["--", "--"]);
    }

    #[test]
    fn four_tabs_go_round() {
        let round: Vec<_> = std::iter::successors(Some(GROUPS[0]), |group| Some(group.next()))
            .take(5)
            .collect();
        assert_eq!(round[..4], GROUPS);
        assert_eq!(round[4], GROUPS[0]);
    }

    #[test]
    fn sizes_are_short() {
        assert_eq!([9_999, 12_345, 12_345_678].map(size), ["9999 B", "12.3 kB", "12.3 MB"]);
    }

    #[test]
    fn failed_sensors_are_named_by_kind_and_plate() {
        let check = |errors, names: &str| assert_eq!(failed_names(Errors(errors)), names);
        check(0, "");
        check(0x8001, "acc 1, temp 4");
        check(0x020F, "acc 1-4, gyro 2");
        check(0x0060, "mag 2 3");
        check(0xFFFF, "acc 1-4, mag 1-4, gyro 1-4, temp 1-4");
    }
}
