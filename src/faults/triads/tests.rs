//! Twelve axes under watch, cycle by cycle against the pages in f64.

extern crate std;

use super::*;
use crate::{
    draws::{Draws, near},
    faults::tests::reference::{Given, Sure, TriadsModel, V, of},
    geometry::triad_axes_b,
};

/// What is wrong with one axis from some cycle to another.
#[derive(Clone, Copy, Debug)]
enum Ill {
    Biased(f32),
    Creeping(f32),
    Noisy,
    Reversed,
    Exchanged,
    Frozen,
    Unread,
    Wild,
}

struct Fault {
    axis: usize,
    cycles: core::ops::Range<u32>,
    ill: Ill,
}

/// A unit with axes that are not quite those of the drawing, its noise and what is held of its calibration.
fn unit(draws: &mut Draws) -> ([Axis; TRIAD_AXES], Uncertainty, f32) {
    let noise = draws.within(0.02, 0.1);
    let alike = draws.below(2) == 0;
    let axes = triad_axes_b().map(|axis_b| {
        let noise = if alike { noise } else { noise * draws.within(0.7, 1.5) };
        Axis::from_sensitivity((axis_b + draws.vector(0.02)) * 100.0, 0.0, noise)
    });
    let uncertainty = Uncertainty {
        bias: draws.within(0.1, 0.5),
        scale: draws.within(1e-3, 0.01),
        direction: draws.within(1e-3, 0.01),
    };
    (axes, uncertainty, draws.one_of([0.0, 0.005]))
}

fn fault(draws: &mut Draws) -> Fault {
    let from = 40 + draws.below(100) as u32;
    let lasts = draws.one_of([1, 4, 60, 200]);
    let (size, slow) = (draws.within(0.2, 3.0), draws.within(0.002, 0.05));
    Fault {
        axis: draws.below(12) as usize,
        cycles: from..from + lasts,
        ill: draws.one_of([
            Ill::Biased(size),
            Ill::Biased(-size),
            Ill::Creeping(slow),
            Ill::Noisy,
            Ill::Reversed,
            Ill::Exchanged,
            Ill::Frozen,
            Ill::Unread,
            Ill::Wild,
        ]),
    }
}

#[derive(Default)]
struct Seen {
    verdicts: [u32; 7],
    undecided: u32,
    cycles: u32,
    events: [u32; 3],
}

/// A run with faults of its own; all that is held of the axes is compared in every cycle.
fn run(seed: u64, seen: &mut Seen) {
    let mut draws = Draws::of(seed);
    let (axes, mut uncertainty, timing_s) = unit(&mut draws);
    // Plates not read at all: what is left has doubles.
    let left_out: u16 = draws.one_of([
        0,
        0,
        0,
        0,
        0b111_111,
        0b1_111_111,
        0b11_111_111,
        0b111_111_110_000,
        0b110_111_111_000,
    ]);
    if left_out != 0 {
        // What is never read is never learnt, and would hide all else.
        uncertainty.bias *= 0.05;
    }
    let mut triads = Triads::new(&axes, uncertainty, timing_s);
    let sure = Sure {
        bias: of(uncertainty.bias),
        scale: of(uncertainty.scale),
        direction: of(uncertainty.direction),
        timing_s: of(timing_s),
    };
    let axes_b: [V; 12] = axes.map(|axis| axis.axis_b.cast());
    let mut model = TriadsModel::new(axes_b, axes.map(|axis| of(axis.noise)), sure);
    let biases: [f32; 12] = core::array::from_fn(|_| draws.within(-0.3, 0.3) * uncertainty.bias);
    let (few, many) = (draws.below(3), draws.below(8));
    let count = draws.one_of([few, few, many]);
    // Whole sensors go as well.
    let mut faults: std::vec::Vec<Fault> = (0..count).map(|_| fault(&mut draws)).collect();
    if draws.below(4) == 0 {
        let (plate, size) = (draws.below(4) as usize, draws.within(0.5, 3.0));
        faults.extend((0..3).map(|k| Fault {
            axis: 3 * plate + k,
            cycles: 60..400,
            ill: Ill::Biased(size),
        }));
    }
    if left_out.count_ones() > 6 {
        // Too little for the gate, and for too long: each of those left looks like any other.
        let left: std::vec::Vec<usize> = (0..12).filter(|k| left_out >> k & 1 == 0).collect();
        let axis = left[draws.below(left.len() as u64) as usize];
        let size = axes[axis].noise * draws.within(3.0, 7.0);
        faults.clear();
        faults.push(Fault {
            axis,
            cycles: 60..200,
            ill: Ill::Biased(size),
        });
    }
    let moving = draws.one_of([0.0, 0.0, 0.5, 3.0]);
    let later = draws.below(2) == 0;
    let (start_b, swings) = (draws.vector(9.0), draws.vector(1.0));
    let mut last = [0.0; 12];
    for cycle in 0..320 {
        let phase = cycle as f32 * 0.3;
        let vector_b = start_b + swings * (moving * ComplexField::sin(phase));
        let (mut present, mut frozen) = (0xFFF & !left_out, 0);
        let mut values: [f32; 12] = core::array::from_fn(|k| {
            let noise = axes[k].noise * (draws.within(-1.0, 1.0) + draws.within(-1.0, 1.0) + draws.within(-1.0, 1.0));
            axes[k].axis_b.dot(&vector_b) + biases[k] + noise
        });
        for Fault { axis, cycles, ill } in faults.iter().filter(|fault| fault.cycles.contains(&cycle)) {
            let sound = values[*axis];
            values[*axis] = match ill {
                Ill::Biased(size) => sound + size,
                Ill::Creeping(slow) => sound + slow * (cycle - cycles.start) as f32,
                Ill::Noisy => sound + draws.within(-1.0, 1.0),
                Ill::Reversed => -sound,
                Ill::Exchanged => axes[axis / 3 * 3 + (axis + 1) % 3].axis_b.dot(&vector_b),
                Ill::Frozen => {
                    frozen |= 1 << axis;
                    last[*axis]
                }
                Ill::Unread => {
                    present &= !(1 << axis);
                    sound
                }
                Ill::Wild => sound + 300.0,
            };
        }
        last = values;
        let dt_s = (draws.below(20) > 0).then_some(0.2);
        let rate = draws.one_of([0.0, moving]);
        let by_place = 0.02 * moving;
        let cycle_of = Cycle {
            values: &values,
            present,
            frozen,
            dt_s,
            watched_later: later,
        };
        triads.step(&cycle_of, &Apart { rate, by_place });
        let given = Given {
            values: values.map(of),
            present,
            frozen,
            dt_s: dt_s.map(of),
            later,
        };
        model.step(&given, of(rate), of(by_place));
        if model.tied || model.watches.iter().any(|watch| watch.open) {
            break;
        }
        let is = |found: f32, expected: f64, what: &str, k: usize| {
            assert!(
                near(found, expected, 2e-3, 2e-4),
                "{seed} {cycle}: {what} {k}: {found} {expected}"
            );
        };
        let (solution, what) = (&triads.solution, std::format!("{seed} {cycle}"));
        assert_eq!(
            (solution.used, triads.undecided),
            (model.used, model.undecided),
            "{what}"
        );
        assert_eq!(solution.known == Known::All, model.solution.is_some(), "{what}");
        if let Some((vector_b, covariance_b)) = model.solution {
            (0..3).for_each(|k| is(solution.vector_b[k], vector_b[k], "vector", k));
            let off = (solution.covariance_b.cast::<f64>() - covariance_b).norm();
            assert!(off < 2e-3 * covariance_b.norm(), "{what}: {off}");
        }
        for k in 0..12 {
            let (found, expected) = (&triads.watches[k], &model.watches[k]);
            assert_eq!(triads.verdict(k), expected.verdict, "{what}: axis {k}");
            assert_eq!(triads.excluded() >> k & 1 == 1, expected.excluded(), "{what}: axis {k}");
            is(found.offset, expected.offset, "offset", k);
            assert!(
                near(found.offset_variance, expected.offset_variance, 5e-3, 1e-9),
                "{what}: variance {k}"
            );
            seen.verdicts[expected.verdict as usize] += 1;
        }
        seen.undecided += u32::from(model.undecided);
        seen.cycles += 1;
    }
    (0..3).for_each(|k| seen.events[k] += model.events[k]);
}

#[test]
fn all_that_is_held_of_the_axes_is_what_the_pages_say() {
    let mut seen = Seen::default();
    for seed in 0..150 {
        run(seed, &mut seen);
    }
    // Each verdict was seen, whole sensors went, faults had doubles and got other names.
    let events = (seen.verdicts, seen.undecided, seen.events);
    assert!(seen.verdicts.iter().all(|count| *count > 100), "{events:?}");
    assert!(
        seen.undecided > 50 && seen.events.iter().all(|count| *count > 3),
        "{events:?}"
    );
}
