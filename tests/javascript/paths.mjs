// Message paths as Foxglove and Lichtblick read them, as far as layouts of rths use them: a topic, in quotation marks where
// it has other characters than letters, digits, `_`, `-` and `/`; then fields `.name`, slices `[1:2]` and filters
// `{name=="text"}`.

const TOPIC = /^(?:"((?:[^"\\]|\\["\\])*)"|([a-zA-Z0-9_/-]+))/;
const PART = /^(?:\.([a-zA-Z0-9_-]+)|\[(-?\d*):(-?\d*)\]|\{([a-zA-Z0-9_-]+)=="([^"]*)"\})/;

/** Topic and parts of a path; throws where the grammar does not have it. */
export function parsed(text) {
  const head = TOPIC.exec(text);
  if (!head) {
    throw new Error(`no topic: ${text}`);
  }
  const parts = [];
  let rest = text.slice(head[0].length);
  while (rest) {
    const part = PART.exec(rest);
    if (!part) {
      throw new Error(`no part of a path: ${rest}`);
    }
    const [all, name, start, end, field, value] = part;
    parts.push(name ? { name } : field ? { field, value } : { start: +start, end: end ? +end : Infinity });
    rest = rest.slice(all.length);
  }
  return { topic: head[1]?.replace(/\\(["\\])/g, "$1") ?? head[2], parts };
}

/** What a path finds in a message; throws where it names a field that is none. */
export function found(message, [part, ...rest]) {
  if (!part) {
    return [message];
  }
  if (part.name !== undefined || part.field !== undefined) {
    const name = part.name ?? part.field;
    if (!(name in message)) {
      throw new Error(`no field ${name}`);
    }
  }
  if (part.name !== undefined) {
    return found(message[part.name], rest);
  }
  if (part.field !== undefined) {
    return message[part.field] === part.value ? found(message, rest) : [];
  }
  return message.slice(part.start, part.end + 1).flatMap((item) => found(item, rest));
}
