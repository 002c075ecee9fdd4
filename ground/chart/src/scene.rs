//! Bodies that turn: a shape in its own axes, and one or several histories of how it was turned.
//!
//! In: a [`Scene`]. World axes are right-handed and the third points down; a pose is a unit quaternion (Hamilton, scalar
//! first) that takes components in the body to components in the world. Out: pictures of a few instants, which need no script, and
//! what the script of the page turns: by a slider, by the pointer in every panel whose x axis has the same label, and seen from any side.
//!
//! A history of more than [`POSES_KEPT`] poses is shown with every k-th: poses have no least and most.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::{COLOURS, live::Store, page::escape};

/// Poses that a page holds of a history.
pub const POSES_KEPT: usize = 4_000;

/// Pictures of instants.
const INSTANTS: usize = 5;

/// \[px\] side of a picture, and the length of one unit on it.
const SIDE: f64 = 200.0;
const UNIT: f64 = 70.0;

/// \[rad\] where the viewer stands: from the first world axis towards the second, and above the plane of both.
const AZIMUTH: f64 = 3.6;
const ELEVATION: f64 = 0.45;

/// A plane face of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Corners in the body's axes, in turn; the body is about one unit large.
    pub corners: Vec<[f64; 3]>,
    /// Index into [`COLOURS`].
    pub colour: usize,
}

/// An arrow from the origin, one unit long or so.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow {
    /// Its tip.
    pub tip: [f64; 3],
    /// What stands at it.
    pub name: String,
    /// Index into [`COLOURS`].
    pub colour: usize,
}

/// A history of attitudes.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    /// Whose.
    pub name: String,
    /// Index into [`COLOURS`].
    pub colour: usize,
    /// Time, and the quaternion `(w, x, y, z)` from body to world.
    pub at: Vec<(f64, [f64; 4])>,
}

/// A body and how it turned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Label of the time axis, as the panels have it that move with it.
    pub time: String,
    /// The body.
    pub faces: Vec<Face>,
    /// Arrows fixed to the body.
    pub body: Vec<Arrow>,
    /// Arrows fixed to the world.
    pub world: Vec<Arrow>,
    /// How it turned; the first is drawn whole, the others by their edges.
    pub poses: Vec<Poses>,
}

impl Scene {
    pub(crate) fn check(&self) -> Result<(), String> {
        for poses in &self.poses {
            if poses.at.windows(2).any(|pair| pair[1].0 < pair[0].0) {
                return Err(format!("times of \"{}\" go back", poses.name));
            }
        }
        Ok(())
    }

    /// Adds it to what the script gets; its number.
    pub(crate) fn live(&self, store: &mut Store) -> usize {
        let arrows = |arrows: &[Arrow]| -> Value {
            let each = arrows.iter();
            each.map(|arrow| json!({"tip": arrow.tip, "name": arrow.name, "colour": arrow.colour % COLOURS.len()}))
                .collect()
        };
        let faces = self
            .faces
            .iter()
            .map(|face| json!({"corners": face.corners, "colour": face.colour % COLOURS.len()}));
        let histories = self.poses.iter().map(|poses| {
            let kept: Vec<&(f64, [f64; 4])> = poses.at.iter().step_by(poses.at.len().div_ceil(POSES_KEPT).max(1)).collect();
            let q: Vec<usize> = (0..4).map(|part| store.values(kept.iter().map(|(_, q)| q[part]))).collect();
            json!({
                "name": poses.name, "colour": poses.colour % COLOURS.len(), "t": store.fine(kept.iter().map(|(t, _)| *t)), "q": q,
            })
        });
        let histories: Vec<Value> = histories.collect();
        store.scenes.push(json!({
            "time": self.time, "faces": faces.collect::<Vec<_>>(), "body": arrows(&self.body), "world": arrows(&self.world),
            "poses": histories, "azimuth": AZIMUTH, "elevation": ELEVATION,
        }));
        store.scenes.len() - 1
    }

    /// Pictures of a few instants.
    pub(crate) fn pictures(&self) -> String {
        let Some(poses) = self.poses.first().filter(|poses| !poses.at.is_empty()) else {
            return "<p>no pose</p>\n".into();
        };
        let last = poses.at.len() - 1;
        let count = INSTANTS.min(last + 1);
        let mut text = String::from("<div class=\"instants\">\n");
        for k in 0..count {
            let (time, q) = poses.at[last * k / (count - 1).max(1)];
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "<svg viewBox=\"0 0 {SIDE} {0}\" role=\"img\">{1}<text x=\"{2}\" y=\"{3}\" text-anchor=\"middle\">{4}: {time:.1}</text></svg>",
                SIDE + 20.0,
                self.picture(q),
                0.5 * SIDE,
                SIDE + 12.0,
                escape(&self.time)
            );
        }
        text + "</div>\n"
    }

    fn picture(&self, q: [f64; 4]) -> String {
        let mut text = String::new();
        let arrow = |text: &mut String, arrow: &Arrow, tip: [f64; 3], class: &str| {
            let ([x, y], _) = seen(tip);
            let ([to_x, to_y], _) = seen(tip.map(|part| 1.14 * part));
            let _ = write!(
                text,
                "<g class=\"c{}\"><path class=\"{class}\" d=\"M{1} {1}L{x:.1} {y:.1}\"/><text x=\"{to_x:.1}\" y=\"{to_y:.1}\" text-anchor=\"middle\">{2}</text></g>",
                arrow.colour % COLOURS.len(),
                0.5 * SIDE,
                escape(&arrow.name)
            );
        };
        for one in &self.world {
            arrow(&mut text, one, one.tip, "line dashed");
        }
        // What is far is drawn first.
        let mut faces: Vec<(f64, String)> = Vec::new();
        for face in &self.faces {
            let corners: Vec<([f64; 2], f64)> = face.corners.iter().map(|corner| seen(turned(q, *corner))).collect();
            let depth = corners.iter().map(|(_, depth)| depth).sum::<f64>() / corners.len().max(1) as f64;
            let each: Vec<String> = corners.iter().map(|([x, y], _)| format!("{x:.1} {y:.1}")).collect();
            let colour = face.colour % COLOURS.len();
            faces.push((
                depth,
                format!(
                    "<g class=\"c{colour}\"><path class=\"face\" d=\"M{}Z\"/></g>",
                    each.join(" ")
                ),
            ));
        }
        faces.sort_by(|one, other| one.0.total_cmp(&other.0));
        text.extend(faces.into_iter().map(|(_, face)| face));
        for one in &self.body {
            arrow(&mut text, one, turned(q, one.tip), "line");
        }
        text
    }
}

/// `q v q*`.
fn turned([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let u = [x, y, z];
    let t = cross(u, v).map(|part| 2.0 * part);
    let ut = cross(u, t);
    [0, 1, 2].map(|k| v[k] + w * t[k] + ut[k])
}

/// \[px\] where a point of the world is seen, and how near the viewer it is.
fn seen(point: [f64; 3]) -> ([f64; 2], f64) {
    let (sin_a, cos_a) = AZIMUTH.sin_cos();
    let (sin_e, cos_e) = ELEVATION.sin_cos();
    let towards = [cos_e * cos_a, cos_e * sin_a, -sin_e];
    // Up is against the third axis: right = up x towards, up on the page = towards x right.
    let right = [sin_a, -cos_a, 0.0];
    let up = [
        towards[1] * right[2] - towards[2] * right[1],
        towards[2] * right[0] - towards[0] * right[2],
        towards[0] * right[1] - towards[1] * right[0],
    ];
    let along = |axis: [f64; 3]| (0..3).map(|k| axis[k] * point[k]).sum::<f64>();
    (
        [0.5 * SIDE + UNIT * along(right), 0.5 * SIDE - UNIT * along(up)],
        along(towards),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn down_is_down_and_a_turn_of_the_head_goes_from_the_first_axis_to_the_second() {
        let ([_, y], _) = seen([0.0, 0.0, 1.0]);
        assert!(y > 0.5 * SIDE, "the third axis points down the page");
        let half = 0.5f64.sqrt();
        let turned = turned([half, 0.0, 0.0, half], [1.0, 0.0, 0.0]);
        assert!((turned[1] - 1.0).abs() < 1e-12, "{turned:?}");
        // The viewer stands behind the first axis: the second is at the right.
        assert!(seen([0.0, 1.0, 0.0]).0[0] > 0.5 * SIDE);
        assert!(seen([1.0, 0.0, 0.0]).1 < 0.0);
    }

    #[test]
    fn times_that_go_back_are_refused() {
        let poses = Poses {
            name: "a".into(),
            colour: 0,
            at: vec![(1.0, [1.0, 0.0, 0.0, 0.0]), (0.0, [1.0, 0.0, 0.0, 0.0])],
        };
        let scene = Scene {
            poses: vec![poses],
            ..Scene::default()
        };
        assert!(scene.check().is_err());
    }
}
