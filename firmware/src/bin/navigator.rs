//! What flies: answers every frame that arrives over the link with its fix.

#![no_std]
#![no_main]

use eigenmark_core::{
    link::{Reply, Responder},
    localizer::Localizer,
};
use eigenmark_firmware::{atlas_region, board::Board, fail};
use embedded_io::{Read, Write};
use static_cell::ConstStaticCell;

static RESPONDER: ConstStaticCell<Responder> = ConstStaticCell::new(Responder::new());

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some((slot, atlas)) = atlas_region::find() else {
        defmt::error!("no slot holds a valid atlas");
        fail()
    };
    defmt::info!(
        "slot {}: atlas {:08x}, {} landmarks",
        slot,
        atlas.crc(),
        atlas.landmarks().len()
    );
    let Some(mut board) = Board::take() else {
        fail()
    };
    let mut localizer = Localizer::new(atlas);
    let responder = RESPONDER.take();
    loop {
        let mut byte = [0];
        let Ok(_) = board.link.read(&mut byte);
        let Some((reply, packet)) = responder.push(byte[0], &mut localizer) else {
            continue;
        };
        let Ok(()) = board.link.write_all(packet);
        match reply {
            Reply::Identity(_) => defmt::info!("identified"),
            Reply::Fix {
                sequence,
                fix: Some(fix),
            } => defmt::debug!("frame {}: {}", sequence, fix),
            Reply::Fix {
                sequence,
                fix: None,
            } => defmt::info!("frame {}: no fix", sequence),
            Reply::Rejected { reason, .. } => defmt::warn!("rejected: {}", reason),
        }
    }
}
