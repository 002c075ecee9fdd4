//! What the figures hold: checked on the page's text; a browser looks at pages in `tests/pages.rs`.

use emems::sample::{Errors, NOT_READ, Reading};
use packets::stream::{Item, sequence::Step};

use super::*;

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

fn recorded(packets: impl IntoIterator<Item = (u64, Reading)>) -> Record {
    let mut record = Record {
        attitude: None,
        ..Record::default()
    };
    for (number, reading) in packets {
        let item = Item::Packet { offset: 0, reading };
        record.packet(number, Step::Next, &item, Some(0.2));
    }
    record
}

fn drawn(packets: impl IntoIterator<Item = (u64, Reading)>) -> Vec<Figure> {
    let blocks = blocks(&recorded(packets), 0.2, None).expect("figures");
    let figures = blocks.into_iter().filter_map(|block| match block {
        Block::Figure(figure) => Some(figure),
        _ => None,
    });
    figures.collect()
}

fn page(figures: &[Figure]) -> String {
    let blocks: Vec<Block> = figures.iter().cloned().map(Block::Figure).collect();
    chart::html("", "", &blocks)
}

#[test]
fn every_sensor_has_its_figure() {
    let figures = drawn((0..500).map(|number| (number, reading(number as i16 % 90))));
    let titles: Vec<&str> = figures.iter().map(Figure::title).collect();
    assert_eq!(
        titles,
        [
            "Accelerometers",
            "Magnetometers",
            "Gyros",
            "Temperatures",
            "Spectra",
            "Packet period minus its mean of 200.000 ms",
        ]
    );
    let page = page(&figures[..1]);
    assert_eq!(
        page.matches("<g class=\"c0\"><path class=\"line\"").count(),
        4,
        "one x line a plate"
    );
    assert!(page.contains("plate 4") && page.contains("[m/s²]"));
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
    let lines = |page: &str| -> Vec<usize> {
        let parts = page.split("<path class=\"line\" d=\"").skip(1);
        parts
            .filter_map(|part| Some(part.split('"').next()?.matches('M').count()))
            .collect()
    };
    assert_eq!(
        lines(&page(&figures[2..3])),
        [1, 2, 1, 1],
        "the line of gyro 2 is in two parts"
    );
    assert!(figures[2].legend().contains(&"sensor failed"));
    assert!(!figures[0].legend().contains(&"sensor failed"));
}

#[test]
fn a_day_is_drawn_small() {
    const MOST_BYTES: usize = 2_000_000;
    let figures = drawn((0..432_000).map(|number| (number, reading((number * 7919 % 2001) as i16))));
    let page = page(&figures);
    assert!(page.len() < MOST_BYTES, "{}", page.len());
    assert!(page.contains("time [h]"));
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
