//! Inner products of many columns with each other, motion and calibration marginalised.
//!
//! In: columns, and sets of them. Out: `<u, v>` within each set. Two things make it cheap. The parts of the motion are made for many
//! columns at once, and no longer kept than the sets need them that have columns in common. And what the calibration takes of a column, `C'(I - Q Q')u`, is
//! taken from the other side: `(I - Q Q')C` is made once, a block of its columns at a time, and of it a column `u` needs only the few
//! channels that it touches, while `(I - Q Q')u` has samples in all.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    library::column::{Column, Entries},
    parity::space::{AT_ONCE, Space, dot},
};

/// Columns of calibration and nulls whose samples in all channels are held at once: 60 MiB for five minutes of packets. Each time all columns
/// that are asked for are gone through.
const BLOCK: usize = 128;

/// Columns whose parts in the motion are held at once, unless one set has more: 20 MiB for five minutes of packets.
const HELD: usize = 128;

/// A column that is asked for. Its values may be made only where they are needed: those of a whole library at once were a quarter of all
/// memory that a diagnosis took.
pub trait Asked: Sync {
    /// All of its values.
    fn whole(&self) -> Cow<'_, Entries>;

    /// The same in one channel.
    fn within(&self, channel: usize) -> Option<Cow<'_, DVector<f64>>>;
}

impl Asked for Entries {
    fn whole(&self) -> Cow<'_, Entries> {
        Cow::Borrowed(self)
    }

    fn within(&self, channel: usize) -> Option<Cow<'_, DVector<f64>>> {
        let own = self.iter().find(|(own, _)| *own == channel);
        own.map(|(_, values)| Cow::Borrowed(values))
    }
}

impl Asked for Column {
    fn whole(&self) -> Cow<'_, Entries> {
        Cow::Owned(self.entries())
    }

    fn within(&self, channel: usize) -> Option<Cow<'_, DVector<f64>>> {
        self.values(channel)
    }
}

/// A column in a channel that it touches.
#[derive(Clone, Copy)]
struct Touching {
    /// Its place.
    at: usize,
    /// The first sample that is not zero.
    begun: usize,
}

/// `c_u` of columns, a column each.
pub struct Opened(pub(super) DMatrix<f64>);

impl Opened {
    /// Of so many columns of which calibration and nulls are to take nothing.
    pub fn nothing(columns: usize) -> Self {
        Self(DMatrix::zeros(0, columns))
    }
}

impl Space<'_> {
    /// `<u, v>` of the columns of each set, which names them by their places.
    pub fn within<A: Asked>(
        &self,
        columns: &[&A],
        Opened(open): &Opened,
        sets: &[Vec<usize>],
        progress: &dyn Fn(f64),
    ) -> Vec<DMatrix<f64>> {
        let order = side_by_side(columns.len(), sets);
        let mut inner = vec![DMatrix::zeros(0, 0); sets.len()];
        let mut done = 0;
        while done < sets.len() {
            let mut places: Vec<usize> = Vec::new();
            let mut last = done;
            while let Some(set) = order.get(last).map(|at| &sets[*at]) {
                let known = places.len();
                let mut with = places.clone();
                with.extend(set);
                with.sort_unstable();
                with.dedup();
                if known > 0 && with.len() > HELD {
                    break;
                }
                places = with;
                last += 1;
            }
            let held: Vec<Cow<Entries>> = places.iter().map(|place| columns[*place].whole()).collect();
            let parts = self.motion.parts(&held.iter().map(|own| &**own).collect::<Vec<_>>());
            for (place, set) in order[done..last].iter().map(|place| (*place, &sets[*place])) {
                let at: Vec<usize> = set
                    .iter()
                    .map(|place| places.partition_point(|own| own < place))
                    .collect();
                let mut own = DMatrix::zeros(set.len(), set.len());
                for row in 0..set.len() {
                    for column in 0..=row {
                        own[(row, column)] = dot(&held[at[row]], &held[at[column]])
                            - parts.column(at[row]).dot(&parts.column(at[column]))
                            - open.column(set[row]).dot(&open.column(set[column]));
                    }
                }
                own.fill_upper_triangle_with_lower_triangle();
                inner[place] = own;
            }
            done = last;
            progress(done as f64 / sets.len() as f64);
        }
        inner
    }

    /// `I + C'(I - Q Q')C`, and `C'(I - Q Q')u` of each column.
    pub(super) fn opened<A: Asked>(&self, columns: &[&A]) -> (DMatrix<f64>, DMatrix<f64>) {
        let frames = &self.problem.frames;
        let mut touching: Vec<Vec<Touching>> = vec![Vec::new(); frames.len()];
        for (at, column) in columns.iter().enumerate() {
            for (channel, values) in column.whole().iter() {
                if let Some(begun) = values.iter().position(|own| *own != 0.0) {
                    touching[*channel].push(Touching { at, begun });
                }
            }
        }
        // What begins late stands side by side, so that what is nothing before it is left out for many at once.
        touching.iter_mut().for_each(|own| own.sort_by_key(|own| own.begun));
        let calibration: usize = frames.iter().map(|frame| frame.nuisance.ncols()).sum();
        let size = calibration + self.nulls.len();
        let mut inner = DMatrix::identity(size, size);
        let mut open = DMatrix::zeros(size, columns.len());
        self.each_apart(&mut |from, apart| {
            let before = frames.iter().scan(0, |known, frame| {
                *known += frame.nuisance.ncols();
                Some(*known - frame.nuisance.ncols())
            });
            let before: Vec<usize> = before.collect();
            let of_channel = |channel: usize| {
                let (frame, known) = (&frames[channel], before[channel]);
                let apart = apart[channel].transpose();
                // What is right of the diagonal is known from below it.
                let own = (known < from + apart.nrows()).then(|| {
                    let own = inner.view((from, known), (apart.nrows(), frame.nuisance.ncols()));
                    let mut own = own.into_owned();
                    own.gemm(1.0, &apart, &frame.nuisance, 1.0);
                    own
                });
                let products = touching[channel].chunks(HELD).map(|touching| {
                    let begun = touching.first().map_or(0, |own| own.begun);
                    let samples = apart.ncols() - begun;
                    let own = touching.iter().filter_map(|own| columns[own.at].within(channel));
                    let own: Vec<Cow<DVector<f64>>> = own.collect();
                    let values: Vec<_> = own.iter().map(|own| own.rows(begun, samples)).collect();
                    let values = DMatrix::from_columns(&values);
                    apart.columns(begun, samples) * values
                });
                (own, products.collect::<Vec<DMatrix<f64>>>())
            };
            let of_channels: Vec<_> = (0..frames.len()).into_par_iter().map(of_channel).collect();
            for (channel, (own, products)) in of_channels.into_iter().enumerate() {
                if let Some(own) = own {
                    inner.view_mut((from, before[channel]), own.shape()).copy_from(&own);
                }
                let products = products.iter().flat_map(|product| product.column_iter());
                for (Touching { at, .. }, product) in touching[channel].iter().zip(products) {
                    let mut sum = open.view_mut((from, *at), (product.len(), 1));
                    sum += product;
                }
            }
            let width = apart.first().map_or(0, DMatrix::ncols);
            for at in (0..width).filter(|at| from + at >= calibration) {
                for (null, column) in self.nulls.iter().enumerate() {
                    let product = |(channel, values): &(usize, DVector<f64>)| values.dot(&apart[*channel].column(at));
                    inner[(from + at, calibration + null)] += column.iter().map(product).sum::<f64>();
                }
            }
        });
        inner.fill_upper_triangle_with_lower_triangle();
        (inner, open)
    }

    /// `I + C'(I - Q Q')C`, and what the motion can imitate of each column of `C`: where nothing else is asked for, no samples of `(I - Q Q')C`
    /// have to be made.
    pub(super) fn inner(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let parts = self.open_parts();
        let size = parts.ncols();
        let mut inner = DMatrix::identity(size, size);
        let mut known = 0;
        for frame in &self.problem.frames {
            let own = frame.nuisance.ncols();
            let mut view = inner.view_mut((known, known), (own, own));
            view.gemm(1.0, &frame.nuisance.transpose(), &frame.nuisance, 1.0);
            known += own;
        }
        for (null, column) in self.nulls.iter().enumerate() {
            let mut row = inner.row_mut(known + null);
            row += self.plain(column).transpose();
        }
        for first in (0..size).step_by(AT_ONCE) {
            let next = size.min(first + AT_ONCE);
            let own = parts.columns_range(first..next).transpose();
            let mut view = inner.view_mut((first, 0), (next - first, next));
            view.gemm(-1.0, &own, &parts.columns_range(..next), 1.0);
        }
        inner.fill_upper_triangle_with_lower_triangle();
        (inner, parts)
    }

    /// Gives calibration and nulls without what the motion imitates of them, so many columns at a time: the first of them, and the samples
    /// of each channel.
    fn each_apart(&self, with: &mut dyn FnMut(usize, &[DMatrix<f64>])) {
        for (at, columns) in self.columns().chunks(BLOCK).enumerate() {
            let columns: Vec<&Entries> = columns.iter().collect();
            with(BLOCK * at, &self.apart(&columns, &self.motion.parts(&columns)));
        }
    }
}

/// Sets in an order in which those stand side by side that share columns, whichever others they share them through: then none is made twice.
fn side_by_side(columns: usize, sets: &[Vec<usize>]) -> Vec<usize> {
    // Of each column, another of the same sets that stands before it, or itself.
    let mut before: Vec<usize> = (0..columns).collect();
    let first = |before: &[usize], mut own: usize| {
        while before[own] != own {
            own = before[own];
        }
        own
    };
    for set in sets {
        for pair in set.windows(2) {
            let ends = [pair[0], pair[1]].map(|own| first(&before, own));
            before[ends[0].max(ends[1])] = ends[0].min(ends[1]);
        }
    }
    let mut order: Vec<usize> = (0..sets.len()).collect();
    order.sort_by_key(|at| sets[*at].first().map(|own| first(&before, *own)));
    order
}
