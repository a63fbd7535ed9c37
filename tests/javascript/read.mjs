// `node read.mjs FILE`: all that is in a recording as JSON lines, without loss: a double is its 64 bits as hex digits, a
// 64-bit integer its decimal digits.

import { indexed, messages, records } from "./recording.mjs";

function bits(value) {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, value);
  return view.getBigUint64(0).toString(16).padStart(16, "0");
}

function plain(field, value) {
  if (field.resolvedType) {
    return fields(field.resolvedType, value);
  }
  if (field.type === "double") {
    return bits(value);
  }
  return field.type === "int64" ? value.toString() : value;
}

function fields(type, message) {
  const found = {};
  for (const field of type.fieldsArray) {
    const value = message[field.name];
    found[field.name] = field.repeated ? value.map((item) => plain(field, item)) : plain(field, value);
  }
  return found;
}

function say(item) {
  process.stdout.write(
    `${JSON.stringify(item, (_, value) => (typeof value === "bigint" ? value.toString() : value))}\n`,
  );
}

const path = process.argv[2];
for await (const { record, topic, type, message } of messages(path)) {
  const { sequence, logTime, publishTime } = record;
  say({ kind: "message", topic, sequence, logTime, publishTime, fields: fields(type, message) });
}
for await (const record of records(path)) {
  if (record.type === "Metadata") {
    say({ kind: "metadata", name: record.name, values: Object.fromEntries(record.metadata) });
  } else if (record.type === "Attachment") {
    say({ kind: "attachment", name: record.name, data: Buffer.from(record.data).toString("hex") });
  }
}
const reader = await indexed(path);
let count = 0;
for await (const _ of reader.readMessages({ validateCrcs: true })) {
  count += 1;
}
say({ kind: "index", messages: count, counted: reader.statistics.messageCount });
