// The WebSocket to the server. It reconnects by itself; the last picture stays meanwhile.

const DELAYS = [250, 500, 1000, 2000]; // before each further try [ms]; the last one repeats
const HEADER = 6; // bytes in front of a frame's JSON: version, pane, length of the JSON (4 bytes, big-endian)
const VERSION = 1;

export class Connection {
  // handlers: opened(), closed(text), message(object), frame(pane, header, blob)
  constructor(handlers) {
    this.handlers = handlers;
    this.tries = 0;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.tries = 0;
      this.handlers.opened();
    };
    this.socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.handlers.message(JSON.parse(data));
      else this.read(data);
    };
    this.socket.onclose = (event) => this.closed(event.reason);
  }

  async closed(reason) {
    const delay = DELAYS[Math.min(this.tries++, DELAYS.length - 1)];
    setTimeout(() => this.open(), delay);
    this.handlers.closed(reason || (await explanation()));
  }

  read(buffer) {
    const view = new DataView(buffer);
    if (view.getUint8(0) !== VERSION) return;
    const length = view.getUint32(2);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, HEADER, length)));
    this.handlers.frame(view.getUint8(1), header, new Blob([new Uint8Array(buffer, HEADER + length)], { type: header.mime }));
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}

// A browser does not tell a page why a WebSocket was refused, so an ordinary request asks.
async function explanation() {
  try {
    const { status } = await fetch("/state.json", { cache: "no-store" });
    if (status === 401 || status === 403) return "No access: open the address that `glshade dev` printed, with its token.";
  } catch {
    return "The server does not answer. Is `glshade dev` still running?";
  }
  return "The connection was lost. Connecting again …";
}
