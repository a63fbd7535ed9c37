// `node layout.mjs LAYOUT FILE`: what the paths of a layout find in a recording, and what its scripts make of it, as JSON.
// Scripts are compiled with the options of the viewers; a fault that the compiler finds ends this one.

import { readFile } from "node:fs/promises";

import ts from "typescript";

import { found, parsed } from "./paths.mjs";
import { messages } from "./recording.mjs";

const OPTIONS = {
  strict: true,
  target: ts.ScriptTarget.ES2020,
  module: ts.ModuleKind.CommonJS,
  lib: ["lib.es2020.d.ts"], // a script has no page
  types: [],
  skipLibCheck: true,
};

/** A script as a module. */
function compiled(source) {
  const host = ts.createCompilerHost(OPTIONS);
  const { getSourceFile } = host;
  let code = "";
  host.getSourceFile = (name, ...rest) =>
    name === "script.ts" ? ts.createSourceFile(name, source, OPTIONS.target) : getSourceFile(name, ...rest);
  host.writeFile = (_, text) => {
    code = text;
  };
  const program = ts.createProgram(["script.ts"], OPTIONS, host);
  program.emit();
  const faults = ts.getPreEmitDiagnostics(program);
  if (faults.length > 0) {
    throw new Error(ts.formatDiagnostics(faults, host));
  }
  const module = {};
  new Function("exports", code)(module);
  return module;
}

/** The message paths of all panels; a number is no path, but a line. */
function paths(layout) {
  const all = Object.values(layout.configById).flatMap((panel) => [
    ...(panel.paths ?? []).map((path) => path.value),
    ...(panel.xAxisPath ? [panel.xAxisPath.value] : []),
    ...(panel.topicPath ? [panel.topicPath] : []),
  ]);
  return all.filter((path) => Number.isNaN(Number.parseFloat(path)));
}

const layout = JSON.parse(await readFile(process.argv[2], "utf8"));
const scripts = Object.values(layout.userNodes).map((node) => compiled(node.sourceCode));
const wanted = [...new Set(paths(layout))].map((text) => ({ text, ...parsed(text), values: 0, messages: 0 }));
const made = {};

function look(topic, message) {
  for (const path of wanted) {
    if (path.topic === topic) {
      path.messages += 1;
      path.values += found(message, path.parts).length;
    }
  }
}

for await (const { topic, type, message } of messages(process.argv[3])) {
  const shown = type.toObject(message, { defaults: true });
  look(topic, shown);
  for (const { inputs, output, default: script } of scripts) {
    const answer = inputs.includes(topic) ? script({ topic, message: shown }) : undefined;
    if (answer) {
      (made[output] ??= []).push(answer);
      look(output, answer);
    }
  }
}
const report = wanted.map(({ text, ...rest }) => [text, { messages: rest.messages, values: rest.values }]);
process.stdout.write(`${JSON.stringify({ paths: Object.fromEntries(report), made })}\n`);
