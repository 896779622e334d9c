use crate::command::*;
use proptest::prelude::*;
use scenecast_core::{ClientName, Giver, Principal, Role};
use scenecast_protocol::time::Instant;

fn crew() -> [Giver; 4] {
    let of = |name, role| Giver::from(Principal::new(name, role).unwrap());
    [
        of("victor", Role::Viewer),
        of("anna", Role::Operator),
        of("bob", Role::Operator),
        of("carla", Role::Administrator),
    ]
}

fn principals() -> [Principal; 4] {
    crew().map(|giver| giver.principal)
}

/// The same principal at another client.
fn elsewhere(by: &Giver, client: &str) -> Giver {
    Giver { client: ClientName::new(client).unwrap(), ..by.clone() }
}

fn at(seconds: u64) -> Instant {
    Instant::from_micros(seconds * 1_000_000)
}

#[test]
fn the_first_order_takes_command_and_others_are_refused() {
    let [victor, anna, bob, _] = crew();
    let mut command = Command::new(principals());
    assert!(matches!(command.check(&victor, OrderKind::Stop, at(0)), Err(CommandRefusal::Role { .. })));
    assert_eq!(command.handle_order(&bob, OrderKind::Stop, at(0)), None, "a stop takes no command");
    assert!(command.holder().is_none());
    assert_eq!(command.handle_order(&anna, OrderKind::Order, at(1)).unwrap().to.as_deref(), Some("anna"));
    let refusal = command.check(&bob, OrderKind::Order, at(35)).unwrap_err().to_string();
    assert_eq!(
        refusal,
        "anna has had command for 34 s and was last active 34 s ago: request it, or take it after 1 min 26 s more without a \
         sign of the holder"
    );
    assert!(command.check(&bob, OrderKind::Stop, at(35)).is_ok());
}

#[test]
fn command_is_taken_after_silence_only() {
    let [_, anna, bob, _] = crew();
    let mut command = Command::new(principals());
    command.handle_action(&anna, &CommandAction::Take, at(0)).unwrap();
    command.handle_action(&anna, &CommandAction::Keep, at(100)).unwrap();
    let refusal = command.handle_action(&bob, &CommandAction::Take, at(219)).unwrap_err();
    assert!(matches!(refusal, CommandRefusal::Held { .. }), "{refusal}");
    let change = command.handle_action(&bob, &CommandAction::Take, at(220)).unwrap().unwrap();
    assert_eq!((change.from.as_deref(), change.to.as_deref()), (Some("anna"), Some("bob")));
}

#[test]
fn command_is_handed_over_to_an_operator_on_request() {
    let [_, anna, bob, carla] = crew();
    let mut command = Command::new(principals());
    let act = |command: &mut Command, by: &Giver, action, s| command.handle_action(by, &action, at(s));
    act(&mut command, &anna, CommandAction::Request, 0).unwrap();
    assert_eq!(act(&mut command, &anna, CommandAction::HandOver(None), 1), Err(CommandRefusal::NoRequest));
    act(&mut command, &bob, CommandAction::Request, 2).unwrap();
    act(&mut command, &carla, CommandAction::Request, 3).unwrap();
    let to = |name: &str| CommandAction::HandOver(Some(name.to_owned()));
    let wrong = act(&mut command, &anna, to("victor"), 4).unwrap_err();
    assert!(wrong.to_string().contains("the role of victor is viewer"), "{wrong}");
    assert_eq!(act(&mut command, &anna, to("dora"), 4), Err(CommandRefusal::Unknown("dora".to_owned())));
    assert!(act(&mut command, &bob, to("bob"), 4).is_err(), "only the holder hands it over");
    let change = act(&mut command, &anna, CommandAction::HandOver(None), 5).unwrap().unwrap();
    assert_eq!((change.kind, change.to.as_deref()), (CommandChangeKind::HandedOver, Some("bob")));
    let pending: Vec<_> = command.requests(at(6)).map(|r| r.principal.name()).collect();
    assert_eq!(pending, ["carla"]);
    assert_eq!(command.requests(at(200)).count(), 0, "requests lapse");
}

#[test]
fn command_belongs_to_the_client_that_took_it() {
    let [_, anna, bob, _] = crew();
    let [bridge, cabin] = ["bridge", "cabin"].map(|client| elsewhere(&anna, client));
    let mut command = Command::new(principals());
    command.handle_order(&bridge, OrderKind::Order, at(0)).unwrap();
    let refusal = command.check(&cabin, OrderKind::Order, at(1)).unwrap_err().to_string();
    assert_eq!(refusal, "anna has command at another client (bridge): take command to move it here");
    assert!(command.check(&cabin, OrderKind::Stop, at(1)).is_ok());
    command.handle_action(&cabin, &CommandAction::Keep, at(60)).unwrap();
    assert_eq!(command.holder().unwrap().last_active, at(0), "a sign of another client is none of the holder");
    assert!(command.handle_action(&cabin, &CommandAction::Release, at(61)).is_err());
    let moved = command.handle_action(&cabin, &CommandAction::Take, at(62)).unwrap().unwrap();
    assert_eq!((moved.kind, moved.to.as_deref()), (CommandChangeKind::Moved, Some("anna")));
    assert!(command.check(&cabin, OrderKind::Order, at(63)).is_ok());
    assert!(command.check(&bridge, OrderKind::Order, at(63)).is_err());
    assert!(matches!(command.check(&bob, OrderKind::Order, at(63)), Err(CommandRefusal::Held { .. })));
}

#[test]
fn command_handed_over_belongs_to_the_first_client_to_use_it() {
    let [_, anna, bob, _] = crew();
    let [bridge, cabin] = ["bridge", "cabin"].map(|client| elsewhere(&bob, client));
    let mut command = Command::new(principals());
    command.handle_action(&anna, &CommandAction::Take, at(0)).unwrap();
    command.handle_action(&anna, &CommandAction::HandOver(Some("bob".to_owned())), at(1)).unwrap();
    assert!([&bridge, &cabin].iter().all(|by| command.check(by, OrderKind::Order, at(2)).is_ok()));
    assert_eq!(command.handle_order(&cabin, OrderKind::Order, at(2)), None);
    assert!(command.check(&bridge, OrderKind::Order, at(3)).is_err());
}

#[derive(Debug, Clone)]
enum CommandStep {
    Order(OrderKind),
    Act(CommandAction),
}

fn step() -> impl Strategy<Value = CommandStep> {
    let name = prop::sample::select(vec!["victor", "anna", "bob", "carla", "dora"]);
    let to = prop::option::of(name).prop_map(|to| CommandAction::HandOver(to.map(str::to_owned)));
    let others = vec![
        CommandAction::Request,
        CommandAction::Withdraw,
        CommandAction::Take,
        CommandAction::Release,
        CommandAction::Keep,
    ];
    let orders = prop::sample::select(vec![OrderKind::Stop, OrderKind::Record, OrderKind::Order, OrderKind::Settings]);
    prop_oneof![
        orders.prop_map(CommandStep::Order),
        to.prop_map(CommandStep::Act),
        prop::sample::select(others).prop_map(CommandStep::Act)
    ]
}

proptest! {
    /// Command passes only by the holder's hand, by release, after silence, or where nobody has it.
    #[test]
    fn command_changes_hands_by_the_rules_only(steps in prop::collection::vec((0usize..4, 0u64..150, step()), 1..80)) {
        let crew = crew();
        let mut command = Command::new(principals());
        let (mut seconds, mut last_sign, mut recorded) = (0, 0, None);
        for (who, pause, step) in steps {
            seconds += pause;
            let (by, now) = (&crew[who], at(seconds));
            let before = command.holder().map(|h| h.principal.name().to_owned());
            let is_own = before.as_deref() == Some(by.name());
            let mut is_sign = is_own;
            let change = match &step {
                CommandStep::Order(kind) => {
                    let allowed = command.check(by, *kind, now).is_ok();
                    let has_command = !kind.needs_command() || is_own || before.is_none();
                    prop_assert_eq!(allowed, by.role() >= kind.role() && has_command);
                    is_sign &= allowed;
                    command.handle_order(by, *kind, now)
                }
                CommandStep::Act(action) => command.handle_action(by, action, now).ok().flatten(),
            };
            let after = command.holder().map(|h| h.principal.name().to_owned());
            if before != after {
                let by_rule = match &step {
                    CommandStep::Order(kind) => before.is_none() && kind.needs_command(),
                    CommandStep::Act(CommandAction::HandOver(_) | CommandAction::Release) => is_own,
                    CommandStep::Act(CommandAction::Request) => before.is_none(),
                    CommandStep::Act(CommandAction::Take) => before.is_none() || seconds - last_sign >= 120,
                    CommandStep::Act(_) => false,
                };
                prop_assert!(by_rule, "{} took it by {:?}", by.name(), step);
            }
            if let Some(change) = &change {
                prop_assert_eq!((&change.from, &change.to, &*change.by), (&before, &after, by.name()));
                recorded = change.to.clone();
            }
            prop_assert_eq!(&recorded, &after, "each change of the holder is recorded");
            prop_assert!(command.holder().is_none_or(|h| h.principal.role() >= Role::Operator));
            prop_assert!(command.changes().count() <= 32 && command.requests(now).count() <= 4);
            // A sign of the holder: its own step unless refused, or that by which it became the holder.
            if before != after || is_sign {
                last_sign = seconds;
            }
        }
    }
}

#[test]
fn a_refused_request_for_command_is_in_the_log() {
    use crate::{ClientRequest, LogKind, Reply, SurfaceRequest, handle_request};
    let config = scenecast_config::load(None, &[]).unwrap();
    let modem = scenecast_config::modem_profile(&config, 10_000.0);
    let table = scenecast_core::tuning_table::TuningTable::shipped();
    let mut surface = crate::assemble(&config, None, table, modem, 1, at(0)).unwrap();
    surface.set_principals(principals().to_vec());
    let [_, anna, bob, _] = crew();
    let mut ask = |by: Giver, action: CommandAction| {
        let request = ClientRequest { by: Some(by), request: SurfaceRequest::Command(action) };
        handle_request(&mut surface, request, 0.5, at(1))
    };
    assert!(matches!(ask(anna, CommandAction::Take), Reply::Command(_)));
    assert!(matches!(ask(bob.clone(), CommandAction::Take), Reply::NotInCommand(_)));
    assert!(matches!(ask(bob, CommandAction::Keep), Reply::Command(_)), "a sign of presence asks for nothing");
    let refused: Vec<_> = surface.log().entries().filter(|entry| entry.kind == LogKind::Refused).collect();
    let told = "taking of command: refused: anna has had command for 0 s";
    assert!(refused.len() == 1 && refused[0].by.as_deref() == Some("bob"), "{refused:?}");
    assert!(refused[0].text.starts_with(told), "{}", refused[0].text);
}
