//! What one update of an attitude filter costs on the unit's processor, ours beside those of published crates.
//!
//! In: nothing; the motion is a tumble computed here, the same exact rates, specific force and field for each; for ours a rest
//! as well, where it compares more. Out: the static `COSTS`, ticks of the processor's clock for every update of every filter,
//! which the emulated board reads when `DONE` is one. On that board a tick is an instruction.
//!
//! Every filter has its own defaults. Ours gathers samples and updates once a second (`emems::kalman`), so most of its
//! steps are cheap and the eight or ten after that are not; the others do the same at every sample.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod whole;

#[cfg(target_os = "none")]
mod counted {
    use core::sync::atomic::{AtomicU32, Ordering};

    use ahrs::{Ahrs, Madgwick};
    use cortex_m::peripheral::{SYST, syst::SystClkSource};
    use emems::{
        attitude::from_rotation_vector,
        kalman::{Filter, Params, Sampled, Step},
    };
    use nalgebra::{UnitQuaternion, Vector3};
    use vqf_rs::VQF;

    /// Filters, ours twice.
    const FILTERS: usize = 4;
    /// Updates of each: twelve seconds, after eight in which they find the attitude.
    const UPDATES: usize = 600;
    const SETTLING: usize = 400;
    /// \[s\] between them.
    const DT_S: f32 = 0.02;
    /// [m/s2] specific force at rest, and \[uT\] field, north, east, down.
    pub const FORCE_N: Vector3<f32> = Vector3::new(0.0, 0.0, -9.806_65);
    pub const FIELD_N_UT: Vector3<f32> = Vector3::new(20.0, 0.0, 40.0);
    /// SysTick counts down through so many bits.
    const COUNTER: u32 = 0x00FF_FFFF;

    #[unsafe(no_mangle)]
    static COSTS: [AtomicU32; FILTERS * UPDATES] = [const { AtomicU32::new(0) }; FILTERS * UPDATES];
    #[unsafe(no_mangle)]
    static DONE: AtomicU32 = AtomicU32::new(0);

    /// Where the linker looks for handlers of the part's interrupts, of which none is enabled.
    #[unsafe(no_mangle)]
    #[unsafe(link_section = ".vector_table.interrupts")]
    static __INTERRUPTS: [u32; 1] = [0];

    /// What the sensors say at one instant.
    pub struct Sample {
        at_us: u64,
        pub rate_b: Vector3<f32>,
        force_b: Vector3<f32>,
        field_b_ut: Vector3<f32>,
    }

    /// The tumble: rates of some 40 deg/s about all axes.
    pub fn motion(step: usize, q_nb: &mut UnitQuaternion<f32>) -> Sample {
        let t_s = step as f32 * DT_S;
        let rate_b = [(0.7, 0.5), (0.9, 0.4), (1.3, 0.6)].map(|(w, size): (f32, f32)| {
            let phase = nalgebra::ComplexField::sin(w * t_s);
            size * phase
        });
        let rate_b = Vector3::from(rate_b);
        *q_nb *= from_rotation_vector(rate_b * DT_S);
        Sample {
            at_us: ((step + 1) as f32 * DT_S * 1e6) as u64,
            rate_b,
            force_b: q_nb.inverse_transform_vector(&FORCE_N),
            field_b_ut: q_nb.inverse_transform_vector(&FIELD_N_UT),
        }
    }

    /// What `work` gives, and the ticks it takes.
    pub fn ticks<T>(work: impl FnOnce() -> T) -> (T, u32) {
        let before = SYST::get_current();
        let made = core::hint::black_box(work());
        (made, before.wrapping_sub(SYST::get_current()) & COUNTER)
    }

    /// Ticks that `update` takes for each sample of the tumble, or of a rest, kept as those of `filter`.
    fn count(filter: usize, turns: bool, mut update: impl FnMut(&Sample)) {
        let mut q_nb = UnitQuaternion::identity();
        for step in 0..SETTLING + UPDATES {
            let mut sample = motion(step, &mut q_nb);
            if !turns {
                sample.rate_b = Vector3::zeros();
                sample.force_b = FORCE_N;
                sample.field_b_ut = FIELD_N_UT;
            }
            let ((), ticks) = ticks(|| update(&sample));
            if let Some(update) = step.checked_sub(SETTLING) {
                COSTS[filter * UPDATES + update].store(ticks, Ordering::Relaxed);
            }
        }
    }

    #[inline(never)]
    fn ours(n: usize, turns: bool) {
        let mut filter = Filter::new(Params::ROOM);
        count(n, turns, |sample| {
            let sampled = |value_b: Vector3<f32>, variance: f32| {
                Some(Sampled {
                    value_b,
                    variance,
                    scatter: 0.0,
                    at_us: sample.at_us,
                })
            };
            let outcome = filter.step(&Step {
                at_us: sample.at_us,
                covered_s: DT_S,
                angle_b: sample.rate_b * DT_S,
                angle_variance: 1e-10,
                rate_b: sample.rate_b,
                saturated: false,
                acc: sampled(sample.force_b, 0.01),
                mag: sampled(sample.field_b_ut, 0.25),
                lift_off: false,
            });
            core::hint::black_box(&outcome);
        });
        core::hint::black_box(&filter);
    }

    #[inline(never)]
    fn madgwick() {
        let mut filter = Madgwick::<f32>::new(DT_S, 0.1);
        count(2, true, |sample| {
            let old = |vector: &Vector3<f32>| nalgebra_034::Vector3::new(vector.x, vector.y, vector.z);
            let (rate, force, field) = (old(&sample.rate_b), old(&sample.force_b), old(&sample.field_b_ut));
            let _ = core::hint::black_box(filter.update(&rate, &force, &field).is_ok());
        });
        core::hint::black_box(&filter);
    }

    #[inline(never)]
    fn vqf() {
        let mut filter = VQF::new(DT_S, None, None, None);
        count(3, true, |sample| {
            filter.update(
                sample.rate_b.into(),
                sample.force_b.into(),
                Some(sample.field_b_ut.into()),
            );
        });
        core::hint::black_box(&filter);
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(COUNTER);
            core.SYST.clear_current();
            core.SYST.enable_counter();
            ours(0, true);
            ours(1, false);
            madgwick();
            vqf();
            super::whole::count();
            DONE.store(1, Ordering::Relaxed);
        }
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[panic_handler]
    fn panicked(_: &core::panic::PanicInfo) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This image is for the unit: cargo run --ignore-rust-version --target host-tuple -p emems-emulated --example cost"
    );
}
