// A client of simgl/1 for Node: npm install zeromq@6 @msgpack/msgpack@3; node client.mjs ADDRESS
import { decode, encode } from "@msgpack/msgpack";
import { Dealer } from "zeromq";

const PATIENCE_MS = 10_000;
const BIG = { useBigInt64: true }; // nanoseconds do not fit into a double

class Client {
  constructor(address) {
    this.socket = new Dealer({ linger: 0, receiveTimeout: PATIENCE_MS });
    this.socket.connect(address);
    this.id = 0;
  }
  async ask(kind, header) {
    await this.socket.send(["simgl/1", encode(header, BIG)]);
    for (;;) {
      const [, packed, ...planes] = await this.socket.receive(); // throws after PATIENCE_MS
      const reply = decode(packed, BIG);
      if (reply.type === "error") throw new Error(`${reply.code}: ${reply.detail}`);
      if (reply.type === "bye") throw new Error("the server said goodbye");
      if (reply.type === kind) return [reply, planes]; // not the pong of a server that starts
    }
  }
  async render(tai_ns, camera, bodies) {
    const cameras = [{ camera }];
    const header = { type: "render", id: ++this.id, tai_ns, cameras, bodies };
    const [reply, planes] = await this.ask("images", header);
    const [height, width] = reply.images[0].planes[0].shape;
    const dn = new DataView(planes[0].buffer, planes[0].byteOffset, planes[0].byteLength);
    return { reply, height, width, dn: (row, column) => dn.getUint16(2 * (row * width + column), true) };
  }
}

const client = new Client(process.argv[2] ?? "tcp://127.0.0.1:5563");
const hello = { type: "hello", client: "node", versions: ["simgl/1"] };
const [welcome] = await client.ask("welcome", hello);
const pose = { position_m: [0.5, -0.25, 40], velocity_m_s: [0, 0, -0.1] };
const chaser = { ...pose, q_icrf_from_body_xyzw: [0, 0, 0, 1] };
const image = await client.render(welcome.epoch_tai_ns, welcome.cameras[0].name, { chaser });
let sum = 0;
for (let i = 0; i < image.height; ++i) for (let j = 0; j < image.width; ++j) sum += image.dn(i, j);
console.log(`${image.width} x ${image.height}, sum ${sum}, ${image.reply.state_hash}`);
client.socket.close();
