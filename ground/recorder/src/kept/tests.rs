use embassy_futures::block_on;
use emems::{
    flight_log::{FlightLog, LogError, Resumed, record::BootHeader},
    nand::PAGES_PER_BLOCK,
    site::Told,
};
use twin::part::nand::{Cells, Tear, Wear};

use super::*;
use crate::log;

const BLOCKS: u16 = 12;
const RAIL: [u8; 6] = [0x1B, 0x58, 0x21, 0x34, 0x05, 0x03];
const SITE: [u8; 13] = [0x26, 0x34, 0xFF, 0x18, 0xF7, 0xDD, 0xFC, 0x84, 2, 0x0A, 0x40, 15, 0];

fn told(declination: u8) -> Resumed {
    let mut site = SITE;
    site[5] = declination;
    Resumed {
        rail: Rail::of_bytes(RAIL),
        site: Told::of_bytes(site),
        ..Resumed::default()
    }
}

/// Has a unit keep these, one after the other.
fn keep(chip: &mut Cells, all: &[Resumed]) -> Result<(), LogError> {
    let mut log = FlightLog::new(chip, BootHeader::default());
    block_on(async {
        log.mount().await?;
        for mode in all {
            log.keep_mode(*mode).await?;
        }
        Ok(())
    })
}

fn kept(chip: &Cells) -> InSuperblock {
    log::read(&chip.image()).expect("an image").superblock
}

/// What the unit's next start begins with.
fn next_start(chip: &mut Cells) -> (Rail, Told) {
    let resumed = block_on(FlightLog::new(chip, BootHeader::default()).mount()).expect("mounts");
    (resumed.rail, resumed.site)
}

#[test]
fn the_newest_save_is_said_with_its_sigmas_and_in_numbers() {
    let mut chip = Cells::formatted(BLOCKS, 1);
    keep(&mut chip, &[told(0), told(0xDD)]).expect("kept");
    let found = kept(&chip);
    let site = "gravity 9.780 m/s2 latitude -2.32 declination -20.83 dip -8.92 sd 0.2 deg field 26.24 iron 0.15 uT per g 0.00 deg/s";
    assert_eq!(
        found.lines(),
        [
            "kept       launch rail: azimuth 70.00 elevation 85.00 sigma 0.5 0.3 deg",
            &format!("           launch site: {site}"),
        ]
    );
    let expected = serde_json::json!({
        "rail": {
            "azimuth_deg": 70.0, "elevation_deg": 85.0, "azimuth_sigma_deg": 0.5, "elevation_sigma_deg": 0.3, "fault": null,
        },
        "site": {
            "gravity_m_s2": 9.78, "latitude_deg": -2.32, "declination_deg": -20.83, "dip_deg": -8.92, "field_sigma_deg": 0.2,
            "field_ut": 26.24, "iron_sigma_ut": 0.15, "bias_per_g_sigma_deg_s": 0.0, "fault": null,
        },
        "sure": true,
    });
    assert_eq!(found.json(), expected);
}

/// Zeros are what older firmware left there, too.
#[test]
fn nothing_told_an_older_firmware_a_lost_superblock_and_a_dump_are_told_apart_from_what_is_kept() {
    let lines = kept(&Cells::formatted(BLOCKS, 1)).lines();
    assert!(
        lines[0].ends_with("launch rail: none; none was told, or the firmware is older than the word G_RA")
            && lines[1].ends_with("launch site: none; none was told, or the firmware is older than the word G_SI"),
        "{lines:?}"
    );
    let found = log::read(b"no image").expect("a dump").superblock;
    assert!(
        found.lines()[0].contains("in a dump") && found.json().is_null(),
        "{found:?}"
    );
    assert!(InSuperblock::Lost.lines()[0].contains("no superblock is whole") && InSuperblock::Lost.json().is_null());
}

#[test]
fn an_impossible_number_is_said_and_that_the_unit_does_not_take_it() {
    let mut chip = Cells::formatted(BLOCKS, 1);
    let steep = Resumed {
        rail: Rail {
            elevation: 9_001,
            ..told(0).rail
        },
        ..told(0xDD)
    };
    keep(&mut chip, &[steep]).expect("kept");
    let lines = kept(&chip).lines();
    assert!(
        lines[0].ends_with("the unit does not take it: elevation is above 90 deg"),
        "{lines:?}"
    );
    assert!(!lines[1].contains("does not take"), "{lines:?}");
}

/// Wherever the power is cut, whichever page is lost and whichever block retired: what is said is what the next start begins with.
#[test]
fn what_is_kept_is_what_the_next_start_begins_with() {
    let saves: Vec<Resumed> = (0..40).map(|k| told(0xA0 + k)).collect();
    let mut doubts = 0;
    let mut check = |chip: &mut Cells, what: &str| {
        let (rail, site) = match kept(chip) {
            InSuperblock::Save(kept) if kept.is_sure => (kept.rail, kept.site),
            _ => {
                doubts += 1;
                Default::default()
            }
        };
        assert_eq!((rail, site), next_start(chip), "{what}");
    };
    for cut in 0..2 * saves.len() as u64 {
        for tear in [Tear::Nothing, Tear::Half, Tear::Unacknowledged] {
            let mut chip = Cells::formatted(BLOCKS, cut);
            keep(&mut chip, &saves[..3]).expect("kept");
            chip.befalls.cut = Some((chip.operations + cut, tear));
            let _ = keep(&mut chip, &saves[3..]);
            chip.power_on();
            check(&mut chip, &format!("cut {cut} {tear:?}"));
        }
    }
    for block in 0..LOG_START {
        for page in 0..PAGES_PER_BLOCK {
            let mut chip = Cells::formatted(BLOCKS, 1);
            keep(&mut chip, &saves).expect("kept");
            chip.destroy(PageAddress { block, page });
            check(&mut chip, &format!("page {page} of block {block}"));
        }
    }
    // A block that is retired leaves a torn page, which is no doubt.
    for worn in 0..LOG_START {
        for after in 0..12 {
            let mut chip = Cells::formatted(BLOCKS, 1);
            chip.befalls.worn = vec![(worn, after, Wear::ProgramFails)];
            keep(&mut chip, &saves).expect("kept elsewhere");
            check(&mut chip, &format!("block {worn} worn after {after}"));
        }
    }
    assert!(doubts > 50, "{doubts}");
}
