// Who has command: in the bar, and a dialog that requests it, takes it, hands it over or gives it up.

import { logOut, sendCommand } from "../api.js";
import { hasCommand, holder, isElsewhere, principal, rank } from "../command.js";
import { $, announce, h, text } from "../dom.js";
import { missionTime, span } from "../format.js";
import { ageOf, store } from "../store.js";

const SHOWN_CHANGES = 12;
const ages = h("p");
const errorLine = h("p.error", { role: "alert" });
let shown = null;
let announced = null;

export function startCommand() {
  $("command").addEventListener("click", open);
  $("dialog").addEventListener("close", () => (shown = null));
  store.on("state edit tick feed", update);
}

/** The bar has room for a short line. */
function caption() {
  if (hasCommand()) return "You have command";
  return isElsewhere() ? "Command is elsewhere" : `${holder()?.name ?? "Nobody"} has command`;
}

function update() {
  if (!store.snapshot?.command) return;
  const now = caption();
  text($("command"), now);
  $("command").dataset.state = hasCommand() ? "own" : holder() ? "other" : "none";
  if (announced !== null && announced !== now && !store.replay) announce(now);
  announced = now;
  if (shown !== null && $("dialog").open) refresh();
}

function open() {
  shown = "";
  text(errorLine, "");
  refresh();
  $("dialog").showModal();
}

const canTake = () => holder() !== null && store.nowS >= holder().takeable_s;
const isPending = () => store.snapshot.command.requests.some((r) => r.name === principal()?.name);

function refresh() {
  text(ages, describe());
  const { command } = store.snapshot;
  const key = JSON.stringify([principal(), holder()?.name, holder()?.client, command.requests, command.history, canTake()]);
  if (key === shown) return;
  shown = key;
  const mayCommand = principal() && rank(principal().role) >= rank("operator");
  $("dialog").replaceChildren(
    h("h2", { id: "dialog-title" }, "Command"), ages,
    principal() ? h("p", {}, `You are ${principal().name}, ${principal().role}.`) : null,
    h("p.hint", {}, "Orders need command; hold and abort do not."),
    mayCommand ? h("div.buttons.command", {}, ...actions()) : h("p.note", {}, "Command needs the role operator."),
    errorLine,
    h("h3", {}, "History"), history(command.history),
    h("div.buttons", {}, command.principals.length > 0 ? h("button", { type: "button", id: "log-out", onclick: leave }, "Log out") : null,
      h("button.primary", { type: "button", onclick: () => $("dialog").close() }, "Close")),
  );
}

function describe() {
  const now = holder();
  if (!now) return "Nobody has command. The first order takes it.";
  if (isElsewhere()) return `${now.name} has command at another client${now.client ? ` (${now.client})` : ""}. Take it to move it here.`;
  const left = now.takeable_s - store.nowS;
  const take = hasCommand() ? "" : left > 0 ? ` It can be taken in ${span(left)} without a sign of ${now.name}.` : " It can be taken.";
  return `${now.name} has had command for ${span(ageOf(now.since_s))}, last active ${span(ageOf(now.last_active_s))} ago.${take}`;
}

function actions() {
  const button = (name, action, to = null, disabled = false) => h("button", { type: "button", disabled, onclick: () => act(action, to) }, name);
  if (!holder() || isElsewhere()) return [button("Take command", "take")];
  if (!hasCommand()) {
    return [isPending() ? button("Withdraw request", "withdraw") : button("Request command", "request"), button("Take command", "take", null, !canTake())];
  }
  const { principals } = store.snapshot.command;
  const others = principals.filter((p) => p.name !== principal().name && rank(p.role) >= rank("operator"));
  return [...others.map((p) => button(`Hand over to ${p.name}`, "hand_over", p.name)), button("Give up command", "release")];
}

function history(changes) {
  if (changes.length === 0) return h("p.note", {}, "No change since the surface started.");
  const line = (c) => h("li", {}, h("span.since", {}, missionTime(c.at_s)), " ", h("span", {}, sentence(c)));
  return h("ol.changes", {}, ...changes.slice(-SHOWN_CHANGES).reverse().map(line));
}

function sentence({ kind, by, from, to }) {
  switch (kind) {
    case "taken": return from === null ? `${by} took command` : `${by} took command from ${from}, who was silent`;
    case "handed_over": return `${by} handed command over to ${to}`;
    case "released": return `${by} gave command up`;
    case "moved": return `${by} moved command to another client`;
    case "requested": return `${by} requested command from ${from}`;
    default: return `${by} withdrew the request`;
  }
}

async function act(action, to) {
  text(errorLine, "");
  try {
    await sendCommand(action, to);
  } catch (error) {
    text(errorLine, error.message);
  }
}

async function leave() {
  await logOut().catch(() => {});
  location.assign("/login");
}
