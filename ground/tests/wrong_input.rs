//! Eleven inputs that were once answered wrongly with "good" and exit code 0: each is refused or called not good, with the reason.
//! The table in docs/figures.md says what of each.

use std::{fmt::Write, fs, path::Path, process::Command};

/// What the program said, on both outputs, and its exit code.
struct Answer {
    text: String,
    code: Option<i32>,
}

struct Bench {
    place: tempfile::TempDir,
    unit: String,
    channels: Vec<Channel>,
}

struct Channel {
    name: String,
    axis_b: [f64; 3],
    lsb: f64,
}

const GRAVITY: f64 = 9.80665;

impl Bench {
    /// A folder with a flight in it, and the description of the unit that flew.
    fn new() -> Bench {
        let place = tempfile::tempdir().expect("temporary folder");
        let flown = ground(
            place.path(),
            "fly --host --motion tumble --duration 30s --derived --out flights",
        );
        assert_eq!(flown.code, Some(0), "{}", flown.text);
        let unit = "flights/tumble-1/unit.toml".to_string();
        let text = fs::read_to_string(place.path().join(&unit)).expect("unit.toml");
        let table: toml::Table = text.parse().expect("TOML");
        let channels = table["channel"].as_array().expect("channels").iter();
        let channels = channels
            .map(|channel| {
                let axis = channel["axis_b"].as_array();
                Channel {
                    name: channel["name"].as_str().expect("name").into(),
                    axis_b: std::array::from_fn(|k| axis.map_or(0.0, |axis| axis[k].as_float().expect("number"))),
                    lsb: channel["lsb"].as_float().expect("lsb"),
                }
            })
            .collect();
        Bench { place, unit, channels }
    }

    fn run(&self, words: &str) -> Answer {
        ground(self.place.path(), &words.replace("UNIT", &self.unit))
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.place.path().join(name), text).expect("written");
    }

    /// What the nominal unit's channel reads, in counts, with `hum` that no two rows share.
    fn counts(&self, channel: &str, vector: [f64; 3], row: usize) -> f64 {
        let channel = self.channels.iter().find(|known| known.name == channel).expect(channel);
        let along: f64 = channel
            .axis_b
            .iter()
            .zip(vector)
            .map(|(axis, value)| axis * value)
            .sum();
        let hum = 0.3 * (7.3 * row as f64 + 3.1 * channel.name.len() as f64 + channel.axis_b[0]).sin();
        along / channel.lsb + hum
    }

    /// A table of a bench: `told` times each vector under the heads, and the channels' counts after `spoilt`.
    fn table(
        &self,
        heads: &str,
        told: f64,
        channels: &[&str],
        vectors: &[[f64; 3]],
        spoilt: impl Fn(&str, usize, f64) -> f64,
    ) -> String {
        let mut text = format!("{heads},{}\n", channels.join(","));
        for (row, vector) in vectors.iter().enumerate() {
            let mut cells: Vec<String> = vector.iter().map(|value| (value * told).to_string()).collect();
            let counts = channels
                .iter()
                .map(|name| spoilt(name, row, self.counts(name, *vector, row)));
            cells.extend(counts.map(|counts| format!("{counts:.3}")));
            writeln!(text, "{}", cells.join(",")).expect("to a string");
        }
        text
    }
}

fn ground(place: &Path, words: &str) -> Answer {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ground"));
    let output = command
        .args(words.split(' '))
        .current_dir(place)
        .output()
        .expect("runs");
    let text = [output.stdout, output.stderr].concat();
    Answer {
        text: String::from_utf8_lossy(&text).into_owned(),
        code: output.status.code(),
    }
}

fn as_read(_: &str, _: usize, counts: f64) -> f64 {
    counts
}

/// \[rad/s\] both ways about each axis at three rates.
fn rates() -> Vec<[f64; 3]> {
    let signed = [-200.0, -100.0, -40.0, 40.0, 100.0, 200.0_f64];
    let about =
        |axis: usize| signed.map(|rate| std::array::from_fn(|k| if k == axis { rate.to_radians() } else { 0.0 }));
    (0..3).flat_map(about).collect()
}

/// `count` directions that cover the sphere, of this length. Their order goes with no axis: a drift along rows that are sorted by what is
/// applied is a scale, to anyone.
fn sphere(count: usize, length: f64) -> Vec<[f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let place = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        [flat * cos, flat * sin, z].map(|value| value * length)
    };
    // Seven and the counts used here share no factor.
    (0..count).map(|k| place(7 * k % count)).collect()
}

#[test]
fn eleven_wrong_inputs_are_named() {
    let bench = Bench::new();
    let gyros = ["g1", "g2", "g3", "g4"];
    let degrees = 1f64.to_degrees();
    let (rad_s, deg_s) = ("wx_rad_s,wy_rad_s,wz_rad_s", "wx_deg_s,wy_deg_s,wz_deg_s");
    bench.write("good.csv", &bench.table(rad_s, 1.0, &gyros, &rates(), as_read));
    bench.write("degrees.csv", &bench.table(rad_s, degrees, &gyros, &rates(), as_read));
    bench.write("radians.csv", &bench.table(deg_s, 1.0, &gyros, &rates(), as_read));
    let halved = |name: &str, _: usize, counts: f64| if name == "g3" { counts / 2.0 } else { counts };
    bench.write("half.csv", &bench.table(rad_s, 1.0, &gyros, &rates(), halved));

    let (plate, poses) = (["a1x", "a1y", "a1z"], sphere(24, GRAVITY));
    let force = "fx_m_s2,fy_m_s2,fz_m_s2";
    bench.write("poses.csv", &bench.table(force, 1.0, &plate, &poses, as_read));
    bench.write("g.csv", &bench.table(force, 1.0 / GRAVITY, &plate, &poses, as_read));
    let drifting = |_: &str, row: usize, counts: f64| counts + row as f64;
    let stated = bench
        .table(force, 1.0, &plate, &poses, drifting)
        .replace('\n', ",0.05,0.05,0.05\n");
    let stated = stated.replacen(",0.05,0.05,0.05", ",a1x_sigma,a1y_sigma,a1z_sigma", 1);
    bench.write("drift.csv", &stated);

    let field = sphere(400, 23.2);
    let magnetometers = ["m1x", "m1y", "m1z", "m2y"];
    bench.write("field.csv", &bench.table("x,y,z", 1.0, &magnetometers, &field, as_read));
    bench.write("scale.csv", "rate,output\n-2,-1\n-1,-.5\n0,0\n1,.5\n2,3\n");

    let mut still = "t_s,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,mag_x,mag_y,mag_z\n".to_string();
    let (mut slow, mut turning) = (still.clone(), still.clone());
    for k in 0..400 {
        let t_s = 0.02 * f64::from(k);
        let rest = "0,0,-9.81,20,0,40";
        writeln!(still, "{t_s},0,0,0.5,{rest}").expect("to a string");
        writeln!(turning, "{t_s},0,0,{},{rest}", 50.0).expect("to a string");
        writeln!(slow, "{},0,0,0.5,{rest}", t_s * 1000.0).expect("to a string");
    }
    bench.write("still.csv", &still);
    bench.write("turning.csv", &turning);
    bench.write("slow.csv", &slow);

    // That the good ones are good is what makes the others a test of what is wrong with them.
    for words in [
        "calibrate rate-table good.csv --channels g1,g2,g3,g4 --unit UNIT",
        "calibrate multi-position poses.csv --channels a1x,a1y,a1z --unit UNIT",
        "calibrate ellipsoid field.csv --channels m1x,m1y,m1z --strength 23.2 --unit UNIT",
        "decode flights/tumble-1/packets.txt",
    ] {
        let answer = bench.run(words);
        assert_eq!(answer.code, Some(0), "{words}: {}", answer.text);
    }
    for (words, code, says) in [
        (
            "calibrate rate-table degrees.csv --channels g1,g2,g3,g4 --unit UNIT --set s.toml",
            2,
            "it looks like deg/s",
        ),
        (
            "calibrate rate-table radians.csv --channels g1,g2,g3,g4 --unit UNIT --set s.toml",
            1,
            "the excitation looks like rad/s",
        ),
        (
            "calibrate multi-position g.csv --channels a1x,a1y,a1z --unit UNIT --set s.toml",
            2,
            "it looks like g",
        ),
        (
            "calibrate ellipsoid field.csv --channels m1x,m1y,m1z --strength 0.232 --unit UNIT --set s.toml",
            2,
            "is it gauss",
        ),
        (
            "calibrate ellipsoid field.csv --channels m1x,m2y,m1z --strength 23.2 --unit UNIT --set s.toml",
            1,
            "m1x, m2y, m1z are not the axes of one sensor",
        ),
        (
            "calibrate rate-table half.csv --channels g1,g2,g3,g4 --unit UNIT --set s.toml",
            1,
            "wrong   g3",
        ),
        (
            "calibrate multi-position drift.csv --channels a1x,a1y,a1z --unit UNIT --set s.toml",
            1,
            "times the sigma of 0.05 that the table states",
        ),
        ("allan flights/tumble-1/si.csv --time t_s", 1, "the record moves"),
        (
            "calibrate drift --scale scale.csv",
            1,
            "row 5 (rate 2) lies 44 % of full scale from the straight line",
        ),
        (
            "decode flights/tumble-1/packets.txt --cycle 20ms",
            2,
            "the derived frames say 200.000 ms",
        ),
        ("attitude turning.csv", 2, "it looks like deg/s"),
        ("attitude slow.csv", 2, "it looks like ms"),
    ] {
        let answer = bench.run(words);
        assert_eq!(answer.code, Some(code), "{words}: {}", answer.text);
        assert!(answer.text.contains(says), "{words}: {}", answer.text);
        assert!(
            !bench.place.path().join("s.toml").exists(),
            "{words}: a set was written"
        );
    }
    let good = bench.run("attitude still.csv");
    assert!(!good.text.contains("it looks like"), "{}", good.text);
}
