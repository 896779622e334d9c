//! A serial device.

use super::carry::carry;
use super::{Ends, FIRST_PAUSE, back_off};
use crate::problem::Problem;
use tokio::time::Instant;
use tokio_serial::{SerialPort, SerialPortBuilderExt, SerialStream};

/// Opens the device, and opens it again whenever it fails: an unplugged adapter comes back under its stable path.
pub(super) fn open(device: String, baud: u32, ends: Ends) -> Result<(), Problem> {
    let stream = open_port(&device, baud).map_err(|e| Problem::Input(format!("modem.device: {device}: {e}")))?;
    tokio::spawn(keep_open(stream, device, baud, ends));
    Ok(())
}

fn open_port(device: &str, baud: u32) -> tokio_serial::Result<SerialStream> {
    let mut stream = tokio_serial::new(device, baud).open_native_async()?;
    // Two ends may share a pseudo-terminal in a rehearsal; where exclusiveness is not to be had, it is not needed.
    let _ = stream.set_exclusive(false);
    // Some modems garble what they say while RTS is up and flow control off; a pseudo-terminal has no such line.
    let _ = stream.write_request_to_send(false);
    Ok(stream)
}

async fn keep_open(stream: SerialStream, device: String, baud: u32, mut ends: Ends) {
    let mut next = Some(stream);
    let mut pause = FIRST_PAUSE;
    loop {
        let opened = match next.take() {
            Some(stream) => Ok(stream),
            None => open_port(&device, baud),
        };
        match opened {
            Ok(stream) => {
                let began = Instant::now();
                match carry(stream, &mut ends).await {
                    Ok(()) => return,
                    Err(e) => tracing::warn!("modem: {device}: {e}; opening it again"),
                }
                if began.elapsed() > pause * 10 {
                    pause = FIRST_PAUSE;
                }
            }
            Err(e) => tracing::debug!("modem: {device}: {e}"),
        }
        if ends.from.is_closed() {
            return;
        }
        tokio::time::sleep(pause).await;
        pause = back_off(pause);
    }
}
