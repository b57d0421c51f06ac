// Prints as JSON what the independent reader finds in a log: node read_log.js LOG
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import { loadDecompressHandlers } from "@mcap/support";

const file = await open(process.argv[2], "r");
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(file),
  decompressHandlers: await loadDecompressHandlers(),
});

const found = { profile: reader.header.profile, schemas: {}, counts: {}, metadata: {}, attachments: [], samples: [] };
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  found.schemas[channel.topic] = { name: schema.name, encoding: schema.encoding, message: channel.messageEncoding };
}
const decoder = new TextDecoder();
for await (const message of reader.readMessages()) {
  const { topic } = reader.channelsById.get(message.channelId);
  found.counts[topic] = (found.counts[topic] ?? 0) + 1;
  if (topic === "/bench/sample") {
    const { timestamp, ...values } = JSON.parse(decoder.decode(message.data));
    const clock = BigInt(timestamp.sec) * 1000000000n + BigInt(timestamp.nsec);
    if (message.logTime !== clock || message.publishTime !== clock) {
      throw new Error(`log time ${message.logTime} of the sample at ${clock}`);
    }
    found.samples.push({ time_ns: String(clock), ...values });
  }
}
for await (const record of reader.readMetadata()) {
  found.metadata[record.name] = Object.fromEntries(record.metadata);
}
for await (const attachment of reader.readAttachments()) {
  found.attachments.push(attachment.name);
}
await file.close();
console.log(JSON.stringify(found));
