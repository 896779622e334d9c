//! A transparent modem: a byte pipe on a serial device.

use super::pipe::{FIRST_PAUSE, back_off, carry, forget};
use crate::problem::Problem;
use bytes::Bytes;
use tokio::sync::mpsc;
use tokio_serial::{SerialPortBuilderExt, SerialStream};

/// Opens the device, and opens it again whenever it fails: an unplugged adapter comes back under its stable path.
pub(super) fn open(
    device: String,
    baud: u32,
    most: usize,
    to_modem: mpsc::Receiver<Bytes>,
    from_modem: mpsc::Sender<Bytes>,
) -> Result<(), Problem> {
    let stream = open_port(&device, baud).map_err(|e| Problem::Input(format!("modem.device: {device}: {e}")))?;
    tokio::spawn(keep_open(stream, device, baud, most, to_modem, from_modem));
    Ok(())
}

fn open_port(device: &str, baud: u32) -> tokio_serial::Result<SerialStream> {
    let mut stream = tokio_serial::new(device, baud).open_native_async()?;
    // Two ends may share a pseudo-terminal in a rehearsal; where exclusiveness is not to be had, it is not needed.
    let _ = stream.set_exclusive(false);
    Ok(stream)
}

async fn keep_open(
    stream: SerialStream,
    device: String,
    baud: u32,
    most: usize,
    mut to_modem: mpsc::Receiver<Bytes>,
    from_modem: mpsc::Sender<Bytes>,
) {
    let mut next = Some(stream);
    let mut pause = FIRST_PAUSE;
    loop {
        let opened = match next.take() {
            Some(stream) => Ok(stream),
            None => open_port(&device, baud),
        };
        match opened {
            Ok(stream) => {
                forget(&mut to_modem);
                let began = tokio::time::Instant::now();
                match carry(stream, most, &mut to_modem, &from_modem).await {
                    Ok(()) => return,
                    Err(e) => tracing::warn!("modem: {device}: {e}; opening it again"),
                }
                if began.elapsed() > pause * 10 {
                    pause = FIRST_PAUSE;
                }
            }
            Err(e) => tracing::debug!("modem: {device}: {e}"),
        }
        tokio::time::sleep(pause).await;
        pause = back_off(pause);
    }
}
