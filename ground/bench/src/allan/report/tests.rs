use super::{
    super::{
        analysis::{Options, analyse},
        phase::Input,
        series::Series,
        simulate::Noise,
    },
    *,
};

fn analysis() -> Analysis {
    let values = Noise {
        arw: 0.01,
        ..Noise::default()
    }
    .rate(20_000, 0.05, 31);
    let options = Options {
        input: Input::Rate,
        confidence: 0.95,
        outliers: None,
    };
    analyse(
        "g1 <x>",
        Series {
            step_s: 0.05,
            values,
            gaps: Vec::new(),
        },
        &options,
        |_| (),
    )
}

#[test]
fn the_table_has_the_columns_of_appendix_e() {
    let table = table(&analysis());
    assert_eq!(table.len(), 14);
    assert!(table.iter().all(|row| row.len() == COLUMNS.len()));
    // In the first row MDEV is ADEV and TDEV is tau / sqrt(3) of it, as in all four printed tables.
    assert_eq!((table[0][0].as_str(), &table[0][1]), ("0.05", &table[0][4]));
    let number = |cell: &str| cell.parse::<f64>().expect("a number");
    assert!((number(&table[0][5]) / number(&table[0][4]) - 0.05 / 3.0_f64.sqrt()).abs() < 1e-5);
}

#[test]
fn coefficients_come_in_customary_units() {
    let lines = coefficients(&analysis(), "deg/s");
    let walk = &lines
        .iter()
        .find(|(name, _)| name.starts_with("angle random walk"))
        .expect("a line")
        .1;
    // 0.01 deg/sqrt(s) is 0.6 deg/sqrt(h); 20,000 samples know it to about 1 %, three of which are allowed.
    let value: f64 = walk
        .split(' ')
        .next()
        .and_then(|cell| cell.parse().ok())
        .expect("a number");
    assert!((value / 0.6 - 1.0).abs() < 0.03, "{walk}");
    assert!(walk.ends_with("deg/sqrt(h)"));
    assert_eq!(customary(Term::RateWalk, "V"), (1.0, "V/sqrt(s)".into()));
}

#[test]
fn the_verdict_says_what_is_missing() {
    let said = verdict(&analysis());
    assert_eq!(said[0], "good: noise only");
    assert!(
        said[1].starts_with("next: neither bias instability nor rate random walk"),
        "{said:?}"
    );
}

#[test]
fn the_page_needs_nothing_else() {
    let page = chart::html("noise", "a record", &blocks(&analysis(), "deg/s").expect("drawn"));
    assert!(page.contains("g1 &lt;x&gt;") && page.contains("<svg") && !page.contains("href"));
}
