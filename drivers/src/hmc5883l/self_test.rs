//! HMC5883L self-test: the part adds a known field with its offset straps and measures it.
//!
//! In: a magnetometer, the settings in force, the sign of the field. Out: by how much each axis changed, judged by the
//! limits of the Honeywell HMC5883L datasheet (specifications; self test operation): 243 to 575 counts at 390 counts a
//! gauss, in proportion at other gains.

use embedded_hal_async::{delay::DelayNs, i2c::I2c};

use super::{Config, DATA_X, DATA_Y, DATA_Z, Error, Gain, Hmc5883l, Mode, Rate};

/// \[counts\] what self-test must move each axis by at 390 counts a gauss (datasheet, specifications).
const COUNTS_AT_390: (i32, i32) = (243, 575);
/// \[ms\] two periods of the slowest rate at which self-test measures.
const WAIT_MS: u32 = 150;

/// Which way self-test drives the offset straps (datasheet table 6, MS1 MS0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Bias {
    Positive = 0b01,
    Negative = 0b10,
}

/// \[counts\] what an axis may change by: the same field at every gain.
fn limits(gain: Gain, bias: Bias) -> (i16, i16) {
    let (weak, strong) = COUNTS_AT_390;
    // At most 575 * 1370 / 390 = 2019: fits.
    let scaled = |counts: i32| (counts * i32::from(gain.counts_per_gauss()) / 390) as i16;
    match bias {
        Bias::Positive => (scaled(weak), scaled(strong)),
        Bias::Negative => (scaled(-strong), scaled(-weak)),
    }
}

impl<I2C: I2c> Hmc5883l<I2C> {
    /// Adds the part's own field of about 1.1 gauss and returns by how much x, y, z changed [counts at `config.gain`].
    /// Takes 0.3 s; `config` is in force again afterwards, whatever the result. An axis may overflow at the highest gains.
    pub async fn self_test(
        &mut self,
        config: Config,
        bias: Bias,
        delay: &mut impl DelayNs,
    ) -> Result<[i16; 3], Error<I2C::Error>> {
        let moved = self.self_test_change(config, bias, delay).await;
        self.configure(config).await?;
        let moved = moved?;
        for (axis, change) in [DATA_X, DATA_Y, DATA_Z].into_iter().zip(moved) {
            Error::unless_within(axis, change, limits(config.gain, bias))?;
        }
        Ok(moved)
    }

    async fn self_test_change(
        &mut self,
        config: Config,
        bias: Bias,
        delay: &mut impl DelayNs,
    ) -> Result<[i16; 3], Error<I2C::Error>> {
        let (rate, mode) = (Rate::Hz15, Mode::Continuous);
        let [a, b, mode] = Config { rate, mode, ..config }.registers();
        self.write([a | bias as u8, b, mode]).await?;
        delay.delay_ms(WAIT_MS).await;
        // The first set is of the old settings, as after any change.
        self.newest().await?;
        delay.delay_ms(WAIT_MS).await;
        // The part subtracts the outer field itself (datasheet, self test operation).
        self.newest().await.map(|sample| sample.counts)
    }
}

#[cfg(test)]
mod tests {
    use embedded_hal_mock::eh1::delay::NoopDelay;

    use super::super::tests::{configuration, set, with, writes};
    use super::*;

    #[test]
    fn self_test_judges_by_the_gain_and_restores_the_settings() {
        let check = |gain: Gain, bias, (a, b), data, result| {
            let config = Config {
                gain,
                // Which it measures in is the self-test's own business.
                mode: Mode::Asked,
                ..Config::default()
            };
            let expected = [
                writes([a, b, 0x00]),
                set(0x01, [0; 6]),
                set(0x01, data),
                configuration([0x18, b, 0x01], [0x18, b, 0x03]),
            ];
            let mut delay = NoopDelay::new();
            let moved = with(&expected, async |part| part.self_test(config, bias, &mut delay).await);
            assert_eq!(moved, result);
        };
        // 1.16, 1.16, 1.08 gauss (datasheet, self test operation) at 390 counts a gauss.
        let (gain, data) = (Gain::PerGauss390, [0x01, 0xC4, 0x01, 0xA5, 0x01, 0xC4]);
        check(gain, Bias::Positive, (0x11, 0xA0), data, Ok([452, 452, 421]));
        let off = |limits| {
            Err(Error::SelfTest {
                register: DATA_X,
                change: 452,
                limits,
            })
        };
        let weak = off((853, 2019));
        check(Gain::PerGauss1370, Bias::Positive, (0x11, 0x00), data, weak);
        let reversed = off((-575, -243));
        check(gain, Bias::Negative, (0x12, 0xA0), data, reversed);
    }
}
