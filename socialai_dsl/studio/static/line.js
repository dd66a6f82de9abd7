// @ts-check
/** The connection to the server, and what the browser remembers of this window and this person. */

/** @typedef {Record<string, any>} Reply */

const TRY_EVERY = 1000;
const LARGEST_MESSAGE = 2 << 20;
const LOST = "the connection to the studio was lost; what you type stays in this window, which goes on when `socialai studio` runs again at this address";
const token = new URLSearchParams(location.search).get("token") ?? "";
export const address = (/** @type {string} */ name) => `ws://${location.host}/${name}?token=${encodeURIComponent(token)}`;

/** The name of this window, which outlives it being loaded again; a browser that keeps nothing gives it another one. */
const own = {
  /** @returns {string | null} */
  get() {
    try {
      const name = sessionStorage.getItem("window");
      return name && /^[0-9a-f]{16}$/.test(name) ? name : null;
    } catch {
      return null;
    }
  },
  /** @param {string} name */
  set(name) {
    try {
      sessionStorage.setItem("window", name);
    } catch {}
  },
};

/** Questions to the server; those about files and those about the game are answered in order. */
export class Line {
  /** @param {(open: boolean, why: string) => void} changed told when the connection opens or is lost, and why
   * @param {(said: Reply) => void} told what the server says without being asked */
  constructor(changed, told) {
    this.changed = changed;
    this.told = told;
    this.number = 0;
    /** @type {Map<number, (reply: Reply) => void>} */ this.waiting = new Map();
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(address("session"));
    this.socket.onopen = () => this.greet();
    this.socket.onmessage = (event) => {
      const reply = JSON.parse(event.data), answer = this.waiting.get(reply.id);
      this.waiting.delete(reply.id);
      if (answer) answer(reply);
      else this.told(reply);
    };
    this.socket.onclose = (event) => {
      for (const answer of this.waiting.values()) answer({ refused: "the connection was lost", lost: true });
      this.waiting.clear();
      this.changed(false, event.reason || LOST);
      setTimeout(() => this.connect(), TRY_EVERY);
    };
  }

  /** Say which window this is, by a name that stays when it is loaded again, so that it finds its drafts. */
  async greet() {
    const known = await this.ask("hello", { window: own.get() });
    if (known.refused) return;
    own.set(known.window);
    this.changed(true, "");
  }

  /** @param {string} name @param {Reply} more @returns {Promise<Reply>} */
  ask(name, more = {}) {
    if (this.socket?.readyState !== WebSocket.OPEN) return Promise.resolve({ refused: "there is no connection", lost: true });
    const id = ++this.number, message = JSON.stringify({ id, do: name, ...more });
    if (message.length > LARGEST_MESSAGE) return Promise.resolve({ refused: "the text is too large for the studio" });
    this.socket.send(message);
    return new Promise((resolve) => this.waiting.set(id, resolve));
  }
}

/** What is kept under a name, in a list. @param {Storage} storage @param {string} name @returns {string[]} */
function listed(storage, name) {
  const found = JSON.parse(storage.getItem(name) ?? "[]");
  return Array.isArray(found) ? found.map(String) : [];
}

/** How somebody has arranged the page, which all windows of this address begin with. */
export const settings = {
  /** @param {string} name @param {string} otherwise */
  get(name, otherwise) {
    try {
      return localStorage.getItem(name) ?? otherwise;
    } catch {
      return otherwise;
    }
  },
  /** @param {string} name @param {string} value */
  set(name, value) {
    try {
      localStorage.setItem(name, value);
    } catch {}
  },
  /** A list that is this window's alone. @param {string} name */
  ofWindow(name) {
    try {
      return listed(sessionStorage, name);
    } catch {
      return [];
    }
  },
  /** @param {string} name @param {string[]} list */
  setOfWindow(name, list) {
    try {
      sessionStorage.setItem(name, JSON.stringify(list));
    } catch {}
  },
};
