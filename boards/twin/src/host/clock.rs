//! Virtual time for `embassy-time`, one clock a thread, so that many units run in parallel tests.
//!
//! The clock keeps only instants: the one future of a run is polled again at each, whoever asked for it. Computing
//! takes no time, except a wake ([`WAKE`]) and where a part of the board says that it does ([`spend`]).

use std::{
    cell::RefCell,
    collections::BTreeSet,
    future::Future,
    pin::Pin,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll, Wake, Waker},
};

use super::timing::WAKE;
use crate::part::Nanos;

#[derive(Default)]
struct Clock {
    /// \[ns\] since the unit's clock started.
    now: Nanos,
    alarms_us: BTreeSet<u64>,
    /// \[ns\] when the unit's clock started, since power-on.
    started: Nanos,
    /// \[us\] what the unit's clock says more than it should.
    ahead_us: i64,
    /// The processor runs in a circle.
    hung: bool,
}

thread_local! {
    static CLOCK: RefCell<Clock> = RefCell::default();
}

struct ThreadClock;

impl embassy_time_driver::Driver for ThreadClock {
    fn now(&self) -> u64 {
        CLOCK.with_borrow(|clock| (clock.now / 1000).saturating_add_signed(clock.ahead_us))
    }

    fn schedule_wake(&self, at: u64, _waker: &Waker) {
        CLOCK.with_borrow_mut(|clock| {
            if at != u64::MAX {
                let at_us = at.saturating_add_signed(-clock.ahead_us);
                clock.alarms_us.insert(at_us);
            }
        });
    }
}

embassy_time_driver::time_driver_impl!(static DRIVER: ThreadClock = ThreadClock);

/// Starts the clock at zero; `started` is that instant since power-on.
pub fn start(started: Nanos) {
    CLOCK.set(Clock {
        started,
        ..Clock::default()
    });
}

/// \[ns\] since power-on.
pub fn since_power_on() -> Nanos {
    CLOCK.with_borrow(|clock| clock.started + clock.now)
}

/// The processor is busy for `duration` and polls nothing meanwhile.
pub fn spend(duration: Nanos) {
    CLOCK.with_borrow_mut(|clock| clock.now += duration);
}

/// The unit's clock steps by so much.
pub fn step(by_us: i64) {
    CLOCK.with_borrow_mut(|clock| clock.ahead_us += by_us);
}

/// The processor runs in a circle from here on: nothing is polled until the clock is started again.
pub fn hang() {
    CLOCK.with_borrow_mut(|clock| clock.hung = true);
}

#[derive(Default)]
struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Polls `future` until nothing in it can go on before `until` (since power-on), and leaves the clock there.
pub fn advance<F: Future + ?Sized>(mut future: Pin<&mut F>, until: Nanos) -> Poll<F::Output> {
    let woken = Arc::new(Woken(AtomicBool::new(true)));
    let waker = Waker::from(woken.clone());
    let mut context = Context::from_waker(&waker);
    let until = CLOCK.with_borrow(|clock| until.saturating_sub(clock.started));
    loop {
        while woken.0.swap(false, Ordering::Relaxed) && !CLOCK.with_borrow(|clock| clock.hung) {
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return Poll::Ready(output);
            }
        }
        let due = CLOCK.with_borrow_mut(|clock| match clock.alarms_us.first() {
            Some(at_us) if *at_us * 1000 <= until && !clock.hung => {
                clock.now = clock.now.max(*at_us * 1000) + WAKE;
                clock.alarms_us.pop_first().is_some()
            }
            _ => {
                clock.now = clock.now.max(until);
                false
            }
        });
        if !due {
            return Poll::Pending;
        }
        woken.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;

    use embassy_time::{Duration, Instant, Timer};

    use super::*;

    #[test]
    fn a_hung_processor_polls_nothing_while_time_goes_on() {
        start(0);
        let mut unit = pin!(async {
            Timer::after(Duration::from_secs(1)).await;
            hang();
            Timer::after(Duration::from_secs(1)).await;
        });
        assert_eq!(advance(unit.as_mut(), 5_000_000_000), Poll::Pending);
        assert_eq!(since_power_on(), 5_000_000_000);
    }

    #[test]
    fn a_future_sleeps_in_virtual_time_only() {
        start(1_000_000);
        let mut day = pin!(async {
            Timer::after(Duration::from_secs(86_400)).await;
            Instant::now().as_secs()
        });
        assert_eq!(advance(day.as_mut(), 1_000_000_000), Poll::Pending);
        assert_eq!(since_power_on(), 1_000_000_000);
        assert_eq!(advance(day.as_mut(), 90_000 * 1_000_000_000), Poll::Ready(86_400));
    }
}
