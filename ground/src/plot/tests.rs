//! What the figures hold: checked on the SVG's text, seen by eye elsewhere.

use emems::sample::{Errors, NOT_READ, Reading};

use super::*;
use packets::stream::sequence::Step;

fn reading(value: i16) -> Reading {
    Reading {
        errors: Errors(0),
        acc_p: [[value; 3]; 4],
        mag_p: [[value; 3]; 4],
        gyro: [value; 4],
        gyro_temperature: [0; 4],
        temperature: [400; 4],
        ..Reading::unread(0)
    }
}

fn drawn(packets: impl IntoIterator<Item = (u64, Reading)>) -> Vec<Figure> {
    let (mut envelope, mut summary) = (Envelope::default(), Summary::default());
    for (number, reading) in packets {
        envelope.add(number, &reading, 0, Some(0.2));
        summary.packet(&reading, Step::Next, Some(0.2));
    }
    figures(&envelope, 0.2, &summary).expect("figures")
}

fn lines(figure: &Figure) -> usize {
    figure
        .svg
        .matches(&format!("stroke=\"{}\"", hex(XYZ[0]).to_uppercase()))
        .count()
}

#[test]
fn every_sensor_has_its_figure() {
    let figures = drawn((0..50).map(|number| (number, reading(number as i16))));
    let titles: Vec<&str> = figures.iter().map(|figure| figure.title.as_str()).collect();
    assert_eq!(
        titles,
        [
            "Accelerometers [m/s²]",
            "Magnetometers [µT]",
            "Gyros [rad/s]",
            "Temperatures [°C]",
            "Packet period minus its mean of 200.000 ms [µs]",
        ]
    );
    assert_eq!(lines(&figures[0]), 4, "one x line a plate");
    assert!(figures[0].svg.contains("plate 4"));
}

#[test]
fn a_value_that_was_not_read_breaks_its_line() {
    let figures = drawn((0..50).map(|number| {
        let mut reading = reading(number as i16);
        if (20..25).contains(&number) {
            (reading.gyro[1], reading.errors) = (NOT_READ, Errors(1 << 9));
        }
        (number, reading)
    }));
    assert_eq!(lines(&figures[2]), 5, "the line of gyro 2 is in two parts");
    assert!(figures[2].legend.iter().any(|(_, meaning)| *meaning == "sensor failed"));
    assert!(!figures[0].legend.iter().any(|(_, meaning)| *meaning == "sensor failed"));
}

#[test]
fn a_day_is_drawn_small() {
    const MOST_BYTES: usize = 2_000_000;
    let figures = drawn((0..432_000).map(|number| (number, reading((number * 7919 % 4001) as i16))));
    let bytes: usize = figures.iter().map(|figure| figure.svg.len()).sum();
    assert!(bytes < MOST_BYTES, "{bytes}");
    assert!(figures[0].svg.contains("time [h]"));
}

#[test]
fn a_flight_without_packets_has_no_figures_and_one_packet_has_all() {
    assert!(drawn([]).is_empty());
    assert_eq!(drawn([(7, reading(3))]).len(), 5);
}

#[test]
fn nothing_but_unread_values_can_be_drawn_too() {
    assert_eq!(drawn((0..3).map(|number| (number, Reading::unread(0)))).len(), 5);
}
