//! A field that is not the reference's: for how long already, and by how much.
//!
//! In: what a window's field shows of a disturbance, in norm and dip and against the heading. Out: whether it is used, with which
//! variance, and what the attitude's covariance does not say while field and gyros contradict each other.
//!
//! **Shown.** Norm and dip beyond [`Params::field_gate`] show a disturbance whatever the attitude is. A heading beyond
//! [`Params::gate`] of what attitude, reference and samples explain shows that either the field or the attitude is another. A spell
//! begins with either, and ends after [`Params::recovery_s`] with neither: iron that goes round shows in nothing twice in a turn. The
//! longer the gyros keep the heading alone, the more they would explain; what is nearer to the most that has contradicted them than to
//! nothing still does.
//!
//! **Used.** In a spell the field has the variance `v` of the most that it has shown: norm and dip are two components of a disturbance
//! of three, and the heading is the third itself. What has lasted for `T` is taken to last for as long again, so all windows of that
//! time are one witness, each with the variance `v T/window`. Each by itself, as if a disturbance were another one a second later,
//! would have the heading at the field's within a minute and said to be right. And the field is used only where the attitude is known no
//! better than `v`: until then the gyros keep the heading.
//!
//! **Contradiction.** While norm and dip are the reference's and the heading is not, nothing tells which of field and attitude is
//! wrong, and the one that has stood for longer is believed: the attitude stays until it has been contradicted for longer than the field stood
//! by it, and is then found afresh. With the times as odds, and the contradiction `c` the error if the other side is right, there is a
//! doubt about the vertical beside the covariance,
//!
//! ```text
//! doubt = c^2 T_other / (T_believed + T_other)
//! ```
//!
//! which is gone as soon as both agree again, and fades where an attitude was found afresh.

use super::{Params, at_least, innovation::Noise, square};

/// How field and attitude stand to each other.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spell {
    /// \[s\] a spell has lasted; zero: there is none.
    lasted_s: f32,
    /// \[s\] it has shown nothing.
    calm_s: f32,
    /// \[s\] it has shown nothing but a contradiction, without a break by norm or dip.
    contradicted_s: f32,
    /// \[1\] most that it has shown, as the variance of a scalar.
    variance: f32,
    /// [rad^2] square of the latest contradiction, about the vertical.
    contradiction: f32,
    /// \[1\] square of the largest residual of a spell that contradicted.
    most: f32,
    /// \[s\] the field has stood by the attitude since that was found.
    stood_by_s: f32,
    /// [rad^2] square of what contradicted an attitude that was given up, ...
    given_up: f32,
    /// ... which the field had stood by for so long \[s\].
    given_up_s: f32,
}

/// What a window shows, in parts of the field's norm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    pub duration_s: f32,
    /// Square of it in norm and dip.
    pub disturbance: f32,
    /// Residual of the field east, ...
    pub residual: f32,
    /// ... the variance that the attitude gives it, ...
    pub of_state: f32,
    /// ... and that of the reference and the samples.
    pub of_reference: f32,
    /// Horizontal part of the reference.
    pub horizontal: f32,
}

impl Spell {
    /// Goes on by a window. Whether its field is used.
    pub fn go_on(&mut self, params: &Params, shown: &Shown) -> bool {
        let squared = square(shown.residual);
        let disturbed = shown.disturbance > square(params.field_gate);
        let explained = square(params.gate) * (shown.of_state + shown.of_reference);
        let contradicts = squared > explained || (self.most > 0.0 && squared > self.most / 4.0);
        if disturbed || contradicts {
            self.calm_s = 0.0;
        } else {
            self.calm_s += shown.duration_s;
            if !self.lasts() || self.calm_s >= params.recovery_s {
                self.end();
                return true;
            }
        }
        self.lasted_s += shown.duration_s;
        let of_norm_and_dip = square(params.disturbance) * shown.disturbance;
        let variance = at_least(of_norm_and_dip, squared - shown.of_state);
        self.variance = at_least(self.variance, variance);
        if disturbed {
            self.contradicted_s = 0.0;
        } else if contradicts {
            self.most = at_least(self.most, squared);
            self.contradicted_s += shown.duration_s;
            self.contradiction = squared / square(shown.horizontal);
        }
        shown.of_state > self.variance
    }

    /// Whether there is one.
    pub fn lasts(&self) -> bool {
        self.lasted_s > 0.0
    }

    /// Of a scalar of its field.
    pub fn noise(&self, duration_s: f32) -> Noise {
        Noise::lasting(self.variance, self.lasted_s, duration_s)
    }

    /// The field of the window was accepted or not. Whether that stands by the attitude, or says that it is another.
    pub fn judge(&mut self, accepted: bool, duration_s: f32) -> Option<bool> {
        if !self.lasts() {
            self.stood_by_s += if accepted { duration_s } else { 0.0 };
            return Some(accepted);
        }
        let contradicts = self.contradicted_s > 0.0 && self.calm_s <= 0.0;
        (contradicts && self.contradicted_s >= self.stood_by_s).then_some(false)
    }

    /// Another attitude was found, because the field had contradicted the one before, or for another reason.
    pub fn have_other_attitude(&mut self, contradicted: bool) {
        if contradicted {
            (self.given_up, self.given_up_s) = (self.contradiction, self.stood_by_s);
            self.stood_by_s = self.contradicted_s;
            self.end();
        } else {
            self.given_up_s = 0.0;
            self.stood_by_s = 0.0;
        }
    }

    /// [rad^2] by how much the attitude about the vertical is in doubt.
    pub fn doubt(&self) -> f32 {
        let odds = |other_s: f32| other_s / at_least(f32::MIN_POSITIVE, other_s + self.stood_by_s);
        self.contradiction * odds(self.contradicted_s) + self.given_up * odds(self.given_up_s)
    }

    fn end(&mut self) {
        self.lasted_s = 0.0;
        self.most = 0.0;
        self.contradicted_s = 0.0;
        self.variance = 0.0;
    }
}

#[cfg(test)]
mod tests;
