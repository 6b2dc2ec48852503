// The websocket: newest frames come, each is acknowledged when it has been drawn.
const CLOSED = { ended: 1001, rubbish: 1008, full: 1013 };

class Link {
  constructor({ onFrame, onWords, onState }) {
    Object.assign(this, { onFrame, onWords, onState });
    this.pause_s = 0.5;
    this.wants = [];
    this.isFrozen = false;
    this.open();
  }
  open() {
    const { protocol, host, pathname } = window.location;
    this.onState("connecting");
    this.socket = new WebSocket(`${protocol.replace("http", "ws")}//${host}${pathname}live`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.pause_s = 0.5;
      this.say({ want: this.wants, freeze: this.isFrozen });
      this.onState("open");
    };
    this.socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.onWords(JSON.parse(data));
      else this.onFrame(decodeMessage(data));
    };
    this.socket.onclose = ({ code, reason }) => {
      if (code === CLOSED.ended) return this.onState("ended", "The run has ended. Its last frame stays here.");
      if (code === CLOSED.full) return this.onState("ended", reason);
      this.onState("lost", "The connection is lost; trying again.");
      setTimeout(() => this.open(), 1000 * this.pause_s);
      this.pause_s = Math.min(8, 2 * this.pause_s);
    };
  }
  say(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
  want(wants) { this.wants = wants; this.say({ want: wants }); }
  freeze(isFrozen) { this.isFrozen = isFrozen; this.say({ freeze: isFrozen }); }
}
