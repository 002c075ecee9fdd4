//! Whether a table of physical values can be in the units of the unit's description.
//!
//! In: the rows of a `csv` log, the channels of the description. Out: nothing, or what is wrong and which unit it looks like
//! ([`packets::magnitude`]); and for thermometers whether the table holds degrees or, as the description's bias has them,
//! degrees above the code's zero. The table `si.csv` of a flight holds degrees.

use packets::magnitude::{self, Kind, digits};
use twin::predict;

use crate::input::log::Column;

/// \[degC\] a bias beyond which a thermometer's zero is elsewhere: no part is that far off (TMP102 3 K, ADIS16265 5 K).
const OTHER_ZERO_C: f64 = 10.0;

/// \[degC\] a room, where no other thermometer says how warm it is.
const ROOM_C: f64 = 20.0;

/// Share of samples beyond a part's range before the numbers are in doubt. A clipped one stands at the range and none beyond; a
/// range that is described a little too small, with a magnet held to it for a while, is another matter.
const BEYOND: f64 = 0.2;

/// Relative. Ranges are written with few digits.
const RANGE: f64 = 1.05;

/// Rows of a log that can say anything.
const LEAST_ROWS: usize = 16;

/// What to add to the samples of each channel so that they are as the description has them: its bias, for a thermometer whose
/// table holds degrees.
pub fn zeros(columns: &[Column], values: &[Vec<f64>]) -> Vec<f64> {
    let medians: Vec<Option<f64>> = values
        .iter()
        .map(|own| magnitude::median(own.iter().copied()))
        .collect();
    let is_other = |column: &Column| column.sensor == predict::Kind::Thermometer && column.bias.abs() > OTHER_ZERO_C;
    let plain = columns
        .iter()
        .zip(&medians)
        .filter(|(column, _)| column.sensor == predict::Kind::Thermometer && !is_other(column));
    let warm_c = magnitude::median(plain.filter_map(|(_, median)| *median)).unwrap_or(ROOM_C);
    let zero = |(column, median): (&Column, &Option<f64>)| match median {
        Some(median) if is_other(column) && (median - warm_c).abs() < (median - column.bias - warm_c).abs() => {
            column.bias
        }
        _ => 0.0,
    };
    columns.iter().zip(&medians).map(zero).collect()
}

/// What is wrong with times or values: of which channel, and why.
pub fn doubt(
    columns: &[Column],
    times_s: &[f64],
    values: &[Vec<f64>],
    cycle_s: Option<f64>,
) -> Option<(String, String)> {
    if times_s.len() < LEAST_ROWS {
        return Some((
            "rows".into(),
            format!("are {}; at least {LEAST_ROWS} are needed", times_s.len()),
        ));
    }
    let step_s = magnitude::median(times_s.windows(2).map(|pair| pair[1] - pair[0]))?;
    let seconds = [(Kind::Time, Kind::Time.base())];
    if let Some(cycle_s) = cycle_s
        && let Some((_, unit)) = magnitude::likely(cycle_s / step_s, &seconds)
    {
        let why = format!(
            "goes by {} from row to row, and the unit's cycle is {cycle_s} s: it looks like {}; write seconds",
            digits(step_s),
            unit.name
        );
        return Some(("t_s".into(), why));
    }
    for (column, own) in columns.iter().zip(values) {
        let Some(kind) = kind(column.sensor) else { continue };
        let most = column.range[0].abs().max(column.range[1].abs()) * RANGE;
        let beyond = own.iter().filter(|value| value.abs() > most).count();
        let largest = own.iter().map(|value| value.abs()).fold(0.0, f64::max);
        if beyond as f64 > BEYOND * own.len() as f64
            && let Err(doubt) = magnitude::judge("", kind, kind.base(), largest, 0.0..=most)
        {
            let likely = doubt
                .likely
                .map_or(String::new(), |unit| format!("; it looks like {}", unit.name));
            let why = format!(
                "reaches {}, and its part at most {}{likely}: write {}",
                digits(largest),
                digits(most / RANGE),
                kind.base().name
            );
            return Some((column.name.clone(), why));
        }
    }
    force(columns, values)
}

/// Specific force over all accelerometers, whose axes look every way: its norm is sqrt(3) times the root mean square.
fn force(columns: &[Column], values: &[Vec<f64>]) -> Option<(String, String)> {
    let own = columns
        .iter()
        .zip(values)
        .filter(|(column, _)| column.sensor == predict::Kind::Accelerometer);
    let own: Vec<&Vec<f64>> = own.map(|(_, own)| own).collect();
    if own.len() < 3 {
        return None;
    }
    let squares = own
        .iter()
        .filter_map(|own| magnitude::median(own.iter().map(|value| value * value)));
    let norm = (3.0 * squares.sum::<f64>() / own.len() as f64).sqrt();
    let doubt = magnitude::judge("", Kind::Force, Kind::Force.base(), norm, Kind::Force.possible()).err()?;
    // Free fall is near nothing and no unit's fault; what another unit explains is one.
    let unit = doubt.likely?;
    Some((
        "accelerometers".into(),
        format!(
            "feel {} m/s2 on the whole: it looks like {}; write m/s2",
            digits(norm),
            unit.name
        ),
    ))
}

fn kind(sensor: predict::Kind) -> Option<Kind> {
    match sensor {
        predict::Kind::Accelerometer => Some(Kind::Force),
        predict::Kind::Gyro => Some(Kind::Rate),
        predict::Kind::Magnetometer => Some(Kind::Field),
        predict::Kind::Thermometer => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, sensor: predict::Kind, range: f64, bias: f64) -> Column {
        Column {
            name: name.into(),
            lsb: 0.1,
            sensor,
            bias,
            range: [-range, range],
            code_range: None,
            overflow_counts: None,
        }
    }

    fn times(step: f64) -> Vec<f64> {
        (0..50).map(|k| step * f64::from(k)).collect()
    }

    #[test]
    fn a_thermometer_in_degrees_is_told_from_one_above_its_codes_zero() {
        use predict::Kind::Thermometer;
        let columns = [
            column("t1", Thermometer, 125.0, 0.0),
            column("tg1", Thermometer, 100.0, -25.0),
        ];
        assert_eq!(zeros(&columns, &[vec![26.0; 9], vec![26.5; 9]]), [0.0, -25.0]);
        assert_eq!(zeros(&columns, &[vec![26.0; 9], vec![1.5; 9]]), [0.0, 0.0]);
    }

    #[test]
    fn a_table_in_another_unit_is_refused_by_channel() {
        use predict::Kind::{Accelerometer, Gyro};
        let gyro = [column("g1", Gyro, 5.6, 0.0)];
        let says = |columns: &[Column], step: f64, values: &[Vec<f64>], words: &str| {
            let (_, why) = doubt(columns, &times(step), values, Some(0.2)).expect(words);
            assert!(why.contains(words), "{why}");
        };
        says(&gyro, 0.2, &[vec![40.0; 50]], "looks like deg/s");
        says(&gyro, 200.0, &[vec![0.4; 50]], "looks like ms");
        let acc = ["a1x", "a1y", "a1z"].map(|name| column(name, Accelerometer, 58.8, 0.0));
        says(
            &acc,
            0.2,
            &[vec![0.6; 50], vec![0.6; 50], vec![0.5; 50]],
            "looks like g",
        );
        assert_eq!(
            doubt(
                &acc,
                &times(0.2),
                &[vec![5.7; 50], vec![5.7; 50], vec![5.6; 50]],
                Some(0.2)
            ),
            None
        );
        assert_eq!(
            doubt(&acc, &times(0.2), &vec![vec![0.01; 50]; 3], None),
            None,
            "free fall"
        );
        assert!(doubt(&gyro, &times(0.2)[..3], &[vec![0.1; 3]], None).is_some());
    }
}
