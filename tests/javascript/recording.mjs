// Messages of a recording, decoded with the MCAP project's libraries by the schemas in the file.

import { readFile } from "node:fs/promises";

import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers, protobufFromBinaryDescriptor } from "@mcap/support";

/** What the reader with an index needs of a file. */
class Bytes {
  constructor(data) {
    this.data = data;
  }

  async size() {
    return BigInt(this.data.byteLength);
  }

  async read(offset, size) {
    return this.data.subarray(Number(offset), Number(offset + size));
  }
}

/** Every record of a file in its order; each chunk's checksum is checked. */
export async function* records(path) {
  const reader = new McapStreamReader({
    validateCrcs: true,
    decompressHandlers: await loadDecompressHandlers(),
  });
  reader.append(await readFile(path));
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    yield record;
  }
  if (!reader.done()) {
    throw new Error("the file goes on behind its end, or has none");
  }
}

/** A reader that goes by the file's index. */
export async function indexed(path) {
  return await McapIndexedReader.Initialize({
    readable: new Bytes(await readFile(path)),
    decompressHandlers: await loadDecompressHandlers(),
  });
}

/** Every message of a file with its topic and the type that its schema describes. */
export async function* messages(path) {
  const types = new Map();
  const channels = new Map();
  for await (const record of records(path)) {
    if (record.type === "Schema") {
      types.set(record.id, protobufFromBinaryDescriptor(record.data).lookupType(record.name));
    } else if (record.type === "Channel") {
      channels.set(record.id, record);
    } else if (record.type === "Message") {
      const channel = channels.get(record.channelId);
      const type = types.get(channel.schemaId);
      yield { record, topic: channel.topic, type, message: type.decode(record.data) };
    }
  }
}
