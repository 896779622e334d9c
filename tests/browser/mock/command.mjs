// Who has command at the mock. A page is the principal in its cookie `principal`, or `local`, at the client that it names.

const SILENCE_S = 120;
const ROLES = ["viewer", "operator", "administrator"];

export class Command {
  principals = [];
  holder = null;
  requests = [];
  history = [];

  principal(cookies) {
    const name = /\bprincipal=(\w+)/.exec(cookies ?? "")?.[1];
    return this.principals.find((p) => p.name === name) ?? { name: "local", role: "administrator" };
  }

  giver(headers) {
    return { ...this.principal(headers.cookie), client: headers["x-scenecast-client"] ?? "" };
  }

  #isHolder(by) {
    return this.holder?.name === by.name && (this.holder.client ?? by.client) === by.client;
  }

  #keep(by, nowS) {
    if (this.#isHolder(by)) Object.assign(this.holder, { client: by.client, last_active_s: nowS });
  }

  /** The status and the error of an order of a kind (stop, order, settings), or null. */
  refusal(by, kind) {
    const needed = kind === "settings" ? "administrator" : "operator";
    if (ROLES.indexOf(by.role) < ROLES.indexOf(needed)) return [403, `this needs the role ${needed}; the role of ${by.name} is ${by.role}`];
    return kind === "stop" || !this.holder || this.#isHolder(by) ? null : [409, `${this.holder.name} has command`];
  }

  order(by, kind, nowS) {
    if (!this.holder && kind !== "stop") this.#give("taken", by, by, nowS);
    this.#keep(by, nowS);
  }

  /** Changes command; returns the status and the error, or null. */
  act(by, { action, to }, nowS) {
    const refused = this.refusal(by, "stop");
    if (refused) return refused;
    this.#keep(by, nowS);
    const others = () => this.requests.filter((r) => r.name !== by.name);
    if (action === "request" && this.holder) {
      this.requests = [...others(), { name: by.name, at_s: nowS }];
      this.#record("requested", by, this.holder.name, nowS);
    }
    if (action === "withdraw") {
      this.requests = others();
      this.#record("withdrawn", by, this.holder?.name ?? null, nowS);
    }
    if (action === "take" || (action === "request" && !this.holder)) {
      const isOwn = this.holder?.name === by.name;
      if (this.holder && !isOwn && nowS < this.holder.last_active_s + SILENCE_S) return [409, `${this.holder.name} has command`];
      if (!this.#isHolder(by)) this.#give(isOwn ? "moved" : "taken", by, by, nowS);
    }
    if (action === "hand_over" || action === "release") {
      if (!this.#isHolder(by)) return [409, `${this.holder?.name} has command`];
      this.#give(action === "release" ? "released" : "handed_over", by, this.principals.find((p) => p.name === to) ?? null, nowS);
    }
    return null;
  }

  #give(kind, by, to, nowS) {
    const from = this.holder?.name ?? null;
    this.holder = to && { client: null, ...to, since_s: nowS, last_active_s: nowS };
    this.requests = this.requests.filter((r) => r.name !== to?.name);
    this.#record(kind, by, from, nowS);
  }

  #record(kind, by, from, nowS) {
    this.history.push({ at_s: nowS, kind, by: by.name, from, to: this.holder?.name ?? null });
  }

  json() {
    const { principals, requests, history } = this;
    const holder = this.holder && { ...this.holder, takeable_s: this.holder.last_active_s + SILENCE_S };
    return { holder, requests, principals, history };
  }
}
