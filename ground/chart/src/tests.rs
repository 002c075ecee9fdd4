//! What a figure holds: checked on the page's text; a browser looks at pages in `ground/tests/pages.rs`.

use super::*;

fn panel(points: Vec<(f64, f64)>) -> Panel {
    Panel {
        layers: vec![Layer::new("a", 0, Marks::Line(points))],
        ..Panel::default()
    }
}

fn page(panels: &[Panel]) -> String {
    html("t", "", &[Block::Figure(Figure::of("t", 1, panels).unwrap())])
}

/// Moves to in the line of the picture.
fn runs(page: &str) -> usize {
    let line = page
        .split("<path class=\"line\" d=\"")
        .nth(1)
        .and_then(|rest| rest.split('"').next());
    line.unwrap_or_default().matches('M').count()
}

#[test]
fn numbers_that_are_none_break_a_line_and_nothing_else() {
    let whole = page(&[panel(vec![(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)])]);
    let broken = page(&[panel(vec![
        (0.0, 0.0),
        (1.0, 1.0),
        (1.5, f64::NAN),
        (2.0, 2.0),
        (3.0, 3.0),
    ])]);
    assert_eq!((runs(&whole), runs(&broken)), (1, 2));
    assert!(!broken.split("<script").next().unwrap().contains("NaN"));
}

#[test]
fn nothing_to_draw_is_an_empty_panel() {
    for points in [vec![], vec![(f64::INFINITY, 1.0)], vec![(0.0, f64::NAN)]] {
        assert!(page(&[panel(points)]).contains("<svg"));
    }
    assert!(Figure::of("t", 0, &[]).is_ok());
    assert!(Figure::map("t", &Map::default()).is_ok());
}

#[test]
fn a_name_is_once_in_the_legend() {
    let figure = Figure::of("t", 2, &[panel(vec![(0.0, 1.0)]), panel(vec![(0.0, 2.0)])]).unwrap();
    assert_eq!(figure.legend(), ["a"]);
}

#[test]
fn a_million_points_make_a_small_page_that_keeps_the_peak() {
    let empty = page(&[panel(Vec::new())]).len();
    let weight = |page: &str| page.len() - empty;
    let mut points: Vec<(f64, f64)> = (0..1_000_000).map(|k| (f64::from(k), 0.0)).collect();
    let flat = page(&[panel(points.clone())]);
    points[654_321].1 = 1.0;
    let peak = page(&[panel(points)]);
    assert!(weight(&peak) < 200_000, "{} bytes", weight(&peak));
    assert_ne!(flat, peak);
}

#[test]
fn a_line_that_goes_back_is_refused_and_dots_are_not() {
    let points = vec![(0.0, 0.0), (2.0, 1.0), (1.0, 2.0)];
    let error = Figure::of("loop", 1, &[panel(points.clone())]).expect_err("it goes back");
    assert_eq!(
        error.to_string(),
        "figure \"loop\" cannot be drawn: \"a\" goes back along x at its point 2"
    );
    let dots = Panel {
        layers: vec![Layer::new("a", 0, Marks::Dots(points))],
        ..Panel::default()
    };
    assert!(Figure::of("loop", 1, &[dots]).is_ok());
}

#[test]
fn a_map_without_a_row_for_each_name_is_refused() {
    let map = Map {
        rows: vec!["a".into()],
        ..Map::default()
    };
    assert!(Figure::map("m", &map).is_err());
}
