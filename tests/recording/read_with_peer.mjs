// Reads an MCAP file with @mcap/core, once by its index and once from its beginning to its end, and
// writes what each found as one JSON document. Every CRC is checked; whatever is wrong is an error.
//
//   node read_with_peer.mjs FILE

import { readFile } from "node:fs/promises";

import { crc32 } from "@foxglove/crc";
import lz4 from "@foxglove/wasm-lz4";
import zstd from "@foxglove/wasm-zstd";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";

const text = (bytes) => new TextDecoder("utf-8", { fatal: true }).decode(bytes);

function require(holds, what) {
  if (!holds) throw new Error(what);
}

// Numbers of 64 bits as strings, which JSON does not round.
const described = {
  schema: (it) => ({ id: it.id, name: it.name, encoding: it.encoding, data: text(it.data) }),
  channel: (it) => ({
    id: it.id,
    schema: it.schemaId,
    topic: it.topic,
    encoding: it.messageEncoding,
    metadata: Object.fromEntries(it.metadata),
  }),
  message: (it) => ({
    channel: it.channelId,
    sequence: it.sequence,
    log_time: String(it.logTime),
    publish_time: String(it.publishTime),
    data: text(it.data),
  }),
  metadata: (it) => ({ name: it.name, metadata: Object.fromEntries(it.metadata) }),
  attachment: (it) => ({
    name: it.name,
    media_type: it.mediaType,
    log_time: String(it.logTime),
    data: text(it.data),
  }),
};

async function collect(iterable, describe) {
  const found = [];
  for await (const it of iterable) found.push(describe(it));
  return found;
}

async function readByIndex(bytes, decompressHandlers) {
  const reader = await McapIndexedReader.Initialize({
    readable: {
      size: async () => BigInt(bytes.length),
      read: async (offset, length) => {
        require(offset + length <= BigInt(bytes.length), "an index points behind the file");
        return bytes.subarray(Number(offset), Number(offset + length));
      },
    },
    decompressHandlers,
  });
  const data = bytes.subarray(0, Number(reader.dataEndOffset));
  require(reader.footer.summaryCrc !== 0, "the summary has no CRC");
  require(reader.dataSectionCrc === crc32(data), "the CRC of the data section is wrong");
  for (const group of reader.summaryOffsetsByOpcode.values()) {
    require(bytes[Number(group.groupStart)] === group.groupOpcode, "a summary offset is wrong");
  }
  const statistics = reader.statistics;
  return {
    library: reader.header.library,
    schemas: await collect(reader.schemasById.values(), described.schema),
    channels: await collect(reader.channelsById.values(), described.channel),
    messages: await collect(reader.readMessages(), described.message),
    metadata: await collect(reader.readMetadata(), described.metadata),
    attachments: await collect(reader.readAttachments(), described.attachment),
    compressions: reader.chunkIndexes.map((chunk) => chunk.compression),
    groups: [...reader.summaryOffsetsByOpcode.keys()].sort((a, b) => a - b),
    statistics: {
      messages: Number(statistics.messageCount),
      schemas: statistics.schemaCount,
      channels: statistics.channelCount,
      attachments: statistics.attachmentCount,
      metadata: statistics.metadataCount,
      chunks: statistics.chunkCount,
      begin: String(statistics.messageStartTime),
      end: String(statistics.messageEndTime),
      counts: Object.fromEntries(
        [...statistics.channelMessageCounts].map(([id, count]) => [id, Number(count)]),
      ),
    },
  };
}

function readFromBeginning(bytes, decompressHandlers) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const found = { schemas: [], channels: [], messages: [], metadata: [], attachments: [] };
  let isData = true;
  // In pieces, as from a network.
  for (let at = 0; at < bytes.length; at += 1000) {
    reader.append(bytes.subarray(at, at + 1000));
    for (let record; (record = reader.nextRecord()); ) {
      if (record.type === "DataEnd") isData = false;
      if (!isData) continue;
      if (record.type === "Schema") found.schemas.push(described.schema(record));
      if (record.type === "Channel") found.channels.push(described.channel(record));
      if (record.type === "Message") found.messages.push(described.message(record));
      if (record.type === "Metadata") found.metadata.push(described.metadata(record));
      if (record.type === "Attachment") found.attachments.push(described.attachment(record));
    }
  }
  require(reader.done(), "the file has no end");
  return found;
}

await lz4.isLoaded;
await zstd.isLoaded;
const decompressHandlers = {
  lz4: (bytes, size) => lz4(bytes, Number(size)),
  zstd: (bytes, size) => zstd.decompress(bytes, Number(size)),
};
const bytes = new Uint8Array(await readFile(process.argv[2]));
const byIndex = await readByIndex(bytes, decompressHandlers);
const fromBeginning = readFromBeginning(bytes, decompressHandlers);
process.stdout.write(JSON.stringify({ by_index: byIndex, from_beginning: fromBeginning }) + "\n");
