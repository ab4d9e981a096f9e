// A colony of the lab as a session of the live page: its requests and messages are lines.
import fs from "fs";
import { createInterface } from "readline";
import { LiveColony } from "../../lab/live/worker.js";

const [folder, link] = process.argv.slice(2);
const write = (message) => fs.writeSync(1, `${typeof message === "string" ? message : Buffer.from(message).toString("base64")}\n`);
const colony = new LiveColony(new WebAssembly.Module(fs.readFileSync(`${folder}/colony.wasm`)), link, write);
for await (const line of createInterface({ input: process.stdin })) colony.receive(line);
process.exit();
