//! Datagrams with one frame each, for benches, radio links and autopilots.

use super::carry::{reopening, silence, until};
use super::{FromPort, PortEnds, ToPort};
use bytes::Bytes;
use scenecast_host::FrameOutcome;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::UdpSocket;
use tokio::time::Instant;

/// Maximum length of a datagram, bytes.
const MAX_DATAGRAM_BYTES: usize = 2048;
/// A peer that is silent for this time gives way to another one.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(10);
/// Time between two empty datagrams by which an end with a configured address makes its own known, until it is answered.
const KNOCK_INTERVAL: Duration = Duration::from_secs(2);
/// Senders of empty datagrams that are answered.
const MAX_KNOCKERS: usize = 4;
/// Pause after an error of the system.
const RETRY_INTERVAL: Duration = Duration::from_millis(200);

/// A socket at `own`, or anywhere if that is empty, and the address of `remote`, if it is not.
pub(super) async fn open(own: &str, remote: &str) -> io::Result<(UdpSocket, Option<SocketAddr>)> {
    let remote = match remote {
        "" => None,
        text => {
            let none = || io::Error::new(io::ErrorKind::NotFound, format!("{text} is no address"));
            let wrong = |e: io::Error| io::Error::new(e.kind(), format!("{text}: {e}"));
            Some(tokio::net::lookup_host(text).await.map_err(wrong)?.next().ok_or_else(none)?)
        }
    };
    let any = if remote.is_some_and(|r| r.is_ipv6()) { "[::]:0" } else { "0.0.0.0:0" };
    let own = if own.is_empty() { any } else { own };
    let wrong = |e: io::Error| io::Error::new(e.kind(), format!("cannot receive at {own}: {e}"));
    Ok((UdpSocket::bind(own).await.map_err(wrong)?, remote))
}

/// Who becomes the peer of a socket without a configured address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PeerRule {
    /// The sender of the first datagram, whatever it contains.
    First,
    /// The sender of the first datagram that the host accepts.
    Judged,
}

/// The other side of a socket. Datagrams go to it, and those of others are dropped while it is pinned.
#[derive(Debug)]
pub(super) struct UdpPeer {
    name: &'static str,
    /// `None` for a configured address, which is always pinned. Then datagrams come from any port of it.
    rule: Option<PeerRule>,
    address: Option<SocketAddr>,
    /// The end of the pin, if nothing renews it.
    pinned_until: Option<Instant>,
    last_read: Instant,
    /// When its own address is to be made known again; `None` where the other end finds it by what it reads.
    next_knock: Option<Instant>,
    /// Who said where he is reached since the other end was heard last, the latest last.
    knockers: Vec<SocketAddr>,
    /// Whether the other end may make its address known.
    is_of_link: bool,
}

impl UdpPeer {
    /// The peer `fixed`, or the one that `rule` finds. `name` appears in the log.
    pub(super) fn new(
        name: &'static str,
        fixed: Option<SocketAddr>,
        rule: PeerRule,
        is_of_link: bool,
        now: Instant,
    ) -> Self {
        let next_knock = fixed.filter(|_| is_of_link).map(|_| now);
        let rule = if fixed.is_some() { None } else { Some(rule) };
        let (knockers, pinned_until) = (Vec::new(), None);
        Self { name, rule, address: fixed, pinned_until, last_read: now, next_knock, knockers, is_of_link }
    }

    /// Whether another sender than this one is pinned.
    fn excludes(&self, sender: SocketAddr, now: Instant) -> bool {
        self.address != Some(sender) && self.pinned_until.is_some_and(|until| now < until)
    }

    /// Whether the host gets a datagram of this sender.
    fn takes(&mut self, sender: SocketAddr, now: Instant) -> bool {
        let is_taken = match (self.rule, self.address) {
            (None, Some(fixed)) => fixed.ip().to_canonical() == sender.ip().to_canonical(),
            _ => !self.excludes(sender, now),
        };
        if is_taken {
            self.last_read = now;
            self.next_knock = self.next_knock.map(|_| now + SILENCE_TIMEOUT);
            if self.rule == Some(PeerRule::First) {
                self.pin(sender, now);
            }
        }
        is_taken
    }

    /// An empty datagram says where its sender is reached. While nobody is heard, datagrams go to the last of these senders too, so
    /// that none keeps another one out.
    fn handle_knock(&mut self, sender: SocketAddr, now: Instant) {
        if self.is_of_link && self.rule.is_some() && !self.excludes(sender, now) {
            self.knockers.retain(|known| *known != sender);
            self.knockers.push(sender);
            self.knockers.drain(..self.knockers.len().saturating_sub(MAX_KNOCKERS));
        }
    }

    /// The addresses that every datagram goes to: the peer's, once known, then the last other senders of empty ones.
    fn receivers(&self) -> impl Iterator<Item = SocketAddr> {
        let others = self.knockers.iter().copied().filter(|knocker| Some(*knocker) != self.address);
        self.address.into_iter().chain(others)
    }

    /// Whether an empty datagram is due.
    fn knocks(&mut self, now: Instant) -> bool {
        let is_due = self.next_knock.is_some_and(|at| now >= at);
        if is_due {
            self.next_knock = Some(now + KNOCK_INTERVAL);
        }
        is_due
    }

    /// Follows the judgement of a datagram. One that only opened may be a replay: it is answered, but pins nobody.
    fn handle_judged(&mut self, sender: SocketAddr, outcome: FrameOutcome, now: Instant) {
        if self.rule != Some(PeerRule::Judged) || self.excludes(sender, now) {
            return;
        }
        match outcome {
            FrameOutcome::Accepted => self.pin(sender, now),
            FrameOutcome::Opened if self.address != Some(sender) => {
                (self.address, self.pinned_until) = (Some(sender), None)
            }
            FrameOutcome::Opened | FrameOutcome::Dropped => {}
        }
    }

    fn pin(&mut self, sender: SocketAddr, now: Instant) {
        if self.pinned_until.is_none() || self.address != Some(sender) {
            tracing::info!("{}: datagrams of others than {sender} are dropped while it is heard", self.name);
        }
        self.knockers.clear();
        self.address = Some(sender);
        self.pinned_until = Some(now + SILENCE_TIMEOUT);
    }
}

/// Carries datagrams to the peer and from it. A socket has no connection, so it is always open.
pub(super) async fn carry(
    socket: UdpSocket,
    mut peer: UdpPeer,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    loop {
        tokio::select! {
            order = ends.to.recv() => match order {
                None => return Ok(()),
                Some(ToPort::Reopen) => return Err(reopening()),
                Some(ToPort::Judged(sender, outcome)) => peer.handle_judged(sender, outcome, Instant::now()),
                Some(ToPort::Bytes(bytes)) => {
                    for receiver in peer.receivers() {
                        // A peer that is not running yet refuses datagrams; it may start later.
                        if let Err(e) = socket.send_to(&bytes, receiver).await {
                            tracing::debug!("{receiver}: {e}");
                        }
                    }
                }
            },
            () = until(peer.next_knock) => {
                if let (true, Some(address)) = (peer.knocks(Instant::now()), peer.address) {
                    let _ = socket.send_to(&[], address).await;
                }
            }
            received = socket.recv_from(&mut buffer) => match received {
                Ok((0, sender)) => peer.handle_knock(sender, Instant::now()),
                Ok((n, sender)) => {
                    let bytes = Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default());
                    if peer.takes(sender, Instant::now()) && !ends.report(FromPort::Datagram(bytes, sender)).await {
                        return Ok(());
                    }
                }
                // The refusal of a peer that is not running yet is returned as an error of this call.
                Err(_) => tokio::time::sleep(RETRY_INTERVAL).await,
            },
            e = silence(peer.last_read, quiet) => return Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Port;
    use super::*;

    /// The other end, or a stranger.
    struct Sender(UdpSocket);

    impl Sender {
        async fn new() -> Self {
            Self(UdpSocket::bind("127.0.0.1:0").await.unwrap())
        }

        fn address(&self) -> SocketAddr {
            self.0.local_addr().unwrap()
        }

        fn datagram(&self, byte: u8) -> FromPort {
            FromPort::Datagram(vec![byte].into(), self.address())
        }
    }

    /// A port without a configured address.
    struct Carried {
        port: Port,
        address: SocketAddr,
    }

    impl Carried {
        async fn new(rule: PeerRule) -> Self {
            let own = UdpSocket::bind("127.0.0.1:0").await.unwrap();
            let address = own.local_addr().unwrap();
            let (mut port, mut ends) = Port::pair();
            let peer = UdpPeer::new("test", None, rule, true, Instant::now());
            tokio::spawn(async move { carry(own, peer, None, &mut ends).await });
            assert_eq!(port.next().await, FromPort::Open);
            Self { port, address }
        }

        async fn send(&self, from: &Sender, byte: u8) {
            from.0.send_to(&[byte], self.address).await.unwrap();
        }

        /// Sends a datagram that the host gets.
        async fn reports(&mut self, from: &Sender, byte: u8) {
            self.send(from, byte).await;
            assert_eq!(self.port.next().await, from.datagram(byte));
        }

        /// Writes a datagram that `to` gets; the port has then handled all judgements before it.
        async fn writes(&self, to: &Sender, byte: u8) {
            assert!(self.port.write(vec![byte]));
            let mut buffer = [0; 8];
            assert_eq!(to.0.recv(&mut buffer).await.unwrap(), 1);
            assert_eq!(buffer[0], byte);
        }
    }

    #[tokio::test]
    async fn a_stranger_that_speaks_first_does_not_lock_out_the_peer() {
        let mut carried = Carried::new(PeerRule::Judged).await;
        let (stranger, peer) = (Sender::new().await, Sender::new().await);
        carried.reports(&stranger, 1).await;
        carried.port.judge(stranger.address(), FrameOutcome::Dropped);
        carried.reports(&peer, 2).await;
        carried.reports(&stranger, 3).await;
        carried.port.judge(peer.address(), FrameOutcome::Accepted);
        carried.port.judge(stranger.address(), FrameOutcome::Accepted);
        carried.writes(&peer, 4).await;
        carried.send(&stranger, 5).await;
        carried.reports(&peer, 6).await;
    }

    #[tokio::test]
    async fn an_end_without_an_address_answers_all_that_knock() {
        let mut carried = Carried::new(PeerRule::Judged).await;
        let (vehicle, stranger) = (Sender::new().await, Sender::new().await);
        vehicle.0.send_to(&[], carried.address).await.unwrap();
        stranger.0.send_to(&[], carried.address).await.unwrap();
        carried.reports(&stranger, 1).await;
        carried.writes(&vehicle, 2).await;
        assert_eq!(stranger.0.recv(&mut [0; 8]).await.unwrap(), 1, "it is answered, too");
        carried.port.judge(vehicle.address(), FrameOutcome::Accepted);
        carried.writes(&vehicle, 3).await;
        stranger.0.send_to(&[], carried.address).await.unwrap();
        carried.reports(&vehicle, 4).await;
        carried.writes(&vehicle, 5).await;
        assert!(stranger.0.try_recv(&mut [0; 8]).is_err(), "the vehicle alone is heard");
    }

    #[test]
    fn an_end_with_an_address_knocks_until_it_is_answered() {
        let (now, address) = (Instant::now(), "192.0.2.1:4001".parse::<SocketAddr>().unwrap());
        let mut peer = UdpPeer::new("test", Some(address), PeerRule::Judged, true, now);
        assert!(peer.knocks(now) && !peer.knocks(now + KNOCK_INTERVAL / 2) && peer.knocks(now + KNOCK_INTERVAL));
        assert!(peer.takes(address, now + KNOCK_INTERVAL));
        assert!(!peer.knocks(now + SILENCE_TIMEOUT) && peer.knocks(now + KNOCK_INTERVAL + SILENCE_TIMEOUT));
        assert!(
            !UdpPeer::new("test", Some(address), PeerRule::Judged, false, now).knocks(now),
            "an autopilot knows its own"
        );
    }

    #[tokio::test]
    async fn the_sender_of_a_replay_is_answered_but_not_pinned() {
        let mut carried = Carried::new(PeerRule::Judged).await;
        let (stranger, peer) = (Sender::new().await, Sender::new().await);
        carried.reports(&stranger, 1).await;
        carried.port.judge(stranger.address(), FrameOutcome::Opened);
        carried.writes(&stranger, 2).await;
        carried.reports(&peer, 3).await;
        carried.port.judge(peer.address(), FrameOutcome::Opened);
        carried.writes(&peer, 4).await;
    }

    #[tokio::test]
    async fn a_pin_without_accepted_datagrams_lasts_ten_seconds() {
        let mut carried = Carried::new(PeerRule::Judged).await;
        let (stranger, peer) = (Sender::new().await, Sender::new().await);
        carried.reports(&stranger, 1).await;
        carried.port.judge(stranger.address(), FrameOutcome::Accepted);
        carried.writes(&stranger, 2).await;
        tokio::time::pause();
        tokio::time::advance(SILENCE_TIMEOUT - Duration::from_secs(1)).await;
        carried.send(&peer, 3).await;
        carried.reports(&stranger, 4).await;
        carried.port.judge(stranger.address(), FrameOutcome::Opened);
        carried.writes(&stranger, 5).await;
        tokio::time::advance(Duration::from_secs(1)).await;
        carried.reports(&peer, 6).await;
        carried.port.judge(peer.address(), FrameOutcome::Accepted);
        carried.writes(&peer, 7).await;
        carried.send(&stranger, 8).await;
        carried.reports(&peer, 9).await;
    }

    #[tokio::test]
    async fn the_first_sender_is_the_only_one_until_it_is_silent() {
        let mut carried = Carried::new(PeerRule::First).await;
        let (first, second) = (Sender::new().await, Sender::new().await);
        carried.reports(&first, 1).await;
        carried.send(&second, 2).await;
        carried.reports(&first, 3).await;
        carried.writes(&first, 4).await;
        tokio::time::pause();
        tokio::time::advance(SILENCE_TIMEOUT).await;
        carried.reports(&second, 5).await;
        carried.send(&first, 6).await;
        carried.reports(&second, 7).await;
    }

    #[test]
    fn a_configured_address_is_listened_to_at_any_of_its_ports() {
        let now = Instant::now();
        let address = |text: &str| text.parse::<SocketAddr>().unwrap();
        let mut peer = UdpPeer::new("test", Some(address("192.0.2.1:4001")), PeerRule::Judged, true, now);
        assert!(peer.takes(address("192.0.2.1:9"), now));
        peer.handle_judged(address("192.0.2.1:9"), FrameOutcome::Accepted, now);
        assert!(!peer.takes(address("192.0.2.2:4001"), now + 9 * SILENCE_TIMEOUT));
        assert_eq!(peer.address, Some(address("192.0.2.1:4001")), "datagrams go to the configured port");
    }
}
