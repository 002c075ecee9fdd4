//! Inner products of many columns with each other, motion and calibration marginalised.
//!
//! In: columns, and sets of them. Out: `<u, v>` within each set. Two things make it cheap. The parts of the motion are made for many
//! columns at once, and no longer kept than their set needs them. And what the calibration takes of a column, `C'(I - Q Q')u`, is
//! taken from the other side: `(I - Q Q')C` is made once, a block of its columns at a time, and of it a column `u` needs only the few
//! channels that it touches, while `(I - Q Q')u` has samples in all.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    library::products::Entries,
    parity::space::{Space, dot},
};

/// Columns of calibration and nulls whose samples in all channels are held at once: 30 MiB for five minutes of packets.
const BLOCK: usize = 64;

/// The same where nothing else is asked for: what a processor's cache holds.
const LEAST: usize = 16;

/// Columns whose parts in the motion are held at once, unless one set has more: 20 MiB for five minutes of packets.
const HELD: usize = 128;

/// `c_u` of columns, a column each.
pub struct Opened(pub(super) DMatrix<f64>);

impl Opened {
    /// Of so many columns of which calibration and nulls are to take nothing.
    pub fn nothing(columns: usize) -> Self {
        Self(DMatrix::zeros(0, columns))
    }
}

impl Space<'_> {
    /// `<u, v>` of the columns of each set, which names them by their places; sets that share columns stand side by side.
    pub fn within(
        &self,
        columns: &[&Entries],
        Opened(open): &Opened,
        sets: &[Vec<usize>],
        progress: &dyn Fn(f64),
    ) -> Vec<DMatrix<f64>> {
        let mut inner = Vec::with_capacity(sets.len());
        while inner.len() < sets.len() {
            let mut places: Vec<usize> = Vec::new();
            let mut last = inner.len();
            while let Some(set) = sets.get(last) {
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
            let held: Vec<&Entries> = places.iter().map(|place| columns[*place]).collect();
            let parts = self.motion.parts(&held);
            for set in &sets[inner.len()..last] {
                let at: Vec<usize> = set
                    .iter()
                    .map(|place| places.partition_point(|own| own < place))
                    .collect();
                let mut own = DMatrix::zeros(set.len(), set.len());
                for row in 0..set.len() {
                    for column in 0..=row {
                        own[(row, column)] = dot(columns[set[row]], columns[set[column]])
                            - parts.column(at[row]).dot(&parts.column(at[column]))
                            - open.column(set[row]).dot(&open.column(set[column]));
                    }
                }
                own.fill_upper_triangle_with_lower_triangle();
                inner.push(own);
            }
            progress(inner.len() as f64 / sets.len() as f64);
        }
        inner
    }

    /// `I + C'(I - Q Q')C`, and `C'(I - Q Q')u` of each column.
    pub(super) fn opened(&self, columns: &[&Entries]) -> (DMatrix<f64>, DMatrix<f64>) {
        let frames = &self.problem.frames;
        let mut touching: Vec<Vec<(usize, &DVector<f64>)>> = vec![Vec::new(); frames.len()];
        for (at, column) in columns.iter().enumerate() {
            for (channel, values) in column.iter().filter(|(_, values)| values.iter().any(|own| *own != 0.0)) {
                touching[*channel].push((at, values));
            }
        }
        let calibration: usize = frames.iter().map(|frame| frame.nuisance.ncols()).sum();
        let size = calibration + self.nulls.len();
        let mut inner = DMatrix::identity(size, size);
        let mut open = DMatrix::zeros(size, columns.len());
        // Every block goes through all columns that are asked for.
        let block = if columns.is_empty() { LEAST } else { BLOCK };
        self.each_apart(block, &mut |from, apart| {
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
                    let mut values = DMatrix::zeros(apart.ncols(), touching.len());
                    (touching.iter().enumerate()).for_each(|(at, (_, own))| values.set_column(at, own));
                    &apart * values
                });
                (own, products.collect::<Vec<DMatrix<f64>>>())
            };
            let of_channels: Vec<_> = (0..frames.len()).into_par_iter().map(of_channel).collect();
            for (channel, (own, products)) in of_channels.into_iter().enumerate() {
                if let Some(own) = own {
                    inner.view_mut((from, before[channel]), own.shape()).copy_from(&own);
                }
                let products = products.iter().flat_map(|product| product.column_iter());
                for ((place, _), product) in touching[channel].iter().zip(products) {
                    let mut sum = open.view_mut((from, *place), (product.len(), 1));
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

    /// Gives calibration and nulls without what the motion imitates of them, so many columns at a time: the first of them, and the samples
    /// of each channel.
    fn each_apart(&self, block: usize, with: &mut dyn FnMut(usize, &[DMatrix<f64>])) {
        for (at, columns) in self.columns().chunks(block).enumerate() {
            let columns: Vec<&Entries> = columns.iter().collect();
            with(block * at, &self.apart(&columns, &self.motion.parts(&columns)));
        }
    }
}
