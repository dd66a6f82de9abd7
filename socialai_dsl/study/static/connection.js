// @ts-check
/** The connection of a participant's page to the server, which is opened again until the server says that it is over. */

/** @typedef {Record<string, any>} Reply */

const TRY_EVERY = 1000, BEAT_EVERY = 2000;
/** Why the server closes for good. @type {Record<number, string>} */
const CLOSED = { 4404: "unknown", 4409: "elsewhere", 4429: "fast" };

export class Connection {
  /** @param {string} address @param {(said: Reply) => void} hear
   * @param {(why: string | undefined) => void} lost told that it was lost; with a word for why if it is not opened again
   * @param {() => Reply} [greeting] what is sent first, each time */
  constructor(address, hear, lost, greeting) {
    this.address = address;
    this.hear = hear;
    this.lost = lost;
    this.greeting = greeting;
    this.beating = setInterval(() => this.send({ do: "beat" }), BEAT_EVERY);
    this.open();
  }

  open() {
    const socket = this.socket = new WebSocket(this.address);
    socket.onopen = () => this.greeting && this.send(this.greeting());
    socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    socket.onclose = ({ code }) => {
      if (CLOSED[code]) this.close();
      else this.trying = setTimeout(() => this.open(), TRY_EVERY);
      this.lost(CLOSED[code]);
    };
  }

  /** @param {Reply} what */
  send(what) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(what));
  }

  /** Let it go for good. */
  close() {
    clearInterval(this.beating);
    clearTimeout(this.trying);
    if (!this.socket) return;
    this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
  }
}
