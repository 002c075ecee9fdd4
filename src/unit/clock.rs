//! The unit's waiting: one alarm for all its parts.
//!
//! The parts are one future, so each wake polls all of them. With a timer each, every wake would read the hardware clock
//! and set its alarm a dozen times. Instead [`Clock::drive`] reads the clock once before it polls the parts; their waits
//! compare with that reading and say how long they still want to sleep, and the earliest becomes the one alarm.
//!
//! Instants that are kept as data (slot times, fast samples) are read from the hardware clock itself.

use core::{
    cell::Cell,
    convert::Infallible,
    future::{Future, pending, poll_fn},
    pin::{Pin, pin},
    task::{Context, Poll},
};

use embassy_time::{Duration, Instant, Timer};
use embedded_hal_async::delay::DelayNs;
use pin_project_lite::pin_project;

/// The reading of this poll, and the earliest instant that anyone waits for.
pub struct Clock {
    now: Cell<Instant>,
    next: Cell<Instant>,
}

/// The hardware clock. Not inlined wherever it is read: flash is short.
#[inline(never)]
pub fn now() -> Instant {
    Instant::now()
}

/// The next instant on the grid of multiples of `interval` of the unit's time, shifted by `phase`. Parts that do their
/// work on shifted grids keep out of each other's way, and do it at the same times whatever start-up took.
pub fn next_on_grid(interval: Duration, phase: Duration) -> Instant {
    let interval = interval.as_ticks().max(1);
    let since = now().as_ticks().saturating_sub(phase.as_ticks());
    let next = (since / interval).saturating_add(1).saturating_mul(interval);
    Instant::from_ticks(next).saturating_add(phase)
}

/// The instant `delay` from now.
pub fn after(delay: Duration) -> Instant {
    now().saturating_add(delay)
}

/// Waits for ever, as a part does that cannot work: its vote is missing, and the watchdog restarts the unit.
pub async fn never() -> ! {
    match pending::<Infallible>().await {}
}

/// Time was up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedOut;

impl Clock {
    /// A clock that starts now.
    pub fn new() -> Self {
        Clock {
            now: Cell::new(now()),
            next: Cell::new(Instant::MAX),
        }
    }

    /// Runs the parts that wait on this clock.
    pub fn drive<F: Future>(&self, mut parts: Pin<&mut F>) -> impl Future<Output = F::Output> {
        poll_fn(move |context| {
            self.now.set(now());
            self.next.set(Instant::MAX);
            let polled = parts.as_mut().poll(context);
            if polled.is_pending() && self.next.get() != Instant::MAX {
                // One poll sets the alarm; when it rings, the parts are polled and say what they wait for next.
                let alarm = pin!(Timer::at(self.next.get()));
                let _ = alarm.poll(context);
            }
            polled
        })
    }

    /// The reading of this poll.
    pub fn now(&self) -> Instant {
        self.now.get()
    }

    /// Waits until `at`.
    pub fn until(&self, at: Instant) -> impl Future<Output = ()> {
        poll_fn(move |_| {
            if self.has_come(at) {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
    }

    /// What `future` gives, if it does within `limit` from now on.
    pub fn within<F: Future>(&self, limit: Duration, future: F) -> Within<'_, F> {
        // Not the reading of this poll: the parts polled before may have taken their time.
        self.by(after(limit), future)
    }

    /// What `future` gives, if it does before `until`.
    pub fn by<F: Future>(&self, until: Instant, future: F) -> Within<'_, F> {
        Within {
            future,
            clock: self,
            until,
        }
    }

    /// Whether `at` has come; if not, it is waited for. Not inlined into each of the unit's waits: flash is short.
    #[inline(never)]
    fn has_come(&self, at: Instant) -> bool {
        let come = at <= self.now.get();
        if !come {
            self.next.set(self.next.get().min(at));
        }
        come
    }
}

pin_project! {
    /// [`Clock::within`]. Not an `async fn`: that would hold its future twice.
    pub struct Within<'a, F> {
        #[pin]
        future: F,
        clock: &'a Clock,
        until: Instant,
    }
}

impl<F: Future> Future for Within<'_, F> {
    type Output = Result<F::Output, TimedOut>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let this = self.project();
        match this.future.poll(context) {
            Poll::Ready(output) => Poll::Ready(Ok(output)),
            Poll::Pending if this.clock.has_come(*this.until) => Poll::Ready(Err(TimedOut)),
            Poll::Pending => Poll::Pending,
        }
    }
}

impl DelayNs for &Clock {
    fn delay_ns(&mut self, ns: u32) -> impl Future<Output = ()> {
        self.until(after(Duration::from_micros(u64::from(ns).div_ceil(1000))))
    }

    fn delay_us(&mut self, us: u32) -> impl Future<Output = ()> {
        self.until(after(Duration::from_micros(us.into())))
    }

    fn delay_ms(&mut self, ms: u32) -> impl Future<Output = ()> {
        self.until(after(Duration::from_millis(ms.into())))
    }
}
