// Writes an MCAP file with @mcap/core, of the same messages each time.
//
//   node write_with_peer.mjs FILE OPTIONS       options of McapWriter as JSON, and "zstd": true

import { appendFileSync, writeFileSync } from "node:fs";

import zstd from "@foxglove/wasm-zstd";
import { McapWriter } from "@mcap/core";

await zstd.isLoaded;
const path = process.argv[2];
const { zstd: isCompressed, ...options } = JSON.parse(process.argv[3]);
const bytes = (text) => new TextEncoder().encode(text);

writeFileSync(path, "");
let position = 0n;
const writer = new McapWriter({
  ...options,
  compressChunk: isCompressed
    ? (data) => ({ compression: "zstd", compressedData: zstd.compress(data) })
    : undefined,
  writable: {
    position: () => position,
    write: async (data) => {
      appendFileSync(path, data);
      position += BigInt(data.byteLength);
    },
  },
});
await writer.start({ profile: "x", library: "peer" });
const schemaId = await writer.registerSchema({
  name: "s",
  encoding: "jsonschema",
  data: bytes("{}"),
});
const channels = [];
for (const topic of ["/a", "/b"]) {
  channels.push(
    await writer.registerChannel({
      schemaId: topic === "/a" ? schemaId : 0,
      topic,
      messageEncoding: "json",
      metadata: new Map([["topic", topic]]),
    }),
  );
}
for (let i = 0; i < 100; ++i) {
  await writer.addMessage({
    channelId: channels[i % 2],
    sequence: i,
    logTime: 1_700_000_000_000_000_000n + BigInt(i),
    publishTime: BigInt(i),
    data: bytes("x".repeat(i)),
  });
}
await writer.addMetadata({ name: "m", metadata: new Map([["k", "v"]]) });
await writer.addAttachment({
  name: "a.txt",
  logTime: 5n,
  createTime: 6n,
  mediaType: "text/plain",
  data: bytes("attached"),
});
await writer.end();
