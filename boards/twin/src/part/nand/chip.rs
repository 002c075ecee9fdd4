//! The cells as the log's chip, without latches or waiting: for campaigns of many runs.

use emems::nand::{MAIN_BYTES, Nand, NandError, PageAddress, PageBytes, SpareBytes};

use super::{Cells, Outcome};

impl Cells {
    fn answers(&self) -> Result<(), NandError> {
        if self.off || self.befalls.dead {
            Err(NandError::Timeout)
        } else {
            Ok(())
        }
    }
}

fn told(outcome: Outcome) -> Result<(), NandError> {
    match outcome {
        Outcome::Done => Ok(()),
        Outcome::Failed => Err(NandError::Failed),
        Outcome::Cut => Err(NandError::Timeout),
    }
}

impl Nand for Cells {
    fn blocks(&self) -> u16 {
        self.block_count()
    }

    async fn identify(&mut self) -> Result<(), NandError> {
        if self.befalls.absent {
            return Err(NandError::WrongId([0xFF, 0xFF]));
        }
        self.answers()
    }

    fn read(&mut self, at: PageAddress, bytes: &mut PageBytes) -> Result<(), NandError> {
        self.answers()?;
        *bytes = Cells::read(self, at);
        Ok(())
    }

    fn read_spare(&mut self, at: PageAddress, bytes: &mut SpareBytes) -> Result<(), NandError> {
        self.answers()?;
        bytes.copy_from_slice(&Cells::read_spare(self, at)[MAIN_BYTES..]);
        Ok(())
    }

    async fn program(&mut self, at: PageAddress, bytes: &PageBytes) -> Result<(), NandError> {
        self.answers()?;
        told(Cells::program(self, at, bytes))
    }

    async fn erase(&mut self, block: u16) -> Result<(), NandError> {
        self.answers()?;
        told(Cells::erase(self, block))
    }
}
