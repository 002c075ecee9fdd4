//! The host board's recorder: any recorder, until it hangs.
//!
//! Every record is passed on; after [`Fault::RecorderHung`](crate::run::Fault::RecorderHung) none is ever answered.

use std::{cell::Cell, future::pending, rc::Rc};

use emems::recorder::{Record, Recorder, RecorderError, RecorderStatus};

/// A recorder that may hang.
pub struct MayHang<R> {
    /// The recorder.
    pub recorder: R,
    /// Whether it hangs.
    pub hung: Rc<Cell<bool>>,
}

impl<R> MayHang<R> {
    async fn ready(&self) {
        if self.hung.get() {
            pending::<()>().await;
        }
    }
}

impl<R: Recorder> Recorder for MayHang<R> {
    async fn append(&mut self, record: &Record) -> Result<(), RecorderError> {
        self.ready().await;
        self.recorder.append(record).await
    }

    async fn read(&mut self, index: u32) -> Result<Record, RecorderError> {
        self.ready().await;
        self.recorder.read(index).await
    }

    fn start_erase(&mut self) {
        self.recorder.start_erase();
    }

    async fn erase_step(&mut self) -> Result<u32, RecorderError> {
        self.ready().await;
        self.recorder.erase_step().await
    }

    fn status(&self) -> RecorderStatus {
        self.recorder.status()
    }
}
