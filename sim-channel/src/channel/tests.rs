use super::*;
use proptest::prelude::*;

const A: NodeId = NodeId(1);
const B: NodeId = NodeId(2);
const C: NodeId = NodeId(3);
const SECOND: Duration = Duration::from_secs(1);

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// Nodes on a line, `(number, metres east)`.
fn line(config: ChannelConfig, seed: u64, nodes: &[(NodeId, f64)]) -> Channel {
    let mut channel = Channel::new(config, seed);
    for (node, x_m) in nodes {
        channel.place(*node, NodePosition::new(*x_m, 0.0, 0.0));
    }
    channel
}

fn pair(config: ChannelConfig, seed: u64) -> Channel {
    line(config, seed, &[(A, 0.0), (B, 1500.0)])
}

fn drain(channel: &mut Channel) -> Vec<Arrival> {
    std::iter::from_fn(|| channel.poll_arrival(Duration::MAX)).collect()
}

fn reason(arrival: &Arrival) -> Option<LossReason> {
    match &arrival.outcome {
        ReceptionOutcome::Lost { reason, .. } => Some(*reason),
        ReceptionOutcome::Delivered { .. } => None,
    }
}

/// Reason of the loss of transmission `number` at `node`; `None` if it was delivered.
fn fate(arrivals: &[Arrival], number: u64, node: NodeId) -> Option<LossReason> {
    reason(arrivals.iter().find(|a| a.transmission == number && a.to == node).expect("arrival"))
}

#[test]
fn delay_is_range_over_sound_speed_plus_airtime() {
    let mut channel = pair(ChannelConfig::default(), 1);
    channel.transmit(A, vec![7; 9], ms(500), SECOND);
    assert_eq!(channel.poll_timeout(), Some(ms(2500)));
    assert_eq!(channel.poll_arrival(ms(2499)), None);
    let arrival = channel.poll_arrival(ms(2500)).expect("complete");
    assert_eq!((arrival.from, arrival.to, arrival.sent_at, arrival.at), (A, B, SECOND, ms(2500)));
    assert_eq!(arrival.range_m, 1500.0);
    assert_eq!(arrival.outcome, ReceptionOutcome::Delivered { bytes: vec![7; 9], copy: 0, corrupted: false });
    assert_eq!(channel.poll_timeout(), None);
}

#[test]
fn every_other_node_gets_its_own_copy_nearest_first() {
    let mut channel = line(ChannelConfig::default(), 1, &[(A, 0.0), (B, 3000.0), (C, 1500.0)]);
    channel.transmit(A, vec![1], ms(100), Duration::ZERO);
    let order: Vec<_> = drain(&mut channel).iter().map(|a| (a.to, a.at)).collect();
    assert_eq!(order, [(C, ms(1100)), (B, ms(2100))]);
}

#[test]
fn a_moved_node_changes_the_delay_of_later_frames_only() {
    let mut channel = pair(ChannelConfig::default(), 1);
    channel.transmit(A, vec![1], ms(100), Duration::ZERO);
    channel.place(B, NodePosition::new(3000.0, 0.0, 0.0));
    channel.transmit(A, vec![2], ms(100), SECOND);
    let times: Vec<_> = drain(&mut channel).iter().map(|a| a.at).collect();
    assert_eq!(times, [ms(1100), ms(3100)]);
}

#[test]
fn transmitter_misses_signals_that_overlap_its_own() {
    let mut channel = pair(ChannelConfig::default(), 1);
    let first = channel.transmit(A, vec![1], SECOND, Duration::ZERO);
    let second = channel.transmit(B, vec![2], SECOND, ms(1500));
    let arrivals = drain(&mut channel);
    assert_eq!(fate(&arrivals, first, B), Some(LossReason::SelfDeaf));
    assert_eq!(fate(&arrivals, second, A), None, "A had ended before");
}

#[test]
fn signal_during_own_transmission_is_missed() {
    let mut channel = pair(ChannelConfig::default(), 1);
    channel.transmit(B, vec![2], Duration::from_secs(3), Duration::ZERO);
    let late = channel.transmit(A, vec![1], SECOND, ms(100));
    assert_eq!(fate(&drain(&mut channel), late, B), Some(LossReason::SelfDeaf));
}

#[test]
fn full_duplex_receives_while_transmitting() {
    let mut channel = pair(ChannelConfig { half_duplex: false, ..Default::default() }, 1);
    channel.transmit(A, vec![1], SECOND, Duration::ZERO);
    channel.transmit(B, vec![2], SECOND, ms(1500));
    assert!(drain(&mut channel).iter().all(|a| reason(a).is_none()));
}

#[test]
fn collisions_are_judged_where_the_signals_meet() {
    let mut channel = line(ChannelConfig::default(), 1, &[(A, 0.0), (B, 1500.0), (C, 3000.0)]);
    let a = channel.transmit(A, vec![1], ms(200), Duration::ZERO);
    let c = channel.transmit(C, vec![2], ms(200), Duration::ZERO);
    let arrivals = drain(&mut channel);
    assert_eq!(fate(&arrivals, a, B), Some(LossReason::Collision));
    assert_eq!(fate(&arrivals, c, B), Some(LossReason::Collision));
    assert_eq!(fate(&arrivals, a, C), None, "C had ended before");
}

#[test]
fn signals_that_touch_do_not_collide() {
    let mut channel = pair(ChannelConfig::default(), 1);
    channel.transmit(A, vec![1], ms(200), Duration::ZERO);
    channel.transmit(A, vec![2], ms(200), ms(200));
    assert!(drain(&mut channel).iter().all(|a| reason(a).is_none()));
}

#[test]
fn node_is_busy_exactly_while_it_transmits() {
    let mut channel = pair(ChannelConfig::default(), 1);
    channel.transmit(A, vec![1], ms(200), SECOND);
    assert!(!channel.is_busy(A, ms(999)));
    assert!(channel.is_busy(A, SECOND));
    assert!(channel.is_busy(A, ms(1199)));
    assert!(!channel.is_busy(A, ms(1200)));
    assert!(!channel.is_busy(B, SECOND));
}

#[test]
fn outage_loses_only_the_frames_it_touches() {
    let config = ChannelConfig { outages: vec![Outage::all(ms(10_000), ms(20_000))], ..Default::default() };
    let mut channel = pair(config, 1);
    let sent = [ms(8_900), ms(8_901), ms(15_000), ms(18_999), ms(19_000)];
    let numbers: Vec<_> = sent.iter().map(|at| channel.transmit(A, vec![1], ms(100), *at)).collect();
    let arrivals = drain(&mut channel);
    let fates: Vec<_> = numbers.iter().map(|n| fate(&arrivals, *n, B)).collect();
    assert_eq!(fates, [None, Some(LossReason::Outage), Some(LossReason::Outage), Some(LossReason::Outage), None]);
}

#[test]
fn one_way_link_carries_the_other_direction() {
    let config = ChannelConfig { outages: vec![Outage::one_way(A, B)], ..Default::default() };
    let mut channel = pair(config, 1);
    let there = channel.transmit(A, vec![1], ms(100), Duration::ZERO);
    let back = channel.transmit(B, vec![1], ms(100), Duration::from_secs(9));
    let arrivals = drain(&mut channel);
    assert_eq!((fate(&arrivals, there, B), fate(&arrivals, back, A)), (Some(LossReason::Outage), None));
}

#[test]
fn out_of_range_frame_disturbs_no_other() {
    let config = ChannelConfig { max_range_m: 2000.0, ..Default::default() };
    let mut channel = line(config, 1, &[(A, 0.0), (B, 3000.0), (C, 4500.0)]);
    let far = channel.transmit(A, vec![1], SECOND, Duration::ZERO);
    let near = channel.transmit(C, vec![1], SECOND, SECOND);
    let arrivals = drain(&mut channel);
    assert_eq!(fate(&arrivals, far, B), Some(LossReason::OutOfRange));
    assert_eq!(fate(&arrivals, near, B), None);
}

#[test]
fn corruption_flips_bits_and_keeps_the_length() {
    let mut channel = pair(ChannelConfig { corruption: 1.0, ..Default::default() }, 1);
    channel.transmit(A, vec![0; 20], ms(100), Duration::ZERO);
    let ReceptionOutcome::Delivered { bytes, corrupted: true, .. } = drain(&mut channel).remove(0).outcome else {
        panic!("delivered, corrupted")
    };
    let flipped: u32 = bytes.iter().map(|b| b.count_ones()).sum();
    assert!(bytes.len() == 20 && (1..=8).contains(&flipped));
}

#[test]
fn empty_frame_is_not_corrupted() {
    let mut channel = pair(ChannelConfig { corruption: 1.0, ..Default::default() }, 1);
    channel.transmit(A, vec![], ms(100), Duration::ZERO);
    let expected = ReceptionOutcome::Delivered { bytes: vec![], copy: 0, corrupted: false };
    assert_eq!(drain(&mut channel).remove(0).outcome, expected);
}

#[test]
fn duplicates_are_numbered() {
    let mut channel = pair(ChannelConfig { duplication: 1.0, ..Default::default() }, 1);
    channel.transmit(A, vec![5], ms(100), Duration::ZERO);
    let copies: Vec<_> = drain(&mut channel).into_iter().map(|a| a.outcome).collect();
    let copy = |copy| ReceptionOutcome::Delivered { bytes: vec![5], copy, corrupted: false };
    assert_eq!(copies, [copy(0), copy(1)]);
}

#[test]
fn late_frames_are_overtaken() {
    let config = ChannelConfig { reordering: 0.5, reorder_delay: SECOND, ..Default::default() };
    let mut channel = pair(config, 1);
    for n in 0..40 {
        channel.transmit(A, vec![n as u8], ms(100), ms(300 * n));
    }
    let arrivals = drain(&mut channel);
    assert!(arrivals.windows(2).all(|w| w[0].at <= w[1].at), "in order of time");
    assert!(arrivals.windows(2).any(|w| w[0].transmission > w[1].transmission), "not in order of sending");
    assert_eq!(arrivals.len(), 40);
}

#[test]
fn independent_loss_meets_its_probability() {
    let mut channel =
        pair(ChannelConfig { loss: LossModel::Independent { probability: 0.3 }, ..Default::default() }, 5);
    for n in 0..20_000 {
        channel.transmit(A, vec![0], ms(100), ms(200 * n));
    }
    let lost = drain(&mut channel).iter().filter(|a| reason(a) == Some(LossReason::Noise)).count();
    assert!((lost as f64 / 20_000.0 - 0.3).abs() < 0.01, "{lost}");
}

fn stormy() -> ChannelConfig {
    ChannelConfig {
        loss: LossModel::Independent { probability: 0.3 },
        corruption: 0.2,
        duplication: 0.2,
        reordering: 0.2,
        ..Default::default()
    }
}

#[test]
fn equal_seeds_repeat_and_other_seeds_differ() {
    let run = |seed| {
        let mut channel = pair(stormy(), seed);
        for n in 0..50 {
            channel.transmit(A, vec![n as u8; 8], ms(100), ms(200 * n));
        }
        drain(&mut channel)
    };
    assert_eq!(run(4), run(4));
    assert_ne!(run(4), run(5));
}

#[test]
fn traffic_on_one_link_leaves_other_links_unchanged() {
    let run = |busy: bool| {
        let mut channel = line(stormy(), 9, &[(A, 0.0), (B, 1500.0), (C, 4500.0)]);
        for n in 0..100 {
            channel.transmit(A, vec![n as u8; 8], ms(100), ms(20_000 * n));
            if busy {
                channel.transmit(C, vec![1; 8], ms(100), ms(20_000 * n + 10_000));
            }
        }
        drain(&mut channel)
            .into_iter()
            .filter(|a| a.from == A && a.to == B)
            .map(|a| (a.at, a.outcome))
            .collect::<Vec<_>>()
    };
    assert_eq!(run(false), run(true));
}

#[test]
fn loss_can_be_changed_while_running_and_per_link() {
    let mut channel = line(ChannelConfig::default(), 1, &[(A, 0.0), (B, 1500.0), (C, -1500.0)]);
    let all = LossModel::Independent { probability: 1.0 };
    let first = channel.transmit(A, vec![1], ms(100), Duration::ZERO);
    channel.set_link_loss(A, C, LossModel::None);
    channel.set_config(ChannelConfig { loss: all, ..Default::default() });
    let second = channel.transmit(A, vec![1], ms(100), SECOND);
    let arrivals = drain(&mut channel);
    assert_eq!(fate(&arrivals, first, B), None);
    assert_eq!(fate(&arrivals, second, B), Some(LossReason::Noise));
    assert_eq!(fate(&arrivals, second, C), None);
}

#[test]
fn node_on_a_track_transmits_from_its_current_position() {
    let mut channel = pair(ChannelConfig::default(), 1);
    let track = Track::new(vec![
        (Duration::ZERO, NodePosition::new(1500.0, 0.0, 0.0)),
        (Duration::from_secs(1000), NodePosition::new(3000.0, 0.0, 0.0)),
    ]);
    channel.follow_track(B, track, Duration::ZERO);
    channel.transmit(A, vec![1], ms(100), Duration::from_secs(500));
    assert_eq!(drain(&mut channel)[0].range_m, 2250.0);
    assert_eq!(channel.range_m(A, B), Some(2250.0));
}

#[test]
fn an_hour_of_fifteen_busy_nodes_runs_quickly() {
    let mut channel =
        Channel::new(ChannelConfig { duplication: 0.05, reordering: 0.05, ..crate::channel::presets::storm() }, 1);
    for n in 0..15u8 {
        channel.place(NodeId(n), NodePosition::new(200.0 * f64::from(n), 0.0, 0.0));
    }
    let mut arrivals = 0;
    for second in 0..3600u64 {
        for n in 0..15u8 {
            channel.transmit(NodeId(n), vec![n; 64], ms(50), ms(1000 * second + 60 * u64::from(n)));
        }
        while channel.poll_arrival(ms(1000 * second + 999)).is_some() {
            arrivals += 1;
        }
    }
    assert!(arrivals > 3500 * 15 * 14);
}

#[test]
fn transmission_cut_short_is_lost_and_frees_the_sender() {
    let mut channel = pair(ChannelConfig::default(), 1);
    let number = channel.transmit(A, vec![1], SECOND, Duration::ZERO);
    channel.cut_short(number, ms(300));
    assert!(!channel.is_busy(A, ms(300)));
    let whole = channel.transmit(A, vec![1], SECOND, Duration::from_secs(5));
    channel.cut_short(whole, ms(6500));
    let arrivals = drain(&mut channel);
    assert_eq!(fate(&arrivals, number, B), Some(LossReason::Noise));
    assert_eq!(fate(&arrivals, whole, B), None);
}

#[test]
fn onsets_precede_arrivals_at_listening_nodes() {
    let mut channel = pair(ChannelConfig::default(), 1);
    channel.report_onsets();
    channel.transmit(A, vec![1], SECOND, Duration::ZERO);
    assert_eq!(channel.poll_timeout(), Some(SECOND));
    let onset = channel.poll_onset(SECOND).expect("onset");
    assert_eq!((onset.to, onset.at, onset.airtime), (B, SECOND, SECOND));
    assert_eq!(channel.poll_timeout(), Some(2 * SECOND));
    assert!(channel.poll_arrival(2 * SECOND).is_some());
    channel.transmit(A, vec![1], SECOND, 10 * SECOND);
    channel.transmit(B, vec![1], SECOND, ms(10_900));
    let receivers: Vec<_> = std::iter::from_fn(|| channel.poll_onset(20 * SECOND)).map(|onset| onset.to).collect();
    assert_eq!(receivers, [A], "B transmitted when the signal of A came");
}

proptest! {
    #[test]
    fn each_transmission_ends_once_at_each_other_node(
        seed in any::<u64>(),
        positions in proptest::collection::vec((0.0..5000.0f64, 0.0..5000.0f64), 1..7),
        traffic in proptest::collection::vec((0usize..7, 0u64..3000, 1u64..2000), 1..60),
    ) {
        let config = ChannelConfig { duplication: 0.1, reordering: 0.1, ..crate::channel::presets::under_ice() };
        let mut channel = Channel::new(config, seed);
        for (node, (x_m, y_m)) in (0u8..).zip(&positions) {
            channel.place(NodeId(node), NodePosition::new(*x_m, *y_m, 0.0));
        }
        let mut now = Duration::ZERO;
        let mut arrivals = Vec::new();
        for (node, pause, airtime) in &traffic {
            now += ms(*pause);
            arrivals.extend(std::iter::from_fn(|| channel.poll_arrival(now)));
            channel.transmit(NodeId((node % positions.len()) as u8), vec![1, 2, 3], ms(*airtime), now);
        }
        arrivals.extend(drain(&mut channel));
        prop_assert!(arrivals.windows(2).all(|w| w[0].at <= w[1].at));
        let first = |a: &&Arrival| !matches!(a.outcome, ReceptionOutcome::Delivered { copy: 1, .. });
        let mut ends: Vec<_> = arrivals.iter().filter(first).map(|a| (a.transmission, a.to)).collect();
        prop_assert_eq!(ends.len(), traffic.len() * (positions.len() - 1));
        ends.sort();
        ends.dedup();
        prop_assert_eq!(ends.len(), traffic.len() * (positions.len() - 1));
        prop_assert_eq!(channel.poll_timeout(), None);
    }
}
