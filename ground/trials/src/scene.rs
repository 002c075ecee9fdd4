//! A trial before it is flown: the world, what the parts see of it, what becomes of the stream, what the record says.
//!
//! A [`Scene`] starts as a unit that is off its description only as far as its calibration sigmas allow; disturbances
//! then change one thing or another. All views are functions of time since power-on.

use std::sync::Arc;

use emems::sample::Reading;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use packets::channel::{CHANNELS, Quantity};
use twin::{
    environment::{Environment, World},
    geometry,
    motion::Motion,
    part::Input,
    plant::Views,
    truth::TruthSource,
};

use crate::{answer::Size, draw::Draw, followed::Followed, motion::Wander, unit::kind};

/// \[s\] of a dealt case.
pub(crate) const DURATION_S: f64 = 600.0;

/// \[s\] step of the tables of slow filters.
const STEP_S: f64 = 2e-3;

/// What the truth instrument writes for an instant: attitude q_nb and position in n.
pub type Record = Arc<dyn Fn(f64) -> (UnitQuaternion<f64>, Vector3<f64>) + Send + Sync>;

/// Something that happens to the packets between the unit and the file.
pub type Transit = Box<dyn Fn(&mut Vec<Reading>) + Send + Sync>;

/// A trial before it is flown.
pub struct Scene {
    /// How the unit really moves.
    pub motion: Arc<dyn Followed>,
    /// \[s\] for how long.
    pub duration_s: f64,
    /// Where.
    pub site: Environment,
    /// Truth at the centre.
    pub source: Arc<dyn TruthSource>,
    /// What the parts see.
    pub views: Views,
    /// What happens to the packets, in order.
    pub transit: Vec<Transit>,
    /// What the truth instrument writes.
    pub record: Record,
    /// The environment as the case states it.
    pub claimed: Environment,
    /// Sizes of what is wrong that verdicts state too.
    pub sizes: Vec<Size>,
    /// How large what is wrong is on the whole, where no verdict states it; in SI, field in uT.
    pub magnitude: Option<f64>,
}

impl Scene {
    /// A unit whose parts see this of a motion; nothing is wrong with it.
    pub fn of(motion: Arc<dyn Followed>, duration_s: f64, site: Environment, views: Views) -> Self {
        let source: Arc<dyn TruthSource> = Arc::new(World {
            motion: motion.clone() as Arc<dyn Motion>,
            environment: site,
        });
        let followed = motion.clone();
        Scene {
            motion,
            duration_s,
            site,
            source,
            views,
            transit: Vec::new(),
            record: Arc::new(move |t_s| (followed.at(t_s).attitude.q_nb, followed.position_n(t_s))),
            claimed: site,
            sizes: Vec::new(),
            magnitude: None,
        }
    }

    /// How much longer it is than a dealt case: what happens at drawn instants happens within it.
    pub fn pace(&self) -> f64 {
        self.duration_s / DURATION_S
    }

    /// The undisturbed unit of a draw: scales and axes off by their sigmas.
    pub fn new(motion: Wander, site: Environment, draw: &mut Draw) -> Self {
        Self::moved(Arc::new(motion), site, draw)
    }

    /// The same along any motion.
    pub fn moved(motion: Arc<dyn Followed>, site: Environment, draw: &mut Draw) -> Self {
        let source: Arc<dyn TruthSource> = Arc::new(World {
            motion: motion.clone() as Arc<dyn Motion>,
            environment: site,
        });
        let mut views = Views::of(&source);
        for plate in 0..geometry::PLATES {
            let force = imperfect(Quantity::SpecificForce, draw);
            views.force_p[plate] = changed(&views.force_p[plate], move |_, force_p| force * force_p);
            let field = imperfect(Quantity::Field, draw);
            views.field_p_ut[plate] = changed(&views.field_p_ut[plate], move |_, field_p| field * field_p);
            let facts = kind(Quantity::Rate);
            let (scale, tilt) = (1.0 + facts.scale * draw.normal(), facts.axis_rad * draw.vector());
            let (source, axis_b) = (source.clone(), geometry::gyro_axis_b(plate));
            let tilt = tilt - axis_b * axis_b.dot(&tilt);
            views.rate[plate] = Arc::new(move |t_s| scale * (axis_b + tilt).dot(&source.at(t_s).rate_b));
        }
        Scene::of(motion, DURATION_S, site, views)
    }

    /// Notes a size that all channels touched have.
    pub fn size(&mut self, parameter: &str, value: f64) {
        self.sizes.push(Size {
            parameter: parameter.to_owned(),
            channel: None,
            value,
        });
    }

    /// Notes one of each axis of a plate's sensor.
    pub fn sizes_of(&mut self, parameter: &str, quantity: Quantity, plate: usize, values: &[f64]) {
        let own = CHANNELS
            .iter()
            .filter(|channel| channel.quantity == quantity && channel.plate == plate);
        self.sizes.extend(own.zip(values).map(|(channel, value)| Size {
            parameter: parameter.to_owned(),
            channel: Some(channel.name.to_owned()),
            value: *value,
        }));
    }
}

/// Scale and axis errors of a part of three axes.
fn imperfect(quantity: Quantity, draw: &mut Draw) -> Matrix3<f64> {
    let facts = kind(quantity);
    Matrix3::from_fn(|row, column| match row == column {
        true => 1.0 + facts.scale * draw.normal(),
        false => facts.axis_rad * draw.normal(),
    })
}

/// A view with something done to what it shows; the change sees the time.
pub fn changed<T: 'static>(view: &Input<T>, change: impl Fn(f64, T) -> T + Send + Sync + 'static) -> Input<T> {
    let view = view.clone();
    Arc::new(move |t_s| change(t_s, view(t_s)))
}

/// A view at another time than the present.
pub fn shifted<T: 'static>(view: &Input<T>, time: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Input<T> {
    let view = view.clone();
    Arc::new(move |t_s| view(time(t_s)))
}

/// A view through a first-order lag: the mean of the past under exp(-s/tau)/tau, by Gauss and Laguerre with five nodes
/// (Abramowitz and Stegun, table 25.9), exact for a view that is a polynomial of the ninth degree over some lags.
pub fn lagged<T>(view: &Input<T>, tau_s: f64) -> Input<T>
where
    T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T> + 'static,
{
    const NODES: [(f64, f64); 4] = [
        (1.413_403_059_107, 0.398_666_811_083),
        (3.596_425_771_041, 0.075_942_449_681_7),
        (7.085_810_005_859, 0.003_611_758_679_92),
        (12.640_800_844_276, 2.336_997_238_58e-5),
    ];
    const FIRST: (f64, f64) = (0.263_560_319_718, 0.521_755_610_583);
    let view = view.clone();
    Arc::new(move |t_s| {
        let at = |(node, weight): (f64, f64)| view(t_s - node * tau_s) * weight;
        NODES.into_iter().fold(at(FIRST), |sum, node| sum + at(node))
    })
}

/// A view through a first-order lag of any length, settled when it begins; a table up to `to_s`, exact for a view that is
/// straight over [`STEP_S`].
pub fn slow(view: &Input<Vector3<f64>>, tau_s: f64, to_s: f64) -> Input<Vector3<f64>> {
    let steps = (to_s / STEP_S).ceil() as usize;
    let decay = (-STEP_S / tau_s).exp();
    // Of y' = (u - y)/tau over a step in which u is straight.
    let later = 1.0 - tau_s / STEP_S * (1.0 - decay);
    let mut state = view(0.0);
    let mut table = vec![state];
    for step in 1..=steps {
        let [from, to] = [step - 1, step].map(|step| view(step as f64 * STEP_S));
        state = state * decay + from * (1.0 - decay - later) + to * later;
        table.push(state);
    }
    tabled(table)
}

/// How far friction leans on each axis of a view, from -1 to 1, up to `to_s`: what Dahl (A solid friction model, 1968) has
/// for a bristle, dz/du = (1 - z sign du) / `way`, solved exactly over a step in which the view is straight.
pub fn rubbed(view: &Input<Vector3<f64>>, way: f64, to_s: f64) -> Input<Vector3<f64>> {
    let steps = (to_s / STEP_S).ceil() as usize;
    let (mut lean, mut before) = (Vector3::zeros(), view(0.0));
    let mut table = vec![lean];
    for step in 1..=steps {
        let now = view(step as f64 * STEP_S);
        lean = (now - before).zip_map(&lean, |gone, lean: f64| {
            let side = if gone == 0.0 { lean } else { gone.signum() };
            side + (lean - side) * (-gone.abs() / way).exp()
        });
        before = now;
        table.push(lean);
    }
    tabled(table)
}

/// What a table says at every [`STEP_S`], straight between; it has two entries at least.
fn tabled(table: Vec<Vector3<f64>>) -> Input<Vector3<f64>> {
    let steps = table.len() - 1;
    Arc::new(move |t_s| {
        let place = (t_s / STEP_S).clamp(0.0, steps as f64);
        let at = (place as usize).min(steps - 1);
        table[at].lerp(&table[at + 1], place - at as f64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_of_a_sine_is_the_filters() {
        let (tau, w) = (0.05, 4.0_f64);
        let sine: Input<f64> = Arc::new(move |t: f64| (w * t).sin());
        let lagged = lagged(&sine, tau);
        for step in 0..50 {
            let t = 0.1 * f64::from(step);
            let exact = ((w * t).sin() - w * tau * (w * t).cos()) / (1.0 + (w * tau).powi(2));
            assert!((lagged(t) - exact).abs() < 1e-6, "{} {exact}", lagged(t));
        }
    }
    #[test]
    fn a_slow_lag_of_a_step_is_an_exponential_and_of_a_sine_the_filters() {
        let tau = 1.5;
        let step: Input<Vector3<f64>> = Arc::new(|t| Vector3::x() * f64::from(t > 3.0));
        let lagging = slow(&step, tau, 20.0);
        assert_eq!(lagging(2.9), Vector3::zeros());
        let w = 2.0_f64;
        let sine: Input<Vector3<f64>> = Arc::new(move |t: f64| Vector3::x() * (w * t).sin());
        let hummed = slow(&sine, tau, 60.0);
        for at in 0..100 {
            let t = 4.0 + 0.1 * f64::from(at);
            let exact = 1.0 - (-(t - 3.0) / tau).exp();
            assert!((lagging(t).x - exact).abs() < 1e-3, "at {t}");
            let t = t + 40.0;
            let exact = (w * t - (w * tau).atan()).sin() / (1.0 + (w * tau).powi(2)).sqrt();
            assert!((hummed(t).x - exact).abs() < 1e-5, "at {t}");
        }
    }

    #[test]
    fn friction_leans_against_the_way_gone_and_stays_where_nothing_moves() {
        // Up by three ways in 3 s, rest for 1 s, down again.
        let (way, rise) = (0.5, 1.5);
        let hill: Input<Vector3<f64>> =
            Arc::new(move |t: f64| Vector3::x() * rise * (t.min(3.0) - (t - 4.0).clamp(0.0, 3.0)) / 3.0);
        let leaning = rubbed(&hill, way, 8.0);
        let up = 1.0 - (-rise / way).exp();
        assert!((leaning(3.0).x - up).abs() < 1e-9);
        assert!((leaning(3.99).x - up).abs() < 1e-9);
        assert!((leaning(5.0).x - ((1.0 + up) * (-rise / 3.0 / way).exp() - 1.0)).abs() < 1e-9);
        assert_eq!(leaning(5.0).y, 0.0);
    }
}
